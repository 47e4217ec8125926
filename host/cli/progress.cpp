// SPDX-License-Identifier: Apache-2.0
#include "host/cli/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace raywave::cli {

ProgressBar::ProgressBar(bool quiet) : active_(!quiet && isatty(STDERR_FILENO)) {}

ProgressBar::~ProgressBar() {
  if (active_) std::fputs("\r\x1b[K", stderr);
}

void ProgressBar::show(const std::string& what, double share) {
  if (!active_) return;
  constexpr int width = 30;
  const int filled = static_cast<int>(std::clamp(share, 0.0, 1.0) * width);
  std::fprintf(stderr, "\r\x1b[K[%s%s] %3.0f %% %s",
               std::string(static_cast<std::size_t>(filled), '#').c_str(),
               std::string(static_cast<std::size_t>(width - filled), '.').c_str(), share * 100,
               what.c_str());
  std::fflush(stderr);
}

}  // namespace raywave::cli
