// SPDX-License-Identifier: Apache-2.0
/// Seconds that the stages of the pipeline take, by the wall's clock and by the processor's. What
/// drivers compile meanwhile is a stage of its own.
#pragma once

#include <chrono>
#include <ctime>
#include <map>
#include <optional>
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

// How long steps of equal cost will take, by the rate of the first of them.

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
    return add(done, steps, Seconds::now().wall);
  }

private:
  struct Start {
    double done, now_s;
  };
  std::optional<Start> start_;
  bool is_told_ = false;
};

}  // namespace raywave
