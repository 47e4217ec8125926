// SPDX-License-Identifier: Apache-2.0
#include "host/cli/progress.hpp"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "host/common/text.hpp"
#include "host/forecast/cost.hpp"
#include "host/forecast/tuning.hpp"

namespace raywave::cli {

constexpr auto between_lines = std::chrono::seconds(10);

ProgressBar::ProgressBar(bool quiet)
    : on_terminal_(isatty(STDERR_FILENO)),
      active_(!quiet),
      last_(std::chrono::steady_clock::now()) {}

ProgressBar::~ProgressBar() {
  if (active_ && on_terminal_) std::fputs("\r\x1b[K", stderr);
}

void ProgressBar::say(const std::string& line) {
  if (active_)
    std::fprintf(stderr, "%sraywave: %s\n", on_terminal_ ? "\r\x1b[K" : "", line.c_str());
}

void ProgressBar::show(const std::string& what, double share) {
  if (!active_) return;
  if (!on_terminal_) {
    const auto now = std::chrono::steady_clock::now();
    if (now - last_ < between_lines) return;
    last_ = now;
    std::fprintf(stderr, "raywave: %3.0f %% %s\n", share * 100, what.c_str());
    return;
  }
  constexpr int width = 30;
  const int filled = static_cast<int>(std::clamp(share, 0.0, 1.0) * width);
  std::fprintf(stderr, "\r\x1b[K[%s%s] %3.0f %% %s",
               std::string(static_cast<std::size_t>(filled), '#').c_str(),
               std::string(static_cast<std::size_t>(width - filled), '.').c_str(), share * 100,
               what.c_str());
  std::fflush(stderr);
}

void say_time(ProgressBar& bar, double seconds, const std::string& what, const std::string& advice,
              double long_s) {
  if (seconds > long_s)
    bar.say(what + " will take about " + duration_text(two_digits(seconds)) + "; " + advice);
}

PlanNotes notes_of_render(ProgressBar& bar, const cl::DeviceInfo& device, std::size_t lasers,
                          const std::vector<Planned>& planned, const std::string& what) {
  return [&bar, &planned, rates = figures_of(device).rates, lasers, what, is_first = true](
             const Scene& scene, const World& world, const Plan& plan) mutable {
    if (std::exchange(is_first, false))
      say_time(bar, static_cast<double>(lasers) * predicted_s(scene, world, plan, rates), what,
               "raywave plan tells why, --preset draft or a larger sampling.pitch takes less");
    return render_warnings(planned, scene, world, plan);
  };
}

}  // namespace raywave::cli
