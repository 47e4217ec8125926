// SPDX-License-Identifier: Apache-2.0
// Checks of what all holograms are made with: arithmetic, FFTs, propagation, rays through the tree
// and levels.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "cl/fft.hpp"
#include "host/encode/encode.hpp"
#include "host/evaluate/selftest/selfcheck.hpp"
#include "host/evaluate/selftest/selftest.hpp"
#include "host/propagate/propagator.hpp"
#include "host/reference/propagation.hpp"
#include "host/reference/surfaces.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave::selftest {
namespace {

using glm::ivec2;
using reference::Field;
using reference::Random;
using reference::Setup;
using FloatComplex = std::complex<float>;

/// docs/accuracy.md, "Propagation": measured 1.8e-7 to 4.2e-7.
constexpr double propagation_bound = 1e-6;

/// Error of both transforms of a plane whose first live.y rows and live.x columns are not zero.
Finding transformed(const cl::Device& device, cl::FftBackend backend, ivec2 size, ivec2 live) {
  const auto n = [](int value) { return static_cast<std::size_t>(value); };
  const auto fft = cl::make_fft(device, backend, {n(size.x), n(size.y), n(live.x), n(live.y)});
  Finding finding;
  for (const int sign : {-1, 1}) {
    auto plane = reference::noise(size, 1);
    const auto is_live = [&](std::size_t i) {
      return i % n(size.x) < n(live.x) && i / n(size.x) < n(live.y);
    };
    for (std::size_t i = 0; sign < 0 && i < plane.size(); ++i)
      if (!is_live(i)) plane[i] = 0;
    cl::ComplexBuffer buffer(device, plane, "plane");
    sign < 0 ? fft->forward(buffer) : fft->inverse(buffer);
    auto got = reference::to_double(buffer.read()),
         want = reference::direct_transform(reference::to_double(plane), size, sign);
    for (std::size_t i = 0; sign > 0 && i < got.size(); ++i)
      if (!is_live(i)) got[i] = want[i] = 0;
    const double error = reference::relative_error(got, want);
    if (!(error <= finding.measured)) finding.measured = error;
  }
  return finding;
}

/// Error of noise that is propagated, against the same discrete propagation in double.
Finding propagated(const cl::Device& device, const Setup& s, double padding, cl::FftBackend fft) {
  const auto source = reference::noise(s.size, 7);
  Propagator propagator(device, {s.size, s.pitch_m, s.wavelength_m, padding, fft});
  cl::ComplexBuffer field(device, source, "field");
  propagator.load(field);
  propagator.add({s.shift_m, s.distance_m});
  propagator.collect(field);
  return {reference::relative_error(reference::to_double(field.read()),
                                    reference::shifted_angular_spectrum(
                                        reference::to_double(source), s, propagator.padded_size())),
          ""};
}

/// Error of a plane wave with whole periods in n x n unpadded samples: propagation multiplies it
/// by one number, so that the check needs no second plane.
Finding plane_wave(const cl::Device& device, int n) {
  const auto side = static_cast<std::size_t>(n);
  const double distance_m = 95 * mm, across = n / 16, down = 3;  // periods
  const auto wave = [=](std::size_t i, double moved_turns) {
    const auto column = static_cast<double>(i % side), row = static_cast<double>(i / side);
    return std::polar(
        1.0, 2 * std::numbers::pi * (std::fmod(column * across + row * down, n) / n + moved_turns));
  };
  cl::ComplexBuffer field(device, side * side, "field");
  Propagator propagator(
      device, {ivec2(n), glm::dvec2(slm_m), red_m, 1, cl::default_backend(device.info())});
  field.on_host([&](auto samples) {
    for (std::size_t i = 0; i < samples.size(); ++i) samples[i] = FloatComplex(wave(i, 0));
  });
  propagator.load(field);
  propagator.add({{0, 0}, distance_m});
  propagator.collect(field);
  const double frequency = std::hypot(across, down) / (n * slm_m),
               turns = distance_m * std::sqrt(1 / (red_m * red_m) - frequency * frequency);
  double difference = 0;
  const auto compare = [&](auto samples) {
    for (std::size_t i = 0; i < samples.size(); ++i)
      difference += std::norm(std::complex<double>(samples[i]) - wave(i, std::fmod(turns, 1.0)));
  };
  field.on_host(compare, CL_MAP_READ);
  return {std::sqrt(difference) / n, ""};
}

RayCaster caster(const cl::Device& device, const Bvh& bvh) {
  return {device, lanes_for(device.info()), bvh};
}

/// Counts hits in a soup of slivers, points and duplicates that rounding errors cannot explain.
Finding wrong_hits(const cl::Device& device, double scale) {
  Random random(2);
  const auto soup = reference::soup(random, 300, scale);
  const auto rays = reference::as_float(reference::random_rays(random, 5003, scale));
  const auto bvh = build_bvh(soup.positions, soup.triangles, {});
  const auto found = caster(device, bvh).nearest(rays);
  Finding finding;
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const auto verdict = reference::judge(found[i], rays[i], bvh.triangles);
    if (verdict.fault.empty()) continue;
    finding.measured += 1;
    finding.note = verdict.fault;
  }
  return finding;
}

