// SPDX-License-Identifier: Apache-2.0
// The shared library through its installed headers alone, as another program uses it.
#include <raywave/raywave.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <complex>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <optional>
#include <raywave/raywave.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"
#include "tests/support/gltf.hpp"

namespace cl {}
using namespace raywave;  // no name of the library's is `cl`, or like one of another library's
namespace opencl = cl;

namespace {

using Catch::Matchers::ContainsSubstring;

const std::string scene_text =
    "[hologram]\nresolution = [48, 32]\npitch = \"4 um\"\n[sampling]\npitch = \"20 um\"\n"
    "[[light]]\ndirection = [0, 0, 1]\n"
    "[[object]]\nwidth = \"0.2 mm\"\nposition = [0, 0, \"10 mm\"]\n";
// The square of the file below, corner by corner as readers hand it on
const std::vector<Vec3> square{{-0.5, -0.5, 0}, {-0.5, 0.5, 0}, {0.5, 0.5, 0}, {0.5, -0.5, 0}};
const std::vector<std::array<std::uint32_t, 3>> square_faces{{0, 1, 2}, {0, 2, 3}};

Scene square_scene(const std::vector<std::string>& overrides = {}) {
  auto scene = parse_scene(scene_text, ".", overrides);
  scene.set_mesh(0, {square, square_faces});
  return scene;
}

/// The same, half as high.
Scene low_square_scene() {
  auto scene = square_scene();
  auto low = square;
  for (auto& vertex : low) vertex[1] *= 0.5;
  scene.set_mesh(0, {low, square_faces});
  return scene;
}

/// The same with its mesh in a file.
class Desk {
public:
  Desk() {
    folder_.write("square.obj",
                  "v -0.5 -0.5 0\nv -0.5 0.5 0\nv 0.5 0.5 0\nv 0.5 -0.5 0\nf 1 2 3\nf 1 3 4\n");
    folder_.write("scene.toml", scene_text + "mesh = \"square.obj\"\n");
  }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }

private:
  Folder folder_;
};

std::vector<std::complex<float>> samples_of(const FieldView& field) {
  return {field.samples, field.samples + field.size()};
}

std::vector<std::uint8_t> levels_of(const Hologram& hologram) {
  return {hologram.levels().begin(), hologram.levels().end()};
}

/// The samples of a .npy file: what follows its header.
std::vector<std::complex<float>> samples_in(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::vector<char> bytes{std::istreambuf_iterator<char>(in), {}};
  REQUIRE(bytes.size() > 10);
  const auto header =
      10 + static_cast<unsigned char>(bytes[8]) + 256u * static_cast<unsigned char>(bytes[9]);
  std::vector<std::complex<float>> samples((bytes.size() - header) / sizeof(std::complex<float>));
  std::memcpy(samples.data(), bytes.data() + header, samples.size() * sizeof(samples[0]));
  return samples;
}

double relative_error(const auto& a, const auto& b) {
  double difference = 0, norm = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    difference += std::norm(std::complex<double>(a[i]) - std::complex<double>(b[i]));
    norm += std::norm(std::complex<double>(b[i]));
  }
  return std::sqrt(difference / norm);
}

/// A square of 2 units that faces the viewer, whose material has this colour.
test::Gltf coloured_square(float red) {
  test::Gltf gltf;
  const int material = gltf.material(
      {{"pbrMetallicRoughness", {{"baseColorFactor", {red, red, red, 1}}, {"metallicFactor", 0}}}});
  gltf.add(test::Gltf::square(1, {0, 0, 0}, material));
  return gltf;
}

RenderOptions on(const Device& device) {
  RenderOptions options;
  options.on.device = device.index;
  return options;
}

}  // namespace

TEST_CASE("the library renders the bits of the command line") {
  const Desk desk;
  for (const auto& device : list_devices()) {
    for (const std::string goal : {"", " --preset draft"}) {
      const auto line = "'" RAYWAVE_PROGRAM "' render '" + desk.file("scene.toml") + "' -o '" +
                        desk.file("out") + "' --quiet --device " + device.index + goal;
      REQUIRE(std::system(line.c_str()) == 0);
      auto options = on(device);
      if (!goal.empty()) options.goal.preset = "draft";
      const auto hologram = render(load_scene(desk.file("scene.toml")), options);
      CHECK(samples_in(desk.file("out/field.npy")) == samples_of(hologram.field()));
    }
  }
}

