// SPDX-License-Identifier: Apache-2.0
/// The commands of the program `raywave`. Each adds its options to the parser and runs when the parser has met it; errors leave as
/// exceptions.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "cl/fft.hpp"

/// Options that commands share.
struct DeviceOptions {
  std::string device;
  std::string fft;

  void add_to(CLI::App& command);
  raywave::cl::DeviceInfo info() const;
  /// throws  InputError when the named back end is unknown, DeviceError when it does not serve the device
  raywave::cl::FftBackend backend(const raywave::cl::DeviceInfo& device) const;
};

void add_render(CLI::App& app);
void add_reconstruct(CLI::App& app);
void add_info(CLI::App& app);
void add_devices(CLI::App& app);
