// SPDX-License-Identifier: Apache-2.0
/// Wall time and processor time of all threads, since its birth.
#pragma once

#include <chrono>
#include <ctime>
#include <vector>

namespace raywave {

class Stopwatch {
public:
  double wall_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }
  double processor_s() const { return process_s() - processor_start_; }

private:
  static double process_s() {
    std::timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  }

  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double processor_start_ = process_s();
};

/// Calls f and adds its wall time to `seconds`.
template <class F>
auto timed(double& seconds, F&& f) {
  const Stopwatch watch;
  auto result = f();
  seconds += watch.wall_s();
  return result;
}

// Median and quartiles of repeated measurements.

/// Median and quartiles, in the unit of the values.
struct Spread {
  double median = 0, low = 0, high = 0;
};

/// Quantiles are linear between neighbouring values; all are zero when there is no value.
Spread spread_of(std::vector<double> values);

}  // namespace raywave
