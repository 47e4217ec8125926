// SPDX-License-Identifier: Apache-2.0
/// What raywave's kernels and its FFTs are worth on one device: every part held against double
/// precision on the host, and pushed to the limits that users push it to (docs/selftest.md).
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "cl/device.hpp"

namespace raywave {

/// What a check saw.
struct Finding {
  double measured = 0;  // 0 where a refusal is what is wanted, and it came with the right words
  std::string note;     // the words of a refusal, or what explains the number
};

/// A claim about a device.
struct SelfCheck {
  std::string part;      // "FFT", "rays", ...
  std::string claim;     // "clfft, 60 x 35, against the direct sum"
  std::string quantity;  // what is measured, with its unit: "relative L2", "turns", "rays lost"
  double bound = 0;      // of `measured`
  std::function<Finding(const cl::Device&)> measure;
};

struct SelfTestRow {
  std::string part, claim, quantity;
  double bound = 0, measured = 0;
  bool passed = false;
  double seconds = 0;
  std::string note;
};

enum class SelfTestSize {
  quick,  // seconds
  full,   // minutes: every float, millions of rays, large planes
};

/// All checks for a device, in the order of the pipeline, then the extremes.
std::vector<SelfCheck> self_checks(const cl::DeviceInfo& device, SelfTestSize size);

/// Measures. The row passes when the measurement is no larger than the bound; NaN and whatever is
/// thrown fail it.
SelfTestRow run(const SelfCheck& check, const cl::Device& device);

bool all_passed(const std::vector<SelfTestRow>& rows);

/// "raywave 0.1.0 on <device> ..., <date>": what the table was made with.
std::string self_test_header(const cl::DeviceInfo& device, SelfTestSize size);

/// A row as a line of the table, with its note in a line of its own where it failed.
std::string self_test_line(const SelfTestRow& row);

/// Everything, for machines.
std::string self_test_json(const cl::DeviceInfo& device, SelfTestSize size,
                           const std::vector<SelfTestRow>& rows);

}  // namespace raywave
