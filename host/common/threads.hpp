// SPDX-License-Identifier: Apache-2.0
/// A pool of host threads that wait for work: passes of a few milliseconds start no threads.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace raywave::cl {

/// A pool of `count` threads, the calling thread included. Calls of run() from several threads
/// take turns.
class Threads {
public:
  /// The program's pool: one thread per processor of the host.
  static Threads& shared();

  explicit Threads(std::size_t count);
  ~Threads();
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;

  std::size_t count() const { return others_.size() + 1; }

  /// Calls work(0), ..., work(threads - 1) at the same time and waits for all. `threads` is at most
  /// count(), and `work` must not throw.
  void run(std::size_t threads, const std::function<void(std::size_t)>& work);

  /// Calls work(thread, i) for i = 0, ..., count - 1. Each thread takes `grain` numbers at a time.
  /// What the work of a number throws, is thrown at the end; of several, that of one.
  template <class F>
  void for_each(std::size_t threads, std::size_t count, std::size_t grain, const F& work) {
    std::atomic<std::size_t> next = 0;
    std::mutex one_failure;
    std::exception_ptr failure;
    run(threads, [&](std::size_t thread) {
      try {
        for (std::size_t first; (first = next.fetch_add(grain)) < count;) {
          for (std::size_t i = first; i < std::min(first + grain, count); ++i) work(thread, i);
        }
      } catch (...) {
        const std::lock_guard lock(one_failure);
        failure = std::current_exception();
      }
    });
    if (failure) std::rethrow_exception(failure);
  }

  /// Number of vertices or triangles that a thread takes at a time.
  static constexpr std::size_t range = 1 << 13;

  /// Splits 0, ..., count - 1 into ranges and calls work(thread, first, last) for each; uses one
  /// thread per range at most.
  template <class F>
  void for_ranges(std::size_t count, const F& work) {
    const auto ranges = (count + range - 1) / range;
    for_each(std::min(ranges, this->count()), ranges, 1, [&](std::size_t thread, std::size_t r) {
      work(thread, r * range, std::min((r + 1) * range, count));
    });
  }

private:
  void wait_for_work(std::size_t thread);

  std::mutex one_caller_;
  const std::function<void(std::size_t)>* work_ = nullptr;  // null: threads end
  std::size_t threads_ = 0;
  std::atomic<unsigned> round_ = 0;
  std::atomic<std::size_t> busy_ = 0;
  std::vector<std::jthread> others_;
};

}  // namespace raywave::cl
