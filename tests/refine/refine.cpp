// SPDX-License-Identifier: Apache-2.0
#include "host/refine/refine.hpp"

#include "host/common/error.hpp"
#include "host/encode/encode.hpp"
#include "host/encode/shown.hpp"
#include "host/evaluate/refinement.hpp"
#include "host/planning/make_plan.hpp"
#include "host/refine/light.hpp"
#include "host/refine/scene_keys.hpp"
#include "host/render.hpp"
#include "host/view/reconstruct.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using namespace test;
using Complex = std::complex<double>;
using Plane = std::vector<Complex>;
using std::numbers::pi;
constexpr auto host = cl::FftBackend::host;

/// A bright square with a dim one beside it.
RefineKey squares_at(double z_m, glm::dvec2 view = {0, 0}, glm::dvec2 aperture = {1, 1}) {
  RefineKey key{z_m, view, aperture, {40, 34, {}}, {3 * um, 3 * um}};
  for (int y = 0; y < 34; ++y) {
    for (int x = 0; x < 40; ++x)
      key.picture.pixels.push_back(x > 22 && x < 34 && y > 8 && y < 24   ? 2.0f
                                   : x > 4 && x < 16 && y > 10 && y < 28 ? 0.5f
                                                                         : 0.0f);
  }
  return key;
}

/// The loop in double, from the definitions: sums for transforms, convolutions for blurs.
class PlainLoop {
public:
  PlainLoop(const RefineSpec& spec, glm::ivec2 size, const RefineKey& key)
      : size_(size),
        grid_(refinement::picture_grid(optics(spec, size), key, refinement::Propagation::fresnel)),
        target_(refinement::blurred_target(optics(spec, size), key, grid_)),
        sums_(grid_.region_size.x * grid_.region_size.y) {
    // exp(-i pi (x - p)^2 / (lambda z)) without the phases that intensities do not see, per axis
    const auto table = [&](int n, int padded, double pitch_m, double pixel_m) {
      std::vector<Complex> values;
      for (int p = 0; p < padded; ++p) {
        for (int i = 0; i < n; ++i) {
          const double x = (i - (n - 1) / 2.0) * pitch_m, at = (p - (padded - 1) / 2.0) * pixel_m;
          values.push_back(std::polar(1 / std::sqrt(padded),
                                      pi * (2 * x * at - x * x) / (spec.wavelength_m * key.z_m)));
        }
      }
      return values;
    };
    across_ = table(size.x, grid_.size.x, spec.pitch_m.x, grid_.pixel_m.x);
    down_ = table(size.y, grid_.size.y, spec.pitch_m.y, grid_.pixel_m.y);
  }

  /// One frame: `iterations` steps from h.
  Plane frame(Plane h, const RefineSpec& spec, int number) {
    double wanted = 0;
    for (int t = 0; t < spec.iterations; ++t) {
      auto b = show(h);
      const auto own = intensity(b);
      if (t == 0) wanted = wanted_per_radiance(own, number, spec.brightness);
      for (int y = 0; y < grid_.size.y; ++y) {
        for (int x = 0; x < grid_.size.x; ++x) {
          auto& sample = b[static_cast<std::size_t>(y) * grid_.size.x + x];
          const int column = x - grid_.region_first.x, row = y - grid_.region_first.y;
          const bool inside =
              column >= 0 && column < grid_.region_size.x && row >= 0 && row < grid_.region_size.y;
          const auto at = inside ? static_cast<std::size_t>(row) * grid_.region_size.x + column : 0;
          if (!inside || target_[at] < 0) {
            sample = 0;
            continue;
          }
          const double ratio = std::max(wanted * target_[at] - sums_[at], 0.0) / own[at];
          sample *= std::sqrt(std::clamp(ratio, 0.1, 8.0)) - 1;
        }
      }
      const double step =
          spec.first_step + (spec.last_step - spec.first_step) * t / spec.iterations;
      const auto change = back(b);
      for (std::size_t i = 0; i < h.size(); ++i) {
        h[i] += step * change[i];
        h[i] /= std::abs(h[i]);
      }
    }
    const auto own = intensity(show(h));
    for (std::size_t i = 0; i < own.size(); ++i) sums_[i] += own[i];
    return h;
  }

private:
  static refinement::Optics optics(const RefineSpec& spec, glm::ivec2 size) {
    return {size, spec.pitch_m, spec.wavelength_m, spec.blur_m, spec.padding};
  }

