// SPDX-License-Identifier: Apache-2.0
/// Seconds that the stages of the pipeline take, by the wall's clock and by the processor's. What
/// drivers compile meanwhile is a stage of its own.
#pragma once

#include <chrono>
#include <ctime>
#include <map>
#include <string>

namespace raywave {

/// Seconds by both clocks.
struct Seconds {
  double wall = 0, processor = 0;  // the latter of all threads of this process

  /// Since some moment in the past
  static Seconds now() {
    timespec processor{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &processor);
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now().time_since_epoch();
    return {wall.count(),
            static_cast<double>(processor.tv_sec) + 1e-9 * static_cast<double>(processor.tv_nsec)};
  }
  Seconds& operator+=(const Seconds& more) {
    wall += more.wall;
    processor += more.processor;
    return *this;
  }
  friend Seconds operator-(const Seconds& a, const Seconds& b) {
    return {a.wall - b.wall, a.processor - b.processor};
  }
};

/// Seconds of each stage by its name; several clocks of one name add up.
struct StageTimes {
  std::map<std::string, double> wall_s;
  std::map<std::string, double> processor_s;

  void add(const char* stage, const Seconds& seconds) {
    wall_s[stage] += seconds.wall;
    processor_s[stage] += seconds.processor;
  }
};

/// Time that this thread waited for drivers that compile kernels. Which launch compiles is up to
/// them, so that every stage may.
inline thread_local Seconds compiling;

/// Counts the time between its birth and its end as time of compiling.
class CompileClock {
public:
  CompileClock() = default;
  ~CompileClock() { compiling += Seconds::now() - start_; }
  CompileClock(const CompileClock&) = delete;
  CompileClock& operator=(const CompileClock&) = delete;

private:
  Seconds start_ = Seconds::now();
};

/// Adds the time between its birth and its end to a stage, but for what was compiled to "kernels".
/// Clocks of stages do not overlap.
///
/// Kernel launches return before their work is done: finish the device before the clock ends.
class StageClock {
public:
  StageClock(StageTimes& times, const char* stage) : times_(times), stage_(stage) {}
  ~StageClock() {
    const auto compiled = compiling - compiled_before_;
    times_.add(stage_, Seconds::now() - start_ - compiled);
    if (compiled.wall > 0) times_.add("kernels", compiled);
  }
  StageClock(const StageClock&) = delete;
  StageClock& operator=(const StageClock&) = delete;

private:
  StageTimes& times_;
  const char* stage_;
  Seconds compiled_before_ = compiling, start_ = Seconds::now();
};

}  // namespace raywave
