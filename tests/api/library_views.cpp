// SPDX-License-Identifier: Apache-2.0
// What holograms show, through the headers of the shared library alone.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <optional>

#include "tests/api/squares.hpp"

using namespace raywave;
using namespace raywave::test;

namespace {

using Catch::Matchers::ContainsSubstring;

double relative_error(const auto& a, const auto& b) {
  double difference = 0, norm = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    difference += std::norm(std::complex<double>(a[i]) - std::complex<double>(b[i]));
    norm += std::norm(std::complex<double>(b[i]));
  }
  return std::sqrt(difference / norm);
}

}  // namespace

TEST_CASE("a field that is propagated in floats agrees with the one in doubles") {
  const int nx = 40, ny = 27;
  FieldDouble source{nx, ny, 2, {}};
  for (int i = 0; i < nx * ny * 2; ++i)
    source.values.push_back(std::polar(1 + 0.5 * std::sin(0.7 * i), 0.3 * i * i));
  Field rounded{nx, ny, 2, {source.values.begin(), source.values.end()}};
  for (std::size_t i = 0; i < source.values.size(); ++i) source.values[i] = rounded.values[i];
  const Pixels pixels{{4e-6, 5e-6}, 633e-9};
  PropagateOptions options;
  options.shift_m = {20e-6, -30e-6};
  const auto exact = propagate(source, pixels, 1e-3, options);
  for (const auto& device : list_devices()) {
    options.on.device = device.index;
    CHECK(relative_error(propagate(rounded, pixels, 1e-3, options).values, exact.values) < 1e-6);
  }
}

namespace {

using std::numbers::pi;

/// A tilted beam in the middle of some columns and rows, by place.
std::complex<double> beam(double x_m, double y_m) {
  const double x = (x_m - 12e-6) / 18e-6, y = (y_m + 9e-6) / 18e-6;
  return std::polar(std::exp(-x * x - y * y), 2 * pi / 633e-9 * (0.02 * x_m + 0.01 * y_m));
}

/// The places of samples, pitch apart, about a centre; row 0 on top.
template <class Work>
void for_points(int nx, int ny, const Vec2& pitch_m, const Vec2& centre_m, const Work& work) {
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i)
      work(centre_m[0] + (i - (nx - 1) / 2.0) * pitch_m[0],
           centre_m[1] - (j - (ny - 1) / 2.0) * pitch_m[1]);
}

}  // namespace

TEST_CASE("points of another pitch have the direct sum's field, finer, coarser and shifted") {
  const double wavelength_m = 633e-9, k = 2 * pi / wavelength_m, z_m = 3e-3;
  const Pixels pixels{{4e-6, 5e-6}, wavelength_m};
  const int columns = 41, rows = 38;
  for (const auto& size : {std::array{63, 48}, std::array{64, 47}}) {
    const int nx = size[0], ny = size[1];
    FieldDouble source{nx, ny, 2, {}};
    for (const double sign : {1.0, -0.5})
      for_points(nx, ny, pixels.pitch_m, {0, 0},
                 [&](double x, double y) { source.values.push_back(sign * beam(x, y)); });
    const Field rounded{nx, ny, 2, {source.values.begin(), source.values.end()}};
    for (const double ratio : {0.5, 1.0, 1.7}) {
      for (const auto& shift_m : {Vec2{0, 0}, Vec2{31e-6, -47e-6}}) {
        CAPTURE(nx, ratio, shift_m[0]);
        PropagateOptions options;
        options.shift_m = shift_m;
        options.out_pitch_m = {ratio * pixels.pitch_m[0], ratio * pixels.pitch_m[1]};
        options.out_size = {columns, rows};
        std::vector<std::complex<double>> direct, there;
        for_points(columns, rows, *options.out_pitch_m, shift_m, [&](double x, double y) {
          std::complex<double> sum = 0;
          auto sample = source.values.begin();
          for_points(nx, ny, pixels.pitch_m, {0, 0}, [&](double from_x, double from_y) {
            const double r = std::hypot(x - from_x, y - from_y, z_m);
            sum += *sample++ * z_m / (2 * pi * r * r) * std::polar(1.0, k * r) *
                   std::complex(1 / r, -k);
          });
          direct.push_back(sum * pixels.pitch_m[0] * pixels.pitch_m[1]);
          there.push_back(beam(x, y));
        });
        const auto both_frames = [](std::vector<std::complex<double>> samples) {
          for (auto i = samples.size(), n = i; i < 2 * n; ++i)
            samples.push_back(-0.5 * samples[i - n]);
          return samples;
        };
        const auto arrived = propagate(source, pixels, z_m, options);
        CHECK(arrived.nx == columns);
        CHECK(arrived.ny == rows);
        REQUIRE(arrived.values.size() == 2 * direct.size());
        CHECK(relative_error(arrived.values, both_frames(direct)) < 3e-8);
        // No way at all is an interpolation
        CHECK(relative_error(propagate(source, pixels, 0, options).values, both_frames(there)) <
              1e-10);
        for (const auto& device : list_devices()) {
          options.on.device = device.index;
          CHECK(relative_error(propagate(rounded, pixels, z_m, options).values,
                               both_frames(direct)) < 6e-7);
        }
      }
    }
  }
}