TEST_CASE("a mesh from memory renders as the file that holds it") {
  const Desk desk;
  CHECK(samples_of(render(square_scene()).field()) ==
        samples_of(render(load_scene(desk.file("scene.toml"))).field()));
}

TEST_CASE("a mesh from memory gives way to a file that is named after it") {
  const Desk desk;
  auto scene = low_square_scene();
  const auto half = render(scene);
  scene.set({"object.0.mesh=" + desk.file("square.obj")});
  CHECK(levels_of(render(scene)) == levels_of(render(square_scene())));
  CHECK(levels_of(half) != levels_of(render(square_scene())));
}

TEST_CASE("files that a change names are read, whatever was read before") {
  const Folder folder;
  const auto grey = [](int level) {
    return test::tga_picture(4, 2, [&](int i, int) {
      return glm::u8vec4(level / (i + 1), level / (i + 1), level / (i + 1), 255);
    });
  };
  folder.write("a.tga", grey(40));
  folder.write("b.tga", grey(200));
  folder.write("square.glb", coloured_square(0.2f).glb());
  const std::string start =
      "[hologram]\nresolution = [48, 32]\npitch = \"4 um\"\n[sampling]\npitch = \"20 um\"\n"
      "[materials.white]\ntexture = \"b.tga\"\n"
      "[[object]]\nwidth = \"0.2 mm\"\nposition = [0, 0, \"10 mm\"]\nmesh = \"square.glb\"\n";
  const std::string named = "material = \"white\"\n";
  const std::string sky = "[[light]]\ntype = \"environment\"\nsamples = 4\npicture = \"a.tga\"\n";
  const std::string ambient = "[[light]]\ntype = \"ambient\"\n";
  const std::string without =
      "object=[{mesh = \"square.glb\", width = \"0.2 mm\", position = [0, 0, \"10 mm\"]}]";
  const std::vector<std::pair<std::string, std::string>> changes{
      {start + named + sky, "light.0.picture=b.tga"},
      {start + named + ambient,
       "light=[{type = \"environment\", samples = 4, picture = \"b.tga\"}]"},
      {start + named + sky, "light=[{type = \"ambient\"}]"},
      {start + named + ambient, without},
      {start + ambient, "object.0.material=white"},
      {start + named + ambient, "materials.white.texture=a.tga"}};
  for (const auto& [text, change] : changes) {
    INFO(change);
    auto scene = parse_scene(text, folder / "");
    const auto planned = plan(scene).json();
    const auto before = samples_of(render(scene).field());
    CHECK(plan(scene).json() == planned);
    scene.set({change});
    const auto after = samples_of(render(scene).field());
    CHECK(after == samples_of(render(parse_scene(text, folder / "", {change})).field()));
    CHECK(after != before);
  }
}

TEST_CASE("objects that are set whole take the place of meshes in memory") {
  const Desk desk;
  auto scene = low_square_scene();
  const auto object = "{mesh = \"" + desk.file("square.obj") +
                      "\", width = \"0.2 mm\", position = [0, 0, \"10 mm\"]}";
  auto changed = scene;
  changed.set({"object=[" + object + "]"});
  CHECK(levels_of(render(changed)) == levels_of(render(square_scene())));
  // Without a file the mesh stays
  const auto half = levels_of(render(scene));
  scene.set({"object=[{width = \"0.2 mm\", position = [0, 0, \"10 mm\"]}]"});
  CHECK(levels_of(render(scene)) == half);
}

