// SPDX-License-Identifier: Apache-2.0
// Scenes of several lasers: their fields, their colours and their brightness (docs/colour.md).
#include "host/common/text.hpp"
#include "host/encode/shown.hpp"
#include "host/planning/make_plan.hpp"
#include "host/render.hpp"
#include "host/trace/samples.hpp"
#include "host/view/reconstruct.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using namespace test;

const std::string hologram = R"([hologram]
resolution = [96, 80]
pitch      = "4 um"
wavelength = ["638 nm", "520 nm", "450 nm"]
[sampling]
pitch = "25 um"
[[light]]
type = "ambient"
)";

const std::vector<std::string> lists{R"(["638 nm", "520 nm", "450 nm"])", R"(["638 nm", "520 nm"])",
                                     R"(["450 nm", "638 nm", "589 nm", "520 nm"])"};

/// A card that glows in a colour, 0.6 mm wide, or several side by side.
std::string cards(const std::vector<glm::dvec3>& colours) {
  std::string text;
  for (std::size_t i = 0; i < colours.size(); ++i) {
    const auto& c = colours[i];
    const auto name = std::to_string(i);
    text +=
        "[materials.m" + name + "]\ndiffuse = 0\nambient = [" + std::to_string(c.r) + ", " +
        std::to_string(c.g) + ", " + std::to_string(c.b) + "]\n[[object]]\nmesh = \"card.obj\"\n" +
        "width = \"" + std::to_string(0.6 / static_cast<double>(colours.size())) +
        " mm\"\nmaterial = \"m" + name + "\"\nposition = [\"" +
        std::to_string(0.6 / static_cast<double>(colours.size()) *
                       (static_cast<double>(i) - (static_cast<double>(colours.size()) - 1) / 2)) +
        " mm\", 0, \"20 mm\"]\n";
  }
  return text;
}

std::filesystem::path scene_file(const Folder& folder, const std::string& text) {
  ObjText obj;
  obj.quad({-0.5, -0.5, 0}, {-0.5, 0.5, 0}, {0.5, 0.5, 0}, {0.5, -0.5, 0});
  folder.write("card.obj", obj.text());
  return folder.write("scene.toml", hologram + text);
}

const std::string lit_teapot =  // highlights, shadows, three colours
    "[trace]\nshadows = true\n[[light]]\ndirection = [0.3, -0.2, 1]\n"
    "[materials.ball]\nambient = [0.1, 0.05, 0.02]\ndiffuse = [0.2, 0.6, 0.9]\nspecular = [0.8, "
    "0.7, "
    "0.3]\nshininess = 20\n[[object]]\nmesh = \"ball.obj\"\nwidth = \"0.4 mm\"\n"
    "position = [0, 0, \"19.5 mm\"]\nmaterial = \"ball\"\n";

DEVICE_TEST("each laser's hologram is bit-equal to that of its wavelength rendered alone") {
  const Folder folder;
  folder.write("ball.obj", ball_obj(24, 12));
  const auto file =
      scene_file(folder, lit_teapot + cards({{0.9, 0.2, 0.1}, {0.1, 0.8, 0.3}, {0.2, 0.3, 0.9}}));
  for (const auto& list : lists) {
    std::vector<std::string> set{"slm.encoding=phase", "sampling.frames=2",
                                 "hologram.wavelength=" + list};
    const auto scenes = load_scenes(file, set);
    const auto world = build_world(scenes[0]);
    set.emplace_back();
    const auto all = render(device, scenes, world);
    REQUIRE(all.lasers.size() == scenes.size());
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      set.back() = "colour.only=" + length_text(scenes[i].hologram.wavelength_m);
      CAPTURE(set.back());
      const auto alone = render(device, load_scene(file, set));
      const auto& together = all.lasers[i];
      CHECK(alone.plan.hologram.wavelength_m == together.plan.hologram.wavelength_m);
      CHECK(alone.samples == together.samples);
      CHECK(alone.field.samples == together.field.samples);
      CHECK(alone.levels == together.levels);
    }
  }
}