  Plane show(const Plane& h) const {
    const int nx = size_.x, ny = size_.y, px = grid_.size.x, py = grid_.size.y;
    Plane rows(static_cast<std::size_t>(px) * ny), b(static_cast<std::size_t>(px) * py);
    for (int y = 0; y < ny; ++y) {
      for (int p = 0; p < px; ++p) {
        for (int x = 0; x < nx; ++x) rows[y * px + p] += across_[p * nx + x] * h[y * nx + x];
      }
    }
    for (int q = 0; q < py; ++q) {
      for (int y = 0; y < ny; ++y) {
        for (int p = 0; p < px; ++p) b[q * px + p] += down_[q * ny + y] * rows[y * px + p];
      }
    }
    return b;
  }

  Plane back(const Plane& b) const {
    const int nx = size_.x, ny = size_.y, px = grid_.size.x, py = grid_.size.y;
    Plane rows(static_cast<std::size_t>(px) * ny), h(static_cast<std::size_t>(nx) * ny);
    for (int q = 0; q < py; ++q) {
      for (int y = 0; y < ny; ++y) {
        for (int p = 0; p < px; ++p)
          rows[y * px + p] += std::conj(down_[q * ny + y]) * b[q * px + p];
      }
    }
    for (int y = 0; y < ny; ++y) {
      for (int x = 0; x < nx; ++x) {
        for (int p = 0; p < px; ++p)
          h[y * nx + x] += std::conj(across_[p * nx + x]) * rows[y * px + p];
      }
    }
    return h;
  }

  /// Blurred |b|^2 in the region.
  std::vector<double> intensity(const Plane& b) const {
    std::vector<double> result;
    for (int y = 0; y < grid_.region_size.y; ++y) {
      for (int x = 0; x < grid_.region_size.x; ++x) {
        double sum = 0;
        for (int j = -grid_.radius_y(); j <= grid_.radius_y(); ++j) {
          for (int i = -grid_.radius_x(); i <= grid_.radius_x(); ++i) {
            const int at_x = grid_.region_first.x + x + i, at_y = grid_.region_first.y + y + j;
            if (at_x < 0 || at_x >= grid_.size.x || at_y < 0 || at_y >= grid_.size.y) continue;
            sum += grid_.weights_x[std::abs(i)] * grid_.weights_y[std::abs(j)] *
                   std::norm(b[static_cast<std::size_t>(at_y) * grid_.size.x + at_x]);
          }
        }
        result.push_back(sum);
      }
    }
    return result;
  }

  double wanted_per_radiance(const std::vector<double>& own, int number, double brightness) const {
    double light = 0, shown = 0;
    for (std::size_t i = 0; i < own.size(); ++i) {
      if (target_[i] < 0) continue;
      light += target_[i];
      shown += own[i] + sums_[i];
    }
    (void)number;  // number / (number * light / shown) in `refine`
    return shown / light * brightness;
  }

  glm::ivec2 size_;
  refinement::PictureGrid grid_;
  std::vector<float> target_;
  std::vector<double> sums_;
  std::vector<Complex> across_, down_;
};

RefineSpec small_spec(int iterations) {
  return RefineSpec{.pitch_m = {3.74 * um, 3.74 * um},
                    .wavelength_m = 638e-9,
                    .blur_m = 8 * um,
                    .iterations = iterations};
}

