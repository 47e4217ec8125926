// SPDX-License-Identifier: Apache-2.0
#include "host/scene/scene.hpp"

#include <cmath>
#include <numbers>

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave {

int channel_of(double wavelength_m) {
  if (wavelength_m >= 580e-9) return 0;
  return wavelength_m >= 490e-9 ? 1 : 2;
}

double Spectrum::at(double wavelength_m) const {
  if (table.empty()) return channels[channel_of(wavelength_m)];
  const auto after = std::upper_bound(
      table.begin(), table.end(), wavelength_m,
      [](double wanted, const std::pair<double, double>& entry) { return wanted < entry.first; });
  if (after == table.begin()) return table.front().second;
  if (after == table.end()) return table.back().second;
  const auto [low_m, low] = *(after - 1);
  const auto [high_m, high] = *after;
  const auto squared = [](double length_m) { return 1 / (length_m * length_m); };
  const double share =
      (squared(wavelength_m) - squared(low_m)) / (squared(high_m) - squared(low_m));
  return low + share * (high - low);
}

bool Spectrum::holds(double wavelength_m) const {
  return table.empty() ||
         (table.front().first <= wavelength_m && wavelength_m <= table.back().first);
}

bool Spectrum::is_positive() const {
  if (table.empty()) return channels.x > 0 || channels.y > 0 || channels.z > 0;
  return std::any_of(table.begin(), table.end(),
                     [](const auto& entry) { return entry.second > 0; });
}

double depth_of_dioptres(const ViewerSpec& viewer, double dioptres) {
  if (!viewer.eyepiece_m)
    throw InputError(
        "dioptres are seen through an eyepiece; give viewer.eyepiece of the scene, for example "
        "\"120 mm\", reconstruct's --eyepiece 120mm, or a length");
  const double per_m = 1 / *viewer.eyepiece_m + dioptres;
  if (!(per_m > 0))
    throw InputError("no plane is seen at " + number_text(dioptres) + " D through an eyepiece of " +
                     length_text(*viewer.eyepiece_m));
  return 1 / per_m - viewer.eyepiece_distance_m;
}

double detail_for_eye_m(const ViewerSpec& viewer, double z_m) {
  constexpr double arc_minute = std::numbers::pi / 180 / 60;
  const double eye_m = viewer.eyepiece_m ? viewer.eyepiece_distance_m : viewer.distance_m;
  // Real images before the hologram are nearer to the eye
  return arc_minute * std::max(eye_m + z_m, eye_m / 4);
}

Pupil pupil_at(const ViewerSpec& viewer, glm::dvec2 place_m) {
  Pupil pupil{viewer.pupil_m, place_m, 1, viewer.distance_m};
  if (viewer.eyepiece_m) {
    const double focal_m = *viewer.eyepiece_m, lens_m = viewer.eyepiece_distance_m,
                 eye_m = viewer.eye_relief_m;
    pupil.a = 1 - eye_m / focal_m;
    pupil.b_m = lens_m + eye_m - lens_m * eye_m / focal_m;
  }
  if (!(std::abs(pupil.b_m) >= 1e-6))
    throw InputError(viewer.eyepiece_m ? "viewer: the eyepiece images the hologram into the pupil; "
                                         "give another eye_relief or eyepiece_distance"
                                       : "viewer: the pupil stands in the hologram's plane; give a "
                                         "distance > 0");
  return pupil;
}

std::vector<Pupil> pupils_of(const ViewerSpec& viewer) {
  std::vector<Pupil> pupils;
  for (const auto& place_m : viewer.pupil_places_m) pupils.push_back(pupil_at(viewer, place_m));
  if (pupils.empty()) pupils.push_back(pupil_at(viewer, {0, 0}));
  return pupils;
}

double dioptres_of_depth(const ViewerSpec& viewer, double z_m) {
  return 1 / (z_m + viewer.eyepiece_distance_m) - 1 / viewer.eyepiece_m.value();
}

}  // namespace raywave
