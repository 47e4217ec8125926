// SPDX-License-Identifier: Apache-2.0
// The shared library through its installed headers alone, as another program uses it.
#include <raywave/raywave.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "tests/api/squares.hpp"
#include "tests/support/german.hpp"
#include "tests/support/gltf.hpp"

namespace cl {}
using namespace raywave;  // no name of the library's is `cl`, or like one of another library's
using namespace raywave::test;
namespace opencl = cl;

namespace {

using Catch::Matchers::ContainsSubstring;

/// The same, half as high.
Scene low_square_scene() {
  auto scene = square_scene();
  auto low = square;
  for (auto& vertex : low) vertex[1] *= 0.5;
  scene.set_mesh(0, {low, square_faces});
  return scene;
}

/// A square of 2 units that faces the viewer, whose material has this colour.
test::Gltf coloured_square(float red) {
  test::Gltf gltf;
  const int material = gltf.material(
      {{"pbrMetallicRoughness", {{"baseColorFactor", {red, red, red, 1}}, {"metallicFactor", 0}}}});
  gltf.add(test::Gltf::square(1, {0, 0, 0}, material));
  return gltf;
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
      if (!goal.empty()) options.goal.preset = Preset::draft;
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
    const auto before = samples_of(render(scene).field());
    const auto planned = plan(scene).json();  // knows that kernels were compiled
    CHECK(samples_of(render(scene).field()) == before);
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
  const auto chosen = plan(scene, {.preset = Preset::draft});
  RenderOptions options;
  options.goal.preset = Preset::draft;
  const auto by_plan = render(chosen.scene()), by_goal = render(scene, options);
  CHECK(samples_of(by_plan.field()) == samples_of(by_goal.field()));
  // and is judged as it
  for (const auto& hologram : {by_plan, by_goal})
    CHECK_THAT(hologram.report(), ContainsSubstring("\"preset\": \"draft\""));
  CHECK_THAT(chosen.text(), ContainsSubstring("48 x 32 pixels"));
  CHECK_THROWS_AS(render(chosen.scene(), options), InputError);
  CHECK_THROWS_AS(chosen.scene().set({"sampling.frames=2"}), InputError);
}

TEST_CASE("a German program gets the same texts, numbers and pictures") {
  const auto say = [] {
    auto scene = square_scene();
    const auto wanted = plan(scene, Goal{.preset = Preset::balanced});
    const auto hologram = render(scene);
    const auto report = hologram.report();  // measured times stand behind the seed
    auto all = scene.json() + wanted.text() + report.substr(0, report.find("\"seed\""));
    for (const auto& warning : wanted.warnings()) all += warning;
    try {
      scene.set({"hologram.pitch=1234.5 km"});
    } catch (const InputError& error) {
      all += error.what();
    }
    return std::pair(all, samples_of(hologram.field()));
  };
  say();  // plans know that kernels were compiled
  const auto before = say();
  CHECK_THAT(before.first, ContainsSubstring("1234.5 km"));
  const German german;
  CHECK((std::ostringstream() << 1.5).str() == "1,5");
  CHECK(say() == before);
}

TEST_CASE("what a plan warns of is in the notes of what it renders, goal or no goal") {
  auto scene = square_scene();
  scene.set({"hologram.wavelength=900 nm", "sampling.pitch=auto"});
  for (const auto& preset : {std::optional<Preset>(), std::optional(Preset::draft)}) {
    RenderOptions options;
    options.goal.preset = preset;
    const auto warnings = plan(scene, options.goal).warnings();
    REQUIRE(!warnings.empty());
    Renderer renderer(scene, options);
    const auto moving = renderer.render();
    const auto hologram = render(scene, options);
    const auto one = hologram.laser(0);
    for (const auto& notes : {hologram.notes(), one.notes(), moving.notes(), renderer.notes()})
      for (const auto& warning : warnings)
        CHECK(std::count(notes.begin(), notes.end(), warning) == 1);
    CHECK_THAT(hologram.report(), ContainsSubstring("900 nm is no visible light"));
  }
}

TEST_CASE("a hologram is saved as the command line writes it, of several lasers each, or as one") {
  const Desk desk;
  const std::string lasers = "hologram.wavelength=[638e-9, 520e-9, 450e-9]";
  const auto bytes = [&](const std::string& name) {
    std::ifstream in(desk.file(name), std::ios::binary);
    return std::vector<char>{std::istreambuf_iterator<char>(in), {}};
  };
  const auto line = "'" RAYWAVE_PROGRAM "' render '" + desk.file("scene.toml") + "' -o '" +
                    desk.file("out") + "' --quiet --rgb --set sampling.frames=2 --set '" + lasers +
                    "' --set slm.rotate=90";
  REQUIRE(std::system(line.c_str()) == 0);
  const auto hologram =
      render(load_scene(desk.file("scene.toml"), {lasers, "sampling.frames=2", "slm.rotate=90"}));
  hologram.save(desk.file("holo.png"), 1);
  hologram.save(desk.file("packed.png"), 1, true);
  hologram.save(desk.file("all.png"));
  hologram.save(desk.file("all_rgb.png"), {}, true);
  hologram.laser(1).save(desk.file("one.PNG"));
  for (const std::string laser : {"638nm", "520nm", "450nm"})
    CHECK(bytes("holo_" + laser + ".png") == bytes("out/hologram_" + laser + "_2.png"));
  for (const std::string name : {"638nm.png", "638nm_2.png", "450nm_2.png", "rgb.png", "rgb_2.png"})
    CHECK(bytes("all_" + name) == bytes("out/hologram_" + name));
  CHECK(bytes("packed.png") == bytes("out/hologram_rgb_2.png"));
  CHECK(bytes("one.PNG") == bytes("out/hologram_520nm.png"));
  CHECK(!bytes("one.PNG").empty());
  const auto refusal = [](const auto& save) {
    try {
      save();
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  CHECK_THAT(refusal([&] { hologram.save("holo.jpg"); }), ContainsSubstring("must end with .png"));
  CHECK_THAT(refusal([&] { hologram.laser(0).save("holo.png", 0, true); }),
             ContainsSubstring("this has 1"));
  CHECK_THAT(refusal([&] { hologram.save("holo.png", 2); }), ContainsSubstring("there are 2"));
}

TEST_CASE("an animation has the bits of the command line, whichever picture is asked for first") {
  const Desk desk;
  const std::string lasers = "hologram.wavelength=[638e-9, 450e-9]";
  std::ofstream(desk.file("scene.toml"), std::ios::app)
      << "[animation]\nframes = 3\nrate = 10\nslm_rate = 15\n[[animation.track]]\n"
         "of = \"object.0.rotation\"\nat = [0, 3]\nvalues = [[0, 0, 0], [0, 60, 0]]\n";
  const auto line = "'" RAYWAVE_PROGRAM "' animate '" + desk.file("scene.toml") + "' -o '" +
                    desk.file("out") + "' --quiet --stream --no-video --no-preview --set '" +
                    lasers + "'";
  REQUIRE(std::system(line.c_str()) == 0);
  std::ifstream in(desk.file("out/frames.raw"), std::ios::binary);
  const std::vector<std::uint8_t> all{std::istreambuf_iterator<char>(in), {}};
  constexpr std::size_t size = 48 * 32;
  REQUIRE(all.size() == 5 * 2 * size);
  Animation animation(load_scene(desk.file("scene.toml"), {lasers}));
  CHECK(animation.pictures() == 3);
  CHECK(animation.rate_per_s() == 10);
  CHECK(animation.slm_rate_per_s() == Catch::Approx(15));
  REQUIRE(animation.wavelengths_m().size() == 2);
  const int first[] = {0, 2, 3, 5};  // holograms of each laser
  for (const int number : {2, 0, 1}) {
    const auto picture = animation.render(number);
    CHECK(picture.time_s == Catch::Approx(0.1 * number));
    CHECK(picture.powers.size() == 2);
    const auto count = static_cast<std::size_t>(first[number + 1] - first[number]);
    REQUIRE(picture.holograms == static_cast<int>(count));
    REQUIRE(picture.levels.values.size() == count * 2 * size);
    for (std::size_t laser = 0; laser < 2; ++laser)
      for (std::size_t j = 0; j < count; ++j) {
        const auto at = (static_cast<std::size_t>(first[number]) + j) * 2 + laser;
        CHECK(std::equal(
            picture.levels.values.begin() + static_cast<std::ptrdiff_t>((laser * count + j) * size),
            picture.levels.values.begin() +
                static_cast<std::ptrdiff_t>((laser * count + j + 1) * size),
            all.begin() + static_cast<std::ptrdiff_t>(at * size)));
      }
  }
  CHECK_THROWS_AS(animation.render(3), InputError);
  CHECK_THROWS_AS(Animation(square_scene()), InputError);  // nothing moves
  auto in_memory = load_scene(desk.file("scene.toml"));
  in_memory.set_mesh(0, {square, square_faces});
  CHECK_THROWS_AS(Animation(in_memory), InputError);
}

TEST_CASE("a trade measures what the command line measures, of meshes in memory too") {
  const Desk desk;
  TradeOptions options;
  options.presets = true;
  options.renders = 1;
  options.views = false;
  options.lens_points = 4;
  options.border_px = 2;
  options.folder = desk.file("trade");
  const auto made = trade(square_scene({"sampling.pitch=auto"}), options);
  CHECK_THAT(made.text, ContainsSubstring("balanced"));
  CHECK_THAT(made.csv, ContainsSubstring("sampling.pitch"));
  CHECK(made.sheet.values.size() == 3u * static_cast<std::size_t>(made.sheet.nx * made.sheet.ny));
  std::ifstream in(desk.file("trade/trade.json"));
  CHECK(std::string{std::istreambuf_iterator<char>(in), {}} == made.json);
  CHECK(std::ifstream(desk.file("trade/trade.png")).good());
  // Nothing is measured again
  CHECK(trade(square_scene({"sampling.pitch=auto"}), options).json == made.json);
  // Quality does not depend on where the mesh lies
  const auto line = "'" RAYWAVE_PROGRAM "' trade '" + desk.file("scene.toml") + "' -o '" +
                    desk.file("out") +
                    "' --quiet --presets --renders 1 --no-views --lens-points 4 --border 2 --set "
                    "sampling.pitch=auto";
  REQUIRE(std::system(line.c_str()) == 0);
  const auto qualities = [](std::istream&& text) {
    std::vector<std::string> found;
    for (std::string word; std::getline(text, word);)
      if (word.find("\"ssim\"") != word.npos) found.push_back(word);
    return found;
  };
  const auto told = qualities(std::ifstream(desk.file("out/trade.json")));
  CHECK(!told.empty());
  CHECK(told == qualities(std::istringstream(made.json)));
}

TEST_CASE("notes on what is read of an SLM reach the library's user, of every laser") {
  const std::string lut = "slm.lut={\"638 nm\"=[0, 0.5, 1], \"450 nm\"=[0, 0.4, 0.39, 1]}";
  const auto notes =
      parse_scene(scene_text, ".", {"hologram.wavelength=[638e-9, 450e-9]", lut}).notes();
  const auto has = [](const std::vector<std::string>& lines, const std::string& text) {
    return std::count_if(lines.begin(), lines.end(),
                         [&](const auto& line) { return line.find(text) != line.npos; });
  };
  CHECK(has(notes, "it lists 3 of 256 levels") == 1);
  CHECK(has(notes, "it lists 4 of 256 levels") == 1);
  CHECK(has(notes, "taken as noise") == 1);
  const auto slm = parse_slm("[slm]\n" + lut.substr(4));
  CHECK(has(slm.notes(638e-9), "it lists 3") == 1);
  CHECK(has(slm.notes(450e-9), "taken as noise") == 1);
  CHECK(Slm().notes(638e-9).empty());
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
  const std::vector<std::array<float, 4>> bright(4, {2, 0, 0, 1}), one_colour(1);
  const std::vector<std::uint8_t> picture(8);
  refused("colours: must be 0 to 1, got 2", [&] {
    scene.set_mesh(0, {square, square_faces, {}, {}, bright});
  });
  refused("colours: there are 1 for 4", [&] {
    scene.set_mesh(0, {square, square_faces, {}, {}, one_colour});
  });
  refused("texture: needs uv", [&] {
    scene.set_mesh(0, {square, square_faces, {}, {}, {}, picture});
  });
  const auto dull = render(scene);
  refused("depths:", [&] { quality(dull, {.depths_m = {0}}); });
  refused("border:", [&] { quality(dull, {.border_px = -1}); });
  refused("hologram: has no field", [&] { quality(render(scene, {.keep_field = false})); });
  refused("resolution:", [&] { pattern(Pattern::lens, {0, 4}, pixels); });
  refused("focal 1 mm", [&] { pattern(Pattern::lens, {640, 400}, pixels, {}, {.focal_m = 1e-3}); });
  refused("object 1:", [&] { scene.set_mesh(1, {square, square_faces}); });
  refused("position:", [&] { scene.set_pose(0, {nan, 0, 0.1}, {0, 0, 0}); });
  refused("rotation:", [&] { scene.set_pose(0, {0, 0, 0.1}, {0, 1e7, 0}); });
  refused("method \"magic\": unknown; there are wrp, points and rays",
          [] { choice_of<Method>("magic", "method"); });
  refused("preset, budget, psnr and rate", [&] { plan(scene, {Preset::draft, 1.0, {}}); });
  refused("rate:", [&] { plan(scene, {.rate_per_s = nan}); });
  refused("budget:", [&] { plan(scene, {{}, nan, {}}); });
  refused("u: has no samples", [&] { propagate(FieldView{}, pixels, 0.1); });
  const std::vector<std::complex<float>> dark(16), bad(16, {NAN, 0});
  refused("u: holds NaN", [&] { propagate(FieldView{4, 4, 1, bad.data()}, pixels, 0.1); });
  const FieldView night{4, 4, 1, dark.data()};
  refused("out_pitch: must be > 0", [&] {
    propagate(night, pixels, 0.1, {.out_pitch_m = Vec2{8e-6, nan}});
  });
  refused("out_pitch: the points spread over 1000 x 1000 windows", [&] {
    propagate(night, pixels, 0.1, {.out_pitch_m = Vec2{1e-3, 1e-3}, .out_size = {{1000, 1000}}});
  });
  refused("points: there are 0 x 4", [&] {
    propagate(night, pixels, 0.1, {.out_size = {{0, 4}}});
  });
  refused("field: holds NaN", [&] { reconstruct(FieldView{4, 4, 1, bad.data()}, pixels); });
  refused("pitch:", [&] { reconstruct(night, {{0, 0}, 633e-9}); });
  refused("wavelength:", [&] { reconstruct(night, {{1e-6, 1e-6}, nan}); });
  refused("levels:", [&] { shown({4, 4, 1, 8, {1, 2, 3}, {}}, Slm(), pixels); });
  CHECK_THROWS_AS(render(scene, {.on = {.device = "no such device"}}), DeviceError);
  CHECK_THROWS_WITH(render(parse_scene(scene_text)), ContainsSubstring("mesh is missing"));
  CHECK_THROWS_WITH(parse_scene("[hologram]\npitch = -1\n", ".", {}, "mine"),
                    Catch::Matchers::StartsWith("mine:2:"));
}
