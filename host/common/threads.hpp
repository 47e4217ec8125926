// SPDX-License-Identifier: Apache-2.0
/// Threads of the host that wait for work, so that a pass of a few milliseconds need not start any.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace raywave::cl {

/// As many as the host has processors for this program, the calling thread among them. Calls from
/// several threads take turns.
class Threads {
public:
  /// The program's own.
  static Threads& shared();

  explicit Threads(std::size_t count);
  ~Threads();
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;

  std::size_t count() const { return others_.size() + 1; }

  /// Calls work(0), ..., work(threads - 1) at the same time and waits for all. At most count()
  /// threads; `work` does not throw.
  void run(std::size_t threads, const std::function<void(std::size_t)>& work);

  /// Calls work(thread, i) for i = 0, ..., count - 1, each thread taking `grain` of them at a time.
  template <class F>
  void for_each(std::size_t threads, std::size_t count, std::size_t grain, const F& work) {
    std::atomic<std::size_t> next = 0;
    run(threads, [&](std::size_t thread) {
      for (std::size_t first; (first = next.fetch_add(grain)) < count;) {
        for (std::size_t i = first; i < std::min(first + grain, count); ++i) work(thread, i);
      }
    });
  }

  /// Vertices or triangles that a thread takes at a time.
  static constexpr std::size_t range = 1 << 13;

  /// Calls work(thread, first, last) for the ranges that 0, ..., count - 1 fall into, on as many
  /// threads as are worth it.
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
  const std::function<void(std::size_t)>* work_ = nullptr;  // none: the threads end
  std::size_t threads_ = 0;
  std::atomic<unsigned> round_ = 0;
  std::atomic<std::size_t> busy_ = 0;
  std::vector<std::jthread> others_;
};

}  // namespace raywave::cl
