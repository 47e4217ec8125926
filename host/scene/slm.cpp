// SPDX-License-Identifier: Apache-2.0
#include "host/scene/slm.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave {
namespace {

std::string size_text(int width, int height) {
  return std::to_string(width) + " x " + std::to_string(height);
}

}  // namespace

double Illumination::turns(glm::dvec2 at_m, double wavelength_m) const {
  if (!focus_m) return glm::dot(sine, at_m) / wavelength_m;
  // The differences of squared distances over their sum: nothing large is subtracted.
  const glm::dvec2 focus = *focus_m * sine;
  const double to_middle = std::abs(*focus_m),
               from_there = std::sqrt(std::max(
                   0.0, to_middle * to_middle + glm::dot(at_m, at_m) - 2 * glm::dot(at_m, focus))),
               longer =
                   (glm::dot(at_m, at_m) - 2 * glm::dot(at_m, focus)) / (from_there + to_middle);
  return (*focus_m > 0 ? -longer : longer) / wavelength_m;
}

glm::dvec2 Illumination::curvature_per_m() const {
  return focus_m ? (1.0 - sine * sine) / *focus_m : glm::dvec2(0);
}

glm::dvec2 carrier_of(const SlmSpec& slm, glm::dvec2 pitch_m, double wavelength_m) {
  if (slm.shift_m == glm::dvec2(0)) return slm.carrier;
  // Light of direction cosine s along x advances by s pitch / wavelength per pixel. It comes from
  // behind the SLM: what moves the picture to +x in the plane z turns the light towards -x.
  const double distance_m = std::hypot(slm.shift_m.x, slm.shift_m.y, slm.shift_distance_m);
  const auto carrier = -slm.shift_m / distance_m * pitch_m / wavelength_m;
  if (std::max(std::abs(carrier.x), std::abs(carrier.y)) > 0.5)
    throw InputError("slm.shift: " + length_text(slm.shift_m.x) + ", " +
                     length_text(slm.shift_m.y) + " at " + length_text(slm.shift_distance_m) +
                     " needs a carrier of " + number_text(carrier.x) + ", " +
                     number_text(carrier.y) +
                     " cycles per pixel, and pixels show at most 0.5; give a smaller shift");
  return carrier;
}

glm::dvec2 own_carrier_of(Encoding encoding) {
  return encoding == Encoding::burckhardt ? glm::dvec2(-1.0 / 3, 0) : glm::dvec2(0);
}

void require_fit(const FlatnessSpec& flatness, glm::ivec2 size_px) {
  const auto& picture = flatness.picture;
  if (picture.pixels.empty() || flatness.centre ||
      (picture.width == size_px.x && picture.height == size_px.y))
    return;
  throw InputError(flatness.where + ": the picture is " + size_text(picture.width, picture.height) +
                   ", the SLM " + size_text(size_px.x, size_px.y) +
                   "; give flatness_fit = \"centre\" to crop or pad it around its middle");
}

std::string name_of(Encoding encoding) {
  for (const auto& [name, value] : encodings)
    if (value == encoding) return name;
  return "";
}

}  // namespace raywave