DEVICE_TEST("an environment's colour is that of the light on a white card") {
  const Folder folder;
  const glm::dvec3 colour(0.2, 0.6, 0.1);
  const auto sky = [&](const char* name, glm::dvec3 of) {
    std::vector<float> pixels;
    for (int i = 0; i < 8 * 4; ++i)
      for (int k = 0; k < 3; ++k) pixels.push_back(static_cast<float>(of[k]));
    save_picture(folder / name, 8, 4, pixels);
  };
  sky("coloured.exr", colour);
  sky("white.exr", glm::dvec3(1));
  const auto fields = [&](const std::string& picture, const std::string& diffuse) {
    const auto file = scene_file(
        folder, "intensity = 0\n[[light]]\ntype = \"environment\"\npicture = \"" + picture +
                    "\"\nsamples = 16\n[materials.card]\nambient = 0\ndiffuse = " + diffuse +
                    "\n[[object]]\nmesh = \"card.obj\"\nwidth = \"0.3 mm\"\n"
                    "material = \"card\"\nposition = [0, 0, \"20 mm\"]\n");
    const auto scenes = load_scenes(file);
    return render(device, scenes, build_world(scenes[0])).lasers;
  };
  const auto lit = fields("coloured.exr", "1"), painted = fields("white.exr", "[0.2, 0.6, 0.1]"),
             white = fields("white.exr", "1");
  for (std::size_t i = 0; i < 3; ++i) {
    CAPTURE(i);
    CHECK(mean_light_of(painted[i].field) > 0);
    CHECK(mean_light_of(lit[i].field) ==
          Catch::Approx(mean_light_of(painted[i].field)).epsilon(1e-5));
  }
  CHECK(mean_light_of(lit[1].field) / mean_light_of(white[1].field) > 0.4);  // green
  CHECK(mean_light_of(lit[2].field) / mean_light_of(white[2].field) < 0.2);  // blue
}

DEVICE_TEST("a renderer of several lasers shows every pose as renderers of one laser do") {
  const Folder folder;
  folder.write("ball.obj", ball_obj(24, 12));
  // A mirror, whose samples depend on the laser
  const auto mirror =
      "[materials.mirror]\nambient = 0\ndiffuse = 0\nreflectivity = [0.9, 0.5, 0.2]\n"
      "[[object]]\nmesh = \"card.obj\"\nwidth = \"0.8 mm\"\nmaterial = \"mirror\"\n"
      "position = [\"0.2 mm\", 0, \"21 mm\"]\nrotation = [0, 20, 0]\n";
  const std::pair<std::string, std::string> cases[] = {{lit_teapot, lists[0]},
                                                       {lit_teapot, lists[2]},
                                                       {lit_teapot + mirror, lists[0]},
                                                       {lit_teapot + mirror, lists[1]}};
  for (const auto& [objects, list] : cases) {
    const auto scenes =
        load_scenes(scene_file(folder, objects + cards({{0.9, 0.2, 0.1}, {0.1, 0.8, 0.3}})),
                    {"hologram.wavelength=" + list, "slm.encoding=phase"});
    const auto world = build_world(scenes[0]);
    Renderer together(device, scenes, world);
    std::vector<Renderer> alone;
    for (const auto& scene : scenes) alone.emplace_back(device, scene, world);
    std::vector<std::complex<float>> before;
    for (const double x_m : {0.0, 0.0, 0.1e-3}) {  // a pose that stays, and one that changes
      together.set_pose(0, {x_m, 0, 19.5e-3}, {0, 1e6 * x_m, 0});
      for (const bool again : {false, true}) {
        CAPTURE(x_m, again);
        const auto lasers = together.render_lasers().lasers;
        REQUIRE(lasers.size() == scenes.size());
        for (std::size_t i = 0; i < scenes.size(); ++i) {
          if (!again) alone[i].set_pose(0, {x_m, 0, 19.5e-3}, {0, 1e6 * x_m, 0});
          const auto one = alone[i].render();
          CHECK(one.samples == lasers[i].samples);
          CHECK(one.field.samples == lasers[i].field.samples);
          CHECK(one.levels == lasers[i].levels);
        }
        if (x_m > 0 && !again) CHECK(lasers[0].field.samples != before);
        before = lasers[0].field.samples;
      }
    }
  }
}

