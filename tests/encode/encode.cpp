// SPDX-License-Identifier: Apache-2.0
#include "host/encode/encode.hpp"

#include "host/encode/shown.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/render.hpp"

namespace raywave {
namespace {

using namespace test;
using Field = std::vector<std::complex<float>>;
using Pictures = std::vector<std::vector<std::uint8_t>>;
using std::numbers::pi;

constexpr double pitch_m = 4e-6, wavelength_m = 638e-9;

std::shared_ptr<const Panel> panel_of(const SlmSpec& slm, glm::ivec2 size) {
  return std::make_shared<const Panel>(slm, size, glm::dvec2(pitch_m), wavelength_m);
}

std::vector<std::uint8_t> levels_of(const cl::Device& device, const SlmSpec& slm, glm::ivec2 size,
                                    const Field& field) {
  Encoder encoder(device, panel_of(slm, size));
  return encode(device, encoder, {size.x, size.y, 1, field}).front();
}

/// Levels of a row of samples.
std::vector<int> levels_of(const cl::Device& device, const Field& field,
                           const SlmSpec& slm = by_phase()) {
  const auto levels = levels_of(device, slm, {static_cast<int>(field.size()), 1}, field);
  return {levels.begin(), levels.end()};
}

/// Phases all round the circle, of amplitudes up to 1, away from the middle between two levels of
/// `levels` to the turn, after `offset` turns were added.
Field random_field(std::size_t size, double levels = 256, double offset = 0) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  Field field;
  while (field.size() < size) {
    const double turns = uniform(random), at = (turns + offset) * levels;
    if (std::abs(at - std::floor(at) - 0.5) < 1e-3) continue;  // a tie in float
    field.emplace_back(std::polar(uniform(random), 2 * pi * turns));
  }
  return field;
}

double turns_of(std::complex<float> sample) {
  const double turns = std::arg(std::complex<double>(sample)) / (2 * pi);
  return turns - std::floor(turns);
}

SlmSpec of_10_bits() {
  auto slm = by_phase();
  slm.bits = 10;
  slm.levels = slm.levels_per_turn = 1024;
  return slm;
}

/// Levels of a row of samples, of more than 8 bits.
std::vector<int> wide_levels_of(const cl::Device& device, const Field& field, const SlmSpec& slm) {
  const int nx = static_cast<int>(field.size());
  Encoder encoder(device, panel_of(slm, {nx, 1}));
  const auto levels = encode<std::uint16_t>(device, encoder, {nx, 1, 1, field}).front();
  return {levels.begin(), levels.end()};
}

DEVICE_TEST(
    "light and what a clip shows of it are sums of squares, of the brightest and faintest fields") {
  const glm::ivec2 size(37, 21);
  for (const auto encoding : {Encoding::phase, Encoding::double_phase}) {
    for (const double scale : {1.0, 1e-25, 1e25}) {
      CAPTURE(scale, encoding == Encoding::phase);
      SlmSpec slm;
      slm.encoding = encoding;
      slm.illumination.profile.diameter_m = {150e-6, 90e-6};
      const auto panel = panel_of(slm, size);
      auto field = random_field(area_of(size));
      for (auto& u : field) u *= static_cast<float>(scale);
      Encoder encoder(device, panel);
      const double clip = 0.5 * scale;
      const auto light =
          encoder.light_of(cl::ComplexBuffer(device, field, "field"), {{0, 0}, size}, clip);
      double all = 0, shown = 0;
      for (std::size_t i = 0; i < field.size(); ++i) {
        const double square = std::norm(std::complex<double>(field[i])),
                     most = clip * double{panel->beam()[i]};
        all += square;
        shown += std::min(square, most * most);
      }
      CHECK(light.all == Catch::Approx(all).epsilon(1e-5));
      if (encoding == Encoding::double_phase)
        CHECK(light.shown == Catch::Approx(shown).epsilon(1e-5));
    }
  }
}

DEVICE_TEST("a ramp of phase takes all 1024 levels of 10 bits, each where it is nearest") {
  // 16 samples to a level, at odd multiples of a 32nd of it: none lies amid two levels.
  Field ramp;
  std::vector<int> expected;
  for (int i = 0; i < 16 * 1024; ++i) {
    const double levels = (2 * i + 1) / 32.0;
    ramp.emplace_back(std::polar(1.0, 2 * pi * levels / 1024));
    expected.push_back(static_cast<int>(std::lround(levels)) % 1024);
  }
  std::vector<int> falling;  // inverted, phase falls as levels rise
  for (const int level : expected) falling.push_back((1024 - level) % 1024);
  auto inverted = of_10_bits();
  inverted.invert = true;
  for_all_lanes(device, [&](const cl::Device& with) {
    CHECK(wide_levels_of(with, ramp, of_10_bits()) == expected);
    CHECK(wide_levels_of(with, ramp, inverted) == falling);
  });
}

DEVICE_TEST("10 bits by a LUT, and amplitudes, are the nearest level within a step of the table") {
  auto by_lut = of_10_bits();
  for (int level = 0; level < 1024; ++level) {
    const double x = level / 1023.0;
    by_lut.lut.values.push_back(1.05 * (0.7 * x + 0.3 * x * x));
  }
  const auto field = random_field(20000);
  const auto levels = wide_levels_of(device, field, by_lut);
  double largest = 0;
  for (std::size_t i = 0; i < field.size(); ++i) {
    const double away = by_lut.lut.values[levels[i]] - turns_of(field[i]);
    largest = std::max(largest, std::abs(away - std::round(away)));
  }
  // Half of the LUT's widest step, and half a step of the table of phases
  const double half_step = 1.05 * 1.3 / 1023 / 2;
  CHECK(largest <= half_step + 0.5 / Panel::table_size + 1e-6);
  CHECK(largest > half_step / 2);

  auto off_axis = of_10_bits();
  off_axis.encoding = Encoding::off_axis;
  off_axis.clip = 1;
  const Field plain(64, {1, 0});  // (1 + cos 0) / 2
  CHECK(wide_levels_of(device, plain, off_axis) == std::vector<int>(64, 1023));
  off_axis.encoding = Encoding::lee;
  CHECK(wide_levels_of(device, plain, off_axis) == std::vector<int>(64, 1023));
}

/// Checks that each level of a panel comes back from the field that it shows.
template <class Level>
void check_levels_come_back(const cl::Device& device, const SlmSpec& slm) {
  std::vector<Level> levels(static_cast<std::size_t>(slm.levels));
  std::iota(levels.begin(), levels.end(), Level{0});
  const auto panel = panel_of(slm, {slm.levels, 1});
  const auto shown = shown_field(*panel, std::vector<std::vector<Level>>{levels});
  Encoder encoder(device, panel);
  CHECK(encode<Level>(device, encoder, shown).front() == levels);
}

DEVICE_TEST("all levels of 8 and of 10 bits come back from the field they show") {
  check_levels_come_back<std::uint8_t>(device, by_phase());
  check_levels_come_back<std::uint16_t>(device, of_10_bits());
}

DEVICE_TEST("levels of 10 bits are refused where bytes are asked for, and bytes where words are") {
  const Field field(4, 1);
  CHECK_REFUSED(levels_of(device, field, of_10_bits()),
                "slm.bits is 10: this takes levels of 8 bits");
  CHECK_THROWS_AS(wide_levels_of(device, field, by_phase()), InputError);
  CHECK_THROWS_AS(shown_field(*panel_of(of_10_bits(), {4, 1}), Pictures{{0, 1, 2, 3}}), InputError);
}

DEVICE_TEST(
    "phases round to the nearest level, amplitude does not matter, and just below a full turn is "
    "level 0") {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> exponent(-30, 30);
  Field field = random_field(10007);
  std::vector<int> expected;
  for (auto& sample : field) {
    expected.push_back(static_cast<int>(std::lround(turns_of(sample) * 256)) % 256);
    sample *= static_cast<float>(std::pow(10, exponent(random)));
  }
  field.emplace_back(1.0f, -1e-6f);
  expected.push_back(0);
  CHECK(levels_of(device, field) == expected);
}

DEVICE_TEST("zero and values that are not finite get level 0") {
  const float inf = std::numeric_limits<float>::infinity(),
              nan = std::numeric_limits<float>::quiet_NaN();
  const Field field{{0, 0}, {-0.0f, -0.0f}, {nan, 1}, {1, nan}, {inf, inf}, {-1, inf}, {nan, nan}};
  CHECK(levels_of(device, field) == std::vector<int>(field.size()));
}

DEVICE_TEST("every length is encoded to its last sample, in packets of any width") {
  for_all_lanes(device, [&](const cl::Device& with) {
    for (const std::size_t size : {1, 2, 7, 15, 16, 17, 63, 64, 65, 1025})
      CHECK(levels_of(with, Field(size, {0, 2})) == std::vector<int>(size, 64));
  });
}

/// A convention for bytes: phase in turns, 0 to 1, to a level.
struct Convention {
  const char* name;
  SlmSpec slm;
  std::function<int(double turns)> level;
  double steps, offset;  // where it rounds, for random_field
};

std::vector<Convention> conventions() {
  auto neural = by_phase();
  neural.levels_per_turn = 255;
  neural.invert = true;
  neural.offset_turns = 0.5;
  auto slmsuite = by_phase();
  slmsuite.invert = true;
  slmsuite.offset_turns = 0.5 / 256;
  auto holoeye_python = by_phase();
  holoeye_python.offset_turns = -0.5 / 256;
  return {
      // utils.phasemap_8bit(inverted=True): round((1 - ((phi + pi) mod 2 pi) / 2 pi) 255)
      {"neural-holography", neural,
       [](double t) { return static_cast<int>(std::lround((1 - std::fmod(t + 0.5, 1)) * 255)); },
       255, 0.5},
      // hardware/slms/slm.py, SLM._phase2gray: the whole part of -256 phi / 2 pi, taken of negative
      // numbers, minus 1, in 8 bits
      {"slmsuite", slmsuite, [](double t) { return 255 - static_cast<int>(std::floor(256 * t)); },
       256, 0.5 / 256},
      // HOLOEYE, SLM Display SDK: phases are wrapped at "the phase value of a full circle, by
      // default 2pi" (3.x, heds_show_phasevalues_single, phaseWrap; 4.x, SLM.showPhaseData,
      // phase_unit), and its examples have 256 levels to a circle, grey rising with phase. How the
      // SDK itself rounds is not documented. The Python example, "phase data calculated using 8-bit
      // integer values", takes the whole part: int(x * 256 / blazePeriod)
      {"HOLOEYE, Python", holoeye_python,
       [](double t) { return static_cast<int>(std::floor(256 * t)); }, 256, -0.5 / 256}};
}

DEVICE_TEST("HOLOEYE's example of a blaze has raywave's levels") {
  // SLM Display SDK 3, data_uint8.m: 256 mod(x, 77) / 77, which MATLAB rounds to the nearest uint8
  Field field;
  std::vector<int> expected;
  for (int x = 0; x < 1920; ++x) {
    field.emplace_back(std::polar(1.0, 2 * pi * x / 77));
    expected.push_back(static_cast<int>(std::lround(256.0 * (x % 77) / 77)));
  }
  CHECK(levels_of(device, field) == expected);
}

DEVICE_TEST("levels are those of other programs' conventions, byte by byte") {
  for (const auto& [name, slm, level, steps, offset] : conventions()) {
    INFO(name);
    const auto field = random_field(20000, steps, offset);
    std::vector<int> expected;
    for (const auto sample : field) expected.push_back(level(turns_of(sample)));
    CHECK(levels_of(device, field, slm) == expected);
  }
}

DEVICE_TEST("phases are shown to half a level, whatever the SLM's levels") {
  std::vector<double> curved, falling;
  for (int level = 0; level < 256; ++level) {
    const double x = level / 255.0;
    curved.push_back(1.1 * (0.7 * x + 0.3 * x * x));
    falling.push_back(3 - 2.5 * x);
  }
  struct Case {
    const char* name;
    SlmSpec slm;
    double largest_error_turns;
  };
  std::vector<Case> cases;
  const auto add = [&](const char* name, double error, auto change) {
    cases.push_back({name, by_phase(), error});
    change(cases.back().slm);
  };
  const double step = 0.5 / Panel::table_size;
  add("254 levels to a turn", 0.5 / 254, [](auto& s) { s.levels_per_turn = 254; });
  add("inverted, 255 to a turn", 0.5 / 255, [](auto& s) {
    s.invert = true;
    s.levels_per_turn = 255;
  });
  add("less than a turn", 0.5 / 300 + (1 - 255 / 300.0) / 2 + step,
      [](auto& s) { s.levels_per_turn = 300; });
  add("2 levels", 0.25 + step, [](auto& s) { s.levels = 2; });
  add("4 levels", 0.125 + step, [](auto& s) { s.levels = 4; });
  add("16 levels", 1.0 / 32 + 0.5 / 256 + step, [](auto& s) { s.levels = 16; });
  add("a curved LUT", 1.1 * 1.3 / 255 / 2 + step, [&](auto& s) { s.lut.values = curved; });
  add("a falling LUT over 2.5 turns", 2.5 / 255 / 2 + step,
      [&](auto& s) { s.lut.values = falling; });
  std::vector<int> fourth;
  for (int level = 0; level < 256; level += 4) fourth.push_back(level);
  add("every fourth level", 0.5 / 64 + step, [&](auto& s) {
    s.lut.levels = fourth;
    for (const int level : fourth) s.lut.values.push_back(level / 256.0);
  });
  for (const auto& [name, slm, bound] : cases) {
    INFO(name);
    const auto field = random_field(20000);
    const glm::ivec2 size(200, 100);
    const auto panel = panel_of(slm, size);
    const auto levels = levels_of(device, slm, size, field);
    const auto shown = shown_field(*panel, Pictures{levels});
    double largest = 0;
    for (std::size_t i = 0; i < field.size(); ++i) {
      const double away = turns_of(shown.samples[i]) - turns_of(field[i]);
      largest = std::max(largest, std::abs(away - std::round(away)));
    }
    CHECK(largest <= bound + 1e-6);
    CHECK(largest > bound / 3);
    const auto& listed = slm.lut.levels;
    for (const int level : levels)
      if (!listed.empty() && std::find(listed.begin(), listed.end(), level) == listed.end())
        FAIL("level " << level << " is not listed");
  }
}

DEVICE_TEST("the two phases of a double-phase pixel have the field as their mean") {
  auto slm = by_phase();
  slm.encoding = Encoding::double_phase;
  slm.clip = 1;
  // Pairs of equal samples along a row show two phases each.
  std::mt19937 random(2);
  std::uniform_real_distribution<float> uniform(0, 1);
  Field field;
  const glm::ivec2 size(64, 33);
  for (int i = 0; i < size.x * size.y / 2; ++i)
    field.insert(field.end(), 2, std::polar(uniform(random), 6.28f * uniform(random)));
  field[10] = field[11] = 1;  // the brightest
  Encoder encoder(device, panel_of(slm, size));
  const auto levels = encode(device, encoder, {size.x, size.y, 1, field}).front();
  const auto shown = shown_field(encoder.panel(), Pictures{levels});
  // The quantile is of some pixels only; it may leave out the brightest.
  const double clip = encoder.clip_of(field);
  double largest = 0;
  for (std::size_t i = 0; i < field.size(); i += 2) {
    const auto mean =
        (std::complex<double>(shown.samples[i]) + std::complex<double>(shown.samples[i + 1])) / 2.0;
    largest = std::max(largest, std::abs(mean - std::complex<double>(field[i]) / clip));
  }
  CHECK(clip == Catch::Approx(1).margin(1e-6));
  CHECK(largest < 2 * pi * 0.5 / 256 * 1.01);  // half a level of each phase
  CHECK(largest > 2 * pi * 0.5 / 256 / 4);
}

DEVICE_TEST("double phase puts the phases below and above the field's on a checkerboard") {
  auto slm = by_phase();
  slm.encoding = Encoding::double_phase;
  slm.clip = 1;
  const glm::ivec2 size(37, 5);
  const Field field(37 * 5, std::polar(0.5f, 1.0f));
  const double brightest = 0.5;
  Encoder encoder(device, panel_of(slm, size));
  const cl::ComplexBuffer on_device(device, field, "field");
  // A window that begins at an odd pixel continues the board of the whole.
  for (const glm::ivec2 first : {glm::ivec2(0, 0), glm::ivec2(3, 0), glm::ivec2(2, 5)}) {
    const auto levels = encoder.levels_of(on_device, {first, size}, 2 * brightest).read();
    for (int y = 0; y < size.y; ++y) {
      for (int x = 0; x < size.x; ++x) {
        const bool odd = (x + y + first.x + first.y) % 2 != 0;
        const double turns = (1 + (odd ? 1 : -1) * std::acos(0.5)) / (2 * pi);
        CHECK(levels[y * size.x + x] == (static_cast<int>(std::lround(turns * 256)) + 256) % 256);
      }
    }
  }
}

DEVICE_TEST("what is brighter than the clip is shown as bright as the clip") {
  auto slm = by_phase();
  slm.encoding = Encoding::double_phase;
  Encoder encoder(device, panel_of(slm, {64, 1}));
  const cl::ComplexBuffer field(device, Field(64, {0, 7}), "field");
  const auto levels = encoder.levels_of(field, {{0, 0}, {64, 1}}, 2).read();
  CHECK(levels == std::vector<std::uint8_t>(64, 64));
}

DEVICE_TEST("the clip is the amplitude that the given share of pixels stays below") {
  Field field;
  for (int i = 0; i < 300 * 200; ++i)
    field.push_back(std::polar(static_cast<float>(i % 1000) / 1000, 1.0f));
  for (const double share : {0.5, 0.9, 0.99}) {
    auto slm = by_phase();
    slm.encoding = Encoding::double_phase;
    slm.clip = share;
    Encoder encoder(device, panel_of(slm, {300, 200}));
    CHECK(encoder.clip_of(cl::ComplexBuffer(device, field, "field")) ==
          Catch::Approx(share).margin(0.005));
    CHECK(encoder.clip_of(field) == Catch::Approx(share).margin(0.005));
  }
}

DEVICE_TEST("of holograms that are dark in large parts, lit pixels alone count for the clip") {
  Field field(300 * 200, {1e-3f, 0});
  for (std::size_t i = 0; i < 300 * 50; ++i)
    field[i] = {0.1f + static_cast<float>(i % 1000) / 1000, 0};
  auto slm = by_phase();
  slm.encoding = Encoding::double_phase;
  slm.clip = 0.5;
  Encoder encoder(device, panel_of(slm, {300, 200}));
  CHECK(encoder.clip_of(field) == Catch::Approx(0.6).margin(0.005));
}

DEVICE_TEST("pixels that no light falls onto are told what dark ones are") {
  const Field field(64, {0, 0});
  auto slm = by_phase();
  slm.encoding = Encoding::double_phase;
  const auto levels = [&] {
    Encoder encoder(device, panel_of(slm, {64, 1}));
    return encoder.levels_of(cl::ComplexBuffer(device, field, "field"), {{0, 0}, {64, 1}}, 1)
        .read();
  };
  const auto dark = levels();
  slm.illumination.profile.picture =
      std::make_shared<const Image>(Image{4, 1, {0.0f, 0.0f, 1.0f, 1.0f}});
  CHECK(levels() == dark);
}

/// A smooth field: a few plane waves of low frequency.
Field smooth_field(glm::ivec2 size) {
  Field field;
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      const double u = 2 * pi * x / size.x, v = 2 * pi * y / size.y;
      field.push_back(std::complex<float>(std::polar(0.6, 2 * u + v) + std::polar(0.3, -u + 3 * v) +
                                          std::polar(0.1, 4 * u - 2 * v)));
    }
  }
  return field;
}