DEVICE_TEST("three iterations of two frames are those of the plain loop in double") {
  const glm::ivec2 size(41, 33);
  auto spec = small_spec(3);
  spec.brightness = 1.1;
  spec.propagation = refinement::Propagation::fresnel;
  const auto key = squares_at(0.9 * mm);
  const auto start = random_phases(size, 2, 1);
  PlainLoop plain(spec, size, key);
  Plane expected;
  for (int frame = 0; frame < 2; ++frame) {
    const auto first = start.samples.begin() + std::ptrdiff_t{frame} * size.x * size.y;
    const auto h = plain.frame({first, first + size.x * size.y}, spec, frame + 1);
    expected.insert(expected.end(), h.begin(), h.end());
  }
  for (const auto backend : backends_of(device)) {
    const auto refined = refine(device, backend, start, {&key, 1}, spec);
    CHECK(relative_l2(refined.field.samples, expected) <= 2e-4);
    CHECK(refined.figures.transforms == 6.5);  // two per iteration, and one sum in two frames
  }
}

DEVICE_TEST("mirror images through the hologram's plane have conjugate refined holograms") {
  for (const double second : {1 * mm, -1 * mm}) {  // on one side of it, and on both
    auto start = random_phases({41, 33}, 2, 6);
    auto spec = small_spec(4);
    spec.showing.carrier = {0.1, -0.2};
    spec.showing.fill = glm::dvec2(0.8, 0.7);
    std::vector<RefineKey> keys{squares_at(0.9 * mm), squares_at(second, {0.4, -0.3}, {0.5, 0.5})};
    const auto beyond = refine(device, host, start, keys, spec).field.samples;
    for (auto& sample : start.samples) sample = std::conj(sample);
    for (auto& key : keys) key.z_m = -key.z_m;
    spec.showing.carrier = -spec.showing.carrier;
    const auto before = refine(device, host, start, keys, spec).field.samples;
    double apart = 0;
    for (std::size_t i = 0; i < before.size(); ++i)
      apart = std::max(apart, std::abs(std::complex<double>(before[i] - std::conj(beyond[i]))));
    CAPTURE(second);
    CHECK(apart <= 1e-5);
  }
}

DEVICE_TEST("one pixel per work-item, as on GPUs, gives what packets of pixels give") {
  const RefineKey keys[] = {squares_at(0.9 * mm), squares_at(1 * mm, {0.4, -0.3}, {0.5, 0.5})};
  const auto start = random_phases({41, 33}, 2, 2);
  auto info = device.info();
  std::vector<std::complex<float>> first;
  for (const int lanes : {1, 4, 8, 16}) {
    info.float_lanes = lanes;
    info.kind = lanes == 1 ? cl::DeviceKind::gpu : device.info().kind;
    const auto refined = refine(cl::Device(info), host, start, keys, small_spec(4));
    if (first.empty()) first = refined.field.samples;
    CHECK(relative_l2(refined.field.samples, first) <= 1e-4);
  }
}

DEVICE_TEST("equal seeds give equal bits, other seeds other holograms, of modulus 1") {
  const RefineKey keys[] = {squares_at(0.9 * mm), squares_at(1.1 * mm)};
  const auto start = random_phases({41, 33}, 1, 3);
  auto spec = small_spec(5);
  const auto a = refine(device, host, start, keys, spec).field.samples,
             b = refine(device, host, start, keys, spec).field.samples;
  spec.seed = 2;
  const auto c = refine(device, host, start, keys, spec).field.samples;
  CHECK(a == b);
  CHECK(a != c);
  for (const auto& sample : a) CHECK(std::abs(std::abs(sample) - 1) <= 1e-6f);
}

DEVICE_TEST("only the aperture's part of the hologram changes; iterations 0 leave all of it") {
  const auto key = squares_at(0.9 * mm, {0.5, 0.5}, {0.5, 0.5});
  const auto start = random_phases({41, 33}, 1, 4);
  const auto open = refinement::open_part({41, 33}, key.view, key.aperture);
  const auto none = refine(device, host, start, {&key, 1}, small_spec(0)).field.samples;
  CHECK(relative_l2(none, start.samples) <= 1e-6);
  const auto refined = refine(device, host, start, {&key, 1}, small_spec(2)).field.samples;
  int changed = 0;
  for (int y = 0; y < 33; ++y) {
    for (int x = 0; x < 41; ++x) {
      const auto i = static_cast<std::size_t>(y) * 41 + x;
      const bool inside = x >= open.first.x && y >= open.first.y &&
                          x < open.first.x + open.size.x && y < open.first.y + open.size.y;
      const bool differs = std::abs(refined[i] - start.samples[i]) > 1e-3f;
      CHECK((inside || !differs));
      changed += differs;
    }
  }
  CHECK(changed > open.size.x * open.size.y / 2);
}

