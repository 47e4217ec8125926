// SPDX-License-Identifier: Apache-2.0
// What an SLM that is not ideal shows: an uneven beam, pixels with edges, crosstalk, amplitudes
// that come with phases, light that it leaves undiffracted.
#include "host/encode/encode.hpp"
#include "host/encode/shown.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/render.hpp"

namespace raywave {
namespace {

using namespace test;
using Complex = std::complex<double>;
using Catch::Approx;
using std::numbers::pi;

constexpr double pitch_m = 4e-6, wavelength_m = 638e-9;
constexpr glm::ivec2 size(96, 80);

Panel panel_of(const SlmSpec& slm) { return {slm, size, glm::dvec2(pitch_m), wavelength_m}; }

/// Levels of a plane wave of so many cycles per pixel, x right and y up.
std::vector<std::uint8_t> blaze(glm::dvec2 cycles) {
  std::vector<std::uint8_t> levels;
  for (int y = 0; y < size.y; ++y)
    for (int x = 0; x < size.x; ++x) {
      const double turns = cycles.x * x - cycles.y * y;
      levels.push_back(static_cast<std::uint8_t>(std::lround(256 * (turns - std::floor(turns)))));
    }
  return levels;
}

std::vector<std::complex<float>> shown_by(const SlmSpec& slm,
                                          const std::vector<std::uint8_t>& levels) {
  const std::vector<std::vector<std::uint8_t>> frames{levels};
  return shown_field(panel_of(slm), frames).samples;
}

/// Amplitude of a plane wave in a field.
Complex share_of(const std::vector<std::complex<float>>& field, glm::dvec2 cycles) {
  Complex sum = 0;
  for (int y = 0; y < size.y; ++y)
    for (int x = 0; x < size.x; ++x)
      sum += Complex(field[static_cast<std::size_t>(y * size.x + x)]) *
             std::polar(1.0, -2 * pi * (cycles.x * x - cycles.y * y));
  return sum / static_cast<double>(field.size());
}

/// What a pixel of this width, of its pitch, sends into a direction: its middle is at 0.
double sent(double width, double cycles) {
  Complex sum = 0;
  constexpr int points = 2000;
  for (int i = 0; i < points; ++i)
    sum += std::polar(width / points, -2 * pi * cycles * width * ((i + 0.5) / points - 0.5));
  return sum.real();
}

TEST_CASE("a pixel's fill dims what it sends into a direction as its aperture's transform does") {
  for (const glm::dvec2 fill : {glm::dvec2(1, 1), {0.9, 0.6}}) {
    auto slm = by_phase();
    slm.fill = fill;
    for (const glm::dvec2 cycles : {glm::dvec2(0, 0), {0.25, 0}, {12.0 / 96, -0.4}, {-0.375, 0.3}})
      CHECK(std::abs(share_of(shown_by(slm, blaze(cycles)), cycles)) ==
            Approx(sent(fill.x, cycles.x) * sent(fill.y, cycles.y)).epsilon(3e-3));
    // Behind a carrier the picture's order is looked at: 0.25 + 0.375 of it, and no alias
    slm.carrier = {0.25, 0};
    const glm::dvec2 beyond(0.375, 0);
    CHECK(std::abs(share_of(shown_by(slm, blaze(beyond + slm.carrier)), beyond)) ==
          Approx(sent(fill.x, 0.625) * fill.y).epsilon(3e-3));
  }
}

TEST_CASE("undiffracted light is a plane wave at minus the carrier, of its share of the light") {
  for (const double share : {0.0, 0.02, 0.3}) {
    auto slm = by_phase();
    slm.undiffracted = share;
    slm.carrier = {0.25, -0.125};
    const glm::dvec2 cycles(0.125, 0.05);
    const auto field = shown_by(slm, blaze(cycles + slm.carrier));
    CHECK(std::norm(share_of(field, -slm.carrier)) == Approx(share).margin(1e-5));
    CHECK(std::norm(share_of(field, cycles)) == Approx(1 - share).epsilon(1e-3));
  }
}

TEST_CASE("crosstalk turns a step of phase into the Gaussian's integral, and keeps even phases") {
  auto slm = by_phase();
  for (const double sigma_m : {1e-6, 3e-6, 7e-6}) {
    slm.crosstalk.sigma_m = sigma_m;
    for (const int axis : {0, 1}) {
      std::vector<std::uint8_t> levels;
      for (int y = 0; y < size.y; ++y)
        for (int x = 0; x < size.x; ++x) levels.push_back((axis == 0 ? x : y) < 40 ? 10 : 110);
      const auto field = shown_by(slm, levels);
      for (int i = 30; i < 50; ++i) {
        const auto at = static_cast<std::size_t>(axis == 0 ? 17 * size.x + i : i * size.x + 17);
        // From the step to the middle of the pixel
        const double away_m = (i - 40 + 0.5) * pitch_m,
                     turns = (10 + 50 * (1 + std::erf(away_m / (sigma_m * std::sqrt(2))))) / 256;
        CHECK(std::abs(Complex(field[at]) - std::polar(1.0, 2 * pi * turns)) < 1e-3);
      }
    }
    for (const auto& sample : shown_by(slm, std::vector<std::uint8_t>(size.x * size.y, 77)))
      REQUIRE(std::abs(Complex(sample) - std::polar(1.0, 2 * pi * 77 / 256)) < 1e-5);
  }
}

TEST_CASE("a measured kernel of crosstalk blurs phases, of a blaze's flyback too") {
  auto slm = by_phase();
  slm.crosstalk = {0, {3, 1}, {0.2, 0.7, 0.1}};
  const auto levels = blaze({0.125, 0});
  Complex efficiency = 0;
  for (int x = 0; x < size.x; ++x) {
    // The pixels of the edge are their own neighbours
    const auto level = [](int i) { return std::clamp(i, 0, size.x - 1) % 8 * 32.0; };
    const double shown = 0.2 * level(x - 1) + 0.7 * level(x) + 0.1 * level(x + 1);
    efficiency += std::polar(1.0 / size.x, 2 * pi * (shown - level(x)) / 256);
  }
  const auto field = shown_by(slm, levels);
  CHECK(std::norm(share_of(field, {0.125, 0})) == Approx(std::norm(efficiency)).epsilon(1e-4));
  CHECK(std::norm(efficiency) < 0.85);
}

DEVICE_TEST(
    "of levels with amplitudes the nearest state is shown, which is not the nearest phase") {
  auto slm = by_phase();
  // A spiral that darkens, and bright states between its turns
  for (int level = 0; level < 256; ++level) {
    slm.lut.levels.push_back(level);
    slm.lut.values.push_back(level / 128.0);
    slm.lut.amplitudes.push_back(level % 2 ? 0.9 : 1 - level / 320.0);
  }
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(0, 1);
  FieldStack field{size.x, size.y, 1, {}};
  for (int i = 0; i < size.x * size.y; ++i)
    field.samples.emplace_back(std::polar(1.0, 2 * pi * uniform(random)));
  const auto panel = std::make_shared<const Panel>(panel_of(slm));
  Encoder encoder(device, panel);
  const auto levels = encode(device, encoder, field);
  const auto shown = shown_field(*panel, levels).samples;
  std::vector<Complex> states;
  double mean = 0;
  for (std::size_t level = 0; level < 256; ++level) {
    mean += slm.lut.amplitudes[level] / 256;
    states.push_back(std::polar(slm.lut.amplitudes[level], 2 * pi * slm.lut.values[level]));
  }
  int by_phase_alone = 0;
  Complex both = 0, of_phase = 0;
  double light = 0, light_of_phase = 0;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    const Complex wanted(field.samples[i]), is(shown[i]);
    double nearest = 9, nearest_turn = 9;
    Complex of_nearest_phase;
    for (const auto& state : states) {
      nearest = std::min(nearest, std::abs(state - mean * wanted));
      const double turn = std::abs(std::arg(state * std::conj(wanted)));
      if (turn < nearest_turn) nearest_turn = turn, of_nearest_phase = state;
    }
    REQUIRE(std::abs(is - states[levels[0][i]]) < 1e-6);
    // Within half a step of the table of 4096 phases
    CHECK(std::abs(is - mean * wanted) < nearest + 2 * pi / 8192);
    by_phase_alone += std::abs(is - of_nearest_phase) > 1e-6;
    both += is * std::conj(wanted);
    of_phase += of_nearest_phase * std::conj(wanted);
    light += std::norm(is);
    light_of_phase += std::norm(of_nearest_phase);
  }
  CHECK(by_phase_alone > size.x * size.y / 10);
  const double n = size.x * size.y;
  const double correlation = std::norm(both) / (light * n),
               correlation_of_phase = std::norm(of_phase) / (light_of_phase * n);
  INFO(correlation << " against " << correlation_of_phase);
  CHECK(1 - correlation < 0.8 * (1 - correlation_of_phase));
  CHECK(wanted_share_of_levels(slm) == Approx(correlation).epsilon(0.01));
}

TEST_CASE("a Gaussian beam has its diameter, mean square 1, and a picture is stretched over it") {
  BeamProfile profile{.diameter_m = {200e-6, 150e-6}};
  const auto beam = amplitudes_of(profile, size, glm::dvec2(pitch_m));
  double sum = 0;
  for (const float a : beam) sum += double{a} * a / static_cast<double>(beam.size());
  CHECK(sum == Approx(1).epsilon(1e-6));
  // Intensity 25 columns (100 um) off the middle over that 0.5 columns off it
  const auto at = [&](int x, int y) { return std::pow(double{beam[y * size.x + x]}, 2); };
  CHECK(at(48 + 25, 40) / at(48, 40) ==
        Approx(std::exp(-2 * (25.5 * 25.5 - 0.25) / (25.0 * 25.0))).epsilon(1e-4));
  CHECK(at(48, 40 + 18) / at(48, 40) ==
        Approx(std::exp(-2 * (18.5 * 18.5 - 0.25) / (18.75 * 18.75))).epsilon(1e-4));

  BeamProfile picture;
  picture.picture = std::make_shared<Image>(Image{2, 1, {1, 3}});
  const auto two = amplitudes_of(picture, size, glm::dvec2(pitch_m));
  // Even beyond the middles of its pixels, which are a quarter off the edges
  CHECK(std::pow(two[90] / two[3], 2) == Approx(3).epsilon(1e-5));
  CHECK(std::pow((two[47] + two[48]) / (2 * two[3]), 2) == Approx(2).epsilon(1e-3));
  picture.picture = std::make_shared<Image>(Image{1, 1, {0}});
  CHECK_THROWS_AS(amplitudes_of(picture, size, glm::dvec2(pitch_m)), InputError);
}

DEVICE_TEST("double phase and the encodings of amplitudes give back what the beam lacks") {
  // A smooth field, and light that falls to a fifth at the corners
  FieldStack field{size.x, size.y, 1, {}};
  for (int y = 0; y < size.y; ++y)
    for (int x = 0; x < size.x; ++x)
      field.samples.emplace_back(std::polar(0.6 + 0.3 * std::sin(x / 9.0) * std::cos(y / 11.0),
                                            2 * pi * (x * x + y * y) / 4000.0));
  for (const auto encoding : {Encoding::double_phase, Encoding::off_axis}) {
    SlmSpec slm{.encoding = encoding};
    slm.carrier = encoding == Encoding::off_axis ? glm::dvec2(0.25, 0) : glm::dvec2(0);
    slm.stop = StopSpec{{0.3, 0.3}, {0, 0}};
    slm.illumination.profile.diameter_m = {500e-6, 400e-6};
    const auto correlation = [&](const SlmSpec& encoded_for) {
      Encoder encoder(device, std::make_shared<const Panel>(panel_of(encoded_for)));
      const auto shown = shown_field(panel_of(slm), encode(device, encoder, field)).samples;
      Complex both = 0;
      double of_shown = 0, of_field = 0;
      for (std::size_t i = 0; i < shown.size(); ++i) {
        both += Complex(shown[i]) * std::conj(Complex(field.samples[i]));
        of_shown += std::norm(shown[i]);
        of_field += std::norm(field.samples[i]);
      }
      return std::norm(both) / (of_shown * of_field);
    };
    auto even = slm;
    even.illumination = {};
    const double known = correlation(slm), unknown = correlation(even);
    INFO(name_of(encoding) << ": " << known << " against " << unknown);
    CHECK(1 - known < 0.5 * (1 - unknown));
  }
}

}  // namespace
}  // namespace raywave