DEVICE_TEST("lasers share samples: the same places, phases and visibility") {
  const Folder folder;
  folder.write("ball.obj", ball_obj(24, 12));
  const auto scenes =
      load_scenes(scene_file(folder, lit_teapot + cards({{0.9, 0.2, 0.1}, {0.1, 0.8, 0.3}})));
  const auto world = build_world(scenes[0]);
  std::vector<device::Sample> first;
  std::vector<std::uint32_t> first_masks;
  for (const auto& scene : scenes) {
    const auto plan = make_plan(scene, world);
    const DeviceScene arrays(device, world, plan);
    const SampleTable table(device, plan, arrays);
    auto samples = table.samples.read();
    samples.resize(static_cast<std::size_t>(table.count));
    auto masks = table.visibility_masks.read();
    masks.resize(samples.size() * table.visibility_words());
    if (first.empty()) {
      REQUIRE(samples.size() > 300);
      first = samples;
      first_masks = masks;
      continue;
    }
    REQUIRE(samples.size() == first.size());
    CHECK(masks == first_masks);
    int differing = 0, coloured = 0;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      const auto &a = samples[i], &b = first[i];
      differing += a.x != b.x || a.y != b.y || a.z != b.z || a.nx != b.nx || a.ny != b.ny ||
                   a.nz != b.nz || a.weight != b.weight || a.key != b.key || a.hidden != b.hidden ||
                   a.shininess != b.shininess;
      coloured += a.radiance != b.radiance;
    }
    CHECK(differing == 0);
    CHECK(coloured > 300);
  }
}

DEVICE_TEST(
    "a white card is the lasers' white, D65 but for two, and colours are what they mix of them") {
  const Folder folder;
  const std::vector<glm::dvec3> colours{{0.8, 0.8, 0.8}, {0.8, 0, 0},     {0, 0.8, 0},
                                        {0, 0, 0.8},     {0.3, 0.6, 0.1}, {0.05, 0.2, 0.7}};
  for (const auto& list : lists) {
    std::vector<double> of_white;
    for (const auto& colour : colours) {
      CAPTURE(colour.r, colour.g, colour.b);
      const auto scenes = load_scenes(scene_file(folder, cards({colour})),
                                      {"slm.encoding=phase", "hologram.wavelength=" + list});
      const auto lasers = scenes[0].colour->lasers;
      const auto result = render(device, scenes, build_world(scenes[0]));
      if (colour == colours[0]) {
        // Mixed by the lasers at the powers that the report states, phases alone
        glm::dvec3 xyz(0), of_fields(0);
        double sum = 0;
        of_white = result.energies;
        for (std::size_t i = 0; i < lasers.count(); ++i) {
          xyz += result.powers[i] * xyz_of_wavelength(lasers.wavelengths_m[i]);
          of_fields += result.energies[i] * lasers.white_powers[i] *
                       xyz_of_wavelength(lasers.wavelengths_m[i]);
          sum += result.powers[i];
        }
        CHECK(sum == Catch::Approx(1));
        const auto white = lasers.count() > 2 ? glm::dvec2(0.3127, 0.3290)
                                              : chromaticity_of(xyz_from_srgb() * lasers.white());
        CHECK(glm::length(chromaticity_of(xyz) - white) < 0.003);
        CHECK(glm::length(chromaticity_of(of_fields) - white) < 0.003);
        continue;
      }
      for (std::size_t i = 0; i < lasers.count(); ++i)
        CHECK(result.energies[i] / of_white[i] * 0.8 ==
              Catch::Approx(std::max(0.0, glm::dot(lasers.from_rgb[i], colour))).margin(2e-5));
    }
  }
}

