// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace raywave::cli {

/// One line on a terminal that shows what is going on and how far; nothing at all when standard
/// error is no terminal.
class ProgressBar {
public:
  explicit ProgressBar(bool quiet);
  ~ProgressBar();
  ProgressBar(const ProgressBar&) = delete;
  ProgressBar& operator=(const ProgressBar&) = delete;

  void show(const std::string& what, double share);

private:
  bool active_;
};

}  // namespace raywave::cli
