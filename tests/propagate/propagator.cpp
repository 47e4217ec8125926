// SPDX-License-Identifier: Apache-2.0
#include "host/propagate/propagator.hpp"

#include <cstdio>

#include "host/reference/propagation.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using namespace test;
using reference::beam;
using reference::Field;
using reference::noise;
using reference::Setup;
using reference::to_float;
using std::numbers::pi;

using FloatField = std::vector<std::complex<float>>;

constexpr double red_m = 638e-9;

PropagatorSpec spec_of(const Setup& s, double padding = 2,
                       cl::FftBackend backend = cl::FftBackend::host) {
  return {s.size, s.pitch_m, s.wavelength_m, padding, backend};
}

FloatField propagate(const cl::Device& device, Propagator& propagator, const FloatField& source,
                     glm::dvec2 shift_m, double distance_m) {
  cl::ComplexBuffer field(device, source, "field");
  propagator.load(field);
  propagator.add({shift_m, distance_m});
  propagator.collect(field);
  return field.read();
}

FloatField propagate(const cl::Device& device, const FloatField& source, const Setup& s,
                     double padding = 2, cl::FftBackend backend = cl::FftBackend::host) {
  Propagator propagator(device, spec_of(s, padding, backend));
  return propagate(device, propagator, source, s.shift_m, s.distance_m);
}

double relative_error(const FloatField& a, const FloatField& b) {
  return reference::relative_error(reference::to_double(a), reference::to_double(b));
}

/// Error of the device against the same discrete propagation in double.
double discrete_error(const cl::Device& device, const Setup& s, double padding = 2,
                      cl::FftBackend backend = cl::FftBackend::host) {
  const auto source = noise(s.size, 7);
  Propagator propagator(device, spec_of(s, padding, backend));
  const auto got = propagate(device, propagator, source, s.shift_m, s.distance_m);
  return reference::relative_error(
      reference::to_double(got), reference::shifted_angular_spectrum(reference::to_double(source),
                                                                     s, propagator.padded_size()));
}

/// Error of the device against the direct sum, on every n-th row (the sum is slow).
double direct_error(const cl::Device& device, const Setup& s, const Field& source, int every) {
  const auto whole = reference::to_double(propagate(device, to_float(source), s));
  std::vector<int> rows;
  Field got;
  for (int y = every / 2; y < s.size.y; y += every) {
    rows.push_back(y);
    got.insert(got.end(), whole.begin() + y * s.size.x, whole.begin() + (y + 1) * s.size.x);
  }
  return reference::relative_error(got, reference::rayleigh_sommerfeld(source, s, rows));
}

std::complex<double> inner_product(const FloatField& a, const FloatField& b) {
  std::complex<double> sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    sum += std::complex<double>(a[i]) * std::conj(std::complex<double>(b[i]));
  return sum;
}

/// Centre of mass of the light, in samples from the plane's centre, x right and y up.
glm::dvec2 centre_of_mass(const FloatField& field, glm::ivec2 size) {
  glm::dvec2 sum(0);
  double weight = 0;
  for (int j = 0; j < size.y; ++j) {
    for (int i = 0; i < size.x; ++i) {
      const double w = std::norm(field[static_cast<std::size_t>(j) * size.x + i]);
      sum += w * glm::dvec2(i - (size.x - 1) / 2.0, (size.y - 1) / 2.0 - j);
      weight += w;
    }
  }
  return sum / weight;
}

TEST_CASE("the oracle's transform is the sum that defines it") {
  for (const int n : {1, 2, 5, 12, 23, 30}) {
    const auto in = reference::to_double(noise({n, 1}, 3));
    for (const int sign : {-1, 1}) {
      auto got = in;
      reference::transform(got, sign);
      Field sum(n);
      for (int k = 0; k < n; ++k) {
        for (int i = 0; i < n; ++i) sum[k] += in[i] * std::polar(1.0, sign * 2 * pi * i * k / n);
      }
      CHECK(reference::relative_error(got, sum) < 1e-13);
    }
  }
}