TEST_CASE("the object of a glTF scene can be moved") {
  const Folder folder;
  auto gltf = coloured_square(0.8f);
  gltf.root["cameras"] = {
      {{"type", "perspective"}, {"perspective", {{"yfov", 0.5}, {"znear", 0.01}}}}};
  gltf.add_node({{"camera", 0}, {"translation", {0, 0, 100}}});
  folder.write("room.glb", gltf.glb());
  const std::string start =
      "[hologram]\nresolution = [48, 32]\npitch = \"4 um\"\n[sampling]\npitch = \"20 um\"\n"
      "[[light]]\ndirection = [0, 0, 1]\n[scene]\ngltf = \"room.glb\"\nscale = 1e-4\n";
  const auto file = folder.write("scene.toml", start).string();
  auto scene = load_scene(file);
  const auto there = scene.position_m(0);
  CHECK(there[2] == Catch::Approx(0.01));
  const auto before = samples_of(render(scene).field());

  scene.set_pose(0, {2e-5, 0, 0.0101}, scene.rotation_deg(0));
  const auto moved = samples_of(render(scene).field());
  CHECK(moved != before);
  scene.set({"sampling.seed=1"});
  CHECK(scene.position_m(0) == Vec3{2e-5, 0, 0.0101});
  CHECK(samples_of(render(scene).field()) == moved);
  CHECK(samples_of(render(plan(scene).scene()).field()) == moved);

  // The file places its objects anew
  scene.set({"scene.scale=1.1e-4"});
  CHECK(scene.position_m(0)[2] == Catch::Approx(0.011));
  CHECK_THROWS_WITH(scene.set({"object.0.mesh=" + (folder / "room.glb").string()}),
                    ContainsSubstring("belongs to the glTF file"));
  CHECK_THROWS_WITH(load_scene(file, {"object.0.width=1 mm"}),
                    ContainsSubstring("belongs to the glTF file"));

  // After an object of the scene file's own
  auto both = parse_scene(start +
                              "[[object]]\nmesh = \"room.glb\"\nwidth = \"0.1 mm\"\n"
                              "position = [0, 0, \"20 mm\"]\n",
                          folder / "");
  both.set_pose(1, {0, 0, 0.012}, both.rotation_deg(1));
  both.set({"object.0.width=0.2 mm"});
  CHECK(both.position_m(1) == Vec3{0, 0, 0.012});
  CHECK_THROWS_WITH(both.set({"object.1.mesh=room.glb"}),
                    ContainsSubstring("belongs to the glTF file"));
}

TEST_CASE("what is set of a pose later takes its place, and no more than that") {
  auto scene = square_scene();
  scene.set_pose(0, {0, 0, 0.02}, {1, 2, 3});
  scene.set({"object.0.position=[0, 0, 0.03]"});
  CHECK(scene.position_m(0) == Vec3{0, 0, 0.03});
  CHECK(scene.rotation_deg(0) == Vec3{1, 2, 3});
  scene.set({"object.0.rotation=[4, 5, 6]"});
  CHECK(scene.rotation_deg(0) == Vec3{4, 5, 6});
  scene.set_pose(0, {0, 0, 0.02}, {1, 2, 3});
  scene.set({"object=[{position=[0, 0, 0.04]}]"});
  CHECK(scene.position_m(0) == Vec3{0, 0, 0.04});
  CHECK(scene.rotation_deg(0) == Vec3{0, 0, 0});
}

TEST_CASE("renderers on different threads give the bits that one alone gives") {
  for (const auto& device : list_devices()) {
    std::vector<std::vector<std::uint8_t>> alone, together(4);
    const auto picture = [&](std::size_t seed) {
      Renderer renderer(square_scene({"sampling.frames=2"}), on(device));
      renderer.set_seed(static_cast<std::uint32_t>(seed));
      for (int i = 0; i < 3; ++i) renderer.set_pose(0, {0, 1e-5 * i, 0.01}, {0, 5.0 * i, 0});
      return levels_of(renderer.render());
    };
    for (std::size_t i = 0; i < together.size(); ++i) alone.push_back(picture(i));
    std::vector<std::thread> threads;
    for (std::size_t i = 0; i < together.size(); ++i)
      threads.emplace_back([&, i] { together[i] = picture(i); });
    for (auto& thread : threads) thread.join();
    CHECK(together == alone);
    CHECK(alone[0] != alone[1]);
  }
}

TEST_CASE("calls of one renderer from several threads take turns") {
  const auto scene = square_scene();
  std::atomic<int> at_work{0}, most{0};
  RenderOptions options;
  options.progress = [&](const std::string& what, double) {
    if (what == "done") {
      --at_work;
    } else if (what.starts_with("WRP 1 of")) {
      most = std::max(most.load(), ++at_work);
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return true;
  };
  Renderer renderer(scene, options);
  const auto expected = levels_of(renderer.render());
  std::vector<std::thread> threads;
  std::atomic<int> equal{0};
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&] { equal += levels_of(renderer.render()) == expected; });
  for (auto& thread : threads) thread.join();
  CHECK(equal == 4);
  CHECK(most == 1);
}