TEST_CASE("a window wider than the field shows light where its own window ends, and none beyond") {
  // A field that is bright at its edges, whose light goes straight on
  const int nx = 40, ny = 27;
  const Pixels pixels{{8e-6, 8e-6}, 633e-9};
  const FieldDouble source{nx, ny, 1, std::vector<std::complex<double>>(nx * ny, 1.0)};
  PropagateOptions options;
  options.out_pitch_m = {4e-6, 4e-6};
  options.out_size = {4 * nx, 4 * ny};
  const auto seen = propagate(source, pixels, 1e-4, options);
  double inside = 0, all = 0;
  for (int y = 0; y < 4 * ny; ++y)
    for (int x = 0; x < 4 * nx; ++x) {
      const double light = std::norm(seen.values[static_cast<std::size_t>(4 * nx * y + x)]);
      all += light;
      if (std::abs(2 * x + 1 - 4 * nx) <= 2 * nx + 8 && std::abs(2 * y + 1 - 4 * ny) <= 2 * ny + 8)
        inside += light;
    }
  CHECK(all / 4 == Catch::Approx(nx * ny).epsilon(1e-3));
  CHECK(inside > 0.998 * all);
}

TEST_CASE("a hologram shows what a lens sees, through every function of the library") {
  const auto scene = square_scene({"hologram.resolution=[128, 96]"});
  const auto hologram = render(scene);
  const auto shown_field = hologram.shown();
  CHECK(shown_field.values == shown({hologram.nx(), hologram.ny(), 1, 8, levels_of(hologram), {}},
                                    Slm(scene), scene.pixels())
                                  .values);
  const auto again = encode(hologram.field(), Slm(scene), scene.pixels());
  CHECK(again.values.size() == hologram.levels().size());
  ViewOptions view;
  view.z_m = 0.01;
  const auto seen = reconstruct(hologram.field(), hologram.pixels(), view);
  const auto sharp = lens(scene, view, 4);
  const auto alike = compare(sharp, seen, {.blur_px = 6});
  CHECK(alike.psnr_db > 15);
  const auto same = compare(hologram.field(), hologram.field());
  CHECK(same.correlation == Catch::Approx(1));
  CHECK(std::isinf(compare(seen, seen).psnr_db));
}