TEST_CASE("the band is the closed form, also where the shift exceeds half the padded plane") {
  const auto [first, last] = band_m(532e-9, 0.3, 5 * mm, 4 * mm);
  CHECK(std::round(first) == 6266);
  CHECK(std::round(last) == 56366);

  const auto mirrored = band_m(532e-9, 0.3, -5 * mm, 4 * mm);
  CHECK(mirrored.first == -last);
  CHECK(mirrored.second == -first);
  const auto behind = band_m(532e-9, -0.3, 5 * mm, 4 * mm);
  CHECK(behind.first == -last);
  CHECK(behind.second == -first);
  const auto partly = band_m(532e-9, 0.3, 1 * mm, 4 * mm);
  CHECK(partly.first < 0);
  CHECK(partly.second > 0);
}

DEVICE_TEST(
    "apodised fields arrive as the direct Rayleigh-Sommerfeld sum says, at wide angles and "
    "shifted") {
  // Windows 2 S wide when padded; waists and distances keep light inside window and band to 1e-7.
  const auto check = [&](const char* name, glm::ivec2 size, double side_m, double waist_m,
                         glm::dvec2 sine, glm::dvec2 shift_m, double distance_m) {
    const Setup s{size, {side_m, side_m}, red_m, shift_m, distance_m};
    const double error = direct_error(device, s, beam(s, waist_m, sine), 7);
    INFO(device.info().name << ", " << name << ": relative L2 error " << error);
    CHECK(error < 1e-5);
  };
  check("on the axis", {96, 80}, 0.5 * um, 5 * um, {0, 0}, {0, 0}, 40 * um);
  check("on the axis, focused tightly", {96, 80}, 0.4 * um, 2.5 * um, {0, 0}, {0, 0}, 30 * um);
  check("partly shifted in x, |x0| < S", {96, 80}, 0.5 * um, 5 * um, {0.4, 0}, {26 * um, 0},
        60 * um);
  check("partly shifted in y", {80, 96}, 0.5 * um, 5 * um, {0, 0.4}, {0, 26 * um}, 60 * um);
  check("partly shifted in both", {96, 80}, 0.5 * um, 5 * um, {-0.3, 0.25}, {-20 * um, 16 * um},
        60 * um);
  check("fully shifted in x, S < |x0| < 2 S", {96, 80}, 0.5 * um, 5 * um, {0.4, 0}, {66 * um, 0},
        150 * um);
  check("fully shifted down", {80, 96}, 0.5 * um, 5 * um, {0, -0.4}, {0, -66 * um}, 150 * um);
  check("beyond 2 S", {96, 80}, 0.5 * um, 6 * um, {0.45, 0.1}, {110 * um, 24 * um}, 220 * um);
  check("backwards, shifted", {96, 80}, 0.5 * um, 5 * um, {0.4, 0.1}, {-26 * um, -6.5 * um},
        -60 * um);
}

DEVICE_TEST("a hard-edged window costs what band limit and padding cost, below one per cent") {
  // The cost falls with the window's Fresnel number.
  const Setup s{{240, 220}, {0.5 * um, 0.5 * um}, red_m, {0, 0}, 150 * um};
  const double error = direct_error(device, s, Field(240 * 220, 1.0), 60);
  INFO(device.info().name << ": " << error);
  CHECK(error < 1e-2);
  CHECK(error > 1e-6);  // else the window is not hard
}

DEVICE_TEST("small planes send their light over long distances as the direct sum says", "[slow]") {
  // Light of every pixel goes everywhere: noise has no picture that a fault would miss.
  const Setup cases[] = {
      {{240, 136}, {3.74 * um, 3.74 * um}, 532e-9, {0, 0}, 103 * mm},
      {{240, 136}, {3.74 * um, 3.74 * um}, 532e-9, {0.9 * mm, -0.3 * mm}, -103 * mm},
      {{480, 40}, {3.74 * um, 3.74 * um}, red_m, {0, 0}, 0.3},
      {{136, 240}, {8 * um, 6 * um}, red_m, {0, 0}, 1},
      {{240, 240}, {1 * um, 1 * um}, 532e-9, {0, 0}, 30 * mm},
      {{1024, 64}, {3.74 * um, 3.74 * um}, 532e-9, {0, 0}, -1},
      {{64, 64}, {3.74 * um, 3.74 * um}, 532e-9, {0, 0}, 0.3},
  };
  for (const auto& s : cases) {
    auto spec = spec_of(s);
    spec.distance_m = s.distance_m;
    Propagator propagator(device, spec);
    const auto source = noise(s.size, 11);
    const auto got =
        reference::to_double(propagate(device, propagator, source, s.shift_m, s.distance_m));
    const std::vector<int> rows{s.size.y / 4, s.size.y / 2};
    Field of_rows;
    for (const int row : rows)
      of_rows.insert(of_rows.end(), got.begin() + row * s.size.x,
                     got.begin() + (row + 1) * s.size.x);
    const double error = reference::relative_error(
        of_rows, reference::rayleigh_sommerfeld(reference::to_double(source), s, rows));
    INFO(device.info().name << ", " << s.size.x << " x " << s.size.y << " over " << s.distance_m);
    CHECK(error < 0.01);
    CHECK(reference::relative_error(
              got, reference::shifted_angular_spectrum(reference::to_double(source), s,
                                                       propagator.padded_size())) < 1e-6);
  }
}

