// SPDX-License-Identifier: Apache-2.0
#include "host/scene/eyepiece.hpp"

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

double dioptres_of_depth(const ViewerSpec& viewer, double z_m) {
  return 1 / (z_m + viewer.eyepiece_distance_m) - 1 / viewer.eyepiece_m.value();
}

}  // namespace raywave