DEVICE_TEST("behind a stop on the carrier, every encoding shows the field") {
  struct Case {
    Encoding encoding;
    glm::dvec2 carrier, stop;
    double least;
  };
  // The field reaches to 4 / 192 of the band. Lee's stripes have a whole number of pixels as width.
  const Case cases[] = {{Encoding::double_phase, {0, 0}, {0.2, 0.2}, 0.999},
                        {Encoding::double_phase, {0.1, -0.05}, {0.2, 0.2}, 0.999},
                        {Encoding::off_axis, {0.25, 0.1}, {0.1, 0.1}, 0.998},
                        {Encoding::burckhardt, {0, 0}, {0.1, 0.1}, 0.995},
                        {Encoding::lee, {0.15, 0.08}, {0.08, 0.08}, 0.98}};
  const glm::ivec2 size(192, 150);
  const auto field = smooth_field(size);
  for (const auto& one : cases) {
    SlmSpec slm{.encoding = one.encoding,
                .clip = 1,
                .carrier = one.carrier,
                .stop = StopSpec{one.stop, {0, 0}}};
    INFO(name_of(one.encoding));
    const auto panel = panel_of(slm, size);
    const auto levels = levels_of(device, slm, size, field);
    const auto shown = shown_field(*panel, Pictures{levels});
    CHECK(correlation(field, shown.samples) > one.least);
    // The other sign of the carrier is no picture of the field.
    if (shows_amplitude(one.encoding)) {
      auto wrong = slm;
      wrong.stop->centre = glm::dvec2(0.1, 0.3);
      const auto other = shown_field(*panel_of(wrong, size), Pictures{levels});
      CHECK(correlation(field, other.samples) < 0.5);
    }
  }
}