/// Counts rays at shared edges and vertices of closed meshes (5 mm and 1 m wide) that pass through.
Finding cracks(const cl::Device& device, std::size_t count) {
  constexpr std::size_t most_at_once = 1 << 18;
  Finding finding;
  for (const double size : {5e-3, 1.0}) {
    for (const auto& mesh : {reference::sphere({0, 0, 0}, size, 24), reference::torus(size)}) {
      Random random(6);
      const auto bvh = build_bvh(mesh.positions, mesh.triangles, {});
      auto casts = caster(device, bvh);
      for (std::size_t left = count / 4; left > 0;) {
        const auto rays =
            reference::rays_at_edges(random, bvh.triangles, std::min(left, most_at_once), size);
        for (const auto& hit : casts.nearest(rays))
          finding.measured += hit.triangle < 0 || !(hit.t <= 1 + 1e-5);
        left -= rays.size();
      }
    }
  }
  return finding;
}

/// Counts levels that are not nearest to the phase; zero, NaN and infinity must give level 0.
Finding wrong_levels(const cl::Device& device) {
  Random random(1);
  std::vector<FloatComplex> field{{0, 0},   {-0.0f, 0},    {NAN, 1},
                                  {1, NAN}, {INFINITY, 1}, {-1, -INFINITY}};
  std::vector<int> expected(field.size(), 0);
  while (field.size() < 100'000) {
    const double turns = reference::uniform(random, 0, 1),
                 size = std::pow(10, reference::uniform(random, -30, 30));
    if (std::abs(turns * 256 - std::floor(turns * 256) - 0.5) < 1e-3) continue;  // a tie in float
    field.emplace_back(std::polar(size, 2 * std::numbers::pi * turns));
    expected.push_back(static_cast<int>(std::lround(turns * 256)) % 256);
  }
  SlmSpec slm;
  slm.encoding = Encoding::phase;
  const auto count = static_cast<int>(field.size());
  Encoder encoder(device, std::make_shared<Panel>(slm, ivec2(count, 1), glm::dvec2(1), 1));
  const auto levels = encode(device, encoder, {count, 1, 1, field}).front();
  Finding finding;
  for (std::size_t i = 0; i < levels.size(); ++i) finding.measured += levels[i] != expected[i];
  return finding;
}

std::string text(ivec2 size) { return std::to_string(size.x) + " x " + std::to_string(size.y); }

std::vector<SelfCheck> arithmetic_checks(SelfTestSize size) {
  std::vector<SelfCheck> checks{
      {"layout", "members of shared structs lie where the host has them", "misplaced", 0,
       [](const cl::Device& device) {
         const auto misplaced = misplaced_members(device);
         return Finding{static_cast<double>(misplaced.size()),
                        misplaced.empty() ? "" : misplaced.front()};
       }},
      {"phase", "sine and cosine, 200,000 arguments, folds and largest ones", "absolute",
       cos_sin_bound, [](const cl::Device& device) {
         return Finding{cos_sin_error(device, lanes_for(device.info()), cos_sin_arguments()), ""};
       }}};
  if (size == SelfTestSize::full)
    checks.push_back(
        {"phase", "sine and cosine of every float from -0.5 to 0.5 turns", "absolute",
         cos_sin_bound, [](const cl::Device& device) {
           return Finding{cos_sin_error_everywhere(device, lanes_for(device.info())), ""};
         }});
  return checks;
}

std::vector<SelfCheck> fft_checks(const cl::DeviceInfo& info, SelfTestSize size) {
  std::vector<SelfCheck> checks;
  // The host's FFT is checked as part of the propagation. clFFT takes seconds for a new shape.
  for (const auto backend : {cl::FftBackend::clfft, cl::FftBackend::vkfft}) {
    if (!cl::serves(backend, info)) continue;
    std::vector<std::pair<ivec2, ivec2>> shapes{
        {{1, 7}, {1, 7}}, {{60, 35}, {60, 35}}, {{60, 35}, {31, 18}}};
    if (size == SelfTestSize::full) shapes.push_back({{105, 63}, {105, 63}});
    for (const auto& [n, live] : shapes)
      checks.push_back({"FFT",
                        std::string(cl::name_of(backend)) + ", " +
                            (live == n ? "" : text(live) + " live of ") + text(n) +
                            ", against the direct sum",
                        "relative L2",
                        // c eps sqrt(log2 n); c is measured in tests/cl/fft.cpp and has a margin.
                        1.5 * 0x1p-24 * std::sqrt(1 + std::log2(1.0 * n.x * n.y)),
                        [=, n = n, live = live](const cl::Device& device) {
                          return transformed(device, backend, n, live);
                        }});
  }
  return checks;
}