TEST_CASE("a picture that was stopped leaves nothing behind in the renderer") {
  // Several WRPs that are added up, so that the first has light when the second is stopped
  const auto scene = square_scene({"wrp.propagation=spectrum", "wrp.grid=[2, 1]"});
  int calls_left = -1;
  RenderOptions options;
  options.progress = [&](const std::string& what, double) {
    return calls_left < 0 || !what.starts_with("WRP") || calls_left-- > 0;
  };
  const auto expected = samples_of(render(scene).field());
  Renderer renderer(scene, options);
  for (const int steps : {0, 1}) {
    calls_left = steps;
    CHECK_THROWS_AS(renderer.render(), Cancelled);
    calls_left = -1;
    CHECK(samples_of(renderer.render().field()) == expected);
  }
}

TEST_CASE("an exception of the progress callback passes through") {
  RenderOptions options;
  options.progress = [](const std::string&, double) -> bool { throw std::domain_error("mine"); };
  CHECK_THROWS_AS(render(square_scene(), options), std::domain_error);
}

TEST_CASE("a progress callback that calls its own renderer is refused") {
  Renderer* itself = nullptr;
  RenderOptions options;
  options.progress = [&](const std::string&, double) {
    if (itself) itself->set_seed(3);
    return true;
  };
  Renderer renderer(square_scene(), options);
  itself = &renderer;
  CHECK_THROWS_WITH(renderer.render(), ContainsSubstring("progress callback must not call it"));
}

TEST_CASE("a scene changes only where it is set, and not at all when a value is refused") {
  const auto scene = square_scene();
  auto changed = scene;
  changed.set({"hologram.resolution=[64, 40]", "sampling.frames=2"});
  CHECK(changed.resolution() == std::array{64, 40});
  CHECK(changed.frames() == 2);
  CHECK(scene.resolution() == std::array{48, 32});
  CHECK_THROWS_WITH(changed.set({"sampling.frames=3", "wrp.padding=99"}),
                    ContainsSubstring("wrp.padding=99"));
  CHECK(changed.frames() == 2);
  changed.set_pose(0, {0, 0, 0.02}, {1, 2, 3});
  changed.set({"sampling.frames=4"});
  CHECK(changed.position_m(0) == Vec3{0, 0, 0.02});
  CHECK(changed.rotation_deg(0) == Vec3{1, 2, 3});
}

TEST_CASE("the scene of a plan renders what the goal renders") {
  const auto scene = square_scene();
  const auto chosen = plan(scene, {.preset = "draft"});
  RenderOptions options;
  options.goal.preset = "draft";
  CHECK(samples_of(render(chosen.scene()).field()) == samples_of(render(scene, options).field()));
  CHECK_THAT(chosen.text(), ContainsSubstring("48 x 32 pixels"));
  CHECK_THROWS_AS(render(chosen.scene(), options), InputError);
  CHECK_THROWS_AS(chosen.scene().set({"sampling.frames=2"}), InputError);
}

TEST_CASE("a field that is propagated in floats agrees with the one in doubles") {
  const int nx = 40, ny = 27;
  FieldDouble source{nx, ny, 2, {}};
  for (int i = 0; i < nx * ny * 2; ++i)
    source.samples.push_back(std::polar(1 + 0.5 * std::sin(0.7 * i), 0.3 * i * i));
  Field rounded{nx, ny, 2, {source.samples.begin(), source.samples.end()}};
  for (std::size_t i = 0; i < source.samples.size(); ++i) source.samples[i] = rounded.samples[i];
  const Pixels pixels{{4e-6, 5e-6}, 633e-9};
  PropagateOptions options;
  options.shift_m = {20e-6, -30e-6};
  const auto exact = propagate(source, pixels, 1e-3, options);
  for (const auto& device : list_devices()) {
    options.on.device = device.index;
    CHECK(relative_error(propagate(rounded, pixels, 1e-3, options).samples, exact.samples) < 1e-6);
  }
}

TEST_CASE("a process that was forked after a device was opened is told so") {
  REQUIRE(!list_devices().empty());
  const auto scene = square_scene();
  render(scene);
  const pid_t child = fork();
  REQUIRE(child >= 0);
  if (child == 0) {
    try {
      render(scene);
    } catch (const DeviceError& error) {
      _exit(std::strstr(error.what(), "fork") ? 0 : 2);
    } catch (...) {
    }
    _exit(1);
  }
  int status = -1;
  waitpid(child, &status, 0);
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 0);
}

