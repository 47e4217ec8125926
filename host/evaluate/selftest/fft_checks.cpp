// SPDX-License-Identifier: Apache-2.0
// Checks of all FFT back ends that support the device, against direct sums and each other.
#include <algorithm>
#include <cmath>
#include <optional>

#include "cl/fft.hpp"
#include "host/evaluate/selftest/checks.hpp"
#include "host/reference/propagation.hpp"

namespace raywave::selftest {
namespace {

using reference::Field;

/// Bound c eps sqrt(log2 n) of rounding errors in an FFT; c is measured in tests/cl/fft.cpp and has
/// a margin.
double tolerance(glm::ivec2 size) {
  return 1.5 * 0x1p-24 * std::sqrt(1 + std::log2(static_cast<double>(size.x) * size.y));
}

Field transformed(const cl::Device& device, cl::Fft& fft, const Field& plane, int sign) {
  cl::ComplexBuffer buffer(device, reference::to_float(plane), "plane");
  sign < 0 ? fft.forward(buffer) : fft.inverse(buffer);
  return reference::to_double(buffer.read());
}

/// The first live.y rows and live.x columns.
Field corner(const Field& plane, glm::ivec2 size, glm::ivec2 live) {
  Field part;
  for (int y = 0; y < live.y; ++y)
    part.insert(part.end(), plane.begin() + y * size.x, plane.begin() + y * size.x + live.x);
  return part;
}

cl::FftShape shape_of(glm::ivec2 size, glm::ivec2 live) {
  const auto n = [](int value) { return static_cast<std::size_t>(value); };
  return {n(size.x), n(size.y), n(live.x), n(live.y)};
}

Finding against_direct_sum(const cl::Device& device, cl::FftBackend backend, glm::ivec2 size,
                           glm::ivec2 live) {
  const auto fft = cl::make_fft(device, backend, shape_of(size, live));
  auto field = reference::to_double(reference::noise(size, 1));
  for (int y = 0; y < size.y; ++y)
    for (int x = 0; x < size.x; ++x)
      if (x >= live.x || y >= live.y) field[y * size.x + x] = 0;
  const auto spectrum = reference::to_double(reference::noise(size, 2));
  const double forward = reference::relative_error(transformed(device, *fft, field, -1),
                                                   reference::direct_transform(field, size, -1));
  const double inverse =
      reference::relative_error(corner(transformed(device, *fft, spectrum, 1), size, live),
                                corner(reference::direct_transform(spectrum, size, 1), size, live));
  return {std::max(forward, inverse), ""};
}

std::string text(glm::ivec2 size) {
  return std::to_string(size.x) + " x " + std::to_string(size.y);
}

}  // namespace

std::vector<SelfCheck> fft_checks(const cl::DeviceInfo& info, SelfTestSize size) {
  std::vector<SelfCheck> checks;
  // The host FFT is checked as part of the propagation.
  for (const auto backend : {cl::FftBackend::clfft, cl::FftBackend::vkfft}) {
    if (!cl::serves(backend, info)) continue;
    const std::string name(cl::name_of(backend));
    // clFFT takes seconds for a new shape and supports only products of 2, 3, 5 and 7.
    std::vector<glm::ivec2> sizes{{1, 7}, {12, 18}, {60, 35}};
    if (size == SelfTestSize::full) sizes.insert(sizes.end(), {{1, 1}, {7, 1}, {105, 63}});
    for (const auto n : sizes)
      checks.push_back(
          {"FFT", name + ", " + text(n) + ", against the direct sum", "relative L2", tolerance(n),
           [=](const cl::Device& device) { return against_direct_sum(device, backend, n, n); }});
    const glm::ivec2 n{60, 35}, live{31, 18};
    checks.push_back(
        {"FFT", name + ", " + text(live) + " live of " + text(n) + ", against the direct sum",
         "relative L2", tolerance(n),
         [=](const cl::Device& device) { return against_direct_sum(device, backend, n, live); }});
    if (backend == cl::FftBackend::vkfft) continue;  // supports any size
    checks.push_back(
        {"FFT", name + " refuses 17 x 4", "refusals lost", 0, [=](const cl::Device& device) {
           return refused("products of 2, 3, 5, 7", [&] {
             cl::make_fft(device, backend, shape_of({17, 4}, {17, 4}));
           });
         }});
  }
  return checks;
}

}  // namespace raywave::selftest
