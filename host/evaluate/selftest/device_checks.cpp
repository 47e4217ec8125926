// SPDX-License-Identifier: Apache-2.0
// Layout of shared structs, and the phase functions that all kernels share.
#include <cmath>
#include <random>

#include "host/evaluate/selftest/checks.hpp"
#include "host/evaluate/selftest/selfcheck.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave::selftest {
namespace {

/// Evenly spread over the decades up to `longest_m`, and round numbers.
std::vector<float> lengths_up_to(float longest_m) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> exponent(-8, 0);
  std::vector<float> lengths_m{0.0f, longest_m, -longest_m, 0.1f * longest_m};
  while (lengths_m.size() < 1 << 16)
    lengths_m.push_back(longest_m * std::pow(10.0f, exponent(random)));
  return lengths_m;
}

SelfCheck length_check(const char* claim, float longest_m, double wavelength_m, double bound) {
  return {"phase", claim, "turns", bound, [=](const cl::Device& device) {
            return Finding{length_turns_error(device, lanes_for(device.info()),
                                              lengths_up_to(longest_m), wavelength_m),
                           ""};
          }};
}

}  // namespace

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
  checks.push_back(length_check("length to turns, 638 nm, up to 1 m", 1, 638e-9, 5e-8));
  checks.push_back(length_check("length to turns, 10 nm, up to 1 cm", 0.01f, 10e-9, 5e-8));
  checks.push_back(length_check("length to turns, 1 mm, up to 100 m", 100, 1e-3, 5e-8));
  return checks;
}

}  // namespace raywave::selftest
