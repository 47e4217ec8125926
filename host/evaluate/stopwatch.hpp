// SPDX-License-Identifier: Apache-2.0
/// Wall time and processor time of all threads, since its birth.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host/common/stage_clock.hpp"

namespace raywave {

class Stopwatch {
public:
  double wall_s() const { return (Seconds::now() - start_).wall; }
  double processor_s() const { return (Seconds::now() - start_).processor; }

private:
  Seconds start_ = Seconds::now();
};

/// Seconds of a stage; 0 where it was not at work.
inline double seconds_of(const std::map<std::string, double>& stages, const std::string& stage) {
  const auto found = stages.find(stage);
  return found == stages.end() ? 0 : found->second;
}

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