DEVICE_TEST("every size propagates as the same discrete propagation in double") {
  for (const glm::ivec2 size :
       {glm::ivec2(1, 1), {1, 37}, {37, 1}, {31, 17}, {53, 64}, {96, 80}, {127, 61}}) {
    for (const double padding : {1.0, 1.25, 2.0, 2.75}) {
      for (const double distance_m : {0.2 * mm, 7 * mm}) {
        const Setup s{size, {4 * um, 3 * um}, red_m, {1.5 * um, -1 * um}, distance_m};
        INFO(device.info().name << ", " << size.x << " x " << size.y << ", padding " << padding);
        CHECK(discrete_error(device, s, padding) < 1e-6);
      }
    }
  }
}

DEVICE_TEST("every distance, shift and angle keeps its phase") {
  const Setup cases[] = {
      {{480, 40}, {3.74 * um, 3.74 * um}, red_m, {0, 0}, 0.1 * mm},
      {{1920, 3}, {3.74 * um, 3.74 * um}, red_m, {3.6 * mm, 0}, 95 * mm},
      {{1920, 3}, {3.74 * um, 3.74 * um}, red_m, {50 * mm, 0}, 1},
      {{3, 1920}, {3.74 * um, 3.74 * um}, red_m, {0, -50 * mm}, 1},
      {{1920, 3}, {3.74 * um, 3.74 * um}, red_m, {50 * mm, 0}, -1},
      {{240, 200}, {0.4 * um, 0.4 * um}, red_m, {0, 0}, 0.05 * mm},
      {{240, 200}, {0.4 * um, 0.4 * um}, red_m, {0.1 * mm, -0.05 * mm}, 0.2 * mm},
      {{1920, 3}, {0.4 * um, 0.4 * um}, red_m, {5 * mm, 0}, 10 * mm},  // R of thousands of turns
      // Evanescent frequencies are sampled
      {{480, 400}, {0.2 * um, 0.2 * um}, red_m, {0, 0}, 0.01 * mm},
  };
  for (const auto& s : cases) {
    CAPTURE(device.info().name, s.distance_m, s.shift_m.x, s.shift_m.y, s.pitch_m.x);
    const double error = discrete_error(device, s);
    UNSCOPED_INFO("relative L2 error " << error);
    CHECK(error < 1e-6);
  }
}

DEVICE_TEST("all FFT back ends propagate alike") {
  const Setup s{{60, 44}, {2 * um, 2 * um}, red_m, {10 * um, 5 * um}, 0.3 * mm};
  for (const auto backend : backends_of(device)) {
    INFO(device.info().name << ", " << cl::name_of(backend));
    CHECK(discrete_error(device, s, 2, backend) < 1e-6);
  }
}

DEVICE_TEST("every width of packets, and the launches of GPUs, give the same field") {
  const Setup s{{61, 44}, {2 * um, 2 * um}, red_m, {10 * um, 5 * um}, 0.3 * mm};
  auto info = device.info();
  for (const int lanes : {1, 4, 8, 16}) {
    for (const auto kind : {cl::DeviceKind::cpu, cl::DeviceKind::gpu}) {
      info.float_lanes = lanes;
      info.kind = kind;
      INFO(info.name << ", lanes " << lanes << (kind == cl::DeviceKind::gpu ? ", as a GPU" : ""));
      const cl::Device other(info);
      CHECK(discrete_error(other, s) < 1e-6);
      // Two floats
      CHECK(discrete_error(other, {s.size, {0.4 * um, 0.4 * um}, red_m, {}, 2 * mm}) < 1e-6);
    }
  }
}