DEVICE_TEST("a budget decides the iterations, and is kept") {
  const auto key = squares_at(0.9 * mm);
  const auto start = random_phases({41, 33}, 2, 4);
  auto spec = small_spec(7);
  spec.budget_s = 0.2;
  const auto refined = refine(device, host, start, {&key, 1}, spec);
  CHECK(refined.figures.iterations >= 1);
  CHECK(refined.figures.loop_s < 5);  // another process may hold the machine
}

DEVICE_TEST("black, missing and impossible pictures are refused") {
  const auto start = random_phases({41, 33}, 1, 5);
  const auto refused = [&](const RefineKey& key, const RefineSpec& spec) {
    CHECK_THROWS_AS(refine(device, host, start, {&key, 1}, spec), InputError);
  };
  auto key = squares_at(0.9 * mm);
  CHECK_THROWS_AS(refine(device, host, start, {}, small_spec(1)), InputError);
  auto spec = small_spec(1);
  spec.wavelength_m = 0;
  refused(key, spec);
  spec = small_spec(1);
  spec.brightness = NAN;
  refused(key, spec);
  std::fill(key.picture.pixels.begin(), key.picture.pixels.end(), 0.0f);
  refused(key, small_spec(1));
  key.picture.pixels.clear();
  refused(key, small_spec(1));
}

TEST_CASE("depths lie through the scene and beyond it, and views in every part of the hologram") {
  const auto scene = load_scene(RAYWAVE_DATA_DIR "/study.toml");
  const auto plan = make_plan(scene, build_world(scene));
  const auto depths = refine_depths_m(plan, 15 * um);
  REQUIRE(depths.size() == 5);
  const double expected_mm[] = {16.3, 17.55, 18.55, 19.5, 21.25};  // as in the study
  for (std::size_t i = 0; i < 5; ++i)
    CHECK(depths[i] / mm == Catch::Approx(expected_mm[i]).margin(0.05));

  const auto places = key_places(plan, 15 * um, {{}, 24, 1});
  REQUIRE(places.size() == 29);
  int quadrants[2][2] = {};
  for (std::size_t i = 0; i < places.size(); ++i) {
    const auto& place = places[i];
    CHECK(place.times == (i >= 5 ? 1 : i > 0 && i < 4 ? 3 : 2));
    if (i < 5) continue;
    CHECK(std::max(std::abs(place.view.x), std::abs(place.view.y)) <= 0.5);
    CHECK(place.z_m >= depths.front());
    CHECK(place.z_m <= depths.back());
    ++quadrants[place.view.x > 0][place.view.y > 0];
  }
  for (const auto& row : quadrants)
    for (const int count : row) CHECK(count == 6);
}

DEVICE_TEST("refined levels show no less than the field through other parts of the hologram") {
  const double blur_m = 15 * um;
  const auto scene = load_scene(RAYWAVE_DATA_DIR "/study.toml",
                                {"sampling.frames=4", "refine.blur=15um", "refine.lens_points=6"});
  const auto world = build_world(scene);
  const auto rendered = render(device, scene, world);
  const DeviceScene arrays(device, world, rendered.plan);
  std::vector<JudgedKey> judged;
  for (const glm::dvec2 centre : {glm::dvec2(-0.2, 0.1), {0.22, -0.2}, {0, 0.25}})
    judged.push_back(
        {KeyRole::held_out, lens_key(device, rendered.plan, arrays, {19 * mm, centre, {0.5, 0.5}},
                                     blur_m, key_pictures(*rendered.plan.refine))});
  const auto figures = judge_refinement(
      device, host, scene.hologram,
      {rendered.field, rendered.field, shown_field(*rendered.panel, rendered.levels)}, judged,
      blur_m, 5, 19 * mm);
  for (const auto& row : figures.rows) {
    CAPTURE(row.psnr_db.field, row.psnr_db.refined);
    CHECK(row.psnr_db.refined > row.psnr_db.field);
  }
}

