// SPDX-License-Identifier: Apache-2.0
// Pictures by light from a source that has a size and a spectrum.
#include "host/reference/propagation.hpp"
#include "host/scene/scene.hpp"
#include "host/view/reconstruct.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/render.hpp"

namespace raywave {
namespace {

using namespace test;
using Catch::Approx;
using std::numbers::pi;

constexpr auto host = cl::FftBackend::host;
constexpr double wavelength_m = 638e-9, pitch_m = 4e-6, z_m = 40e-3, waist_m = 0.3e-3;

const HologramSpec hologram{{448, 384}, {pitch_m, pitch_m}, wavelength_m};

/// A Gaussian beam of this waist (1/e^2 of the intensity) that converges to a point in the plane z,
/// times a tilt of so many cycles per metre.
FieldStack beam(const SourceSpread& source, glm::dvec2 tilt = {0, 0}) {
  FieldStack field{448, 384, 1, {}, source};
  for (int y = 0; y < field.ny; ++y)
    for (int x = 0; x < field.nx; ++x) {
      const glm::dvec2 at = glm::dvec2(x - 223.5, 191.5 - y) * pitch_m;
      const double r2 = glm::dot(at, at);
      const double turns = (std::sqrt(z_m * z_m + r2) - z_m) / wavelength_m + glm::dot(tilt, at);
      field.samples.emplace_back(
          std::polar(std::exp(-r2 / (waist_m * waist_m)), 2 * pi * (turns - std::round(turns))));
    }
  return field;
}

struct Moments {
  double light = 0;
  glm::dvec2 middle_m{0, 0}, variance_m2{0, 0};
};

Moments moments_of(const Image& image) {
  Moments m;
  glm::dvec2 square(0);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const double v = image.pixels[static_cast<std::size_t>(y * image.width + x)];
      const glm::dvec2 at =
          glm::dvec2(x - (image.width - 1) / 2.0, (image.height - 1) / 2.0 - y) * pitch_m;
      m.light += v;
      m.middle_m += v * at;
      square += v * at * at;
    }
  m.middle_m /= m.light;
  m.variance_m2 = square / m.light - m.middle_m * m.middle_m;
  return m;
}

Moments seen(const cl::Device& device, const FieldStack& field) {
  return moments_of(reconstruct(device, host, field, hologram, {.z_m = z_m}));
}

// Of the spot alone: z wavelength / (pi waist) is where 1/e^2 is left
constexpr double spot_m2 =
    (z_m * wavelength_m / (pi * waist_m) / 2) * (z_m * wavelength_m / (pi * waist_m) / 2);

DEVICE_TEST("a source's size spreads a point over a disc of that angle times the distance") {
  for (const double angle : {0.5e-3, 3e-3, 12e-3}) {
    const double radius_m = angle / 2 * z_m;
    const auto field = beam({.size_rad = angle});
    const auto image = reconstruct(device, host, field, hologram, {.z_m = z_m});
    const auto m = moments_of(image);
    for (const int axis : {0, 1})
      CHECK(1e12 * m.variance_m2[axis] ==
            Approx(1e12 * (spot_m2 + radius_m * radius_m / 4)).epsilon(0.01));
    const auto sharp = seen(device, beam({}));
    CHECK(m.light == Approx(sharp.light).epsilon(1e-3));
    if (angle < 10e-3) continue;
    // Even up to three quarters of the radius
    for (const double share : {0.0, 0.4, -0.75}) {
      const int x = static_cast<int>(std::lround(223.5 + share * radius_m / pitch_m));
      CHECK(image.pixels[static_cast<std::size_t>(192 * 448 + x)] ==
            Approx(m.light * pitch_m * pitch_m / (pi * radius_m * radius_m)).epsilon(0.01));
    }
  }
}

DEVICE_TEST("a picture by a disc of directions is the mean of the pictures of tilted light") {
  // Random phases under a beam: speckle
  SourceSpread source{.size_rad = 4e-3};
  auto field = beam(source);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (auto& sample : field.samples)
    sample *= std::complex<float>(std::polar(1.0, 0.4 * pi * uniform(random)));
  const auto image = reconstruct(device, host, field, hologram, {.z_m = z_m});
  std::vector<double> sum(image.pixels.size());
  constexpr int tilts = 500;
  for (int i = 0; i < tilts; ++i) {
    // As the seeds of a sunflower
    const double r = std::sqrt((i + 0.5) / tilts), turn = 2.399963229728653 * i;
    const glm::dvec2 t(r * std::cos(turn), r * std::sin(turn));
    auto tilted = field;
    tilted.source = {};
    for (int y = 0; y < field.ny; ++y)
      for (int x = 0; x < field.nx; ++x)
        tilted.samples[static_cast<std::size_t>(y * field.nx + x)] *=
            std::complex<float>(std::polar(
                1.0, 2 * pi * source.size_rad / 2 / wavelength_m * (t.x * x - t.y * y) * pitch_m));
    const auto one = reconstruct(device, host, tilted, hologram, {.z_m = z_m});
    for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += double{one.pixels[k]};
  }
  double off = 0, all = 0;
  for (std::size_t k = 0; k < sum.size(); ++k) {
    off += std::pow(sum[k] / tilts - double{image.pixels[k]}, 2);
    all += std::pow(sum[k] / tilts, 2);
  }
  INFO(tilts << " tilts, error " << std::sqrt(off / all));
  CHECK(std::sqrt(off / all) < 0.01);
}

DEVICE_TEST("a spectrum defocuses a point by the hologram's size, and a carrier smears it") {
  const auto change = [](double bandwidth_m) {
    return bandwidth_m / wavelength_m / (2 * std::sqrt(2 * std::log(2.0)));
  };
  for (const double bandwidth_m : {2e-9, 10e-9}) {
    const double relative = change(bandwidth_m), focused = relative * waist_m / 2;
    const auto plain = seen(device, beam({.bandwidth_m = bandwidth_m}));
    for (const int axis : {0, 1})
      CHECK(1e12 * plain.variance_m2[axis] ==
            Approx(1e12 * (spot_m2 + focused * focused)).epsilon(0.01));
    // A carrier of 0.05 cycles per pixel, which the field leaves out
    const double per_m = 0.05 / pitch_m, smear = z_m * wavelength_m * per_m * relative;
    const auto carried = seen(device, beam({.bandwidth_m = bandwidth_m, .per_m = {per_m, 0}}));
    CHECK(1e12 * carried.variance_m2.x ==
          Approx(1e12 * (spot_m2 + focused * focused + smear * smear)).epsilon(0.01));
    CHECK(1e12 * carried.variance_m2.y ==
          Approx(1e12 * (spot_m2 + focused * focused)).epsilon(0.01));
    // A lens that the SLM adds and a field leaves out, as strong as the hologram's own, opposite:
    // no colour is defocused
    const double lens = 1 / (2 * wavelength_m * z_m);
    const auto achromatic =
        seen(device, beam({.bandwidth_m = bandwidth_m, .per_m2 = {-lens, -lens}}));
    for (const int axis : {0, 1})
      CHECK(1e12 * achromatic.variance_m2[axis] < 1e12 * 1.02 * spot_m2);
  }
}

DEVICE_TEST("colours of a spectrum meet without gaps: a smear is even where it is the Gaussian's") {
  const double bandwidth_m = 10e-9, per_m = 0.05 / pitch_m;
  const auto image =
      reconstruct(device, host, beam({.bandwidth_m = bandwidth_m, .per_m = {per_m, 0}}), hologram,
                  {.z_m = z_m, .aperture = {1, 1}});
  std::vector<double> line(448);
  double light = 0;
  for (int y = 0; y < 384; ++y)
    for (int x = 0; x < 448; ++x) {
      line[static_cast<std::size_t>(x)] += image.pixels[static_cast<std::size_t>(y * 448 + x)];
      light += image.pixels[static_cast<std::size_t>(y * 448 + x)];
    }
  const auto m = moments_of(image);
  double worst = 0;
  for (int x = 0; x < 448; ++x) {
    const double at_m = (x - 223.5) * pitch_m - m.middle_m.x,
                 gauss = pitch_m / std::sqrt(2 * pi * m.variance_m2.x) *
                         std::exp(-at_m * at_m / (2 * m.variance_m2.x));
    worst = std::max(worst, std::abs(line[static_cast<std::size_t>(x)] / light - gauss));
  }
  CHECK(worst < 0.03 * pitch_m / std::sqrt(2 * pi * m.variance_m2.x));
}

}  // namespace
}  // namespace raywave