DEVICE_TEST("lasers need the light of their fields and what clipping takes, kept or not") {
  const Folder folder;
  for (const char* encoding : {"phase", "double-phase"}) {
    for (const int frames : {1, 2}) {
      CAPTURE(encoding, frames);
      const auto scenes = load_scenes(
          scene_file(folder, cards({{0.2, 0.3, 0.7}, {0.7, 0.3, 0.1}})),
          {std::string("slm.encoding=") + encoding, "sampling.frames=" + std::to_string(frames)});
      const auto world = build_world(scenes[0]);
      const auto kept = render(device, scenes, world);
      // One after another, and all at a time, of which the lasers' own clips are not the same
      const auto again = render(device, scenes, world, {.keep_field = false});
      Renderer renderer(device, scenes, world, {.keep_field = false});
      renderer.render_lasers();
      const auto moving = renderer.render_lasers();
      std::array<double, 3> needed{};
      double sum = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        const auto& laser = kept.lasers[i];
        const double most = laser.clip * amplitude_unit_m(laser.plan);
        double light = 0, shown = 0;
        for (const std::complex<double> u : laser.field.samples) {
          light += std::norm(u);
          shown += std::min(std::norm(u), most * most);
        }
        const auto pixels = static_cast<double>(laser.field.samples.size());
        CHECK(kept.energies[i] == Catch::Approx(light / pixels).epsilon(1e-5));
        const bool is_phase = laser.plan.slm.encoding == Encoding::phase;
        needed[i] =
            scenes[0].colour->lasers.white_powers[i] * (is_phase ? light / pixels : light / shown);
        sum += needed[i];
      }
      for (std::size_t i = 0; i < 3; ++i) {
        CAPTURE(i);
        CHECK(kept.powers[i] == Catch::Approx(needed[i] / sum).epsilon(1e-5));
        for (const auto* other : {&again, &moving}) {
          CHECK(other->lasers[i].field.samples.empty());
          CHECK(other->powers[i] == Catch::Approx(kept.powers[i]).epsilon(1e-5));
          CHECK(other->energies[i] == Catch::Approx(kept.energies[i]).epsilon(1e-5));
          CHECK(other->lasers[i].clip == Catch::Approx(kept.lasers[i].clip).epsilon(1e-5));
          std::size_t differing = 0, count = 0;
          for (std::size_t frame = 0; frame < kept.lasers[i].levels.size(); ++frame)
            for (std::size_t at = 0; at < kept.lasers[i].levels[frame].size(); ++at, ++count)
              differing += std::abs(int{kept.lasers[i].levels[frame][at]} -
                                    int{other->lasers[i].levels[frame][at]}) %
                               255 >
                           1;
          CHECK(differing <= count / 1000);
        }
      }
    }
  }
}

DEVICE_TEST("encodings that show amplitudes have one scale for all lasers") {
  const Folder folder;
  const auto scenes =
      load_scenes(scene_file(folder, cards({{0.05, 0.2, 0.7}})), {"slm.encoding=double-phase"});
  const auto world = build_world(scenes[0]);
  const auto result = render(device, scenes, world);
  const double brightest = result.lasers[2].clip;
  REQUIRE(brightest > 0);
  std::array<double, 3> needed{};  // white's powers, and what clipping takes away
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    double light = 0, shown = 0;
    for (const auto& u : result.lasers[i].field.samples) {
      const double a = std::hypot(double{u.real()}, double{u.imag()});
      light += a * a;
      shown += std::pow(std::min(a, brightest * 25e-6), 2);
    }
    needed[i] = scenes[0].colour->lasers.white_powers[i] * light / shown;
    sum += needed[i];
  }
  for (std::size_t i = 0; i < 3; ++i) {
    CAPTURE(i);
    const auto& laser = result.lasers[i];
    CHECK(laser.clip == Catch::Approx(brightest));
    CHECK(result.powers[i] == Catch::Approx(needed[i] / sum));
    // As a render alone that is told the scale
    const auto alone = render(device, scenes[i], world, RenderOptions{.clip = brightest});
    std::size_t differing = 0;
    for (std::size_t at = 0; at < alone.levels[0].size(); ++at)
      differing += std::abs(int{alone.levels[0][at]} - int{laser.levels[0][at]}) % 255 > 1;
    CHECK(differing == 0);
  }
}

