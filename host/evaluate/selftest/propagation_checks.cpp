// SPDX-License-Identifier: Apache-2.0
// Checks of Propagator with the device's default FFT against sums and transforms in double, and of
// the limits of propagation.
#include <cmath>
#include <cstdio>
#include <numbers>

#include "host/evaluate/selftest/checks.hpp"
#include "host/propagate/propagator.hpp"
#include "host/reference/propagation.hpp"

namespace raywave::selftest {
namespace {

using reference::Field;
using reference::Setup;
using FloatField = std::vector<std::complex<float>>;

constexpr double nm = 1e-9, um = 1e-6, mm = 1e-3, red_m = 638e-9;

/// docs/accuracy.md, "Propagation": measured 1.8e-7 to 4.2e-7.
constexpr double discrete_bound = 1e-6;

/// Bound when only a few frequencies arrive: errors of their phases do not average out.
constexpr double few_frequencies_bound = 2e-6;

PropagatorSpec spec_of(const cl::Device& device, const Setup& s, double padding) {
  return {s.size, s.pitch_m, s.wavelength_m, padding, cl::default_backend(device.info())};
}

FloatField propagated(const cl::Device& device, Propagator& propagator, const FloatField& source,
                      const Setup& s) {
  cl::ComplexBuffer field(device, source, "field");
  propagator.load(field);
  propagator.add({s.shift_m, s.distance_m});
  propagator.collect(field);
  auto arrived = field.read();
  require_finite(arrived, "field");
  return arrived;
}

/// Relative L2 error against the discrete propagation in double.
Finding discrete(const cl::Device& device, const PropagatorSpec& spec, const Setup& s,
                 const FloatField& source) {
  Propagator propagator(device, spec);
  const auto got = propagated(device, propagator, source, s);
  return {reference::relative_error(reference::to_double(got),
                                    reference::shifted_angular_spectrum(
                                        reference::to_double(source), s, propagator.padded_size())),
          ""};
}

Finding discrete_noise(const cl::Device& device, const Setup& s, double padding = 2) {
  return discrete(device, spec_of(device, s, padding), s, reference::noise(s.size, 7));
}

/// Error of the transfer function. A single bright sample contains all frequencies equally: the
/// error of its field is that of the transfer function (and 1e-7 of one transform).
Finding transfer_function(const cl::Device& device, const Setup& s) {
  FloatField impulse(static_cast<std::size_t>(s.size.x) * s.size.y);
  impulse[0] = 1;
  auto spec = spec_of(device, s, 1);
  if (padded_size(s.size, 1) != s.size)
    throw std::logic_error("transfer_function: not a size that is transformed as it is");
  return discrete(device, spec, s, impulse);
}

/// Error of light inside band and window against the direct Rayleigh-Sommerfeld sum, on every
/// seventh row.
Finding direct_sum(const cl::Device& device, const Setup& s, double waist_m, glm::dvec2 sine) {
  const auto source = reference::beam(s, waist_m, sine);
  Propagator propagator(device, spec_of(device, s, 2));
  const auto whole =
      reference::to_double(propagated(device, propagator, reference::to_float(source), s));
  std::vector<int> rows;
  Field got;
  for (int y = 3; y < s.size.y; y += 7) {
    rows.push_back(y);
    got.insert(got.end(), whole.begin() + y * s.size.x, whole.begin() + (y + 1) * s.size.x);
  }
  return {reference::relative_error(got, reference::rayleigh_sommerfeld(source, s, rows)), ""};
}

/// The largest usable shift in x, taken from the message that refuses a larger shift.
double named_shift_m(const cl::Device& device, const Setup& s) {
  const auto finding = refused("usable shift is ", [&] {
    Propagator propagator(device, spec_of(device, s, 2));
    propagated(device, propagator, reference::noise(s.size, 1), s);
  });
  double x_mm = 0;
  const auto at = finding.note.find("usable shift is ");
  if (at == std::string::npos ||
      std::sscanf(finding.note.c_str() + at, "usable shift is %lf mm", &x_mm) != 1)
    throw std::runtime_error("no usable shift is named: " + finding.note);
  return x_mm * mm;
}

/// Error for n x n unpadded samples of a few plane waves that are periodic in the plane.
/// Propagation only multiplies each wave by the transfer function, so that the test needs no second
/// plane and no slow sum.
Finding plane_waves(const cl::Device& device, int n) {
  const Setup s{{n, n}, {3.74 * um, 3.74 * um}, red_m, {1 * mm, -0.5 * mm}, 95 * mm};
  struct PlaneWave {
    int across, down;  // periods in the plane
    Field x, y;        // values along a row and along a column
    std::complex<double> factor;
  };
  std::vector<PlaneWave> waves;
  for (const auto& [across, down] :
       {std::pair(0, 0), {n / 16, 3}, {-7, n / 19}, {n / 11, -n / 23}, {-n / 31, n / 9}}) {
    PlaneWave wave{across, down, Field(n), Field(n), 1};
    for (int i = 0; i < n; ++i) {
      const auto turns = [&](int periods) {
        return static_cast<double>(static_cast<long long>(periods) * i % n) / n;
      };
      wave.x[i] = std::polar(1.0, 2 * std::numbers::pi * turns(across));
      wave.y[i] = std::polar(1.0, 2 * std::numbers::pi * turns(down));
    }
    const double u = across / (n * s.pitch_m.x), v = -down / (n * s.pitch_m.y);
    const double turns =
        s.shift_m.x * u + s.shift_m.y * v +
        s.distance_m * std::sqrt(1 / (s.wavelength_m * s.wavelength_m) - u * u - v * v);
    wave.factor = std::polar(1.0, 2 * std::numbers::pi * std::remainder(turns, 1.0));
    waves.push_back(std::move(wave));
  }
  // A row of the field, before and after propagation
  const auto row_of = [&](int row, bool arrived) {
    Field values(n);
    for (const auto& wave : waves) {
      const auto factor = wave.y[row] * (arrived ? wave.factor : 1.0);
      for (int i = 0; i < n; ++i) values[i] += factor * wave.x[i];
    }
    return values;
  };
  cl::ComplexBuffer field(device, static_cast<std::size_t>(n) * n, "field");
  Propagator propagator(device, spec_of(device, s, 1));
  field.on_host([&](std::span<std::complex<float>> samples) {
    for (int row = 0; row < n; ++row) {
      const auto values = row_of(row, false);
      for (int i = 0; i < n; ++i)
        samples[static_cast<std::size_t>(row) * n + i] = std::complex<float>(values[i]);
    }
  });
  propagator.load(field);
  propagator.add({s.shift_m, s.distance_m});
  propagator.collect(field);
  double difference = 0, energy = 0;
  field.on_host(
      [&](std::span<std::complex<float>> samples) {
        for (int row = 0; row < n; ++row) {
          const auto values = row_of(row, true);
          for (int i = 0; i < n; ++i) {
            difference += std::norm(
                std::complex<double>(samples[static_cast<std::size_t>(row) * n + i]) - values[i]);
            energy += std::norm(values[i]);
          }
        }
      },
      CL_MAP_READ);
  return {std::sqrt(difference / energy), ""};
}

}  // namespace

std::vector<SelfCheck> propagation_checks(SelfTestSize) {
  std::vector<SelfCheck> checks;
  const auto transfer = [&](const char* what, const Setup& s) {
    checks.push_back({"propagation", std::string("transfer function, ") + what, "relative L2",
                      discrete_bound,
                      [=](const cl::Device& device) { return transfer_function(device, s); }});
  };
  const double slm = 3.74 * um;
  transfer("0.1 mm", {{240, 160}, {slm, slm}, red_m, {0, 0}, 0.1 * mm});
  transfer("95 mm, shift 3.6 mm", {{1920, 16}, {slm, slm}, red_m, {3.6 * mm, 0}, 95 * mm});
  transfer("1 m, shift 50 mm up", {{16, 1920}, {slm, slm}, red_m, {0, 50 * mm}, 1});
  transfer("10 mm, shift 5 mm, pitch 0.4 um",
           {{1920, 16}, {0.4 * um, 0.4 * um}, red_m, {5 * mm, 0}, 10 * mm});

  const auto direct = [&](const char* what, const Setup& s, double waist_m, glm::dvec2 sine) {
    checks.push_back(
        {"propagation", std::string("Rayleigh-Sommerfeld sum, ") + what, "relative L2", 1e-5,
         [=](const cl::Device& device) { return direct_sum(device, s, waist_m, sine); }});
  };
  const glm::dvec2 half_um(0.5 * um, 0.5 * um);
  direct("on the axis", {{96, 80}, half_um, red_m, {0, 0}, 40 * um}, 5 * um, {0, 0});
  direct("shifted within the plane", {{96, 80}, half_um, red_m, {-20 * um, 16 * um}, 60 * um},
         5 * um, {-0.3, 0.25});
  direct("shifted beyond its edge", {{96, 80}, half_um, red_m, {66 * um, 0}, 150 * um}, 5 * um,
         {0.4, 0});
  direct("shifted beyond its far edge", {{96, 80}, half_um, red_m, {110 * um, 24 * um}, 220 * um},
         6 * um, {0.45, 0.1});
  direct("backwards", {{96, 80}, half_um, red_m, {-26 * um, -6.5 * um}, -60 * um}, 5 * um,
         {0.4, 0.1});

  checks.push_back({"propagation", "the same in double, every FFT", "relative L2", discrete_bound,
                    [](const cl::Device& device) {
                      const Setup s{{60, 44}, {2 * um, 2 * um}, red_m, {10 * um, 5 * um}, 0.3 * mm};
                      Finding worst;
                      for (const auto backend : {cl::FftBackend::host, cl::FftBackend::clfft}) {
                        if (!cl::serves(backend, device.info())) continue;
                        const auto found =
                            discrete(device, {s.size, s.pitch_m, s.wavelength_m, 2, backend}, s,
                                     reference::noise(s.size, 7));
                        if (!(found.measured <= worst.measured)) worst = found;
                      }
                      return worst;
                    }});
  return checks;
}

std::vector<SelfCheck> optics_extremes(SelfTestSize size) {
  std::vector<SelfCheck> checks;
  const auto add = [&](const std::string& what, const Setup& s, double padding = 2) {
    checks.push_back(
        {"extremes", "propagation, " + what, "relative L2", discrete_bound,
         [=](const cl::Device& device) { return discrete_noise(device, s, padding); }});
  };
  const glm::ivec2 small(96, 80);
  const auto square = [](double pitch_m) { return glm::dvec2(pitch_m, pitch_m); };
  add("wavelength 10 nm, pitch 50 nm, 0.1 mm",
      {small, square(50 * nm), 10 * nm, {2 * um, 0}, 0.1 * mm});
  add("wavelength 10 nm, pitch 3.74 um, 1 m",
      {small, square(3.74 * um), 10 * nm, {0.5 * mm, 0}, 1});
  add("wavelength 1 mm, pitch 0.3 mm, 0.1 m",
      {small, square(0.3 * mm), 1 * mm, {5 * mm, 3 * mm}, 0.1});
  add("wavelength 1 mm, pitch 0.3 mm, 100 m", {small, square(0.3 * mm), 1 * mm, {0, 0}, 100});
  add("pitch a quarter wavelength, 10 um", {small, square(red_m / 4), red_m, {3 * um, 0}, 10 * um});
  add("pitch a quarter wavelength, 10 mm, shift 10 mm",
      {{1920, 3}, square(red_m / 4), red_m, {10 * mm, 0}, 10 * mm});
  add("pitch 100 um, 1 m", {small, square(100 * um), red_m, {2 * mm, -1 * mm}, 1});
  add("distance 0", {small, square(0.2 * um), red_m, {0, 0}, 0});
  add("distance 1 um", {small, square(0.4 * um), red_m, {0, 0}, 1 * um});
  add("distance 1 um, pitch 3.74 um, shifted",
      {small, square(3.74 * um), red_m, {5 * um, 0}, 1 * um});
  add("distance 100 m, pitch 3.74 um", {small, square(3.74 * um), red_m, {0, 0}, 100});
  add("distance 100 m, pitch 100 um", {{240, 160}, square(100 * um), red_m, {0.02, 0}, 100});
  for (const glm::ivec2 n : {glm::ivec2(1, 1), {1, 37}, {37, 1}, {31, 17}, {127, 61}})
    for (const double padding : {1.0, 2.0})
      add(std::to_string(n.x) + " x " + std::to_string(n.y) + " samples, padding " +
              (padding > 1 ? "2" : "1"),
          {n, {4 * um, 3 * um}, red_m, {1.5 * um, -1 * um}, 0.2 * mm}, padding);

  const Setup beyond{{64, 64}, square(1 * um), red_m, {0.2 * mm, 0}, 0.1 * mm};
  checks.push_back(
      {"extremes", "a shift beyond the band is refused, naming the largest", "refusals lost", 0,
       [=](const cl::Device& device) {
         const double named_m = named_shift_m(device, beyond);
         Propagator propagator(device, spec_of(device, beyond, 2));
         const bool right = propagator.reaches({{0.999 * named_m, 0}, beyond.distance_m}) &&
                            !propagator.reaches({{1.001 * named_m, 0}, beyond.distance_m});
         return Finding{right ? 0.0 : 1.0, "named " + std::to_string(named_m / mm) + " mm"};
       }});
  checks.push_back({"extremes", "propagation, the largest shift that was named", "relative L2",
                    few_frequencies_bound, [=](const cl::Device& device) {
                      auto s = beyond;
                      s.shift_m.x = 0.999 * named_shift_m(device, beyond);
                      return discrete_noise(device, s);
                    }});
  const auto refusal = [&](const std::string& claim, const std::string& words, const Setup& s) {
    checks.push_back(
        {"extremes", claim, "relative L2", few_frequencies_bound, [=](const cl::Device& device) {
           return exact_or_refused(words, [&] { return discrete_noise(device, s); });
         }});
  };
  refusal("propagation, 100 m, shift 50 m, tiny plane: exact or refused",
          "samples too few directions", {small, square(0.4 * um), red_m, {50, 0}, 100});
  refusal("propagation, 100 m, shift 100 m, steep: exact or refused",
          "too far for its phase to be exact",
          {{1 << 19, 1}, square(red_m / 4), red_m, {100, 0}, 100});
  std::vector<int> large{1024};
  if (size == SelfTestSize::full) large.insert(large.end(), {4096, 16384});
  for (const int n : large) {
    const auto text = std::to_string(n);
    checks.push_back({"extremes",
                      "propagation, " + text + " x " + text + " samples: exact or refused",
                      "relative L2", discrete_bound, [=](const cl::Device& device) {
                        return exact_or_refused(" asked", [&] { return plane_waves(device, n); });
                      }});
  }
  return checks;
}

}  // namespace raywave::selftest