DEVICE_TEST(
    "a scene with [refine] gets levels that show several dB more than its phase, between the "
    "depths too") {
  const double blur_m = 24 * um;
  for (const double brightness : {1.0, brighter}) {
    auto scene =
        load_scene(RAYWAVE_DATA_DIR "/study.toml",
                   {"hologram.resolution=[96,80]", "sampling.frames=2", "hologram.pitch=8um",
                    "sampling.pitch=40um", "refine.blur=24um", "refine.lens_points=6"});
    scene.refine->brightness = brightness;
    const auto world = build_world(scene);
    const auto rendered = render(device, scene, world);
    REQUIRE(rendered.refined);
    const auto& refined = *rendered.refined;
    CHECK(rendered.panel->slm().encoding == Encoding::phase);
    REQUIRE(make_plan(load_scene(RAYWAVE_DATA_DIR "/study.toml"), world).slm.encoding ==
            Encoding::double_phase);
    Encoder encoder(device, rendered.panel);
    CHECK(rendered.levels == encode(device, encoder, refined.phases));

    std::vector<JudgedKey> judged;
    for (const auto& key : refined.keys) judged.push_back({KeyRole::optimised, key});
    const DeviceScene arrays(device, world, rendered.plan);
    judged.push_back({KeyRole::held_out, lens_key(device, rendered.plan, arrays, {19 * mm}, blur_m,
                                                  key_pictures(*rendered.plan.refine))});
    const auto figures = judge_refinement(
        device, host, scene.hologram,
        {rendered.field, shown_field(*rendered.panel, encode(device, encoder, rendered.field)),
         shown_field(*rendered.panel, rendered.levels)},
        judged, blur_m, 5, 19 * mm);
    REQUIRE(figures.rows.size() == judged.size());
    CHECK_SAYS(refinement_text(figures, refined.figures),
               "window 0.768 x 0.64 mm, blur 24 um, border 5 px");
    for (const auto& row : figures.rows) {
      CAPTURE(row.z_m, brightness, row.psnr_db.field, row.psnr_db.unrefined, row.psnr_db.refined);
      CHECK(row.psnr_db.refined > row.psnr_db.unrefined + 3);
    }
    INFO("light " << figures.light.unrefined << ", " << figures.light.refined);
    // Measured 0.60 and 0.68 of 0.78; less is left in a hologram this small than in a large one
    CHECK(figures.light.refined > 0.72 * brightness * figures.light.unrefined);
  }
}

TEST_CASE("a scene without iterations is not refined, and an SLM of amplitudes cannot be") {
  const std::string study = RAYWAVE_DATA_DIR "/study.toml";
  CHECK_FALSE(load_scene(study, {"refine.iterations=0", "refine.views=3"}).refine);
  const auto scene =
      load_scene(study, {"refine.views=3", "slm.encoding=lee", "slm.carrier=[0.2, 0]"});
  const auto world = build_world(scene);
  CHECK_REFUSED(make_plan(scene, world), "encoding \"lee\"");
}

TEST_CASE("what a refinement is to begin with must have the scene's size") {
  auto scene =
      load_scene(RAYWAVE_DATA_DIR "/study.toml", {"hologram.resolution=[96,80]", "refine.views=0"});
  RenderOptions how{.refine_starts = {random_phases({96, 81}, 16, 1)}};
  CHECK_REFUSED(render(all_devices().front(), scene, how),
                "96 x 81 samples; the scene has 16 of 96 x 80");
}

}  // namespace
}  // namespace raywave