std::vector<SelfCheck> propagation_checks(const cl::DeviceInfo& info, SelfTestSize size) {
  std::vector<SelfCheck> checks;
  const auto add = [&](const std::string& claim, auto measure) {
    checks.push_back({"propagation", claim, "relative L2", propagation_bound, measure});
  };
  const auto fft = cl::default_backend(info);
  const auto square = [](double pitch_m) { return glm::dvec2(pitch_m); };
  const ivec2 small(96, 80);
  const std::pair<const char*, Setup> setups[] = {
      {"95 mm, shift 3.6 mm", {{1920, 16}, square(slm_m), red_m, {3.6 * mm, 0}, 95 * mm}},
      {"1 m, shift 50 mm up", {{16, 1920}, square(slm_m), red_m, {0, 50 * mm}, 1}},
      {"60 um backwards, pitch 0.5 um", {small, square(0.5 * um), red_m, {-26 * um, 0}, -60 * um}},
      {"wavelength 10 nm, pitch 50 nm", {small, square(50 * nm), 10 * nm, {0, 0}, 0.1 * mm}},
      {"wavelength 10 nm, 1 m", {small, square(slm_m), 10 * nm, {0, 0}, 1}},
      {"wavelength 1 mm, pitch a quarter of it", {small, square(0.25 * mm), 1 * mm, {}, 0.1}},
      {"wavelength 1 mm, pitch 0.3 mm, 100 m", {small, square(0.3 * mm), 1 * mm, {0, 0}, 100}},
      {"pitch a quarter wavelength, shift 10 mm",
       {{1920, 3}, square(red_m / 4), red_m, {10 * mm, 0}, 10 * mm}},
      {"distance 0", {small, square(0.2 * um), red_m, {0, 0}, 0}},
      {"distance 1 um, shifted", {small, square(slm_m), red_m, {5 * um, 0}, 1 * um}},
      {"distance 100 m", {small, square(slm_m), red_m, {0, 0}, 100}},
      {"distance 100 m, pitch 100 um", {{240, 160}, square(100 * um), red_m, {0.02, 0}, 100}},
      {"1 x 1 samples", {{1, 1}, square(4 * um), red_m, {1.5 * um, -1 * um}, 0.2 * mm}},
      {"37 x 1 samples", {{37, 1}, square(4 * um), red_m, {1.5 * um, -1 * um}, 0.2 * mm}},
      {"31 x 17 samples", {{31, 17}, {4 * um, 3 * um}, red_m, {1.5 * um, -1 * um}, 0.2 * mm}},
  };
  for (const auto& [claim, s] : setups)
    add(claim, [=, s = s](const cl::Device& device) { return propagated(device, s, 2, fft); });
  add("127 x 61 samples, no padding", [=](const cl::Device& device) {
    return propagated(device, {{127, 61}, {4 * um, 3 * um}, red_m, {0, 0}, 0.2 * mm}, 1, fft);
  });
  for (const auto backend : cl::all_backends)
    if (cl::serves(backend, info))
      add("by " + std::string(cl::name_of(backend)), [=](const cl::Device& device) {
        const Setup s{{60, 44}, {2 * um, 2 * um}, red_m, {10 * um, 5 * um}, 0.3 * mm};
        return propagated(device, s, 2, backend);
      });
  add("100 m, shift 50 m, tiny plane: exact or refused", [=](const cl::Device& device) {
    return exact_or_refused("samples too few directions", [&] {
      return propagated(device, {small, square(0.4 * um), red_m, {50, 0}, 100}, 2, fft);
    });
  });
  for (const int n : {1024, 4096, 16384})
    if (n == 1024 || size == SelfTestSize::full)
      add(text(ivec2(n)) + " samples: exact or refused", [=](const cl::Device& device) {
        return exact_or_refused(" asked", [&] { return plane_wave(device, n); });
      });
  return checks;
}

std::vector<SelfCheck> ray_and_level_checks(SelfTestSize size) {
  std::vector<SelfCheck> checks;
  for (const auto& [name, scale] : {std::pair("1 um", 1e-6), {"10 mm", 1e-2}, {"1 km", 1e3}})
    checks.push_back(
        {"rays", std::string("5,000 rays, soup of slivers, points, duplicates, ") + name,
         "wrong hits", 0,
         [scale = scale](const cl::Device& device) { return wrong_hits(device, scale); }});
  const std::size_t many = size == SelfTestSize::full ? 10'000'000 : 100'000;
  checks.push_back({"rays",
                    std::string(size == SelfTestSize::full ? "10,000,000" : "100,000") +
                        " rays at shared edges and vertices, 5 mm and 1 m",
                    "slipped through", 0,
                    [=](const cl::Device& device) { return cracks(device, many); }});
  checks.push_back(
      {"encode", "100,000 phases, zero, NaN and infinity", "wrong levels", 0, wrong_levels});
  return checks;
}

}  // namespace

std::vector<SelfCheck> part_checks(const cl::DeviceInfo& device, SelfTestSize size) {
  std::vector<SelfCheck> checks;
  for (auto& part : {arithmetic_checks(size), fft_checks(device, size),
                     propagation_checks(device, size), ray_and_level_checks(size)})
    checks.insert(checks.end(), part.begin(), part.end());
  return checks;
}

}  // namespace raywave::selftest