DEVICE_TEST(
    "a colour chart's fields and refined levels show its 24 patches within a CIEDE2000 of 1, "
    "other levels within 5",
    "[slow]") {
  // 8-bit sRGB, row by row from the top left: McCamy, Marcus and Davidson (1976), as their maker
  // gives them
  constexpr int chart[24][3] = {{115, 82, 68},   {194, 150, 130}, {98, 122, 157},  {87, 108, 67},
                                {133, 128, 177}, {103, 189, 170}, {214, 126, 44},  {80, 91, 166},
                                {193, 90, 99},   {94, 60, 108},   {157, 188, 64},  {224, 163, 46},
                                {56, 61, 150},   {70, 148, 73},   {175, 54, 60},   {231, 199, 31},
                                {187, 86, 149},  {8, 133, 161},   {243, 243, 242}, {200, 200, 200},
                                {160, 160, 160}, {122, 122, 121}, {85, 85, 85},    {52, 52, 52}};
  struct Case {
    const char *setting, *frames;
    bool by_levels;
    double largest, mean;
  };
  Rendered result;  // of the settings `rendered`
  std::string rendered;
  for (const auto& c :
       {Case{"slm.encoding=phase", "8", false, 1, 0.5},
        Case{"slm.encoding=phase", "8", true, 5, 2.5},
        Case{"slm.encoding=double-phase", "8", true, 2, 1}, Case{"refine.views=0", "1", true, 2, 1},
        Case{"refine.views=0", "2", true, 1, 0.5}}) {
    INFO(c.setting << ", frames " << c.frames << (c.by_levels ? ", levels" : ", fields"));
    const auto scenes =
        load_scenes(std::filesystem::path(RAYWAVE_DATA_DIR) / "colour.toml",
                    {c.setting, std::string("sampling.frames=") + c.frames, "trace.shadows=false",
                     "light=[{type = \"ambient\"}]",
                     "object=[{mesh = \"colour_chart.ply\", width = \"5 mm\", position = [0, 0, "
                     "\"103 mm\"]}]"});
    const auto world = build_world(scenes[0]);
    const auto& lasers = scenes[0].colour->lasers;
    const auto xyz_from_rgb = xyz_from_srgb();
    const auto white = xyz_from_rgb * glm::dvec3(1);
    if (const auto settings = c.setting + std::string(c.frames); settings != rendered) {
      result = render(device, scenes, world);
      rendered = settings;
    }
    std::array<glm::dvec3, 24> shown{}, true_xyz{};
    for (std::size_t laser = 0; laser < 3; ++laser) {
      ReconstructSpec what{.z_m = 103e-3};
      const auto& of_laser = result.lasers[laser];
      const auto image =
          reconstruct(device, raywave::cl::FftBackend::host,
                      c.by_levels ? shown_field(*of_laser.panel, of_laser.levels) : of_laser.field,
                      scenes[laser].hologram, what);
      // Fields have the unit of white; levels shine as brightly as their laser
      const double gain = c.by_levels ? result.powers[laser] / lasers.white_powers[laser] : 1;
      // Means over the inner two thirds of a patch: what is left is speckle
      const double pitch_m = scenes[laser].hologram.pitch_m.x, patch_m = 5e-3 / 5.88,
                   half = 0.38 * patch_m / pitch_m;
      for (int patch = 0; patch < 24; ++patch) {
        const double x = (patch % 6 - 2.5) * patch_m / pitch_m + (image.width - 1) / 2.0,
                     y = (patch / 6 - 1.5) * patch_m / pitch_m + (image.height - 1) / 2.0;
        double sum = 0;
        int count = 0;
        for (int row = static_cast<int>(y - half); row <= static_cast<int>(y + half); ++row)
          for (int column = static_cast<int>(x - half); column <= static_cast<int>(x + half);
               ++column, ++count)
            sum += double{
                image.pixels[static_cast<std::size_t>(row) * static_cast<std::size_t>(image.width) +
                             static_cast<std::size_t>(column)]};
        shown[patch] += gain * sum / count * lasers.rgb[laser];
      }
    }
    double along = 0, squared = 0;
    for (std::size_t patch = 0; patch < 24; ++patch) {
      glm::dvec3 colour;
      for (int k = 0; k < 3; ++k) {
        const double v = chart[patch][k] / 255.0;
        colour[k] = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
      }
      true_xyz[patch] = xyz_from_rgb * colour;
      shown[patch] = xyz_from_rgb * shown[patch];
      along += true_xyz[patch].y * shown[patch].y;
      squared += shown[patch].y * shown[patch].y;
    }
    double most = 0, sum = 0;
    for (std::size_t patch = 0; patch < 24; ++patch) {
      const double difference = delta_e_2000(lab_of(true_xyz[patch], white),
                                             lab_of(along / squared * shown[patch], white));
      most = std::max(most, difference);
      sum += difference;
    }
    INFO("largest " << most << ", mean " << sum / 24);
    CHECK(most < c.largest);
    CHECK(sum / 24 < c.mean);
  }
}

}  // namespace
}  // namespace raywave
