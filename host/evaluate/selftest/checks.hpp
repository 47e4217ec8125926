// SPDX-License-Identifier: Apache-2.0
/// The parts that make up self_checks(), a file each, and what they share. A check more is a line
/// more in its part's list.
#pragma once

#include <complex>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "cl/device.hpp"
#include "host/common/error.hpp"
#include "host/common/fft_backend.hpp"
#include "host/reference/stage.hpp"

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
  std::string quantity;  // what is measured, with its unit: "relative L2", "turns", "rays lost"
  double bound = 0;      // of `measured`
  std::function<Finding(const cl::Device&)> measure;
};

enum class SelfTestSize {
  quick,  // seconds
  full,   // minutes: every float, millions of rays, large planes
};

namespace selftest {

std::vector<SelfCheck> device_checks(SelfTestSize size);
std::vector<SelfCheck> fft_checks(const cl::DeviceInfo& device, SelfTestSize size);
std::vector<SelfCheck> propagation_checks(SelfTestSize size);
std::vector<SelfCheck> ray_checks(SelfTestSize size);
std::vector<SelfCheck> light_checks();
std::vector<SelfCheck> optics_extremes(SelfTestSize size);
std::vector<SelfCheck> scene_extremes(SelfTestSize size);

/// The finding of a check in which `action` must be refused with these words.
template <class Action>
Finding refused(const std::string& words, Action&& action) {
  std::string message;
  try {
    action();
  } catch (const InputError& error) {
    message = error.what();
  } catch (const cl::DeviceError& error) {
    message = error.what();
  }
  if (message.empty()) return {1, "not refused"};
  return {message.find(words) == std::string::npos ? 1.0 : 0.0, "refused: " + message};
}

/// The finding of `measure`, or 0 when it is refused with these words.
template <class Measure>
Finding exact_or_refused(const std::string& words, Measure&& measure) {
  Finding found;
  auto refusal = refused(words, [&] { found = measure(); });
  return refusal.note == "not refused" ? found : refusal;
}

/// Error of a hologram (its first tile) over virtual planes against the same computation in double,
/// at 100 pixels.
///
/// propagation  compact, or automatic: 0 with a note where virtual planes do not serve
Finding over_virtual_planes(const cl::Device& device, reference::Stage stage,
                            WrpPropagation propagation, FftBackend fft);

/// throws  std::runtime_error when a sample is NaN or infinite
void require_finite(std::span<const std::complex<float>> field, const char* what);

}  // namespace selftest
}  // namespace raywave