DEVICE_TEST("propagating by zero distance returns the field") {
  // Evanescent frequencies come back, too
  const Setup s{{45, 38}, {0.2 * um, 0.2 * um}, red_m, {0, 0}, 0};
  const auto source = noise(s.size, 1);
  CHECK(relative_error(propagate(device, source, s), source) < 1e-6);
}

DEVICE_TEST("a shift by whole samples at zero distance moves the window") {
  const glm::ivec2 size(24, 20);
  const Setup s{size, {um, um}, red_m, {5 * um, 3 * um}, 0};
  const auto source = noise(size, 2);
  FloatField moved(source.size());
  for (int y = 3; y < size.y; ++y) {  // a window further up shows every row further down
    for (int x = 0; x + 5 < size.x; ++x) moved[y * size.x + x] = source[(y - 3) * size.x + x + 5];
  }
  CHECK(relative_error(propagate(device, source, s), moved) < 1e-6);
}

DEVICE_TEST("a tilt to +x moves the light to +x, a tilt to +y to the rows above") {
  const Setup s{{96, 80}, {um, um}, red_m, {0, 0}, 100 * um};
  for (const glm::dvec2 sine : {glm::dvec2(0.15, 0), {0, 0.15}, {-0.1, 0.05}}) {
    const auto arrived = propagate(device, to_float(beam(s, 10 * um, sine)), s);
    const auto centre = centre_of_mass(arrived, s.size);
    const double cosine = std::sqrt(1 - sine.x * sine.x - sine.y * sine.y);
    CHECK(std::abs(centre.x - sine.x / cosine * 100) < 0.1);
    CHECK(std::abs(centre.y - sine.y / cosine * 100) < 0.1);
  }
}

DEVICE_TEST("forward and back returns a field that stays inside window and band") {
  Setup s{{96, 80}, {0.5 * um, 0.5 * um}, red_m, {26 * um, 5 * um}, 60 * um};
  const auto source = to_float(beam(s, 5 * um, {0.4, 0.08}));
  Propagator propagator(device, spec_of(s));
  const auto there = propagate(device, propagator, source, s.shift_m, s.distance_m);
  const auto back = propagate(device, propagator, there, -s.shift_m, -s.distance_m);
  CHECK(relative_error(back, source) < 1e-5);
}

DEVICE_TEST("the adjoint is propagation back by the opposite shift") {
  for (const glm::ivec2 size : {glm::ivec2(33, 21), {7, 50}, {1, 9}}) {
    const Setup s{size, {3 * um, 2 * um}, red_m, {20 * um, -13 * um}, 0.3 * mm};
    Propagator propagator(device, spec_of(s));
    const auto x = noise(size, 4), y = noise(size, 5);
    const auto ax = propagate(device, propagator, x, s.shift_m, s.distance_m);
    const auto ay = propagate(device, propagator, y, -s.shift_m, -s.distance_m);
    const double scale = std::sqrt(std::abs(inner_product(x, x)) * std::abs(inner_product(y, y)));
    INFO(device.info().name << ", " << size.x << " x " << size.y);
    CHECK(std::abs(inner_product(ax, y)) > 1e-4 * scale);
    CHECK(std::abs(inner_product(ax, y) - inner_product(x, ay)) < 1e-6 * scale);
  }
}

