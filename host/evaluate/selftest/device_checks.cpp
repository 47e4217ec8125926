// SPDX-License-Identifier: Apache-2.0
// Checks of the layout of shared structs and of the phase functions that all kernels use.
#include "host/evaluate/selftest/checks.hpp"
#include "host/evaluate/selftest/selfcheck.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave::selftest {
std::vector<SelfCheck> device_checks(SelfTestSize size) {
  std::vector<SelfCheck> checks;
  checks.push_back({"layout", "members of shared structs lie where the host has them", "misplaced",
                    0, [](const cl::Device& device) {
                      const auto misplaced = misplaced_members(device);
                      return Finding{static_cast<double>(misplaced.size()),
                                     misplaced.empty() ? "" : misplaced.front()};
                    }});
  if (size == SelfTestSize::full) {
    checks.push_back(
        {"phase", "sine and cosine of every float from -0.5 to 0.5 turns", "absolute",
         cos_sin_bound, [](const cl::Device& device) {
           return Finding{cos_sin_error_everywhere(device, lanes_for(device.info())), ""};
         }});
  }
  checks.push_back(
      {"phase", "sine and cosine, 200,000 arguments, folds and largest ones", "absolute",
       cos_sin_bound, [](const cl::Device& device) {
         return Finding{cos_sin_error(device, lanes_for(device.info()), cos_sin_arguments()), ""};
       }});
  return checks;
}

}  // namespace raywave::selftest
