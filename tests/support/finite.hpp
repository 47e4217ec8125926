// SPDX-License-Identifier: Apache-2.0
/// Checks for NaN and infinity in all outputs.
#pragma once

#include <algorithm>
#include <cmath>
#include <complex>
#include <nlohmann/json.hpp>
#include <span>
#include <string>

#include "host/evaluate/report.hpp"
#include "host/geometry/shared_types.hpp"
#include "host/render.hpp"
#include "host/scene/image.hpp"

namespace raywave::test {

inline bool finite(double value) { return std::isfinite(value); }
inline bool finite(std::complex<float> z) {
  return std::isfinite(z.real()) && std::isfinite(z.imag());
}

inline bool finite(const device::Sample& s) {
  const float numbers[] = {s.x,      s.y,      s.z,        s.nx,       s.ny,
                           s.nz,     s.weight, s.radiance, s.specular, s.shininess,
                           s.tilt_x, s.tilt_y, s.tilt_z};
  return std::all_of(std::begin(numbers), std::end(numbers),
                     [](float v) { return std::isfinite(v); });
}

template <class Range>
bool all_finite_in(const Range& range) {
  return std::all_of(std::begin(range), std::end(range),
                     [](const auto& value) { return finite(value); });
}

inline bool finite(const Image& image) { return all_finite_in(image.pixels); }

/// The outputs of a render that hold NaN or infinity, as text; "" when all numbers are finite. JSON
/// has null in place of NaN and infinity.
inline std::string not_finite(const Scene& scene, const RenderResult& result,
                              const cl::Device& device) {
  if (!all_finite_in(result.field.samples)) return "field";
  for (const auto& wrp : result.wrps) {
    if (!all_finite_in(wrp.samples)) return "field of a WRP";
  }
  if (render_report_json(scene, result, device.info(), cl::FftBackend::host).dump().find("null") !=
      std::string::npos)
    return "report.json";
  return "";
}

}  // namespace raywave::test
