// SPDX-License-Identifier: Apache-2.0
/// --quality, --budget and --psnr.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "host/plan/presets.hpp"

namespace raywave::cli {

struct GoalOptions {
  std::string quality, budget;
  std::optional<double> psnr_db;

  void add_to(CLI::App& command);
  /// throws  InputError when a text is no quality, or no time
  Goal goal() const;
};

}  // namespace raywave::cli