DEVICE_TEST("a carrier, a lens and Zernike terms are the phases of their formulas") {
  auto slm = by_phase();
  slm.carrier = {0.1, -0.2};
  slm.lens_m = 0.05;
  slm.zernike = {{2, 0.3}, {4, -0.2}, {7, 0.1}};
  slm.offset_turns = 0.125;
  const glm::ivec2 size(31, 20);
  const Field field(31 * 20, 1);
  const auto levels = levels_of(device, slm, size, field);
  double largest = 0;
  for (int row = 0; row < size.y; ++row) {
    for (int column = 0; column < size.x; ++column) {
      const double right = column - 15.0, up = 9.5 - row, x = right * pitch_m, y = up * pitch_m;
      const double radius = 15.5 * pitch_m, p = x / radius, q = y / radius, rr = p * p + q * q;
      // Noll, Table I
      const double turns =
          0.125 + 0.1 * right - 0.2 * up - (x * x + y * y) / (2 * wavelength_m * 0.05) +
          0.3 * 2 * p - 0.2 * std::sqrt(3) * (2 * rr - 1) + 0.1 * std::sqrt(8) * (3 * rr - 2) * q;
      const double away = turns - levels[row * size.x + column] / 256.0;
      largest = std::max(largest, std::abs(away - std::round(away)));
    }
  }
  CHECK(largest <= 0.5 / 256 + 0.5 / 65536 + 1e-5);
}

