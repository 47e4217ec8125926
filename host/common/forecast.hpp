// SPDX-License-Identifier: Apache-2.0
/// How long steps of equal cost will take, by the rate of the first of them.
#pragma once

#include <chrono>
#include <optional>

namespace raywave {

class Forecast {
public:
  /// Takes note of what is done. The first call starts the clock: what was compiled before it does
  /// not count.
  ///
  /// done     steps, with the share of the one at work
  /// steps    in all
  /// now_s    of any clock
  /// returns  the seconds from the first call to the last step, once: at the end of the first step,
  ///          as its beginning may be lighter than the rest of it, but after 10 to 30 s
  std::optional<double> add(double done, double steps, double now_s) {
    constexpr double least_s = 10, most_s = 30;
    if (is_told_) return {};
    if (!start_) start_ = {done, now_s};
    const double seconds = now_s - start_->now_s, part = done - start_->done;
    if (seconds < least_s || (done < 1 && seconds < most_s) || !(part > 0)) return {};
    is_told_ = true;
    return seconds / part * (steps - start_->done);
  }
  std::optional<double> add(double done, double steps) {
    const std::chrono::duration<double> now = std::chrono::steady_clock::now().time_since_epoch();
    return add(done, steps, now.count());
  }

private:
  struct Start {
    double done, now_s;
  };
  std::optional<Start> start_;
  bool is_told_ = false;
};

}  // namespace raywave