TEST_CASE("points strewn over a square look as the square does, and hide what is behind them") {
  auto scene = square_scene({"hologram.resolution=[128, 96]"});
  ViewOptions view;
  view.z_m = 0.01;
  const auto whole = lens(scene, view, 4);
  std::vector<Vec3> points, normals;
  std::vector<std::array<float, 4>> colours;
  constexpr int side = 40;
  for (int i = 0; i < side * side; ++i) {
    points.push_back({(i % side + 0.5) / side - 0.5, (i / side + 0.5) / side - 0.5, 0});
    normals.push_back({0, 0, -1});
    colours.push_back({1, 1, 1, 1});
  }
  const std::vector<double> radii(points.size(), 0.75 / side);
  scene.set_mesh(0, {.vertices = points, .normals = normals, .radii = radii});
  const auto strewn = lens(scene, view, 4);
  CHECK(compare(whole, strewn, {.blur_px = 1}).psnr_db >
        25);  // it reaches beyond the square's edge
  const auto light = [](const Picture& picture) {
    double sum = 0;
    for (const float v : picture.values) sum += v;
    return sum;
  };
  CHECK(light(strewn) == Catch::Approx(light(whole)).epsilon(0.08));

  // Without normals they are balls that show their colours; a black one hides its disc of them
  const std::vector<double> by_distance(points.size(), 0);
  scene.set_mesh(0, {.vertices = points, .colours = colours, .radii = by_distance});
  const double open = light(lens(scene, view, 4));
  auto with_hider = points;
  with_hider.push_back({0, 0, -0.5});
  colours.push_back({0, 0, 0, 1});
  auto sizes = by_distance;
  sizes.push_back(0.25);
  scene.set_mesh(0, {.vertices = with_hider, .colours = colours, .radii = sizes});
  const double hidden = 1 - light(lens(scene, view, 4)) / open;
  // An octahedron seen along its axis; 0.1 mm nearer it covers 1 % more
  const double reach = 0.25 * std::sqrt(std::numbers::pi / std::sqrt(3.0));
  CHECK(hidden == Catch::Approx(2 * reach * reach).epsilon(0.1));

  CHECK_THROWS_WITH(scene.set_mesh(0, {.vertices = points, .radii = std::vector<double>{1}}),
                    Catch::Matchers::StartsWith("radii: belong to points"));
  CHECK_THROWS_WITH(scene.set_mesh(0, {.vertices = square, .radii = std::vector<double>(4, -1)}),
                    Catch::Matchers::StartsWith("radii: must be 0 or more"));
}

TEST_CASE("behind an eyepiece the library looks through the scene's pupil, or through any") {
  const auto scene =
      square_scene({"hologram.resolution=[160,120]", "viewer.eyepiece=50mm", "viewer.pupil=2mm",
                    "viewer.pupil_position=[[\"-0.6mm\",0],[0,0],[\"0.6mm\",0]]",
                    "object.0.position=[0,0,\"-3.4mm\"]"});
  const auto hologram = render(scene);
  const ViewOptions whole{.z_m = -3e-3, .pupil = "none"};
  const ViewOptions first{.z_m = -3e-3, .pupil = "2mm@-0.6mm,0"};
  const ViewOptions asked{.z_m = -3e-3}, last{.z_m = -3e-3, .pupil = "scene@0.6mm,0"};
  const auto seen = reconstruct(hologram, asked);
  CHECK(seen.values == reconstruct(hologram, first).values);
  CHECK(seen.values != reconstruct(hologram, last).values);
  CHECK(seen.values != reconstruct(hologram, whole).values);
  CHECK(lens(scene, asked, 6).values == lens(scene, first, 6).values);
  CHECK(lens(scene, asked, 6).values != lens(scene, last, 6).values);
  // A part of the hologram is looked through without a pupil
  const ViewOptions part{.z_m = -3e-3, .aperture = {0.5, 1}};
  auto plain = part;
  plain.pupil = "none";
  CHECK(reconstruct(hologram, part).values == reconstruct(hologram, plain).values);

  QualityOptions how{.depths_m = {-3e-3}, .lens_points = 6, .border_px = 0};
  how.window_m = {0.4e-3, 0.3e-3};
  how.blur_m = 0;
  const auto rows = quality(hologram, how);
  REQUIRE(rows.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(rows[i].view == View::pupil);
    CHECK(rows[i].pupil_m == 2e-3);
    CHECK(std::abs(rows[i].pupil_place_m[0] - (static_cast<double>(i) - 1) * 0.6e-3) < 1e-12);
  }
  auto view = rows[2].pupil_place_m[0] > 0 ? last : first;
  view.window_m = how.window_m;
  const auto expected = compare(lens(scene, view, 6), reconstruct(hologram, view));
  CHECK(std::abs(rows[2].levels.psnr_db - expected.psnr_db) < 1e-6);
  how.pupils = {"none"};
  how.views = false;
  CHECK(quality(hologram, how).at(0).view == View::whole);
  CHECK_THROWS_WITH(reconstruct(hologram, ViewOptions{.z_m = -3e-3, .pupil = "-1mm"}),
                    ContainsSubstring("pupil"));
  LiveView live(scene, {.longest = 16});
  auto viewing = live.start();
  viewing.view = {0.5, 0};
  CHECK_THROWS_WITH(live.look(viewing), ContainsSubstring("behind an eyepiece"));
}

