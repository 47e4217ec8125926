// SPDX-License-Identifier: Apache-2.0
/// The commands of the program `raywave`. Each adds its options to the parser and runs when the
/// parser has met it; errors leave as exceptions.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "cl/fft.hpp"
#include "host/plan/plan.hpp"

namespace raywave::cli {

/// Options that commands share.
struct DeviceOptions {
  std::string device;
  std::string fft;

  void add_device_to(CLI::App& command);
  void add_to(CLI::App& command);  // and --fft
  /// In the work shape that `raywave tune` has stored for it, if any.
  /// throws  InputError when that file is damaged, DeviceError when there is no such device
  cl::DeviceInfo info() const;
  /// throws  InputError when the named back end is unknown, DeviceError when it does not serve the
  ///         device
  cl::FftBackend backend(const cl::DeviceInfo& device) const;
};

/// "wrp", "points" or "rays"
/// throws  InputError for anything else
Method method_of(const std::string& name);

void add_render(CLI::App& app);
void add_reconstruct(CLI::App& app);
void add_lens(CLI::App& app);
void add_compare(CLI::App& app);
void add_quality(CLI::App& app);
void add_plan(CLI::App& app);
void add_tune(CLI::App& app);
void add_devices(CLI::App& app);
void add_selftest(CLI::App& app);
void add_kernels(CLI::App& app);
void add_bench(CLI::App& app);
void add_trade(CLI::App& app);

}  // namespace raywave::cli