TEST_CASE("Zernike polynomials have mean square 1 over the disc and are orthogonal") {
  constexpr int most = 28, steps = 200;
  std::vector<double> products(most * most);
  double count = 0;
  for (int j = 0; j < steps; ++j) {
    for (int i = 0; i < steps; ++i) {
      const double x = (2 * i + 1.0) / steps - 1, y = (2 * j + 1.0) / steps - 1;
      if (x * x + y * y > 1) continue;
      ++count;
      std::array<double, most> values;
      for (int k = 0; k < most; ++k) values[k] = zernike(k + 1, x, y);
      for (std::size_t a = 0; a < most; ++a)
        for (std::size_t b = 0; b < most; ++b) products[a * most + b] += values[a] * values[b];
    }
  }
  for (std::size_t a = 0; a < most; ++a)
    for (std::size_t b = 0; b < most; ++b)
      CHECK(products[a * most + b] / count == Catch::Approx(a == b ? 1 : 0).margin(0.05));
}

DEVICE_TEST("a shift moves the picture by its length, in its direction") {
  // A point in the plane 20 mm; with the shift, its picture stands 0.3 mm right and 0.2 mm below.
  const glm::ivec2 size(256, 256);
  const double z_m = 20e-3;
  HologramSpec hologram{
      .resolution = size, .pitch_m = glm::dvec2(pitch_m), .wavelength_m = wavelength_m};
  Field field;
  for (int row = 0; row < size.y; ++row) {
    for (int column = 0; column < size.x; ++column) {
      const double x = (column - 127.5) * pitch_m, y = (127.5 - row) * pitch_m;
      field.push_back(
          std::polar<float>(1, static_cast<float>(std::remainder(
                                   2 * pi / wavelength_m * std::hypot(x, y, z_m), 2 * pi))));
    }
  }
  auto slm = by_phase();
  slm.shift_m = {0.3e-3, -0.2e-3};
  slm.shift_distance_m = z_m;
  const auto levels = levels_of(device, slm, size, field);
  const auto uncorrected = shown_field(*panel_of(by_phase(), size), Pictures{levels});
  const auto picture =
      reconstruct(device, cl::FftBackend::host, uncorrected, hologram, {.z_m = z_m});
  const auto spot = peak_of(picture, glm::dvec2(pitch_m));
  CHECK(spot.x_m == Catch::Approx(0.3e-3).margin(1.1 * pitch_m));
  CHECK(spot.y_m == Catch::Approx(-0.2e-3).margin(1.1 * pitch_m));
}