TEST_CASE("a preview shows the outline of a sphere as the middle of the hologram sees it") {
  // The cone that touches a sphere of radius 3, 10 away, in the plane z
  const double radius = 3e-3, distance = 10e-3;
  auto scene = parse_scene(
      "[hologram]\nresolution = [48, 32]\npitch = \"4 um\"\n[[light]]\ntype = \"ambient\"\n"
      "[[object]]\nwidth = \"6 mm\"\nposition = [0, 0, \"10 mm\"]\n",
      ".");
  const std::uint32_t around = 192, rows = 96;
  std::vector<Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> faces;
  for (std::uint32_t row = 0; row <= rows; ++row)
    for (std::uint32_t i = 0; i < around; ++i) {
      const double polar = pi * row / rows, turn = 2 * pi * i / around;
      vertices.push_back(
          {std::sin(polar) * std::cos(turn), std::cos(polar), std::sin(polar) * std::sin(turn)});
      if (row == rows) continue;
      const auto a = row * around + i, b = row * around + (i + 1) % around;
      if (row > 0) faces.push_back({a, b, a + around});
      if (row + 1 < rows) faces.push_back({b, b + around, a + around});
    }
  scene.set_mesh(0, {vertices, faces});
  PreviewOptions options;
  options.window_m = {8e-3, 8e-3};
  for (const auto& device : list_devices()) {
    options.on.device = device.index;
    for (const double z_m : {10e-3, 8e-3}) {
      options.z_m = z_m;
      const auto seen = preview(scene, options);
      REQUIRE(seen.channels == 1);
      CHECK(seen.nx == seen.ny);
      CHECK(seen.nx <= 320);
      const auto lit = std::count_if(seen.values.begin(), seen.values.end(),
                                     [](float light) { return light > 0; });
      const double outline = z_m * radius / std::sqrt(distance * distance - radius * radius);
      const double pixel = 8e-3 / seen.nx;
      CHECK(std::sqrt(static_cast<double>(lit) / pi) * pixel ==
            Catch::Approx(outline).epsilon(3e-3));
    }
  }
  options.z_m = 0;
  CHECK_THROWS_WITH(preview(scene, options), ContainsSubstring("z:"));
}

