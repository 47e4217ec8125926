// SPDX-License-Identifier: Apache-2.0
/// Accuracy of raywave's kernels and FFTs on one device: every part is compared with double
/// precision on the host, up to the limits of ordinary use (docs/selftest.md).
#pragma once

#include <string>
#include <vector>

#include "host/evaluate/selftest/checks.hpp"

namespace raywave {

struct SelfTestRow {
  std::string part, claim, quantity;
  double bound = 0, measured = 0;
  bool passed = false;
  double seconds = 0;
  std::string note;
};

/// All checks for a device, in the order of the pipeline, then the extremes.
std::vector<SelfCheck> self_checks(const cl::DeviceInfo& device, SelfTestSize size);

/// Runs a check. The row passes when the measurement is at most the bound; NaN and exceptions fail
/// it.
SelfTestRow run(const SelfCheck& check, const cl::Device& device);

bool all_passed(const std::vector<SelfTestRow>& rows);

/// The table's header: version, size of the self-test, date and device.
std::string self_test_header(const cl::DeviceInfo& device, SelfTestSize size);

/// A row as a line of the table, with its note in a line of its own where it failed.
std::string self_test_line(const SelfTestRow& row);

/// Everything, for machines.
std::string self_test_json(const cl::DeviceInfo& device, SelfTestSize size,
                           const std::vector<SelfTestRow>& rows);

}  // namespace raywave