DEVICE_TEST(
    "sources summed before one inverse transform equal the sum of their propagations, time after "
    "time") {
  const Setup s{{50, 34}, {2 * um, 2 * um}, red_m, {}, 0.2 * mm};
  const glm::dvec2 left(-40 * um, -25 * um), right(35 * um, 31 * um);
  const auto a = noise(s.size, 8), b = noise(s.size, 9);
  Propagator propagator(device, spec_of(s));
  auto expected = propagate(device, propagator, a, left, s.distance_m);
  const auto second = propagate(device, propagator, b, right, 0.3 * mm);
  std::transform(expected.begin(), expected.end(), second.begin(), expected.begin(), std::plus<>());
  const Target targets[] = {{left, s.distance_m}, {right, 0.3 * mm}};  // of other rows each
  // Those that are told of one target leave their memory to what comes back
  for (const auto& [is_first_told, is_second_told] :
       {std::pair(false, false), {true, false}, {false, true}, {true, true}, {true, true}}) {
    cl::ComplexBuffer field(device, a, "field");
    propagator.load(field, 0, {targets, is_first_told ? 1u : 0u});
    propagator.add(targets[0]);
    field.write(b);
    propagator.load(field, 0, {targets + 1, is_second_told ? 1u : 0u});
    propagator.add(targets[1]);
    propagator.collect(field);
    CHECK(relative_error(field.read(), expected) < 1e-6);
    if (is_second_told) CHECK_THROWS_AS(propagator.add(targets[1]), std::invalid_argument);
  }
  cl::ComplexBuffer nothing(device, a, "field");
  propagator.collect(nothing);
  CHECK(nothing.read() == FloatField(a.size()));
}

DEVICE_TEST("light that stays inside the window is right at every padding") {
  // From one side to the other, too: farther than half the padded plane.
  const Setup s{{320, 160}, {1.6 * um, 1.6 * um}, red_m, {}, 2.4 * mm};
  auto source = beam(s, 20 * um, {0, 0});
  // The beam's middle starts at the left end and travels to the right one.
  for (int y = 0; y < s.size.y; ++y) {
    auto* row = source.data() + y * s.size.x;
    std::rotate(row, row + 104, row + s.size.x);
    for (int x = 0; x < s.size.x; ++x)
      row[x] *= std::polar(1.0, 2 * pi / s.wavelength_m * 0.138 * x * s.pitch_m.x);
  }
  const auto wide = propagate(device, to_float(source), s, 4);
  CHECK(centre_of_mass(wide, s.size).x > -104 + 0.625 * s.size.x);
  for (const double padding : {1.0, 1.125, 1.25, 1.5, 2.0}) {
    for (const auto backend : backends_of(device)) {
      // Their plans take seconds
      if (backend != cl::FftBackend::host && padding != 1.25) continue;
      const double error =
          relative_error(propagate(device, to_float(source), s, padding, backend), wide);
      CAPTURE(device.info().name, cl::name_of(backend), padding, error);
      CHECK(error < 1e-3);
    }
  }
}

DEVICE_TEST("more sources than wait for the inverse transform still add up") {
  const Setup s{{60, 44}, {2 * um, 2 * um}, red_m, {}, 0.3 * mm};
  Propagator together(device, spec_of(s, 1.25)), alone(device, spec_of(s, 1.25));
  FloatField expected(static_cast<std::size_t>(s.size.x) * s.size.y);
  cl::ComplexBuffer field(device, expected, "field");
  for (unsigned i = 0; i < 9; ++i) {
    const Target target{{(i % 3 - 1.0) * 60 * um, (i / 3 - 1.0) * 44 * um}, s.distance_m};
    const auto source = noise(s.size, i);
    field.write(source);
    together.load(field, 0, {&target, 1});
    together.add(target);
    const auto part = propagate(device, alone, source, target.shift_m, target.distance_m);
    std::transform(expected.begin(), expected.end(), part.begin(), expected.begin(), std::plus<>());
  }
  together.collect(field);
  CHECK(relative_error(field.read(), expected) < 1e-6);
}

DEVICE_TEST("columns without light leave the sum of earlier sources as it was") {
  const Setup s{{75, 44}, {4 * um, 4 * um}, red_m, {}, 10 * mm};
  const auto part = [&](int first, int last) {  // columns of noise
    auto field = noise(s.size, 5);
    for (std::size_t i = 0; i < field.size(); ++i) {
      const int column = static_cast<int>(i) % s.size.x;
      if (column < first || column >= last) field[i] = 0;
    }
    return field;
  };
  Propagator used(device, spec_of(s));
  for (const auto& source : {part(0, 75), part(33, 40), part(0, 16), part(0, 0), part(70, 75)})
    CHECK(propagate(device, used, source, s.shift_m, s.distance_m) == propagate(device, source, s));
  const auto left = propagate(device, used, part(0, 37), s.shift_m, s.distance_m),
             right = propagate(device, used, part(37, 75), s.shift_m, s.distance_m);
  auto sum = left;
  std::transform(sum.begin(), sum.end(), right.begin(), sum.begin(), std::plus<>());
  CHECK(relative_error(sum, propagate(device, part(0, 75), s)) < 1e-6);
}

