// SPDX-License-Identifier: Apache-2.0
#include "host/scene/eyepiece.hpp"

#include <algorithm>
#include <numbers>

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave {

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

double dioptres_of_depth(const ViewerSpec& viewer, double z_m) {
  return 1 / (z_m + viewer.eyepiece_distance_m) - 1 / viewer.eyepiece_m.value();
}

}  // namespace raywave