DEVICE_TEST(
    "flatness in levels is added to grey, also where phase falls; flatness in nm is taken off") {
  const glm::ivec2 size(20, 10);
  const Field field(200, std::polar(1.0f, 1.0f));
  auto slm = by_phase();
  slm.flatness.picture = {20, 10, std::vector<float>(200, 30.0f / 255)};
  auto in_nm = slm;
  in_nm.flatness.in_nm = true;
  in_nm.flatness.picture.pixels.assign(200, 638.0f / 4);  // a quarter of the wavelength
  const int plain = static_cast<int>(std::lround(256 / (2 * pi)));
  CHECK(levels_of(device, slm, size, field).front() == plain + 30);
  CHECK(levels_of(device, in_nm, size, field).front() == (plain - 64 + 256) % 256);
  auto falling = slm;
  falling.invert = true;
  CHECK(levels_of(device, falling, size, field).front() == 256 - plain + 30);
  auto table = slm;
  for (int level = 0; level < 256; ++level) table.lut.values.push_back(-level / 256.0);
  CHECK(levels_of(device, table, size, field).front() == 256 - plain + 30);
}

TEST_CASE("a flatness picture of another size is refused, or cropped and padded when asked") {
  auto slm = by_phase();
  slm.flatness.where = "slm.toml:3: slm: flatness";
  slm.flatness.picture = {4, 2, {1, 2, 3, 4, 5, 6, 7, 8}};
  for (auto& value : slm.flatness.picture.pixels) value /= 255;
  CHECK_REFUSED(panel_of(slm, {2, 4}),
                "slm.toml:3: slm: flatness: the picture is 4 x 2, the SLM 2 x 4",
                "give flatness_fit = \"centre\" to crop or pad it");
  slm.flatness.centre = true;
  const auto added = panel_of(slm, {2, 4})->added();
  const std::vector<std::uint16_t> expected{0, 0, 2 * 256, 3 * 256, 6 * 256, 7 * 256, 0, 0};
  CHECK(added == expected);
}

TEST_CASE("a band keeps the frequencies within and no others") {
  const glm::ivec2 size(48, 35);
  Field plane;
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      const auto wave = [&](int i, int j) {
        return std::polar(1.0, 2 * pi * (double(i * x) / size.x - double(j * y) / size.y));
      };
      plane.push_back(std::complex<float>(wave(3, 2) + wave(-15, 1) + wave(2, 9)));
    }
  }
  keep_band(plane, size, {0.5, 0.5}, {0, 0});
  double largest = 0;
  for (int y = 0; y < size.y; ++y) {
    for (int x = 0; x < size.x; ++x) {
      const auto expected = std::polar(1.0, 2 * pi * (3.0 * x / size.x - 2.0 * y / size.y));
      largest = std::max(largest, std::abs(std::complex<double>(plane[y * size.x + x]) - expected));
    }
  }
  CHECK(largest < 1e-5);
}

}  // namespace
}  // namespace raywave
