// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

#include "cl/device.hpp"
#include "host/forecast/presets.hpp"
#include "host/render.hpp"

namespace raywave::cli {

/// What is going on and how far: a line on a terminal that changes; a line every ten seconds where
/// standard error is a pipe or a file.
class ProgressBar {
public:
  explicit ProgressBar(bool quiet);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void show(const std::string& what, double share);
  /// Prints a line above the bar.
  void say(const std::string& line);

private:
  bool on_terminal_, active_;
  std::chrono::steady_clock::time_point last_;
};

/// Says how long something takes where that is long.
///
/// what    "this", "the render"
/// advice  what takes less
void say_time(ProgressBar& bar, double seconds, const std::string& what, const std::string& advice,
              double long_s = 60);
/// RenderOptions::planned that says the same of a render, as it is predicted for all its lasers,
/// and returns render_warnings.
///
/// planned  of a goal, or empty; lives as long as what is returned
PlanNotes notes_of_render(ProgressBar& bar, const cl::DeviceInfo& device, std::size_t lasers,
                          const std::vector<Planned>& planned, const std::string& what = "this");

}  // namespace raywave::cli