TEST_CASE("refinement brings the pictures of an SLM's levels nearer to what a lens sees") {
  const auto scene = square_scene({"hologram.resolution=[96, 64]"});
  ViewOptions view;
  view.z_m = 0.01;
  const auto sharp = lens(scene, view, 4);
  const auto psnr_db = [&](const FieldView& field) {
    return compare(sharp, reconstruct(field, scene.pixels(), view), {.blur_px = 4}).psnr_db;
  };
  const auto hologram = render(scene);
  const auto unrefined = psnr_db(hologram.shown());
  RefineOptions options;
  options.iterations = 20;  // rays to a lens
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
        mean[c] += double{picture.values[static_cast<std::size_t>(48 * y + x) * 3 + c]} / 400;
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

TEST_CASE("a solid keeps its size as it turns, where a pose of its width does not") {
  const auto light = [](bool is_solid) {
    Renderer renderer(glowing_card({"colour.only=520 nm"}), {.keep_field = true});
    renderer.set_pose(0, {0, 0, 0.01}, {0, 60, 0}, is_solid);
    double sum = 0;
    for (const auto& sample : samples_of(renderer.render().field())) sum += std::norm(sample);
    return sum;
  };
  // Half as wide as it was; or as wide, and twice as high
  CHECK(light(false) / light(true) == Catch::Approx(4).epsilon(0.1));
}

TEST_CASE("a live view turns solids, and what it cannot show leaves the next picture as it was") {
  for (const auto& device : list_devices()) {
    LiveView live(square_scene(), {.on = {.device = device.index}, .longest = 48});
    auto viewing = live.start();
    CHECK(viewing.focus_m == Catch::Approx(0.01));
    const auto first = live.look(viewing);
    CHECK(first.rgb.size() == std::size_t{3} * 48 * 48);
    CHECK(first.hologram_s == 0);
    viewing.poses[0].turn({0, 60, 0});
    viewing.has_lens = true;
    const auto turned = live.look(viewing);
    CHECK(turned.nx == 2 * 48);
    // Columns with light from a lens: half as many as the square had
    const auto columns = [&](const LivePicture& picture, int from) {
      int lit = 0;
      for (int x = from; x < from + 48; ++x)
        lit += picture.rgb[3 * static_cast<std::size_t>(24 * picture.nx + x)] > 64;
      return lit;
    };
    CHECK(columns(turned, 48) == Catch::Approx(0.5 * 40).margin(2));  // a fifth more is seen
    const auto refused = [&](const std::string& start, auto&& change) {
      auto wrong = live.start();
      change(wrong);
      CHECK_THROWS_WITH(live.look(wrong), Catch::Matchers::StartsWith(start));
    };
    refused("poses: there are 0", [](Viewing& v) { v.poses.clear(); });
    refused("focus: must be a depth in metres", [](Viewing& v) { v.focus_m = 98; });
    refused("view: must be -1 to 1", [](Viewing& v) { v.view = {0, 2}; });
    refused("pupil: takes the place of aperture", [](Viewing& v) {
      v.aperture = 0.5;
      v.pupil_m = 1e-3;
    });
    const auto again = live.look(viewing);
    CHECK(again.rgb == turned.rgb);
    CHECK(again.hologram_s == 0);
  }
  CHECK_THROWS_WITH(LiveView(square_scene(), {.longest = 0}),
                    ContainsSubstring("longest: must be"));
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
  const auto alike = compare(sharp, seen, {.blur_px = 4});
  REQUIRE(alike.colours);
  CHECK(alike.colours->mean > 0.1);
  CHECK(compare(sharp, sharp).colours->most == 0);
  auto grey = sharp;
  grey.channels = 1;
  grey.values.resize(48 * 32);
  CHECK_THROWS_WITH(compare(sharp, grey), ContainsSubstring("channels"));
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
  const FieldView view{8, 8, 1, field.data()};
  std::vector<std::vector<std::uint8_t>> levels;
  for (const double wavelength_m : scene.wavelengths_m())
    levels.push_back(encode(view, Slm(scene), {{4e-6, 4e-6}, wavelength_m}).values);
  // A level that turns the light farther is a smaller one
  CHECK(levels[0][0] > levels[1][0]);
  CHECK(levels[1][0] > levels[2][0]);
  CHECK_THROWS_WITH(encode(view, Slm(scene), {{4e-6, 4e-6}, 500e-9}),
                    ContainsSubstring("several lasers, 638 nm, 520 nm, 450 nm, got 500 nm"));
}