DEVICE_TEST(
    "a source loaded for given targets arrives as one loaded for any, and other targets are "
    "refused") {
  const Setup s{{61, 44}, {4 * um, 4 * um}, red_m, {}, 10 * mm};
  const auto source = noise(s.size, 3);
  Propagator propagator(device, spec_of(s));
  cl::ComplexBuffer field(device, source, "field");
  const Target targets[] = {
      {{0, 0}, s.distance_m}, {{0, 0.1 * mm}, s.distance_m}, {{0, -0.1 * mm}, s.distance_m}};
  propagator.load(field, 0, {targets, 2});
  CHECK_THROWS_AS(propagator.add(targets[2]), std::invalid_argument);
  for (const auto& target : {targets[0], targets[1]}) {
    propagator.add(target);
    propagator.collect(field);
    CHECK(field.read() ==
          propagate(device, source, {s.size, s.pitch_m, red_m, target.shift_m, target.distance_m}));
  }
}

DEVICE_TEST("a shift beyond reach is refused with the largest that is usable") {
  // The steepest light that arrives has the highest sampled frequency f = 63/128 per um (64/128 to
  // the other side) and leaves for the far edge of the padded plane across, where its other slope
  // is at most S/z = 0.64: least S + z lambda f / sqrt(1 - (lambda f)^2), most sqrt(1 + 0.64^2)
  // times that.
  const Setup s{{64, 64}, {um, um}, red_m, {}, 0.1 * mm};
  const auto reach = [&](double f, double slope) {
    return 64 * um +
           s.distance_m * red_m * f * std::hypot(1, slope) / std::sqrt(1 - red_m * f * red_m * f);
  };
  const double least = reach(63 / (128 * um), 0), most = reach(64 / (128 * um), 0.64);
  Propagator propagator(device, spec_of(s));
  cl::ComplexBuffer field(device, noise(s.size, 1), "field");
  propagator.load(field);
  for (const double distance_m : {s.distance_m, -s.distance_m}) {
    for (const glm::dvec2 side : {glm::dvec2(1, 0), {-1, 0}, {0, 1}, {0, -1}}) {
      CHECK_NOTHROW(propagator.add({side * least, distance_m}));
      const auto message = input_error_of([&] { propagator.add({side * 0.2 * mm, distance_m}); });
      INFO(message);
      double x_mm = 0, y_mm = 0;
      REQUIRE(message.find("usable shift is ") != std::string::npos);
      REQUIRE(std::sscanf(message.c_str() + message.find("usable shift is "),
                          "usable shift is %lf mm in x, %lf mm in y", &x_mm, &y_mm) == 2);
      const double named = (side.x != 0 ? x_mm : y_mm) * mm;
      CHECK(named > least);
      CHECK(named < most * 1.001);
      CHECK(propagator.reaches({side * named * 0.999, distance_m}));
      CHECK_FALSE(propagator.reaches({side * named * 1.001, distance_m}));
    }
  }
  CHECK_THROWS_AS(propagator.add({{0.01, 0.01}, s.distance_m}), InputError);
  CHECK_THROWS_AS(propagator.add({{65 * um, 0}, 0}), InputError);
  CHECK_THROWS_AS(propagator.add({{std::nan(""), 0}, 1 * mm}), InputError);
}

DEVICE_TEST("impossible planes are refused") {
  CHECK_THROWS_AS(Propagator(device, {{0, 5}, {um, um}, red_m}), InputError);
  CHECK_THROWS_AS(Propagator(device, {{5, 5}, {0, um}, red_m}), InputError);
  CHECK_THROWS_AS(Propagator(device, {{5, 5}, {um, um}, -1}), InputError);
  CHECK_THROWS_AS(Propagator(device, {{5, 5}, {um, um}, red_m, 0.9}), InputError);
}

}  // namespace
}  // namespace raywave
