// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>

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

/// Says how long something takes where that is more than a minute.
///
/// what    "this", "the render"
/// advice  what takes less
void say_time(ProgressBar& bar, double seconds, const std::string& what, const std::string& advice);
/// The same of a render, as it is predicted.
void say_render_time(ProgressBar& bar, double seconds, const std::string& what = "this");

}  // namespace raywave::cli
