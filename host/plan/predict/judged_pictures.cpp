// SPDX-License-Identifier: Apache-2.0
#include "host/plan/predict/judged_pictures.hpp"

#include <algorithm>

namespace raywave {

std::vector<double> quality_depths_m(const Plan& plan) {
  std::vector<double> depths{plan.near_m};
  if (plan.far_m - plan.near_m > 1e-6 * plan.near_m) depths.push_back(plan.far_m);
  depths.push_back(
      plan.near_m -
      std::min(std::max(0.1 * (plan.far_m - plan.near_m), 0.01 * plan.near_m), 0.5 * plan.near_m));
  return depths;
}

}  // namespace raywave
