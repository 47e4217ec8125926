// SPDX-License-Identifier: Apache-2.0
/// Seconds that the stages of the pipeline take, by the wall's clock and by the processor's.
#pragma once

#include <chrono>
#include <ctime>
#include <map>
#include <string>

namespace raywave {

/// Seconds of each stage by its name; several clocks of one name add up.
struct StageTimes {
  std::map<std::string, double> wall_s;
  std::map<std::string, double> processor_s;  // of all threads of this process
};

/// Adds the time between its birth and its end to a stage.
///
/// Kernel launches return before their work is done: finish the device before the clock ends.
class StageClock {
public:
  StageClock(StageTimes& times, const char* stage)
      : wall_s_(times.wall_s[stage]), processor_s_(times.processor_s[stage]) {}
  ~StageClock() {
    using Seconds = std::chrono::duration<double>;
    wall_s_ += Seconds(std::chrono::steady_clock::now() - wall_start_).count();
    processor_s_ += processor_now_s() - processor_start_s_;
  }
  StageClock(const StageClock&) = delete;
  StageClock& operator=(const StageClock&) = delete;

private:
  static double processor_now_s() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  }

  double &wall_s_, &processor_s_;
  std::chrono::steady_clock::time_point wall_start_ = std::chrono::steady_clock::now();
  double processor_start_s_ = processor_now_s();
};

}  // namespace raywave
