// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>

namespace raywave {

/// Work that a thread of its own does in order, such as writing files, while the caller goes on.
/// The queue is short: memory does not grow when writing is slower than computing.
class WriteQueue {
public:
  /// longest  number of jobs that wait, >= 1
  explicit WriteQueue(std::size_t longest);
  /// Waits for the job at work and leaves out those that wait.
  ~WriteQueue();
  WriteQueue(const WriteQueue&) = delete;
  WriteQueue& operator=(const WriteQueue&) = delete;

  /// Adds a job; waits while the queue is full.
  ///
  /// throws  what an earlier job has thrown; no job is done after that
  void push(std::function<void()> job);
  /// Waits until all jobs are done.
  ///
  /// throws  as push
  void finish();

private:
  void work();
  void require_success();

  std::size_t longest_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> jobs_;  // the first is at work
  std::exception_ptr failure_;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace raywave
