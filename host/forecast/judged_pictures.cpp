// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/judged_pictures.hpp"

#include <algorithm>
#include <cmath>

namespace raywave {

std::vector<double> quality_depths_m(const Plan& plan) {
  std::vector<double> depths{plan.extent.near_m};
  const double nearest_m = std::abs(plan.extent.near_m);
  if (plan.extent.far_m - plan.extent.near_m > 1e-6 * nearest_m)
    depths.push_back(plan.extent.far_m);
  depths.push_back(
      plan.extent.near_m -
      std::min(std::max(0.1 * (plan.extent.far_m - plan.extent.near_m), 0.01 * nearest_m),
               0.5 * nearest_m));
  // No lens focuses on its own plane.
  for (double& depth : depths)
    if (std::abs(depth) < 1e-9) depth = plan.extent.closest_m;
  return depths;
}

}  // namespace raywave