TEST_CASE("what is wrong is refused by the name of its argument") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Pixels pixels{{8e-6, 8e-6}, 633e-9};
  auto scene = square_scene();
  const auto refused = [](const std::string& start, auto&& call) {
    INFO(start);
    CHECK_THROWS_AS(call(), InputError);
    CHECK_THROWS_WITH(call(), Catch::Matchers::StartsWith(start));
  };
  const auto mesh = [&](std::vector<Vec3> vertices, std::vector<std::array<std::uint32_t, 3>> faces,
                        std::vector<Vec2> uvs = {}) {
    scene.set_mesh(0, {vertices, faces, uvs});
  };
  refused("vertices:", [&] { mesh({}, square_faces); });
  refused("vertices:", [&] { mesh({{nan, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}); });
  refused("vertices:", [&] { mesh({{1e31, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}); });
  refused("faces:", [&] { mesh(square, {}); });
  refused("faces: face 0 names vertex 4", [&] { mesh(square, {{0, 1, 4}}); });
  refused("faces: none has an area", [&] { mesh(square, {{0, 1, 1}}); });
  refused("uv:", [&] { mesh(square, square_faces, {{0, 0}}); });
  refused("object 1:", [&] { scene.set_mesh(1, {square, square_faces}); });
  refused("position:", [&] { scene.set_pose(0, {nan, 0, 0.1}, {0, 0, 0}); });
  refused("rotation:", [&] { scene.set_pose(0, {0, 0, 0.1}, {0, 1e7, 0}); });
  refused("method", [&] { render(scene, {.method = "magic"}); });
  refused("fft", [&] { render(scene, {.on = {.fft = "none"}}); });
  refused("preset, budget and psnr", [&] { plan(scene, {"draft", 1.0, {}}); });
  refused("budget:", [&] { plan(scene, {"", nan, {}}); });
  refused("u: has no samples", [&] { propagate(FieldView{}, pixels, 0.1); });
  const std::vector<std::complex<float>> dark(16), bad(16, {NAN, 0});
  refused("u: holds NaN", [&] { propagate(FieldView(bad.data(), 4, 4), pixels, 0.1); });
  refused("field: holds NaN", [&] { reconstruct(FieldView(bad.data(), 4, 4), pixels); });
  refused("pitch:", [&] { reconstruct(FieldView(dark.data(), 4, 4), {{0, 0}, 633e-9}); });
  refused("wavelength:", [&] { reconstruct(FieldView(dark.data(), 4, 4), {{1e-6, 1e-6}, nan}); });
  refused("levels:", [&] { shown({4, 4, 1, 8, {1, 2, 3}, {}}, Slm(), pixels); });
  CHECK_THROWS_AS(render(scene, {.on = {.device = "no such device"}}), DeviceError);
  CHECK_THROWS_WITH(render(parse_scene(scene_text)), ContainsSubstring("mesh is missing"));
  CHECK_THROWS_WITH(parse_scene("[hologram]\npitch = -1\n", ".", {}, "mine"),
                    Catch::Matchers::StartsWith("mine:2:"));
}

TEST_CASE("a hologram shows what a lens sees, through every function of the library") {
  const auto scene = square_scene({"hologram.resolution=[128, 96]"});
  const auto hologram = render(scene);
  const auto shown_field = hologram.shown();
  CHECK(shown_field.samples == shown({hologram.nx(), hologram.ny(), 1, 8, levels_of(hologram), {}},
                                     Slm(scene), scene.pixels())
                                   .samples);
  const auto again = encode(hologram.field(), Slm(scene), scene.pixels());
  CHECK(again.bytes.size() == hologram.levels().size());
  ViewOptions view;
  view.z_m = 0.01;
  const auto seen = reconstruct(hologram.field(), hologram.pixels(), view);
  const auto sharp = lens(scene, view, 4);
  const auto alike = compare(PictureView(sharp), seen, {.blur_px = 6});
  CHECK(alike.psnr_db > 15);
  const auto same = compare(hologram.field(), hologram.field());
  CHECK(same.correlation == Catch::Approx(1));
  CHECK(std::isinf(compare(PictureView(seen), seen).psnr_db));
}

TEST_CASE("refinement brings the pictures of an SLM's levels nearer to what a lens sees") {
  const auto scene = square_scene({"hologram.resolution=[96, 64]"});
  ViewOptions view;
  view.z_m = 0.01;
  const auto sharp = lens(scene, view, 4);
  const auto psnr_db = [&](const FieldView& field) {
    return compare(PictureView(sharp), reconstruct(field, scene.pixels(), view), {.blur_px = 4})
        .psnr_db;
  };
  const auto hologram = render(scene);
  const auto unrefined = psnr_db(hologram.shown());
  RefineOptions options;
  options.iterations = 12;
  options.lens_points = 2;
  const auto refined = refine(scene, options);
  REQUIRE(refined.refined());
  CHECK(psnr_db(refined.shown()) > unrefined + 2);
  options.lens_points = std::nullopt;
  const Target target{view.z_m, sharp};
  CHECK(psnr_db(refine(hologram.field(), scene.pixels(), {&target, 1}, options)) > unrefined + 2);
}

namespace {

const std::string lasers_key = "hologram.wavelength=[\"638 nm\", \"520 nm\", \"450 nm\"]";

/// A card that glows in a colour.
Scene glowing_card(const std::vector<std::string>& overrides = {}) {
  auto scene = parse_scene(
      "[hologram]\nresolution = [48, 32]\npitch = \"4 um\"\n"
      "wavelength = [\"638 nm\", \"520 nm\", \"450 nm\"]\n"
      "[sampling]\npitch = \"20 um\"\nframes = 4\n[slm]\nencoding = \"phase\"\n"
      "[[light]]\ntype = \"ambient\"\n"
      "[materials.glow]\nambient = [0.8, 0.3, 0.1]\ndiffuse = 0\n"
      "[[object]]\nwidth = \"0.12 mm\"\nposition = [0, 0, \"10 mm\"]\nmaterial = \"glow\"\n",
      ".", overrides);
  scene.set_mesh(0, {square, square_faces});
  return scene;
}

/// Of the middle of the card.
Vec3 mean_of(const Picture& picture) {
  REQUIRE(picture.channels == 3);
  Vec3 mean{0, 0, 0};
  for (int y = 6; y < 26; ++y)
    for (int x = 14; x < 34; ++x)
      for (std::size_t c = 0; c < 3; ++c)
        mean[c] += double{picture.pixels[static_cast<std::size_t>(48 * y + x) * 3 + c]} / 400;
  return mean;
}

}  // namespace

TEST_CASE("a scene of three lasers renders the bits of the command line, laser by laser") {
  const Desk desk;
  const std::vector<std::string> lasers{"638nm", "520nm", "450nm"};
  const auto scene = load_scene(desk.file("scene.toml"), {lasers_key, "sampling.frames=2"});
  REQUIRE(scene.wavelengths_m().size() == 3);
  CHECK(scene.wavelengths_m()[2] == Catch::Approx(450e-9));
  CHECK(scene.pixels().wavelength_m == 0);
  CHECK(plan(scene).seconds() > 0);
  CHECK_THAT(plan(scene).text(), ContainsSubstring("3 lasers in turn"));
  for (const auto& device : list_devices()) {
    const auto line = "'" RAYWAVE_PROGRAM "' render '" + desk.file("scene.toml") + "' -o '" +
                      desk.file("out") + "' --quiet --set sampling.frames=2 --set '" + lasers_key +
                      "' --device " + device.index;
    REQUIRE(std::system(line.c_str()) == 0);
    const auto hologram = render(scene, on(device));
    REQUIRE(hologram.lasers() == 3);
    CHECK(hologram.frames() == 2);
    CHECK(hologram.levels().size() == 3 * 2 * 48 * 32);
    std::vector<std::complex<float>> all;
    for (int i = 0; i < 3; ++i) {
      const auto one = hologram.laser(i);
      const auto wanted = samples_in(desk.file("out/field_" + lasers[std::size_t(i)] + ".npy"));
      CHECK(samples_of(one.field()) == wanted);
      CHECK(one.pixels().wavelength_m == scene.wavelengths_m()[std::size_t(i)]);
      CHECK(one.levels().data() == hologram.levels().data() + std::ptrdiff_t(i) * 2 * 48 * 32);
      all.insert(all.end(), wanted.begin(), wanted.end());
    }
    CHECK(samples_of(hologram.field()) == all);
    // A renderer of pictures that move, before anything has moved
    Renderer renderer(scene, on(device));
    std::vector<std::uint8_t> levels(hologram.levels().size());
    std::vector<std::complex<float>> field(all.size());
    CHECK(renderer.render({levels.data(), field.data()}) == hologram.powers());
    CHECK(field == all);
    CHECK(levels == levels_of(hologram));
    CHECK(levels_of(renderer.render()) == levels);
    renderer.set_pose(0, {0, 0, 0.01}, {0, 20, 0});
    CHECK(levels_of(renderer.render()) != levels);
  }
  CHECK_THROWS_AS(render(scene).for_slm(), InputError);
  CHECK_THROWS_AS(render(scene).laser(3), InputError);
  CHECK_THROWS_WITH(propagate(render(scene).field(), scene.pixels(), 0.1),
                    ContainsSubstring("wavelength:"));
}

TEST_CASE("colours that the library shows are those of the material") {
  const auto scene = glowing_card();
  const auto of_one = glowing_card({"colour.only=520 nm"});
  CHECK(of_one.wavelengths_m() == std::vector{scene.wavelengths_m()[1]});
  const auto hologram = render(scene);
  // Levels of phases do not depend on the other lasers
  CHECK(levels_of(hologram.laser(1)) == levels_of(render(of_one)));
  double sum = 0;
  for (const double power : hologram.powers()) sum += power;
  CHECK(sum == Catch::Approx(1));
  CHECK(render(of_one).powers() == std::vector<double>{1});

  ViewOptions view;
  view.z_m = 0.01;
  const auto sharp = lens(scene, view, 2);
  const auto wanted = Vec3{0.8, 0.3, 0.1};
  for (std::size_t c = 0; c < 3; ++c)
    CHECK(mean_of(sharp)[c] == Catch::Approx(wanted[c]).margin(1e-3));
  const auto seen = reconstruct(hologram, view);
  for (std::size_t c = 1; c < 3; ++c) {
    CAPTURE(c);
    CHECK(mean_of(seen)[c] / mean_of(seen)[0] == Catch::Approx(wanted[c] / wanted[0]).margin(0.03));
  }
  const auto alike = compare(PictureView(sharp), seen, {.blur_px = 4});
  REQUIRE(alike.colours);
  CHECK(alike.colours->mean > 0.1);
  CHECK(compare(PictureView(sharp), sharp).colours->most == 0);
  auto grey = sharp;
  grey.channels = 1;
  grey.pixels.resize(48 * 32);
  CHECK_THROWS_WITH(compare(PictureView(sharp), grey), ContainsSubstring("channels"));
}

TEST_CASE("the SLM of a scene of three lasers is for their wavelengths, with the LUT of each") {
  const Folder folder;
  const auto lut = [](double end) {
    std::string text;
    for (int i = 0; i < 256; ++i) text += std::to_string(end * i / 255) + "\n";
    return text;
  };
  folder.write("red.txt", lut(1));
  folder.write("green.txt", lut(1.2));
  folder.write("blue.txt", lut(1.4));
  const auto scene =
      parse_scene(scene_text +
                      "[slm]\nencoding = \"phase\"\n[slm.lut]\n\"638 nm\" = \"red.txt\"\n"
                      "\"520 nm\" = \"green.txt\"\n\"450 nm\" = \"blue.txt\"\n",
                  folder / "", {lasers_key});
  const std::vector<std::complex<float>> field(64, {0.3f, 0.8f});
  const FieldView view(field.data(), 8, 8);
  std::vector<std::vector<std::uint8_t>> levels;
  for (const double wavelength_m : scene.wavelengths_m())
    levels.push_back(encode(view, Slm(scene), {{4e-6, 4e-6}, wavelength_m}).bytes);
  // A level that turns the light farther is a smaller one
  CHECK(levels[0][0] > levels[1][0]);
  CHECK(levels[1][0] > levels[2][0]);
  CHECK_THROWS_WITH(encode(view, Slm(scene), {{4e-6, 4e-6}, 500e-9}),
                    ContainsSubstring("several lasers, 638 nm, 520 nm, 450 nm, got 500 nm"));
}
