// SPDX-License-Identifier: Apache-2.0
/// Accuracy of raywave's kernels and FFTs on one device: parts and whole holograms against double
/// precision on the host (host/reference/), up to the limits of ordinary use.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "cl/device.hpp"
#include "host/common/error.hpp"

namespace raywave {

/// The result of a check.
struct Finding {
  double measured = 0;  // 0 where a refusal is wanted and came with the right words
  std::string note;     // the words of a refusal, or what explains the number
};

/// A claim about a device.
struct SelfCheck {
  std::string part;      // "FFT", "rays", ...
  std::string claim;     // "clfft, 60 x 35, against the direct sum"
  std::string quantity;  // what is measured, with its unit: "relative L2", "rays lost"
  double bound = 0;      // largest `measured` that passes
  std::function<Finding(const cl::Device&)> measure;
};

enum class SelfTestSize {
  quick,  // seconds
  full,   // minutes: every float, millions of rays, large planes
};

struct SelfTestRow {
  std::string part, claim, quantity;
  double bound = 0, measured = 0;
  bool passed = false;
  double seconds = 0;
  std::string note;
};

/// All checks for a device, in the order of the pipeline.
std::vector<SelfCheck> self_checks(const cl::DeviceInfo& device, SelfTestSize size);

/// Runs a check. The row passes when the measurement is at most the bound; NaN and exceptions fail
/// it.
SelfTestRow run(const SelfCheck& check, const cl::Device& device);

bool all_passed(const std::vector<SelfTestRow>& rows);

/// The table's header: version, size of the self-test, date and device.
std::string self_test_header(const cl::DeviceInfo& device, SelfTestSize size);

/// A row as a line of the table, with its note in a line of its own where it failed.
std::string self_test_line(const SelfTestRow& row);

/// A scene at a limit, by the carrier that planning takes for it.
struct Extreme {
  std::string name, carrier;
  double measured = 0, bound = 0;  // relative L2 error of the field
};

/// Of the rows of scenes that were computed with every carrier, in their order.
std::vector<Extreme> extremes_of(const std::vector<SelfTestRow>& rows);

/// A line each, with the factor that is left to the bound; empty where there are none.
std::string extremes_text(const std::vector<SelfTestRow>& rows);

/// Everything, for machines.
std::string self_test_json(const cl::DeviceInfo& device, SelfTestSize size,
                           const std::vector<SelfTestRow>& rows);

namespace selftest {

/// What claims of a scene over virtual planes end with; those over WRPs have the same beginning.
inline constexpr std::string_view if_planned = ", if planned";
/// What notes of such a claim begin with where planning takes another carrier.
inline constexpr std::string_view not_over_planes = "over WRPs: ";

/// Parts of the pipeline by themselves. A check more is a line more in its part's list.
std::vector<SelfCheck> part_checks(const cl::DeviceInfo& device, SelfTestSize size);
/// Samples, lens pictures and whole holograms of small scenes.
std::vector<SelfCheck> scene_checks();

/// The finding of `measure`, or 0 when it is refused with these words.
template <class Measure>
Finding exact_or_refused(const std::string& words, Measure&& measure) {
  std::string message;
  try {
    return measure();
  } catch (const InputError& error) {
    message = error.what();
  } catch (const cl::DeviceError& error) {
    message = error.what();
  }
  return {message.find(words) == std::string::npos ? 1.0 : 0.0, "refused: " + message};
}

}  // namespace selftest
}  // namespace raywave
