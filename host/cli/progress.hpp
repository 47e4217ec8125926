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

/// Says how long a render is predicted to take where that is more than a minute.
void say_time(ProgressBar& bar, double seconds);

}  // namespace raywave::cli
