// SPDX-License-Identifier: Apache-2.0
#include "host/animate/write_queue.hpp"

#include <utility>

namespace raywave {

WriteQueue::WriteQueue(std::size_t longest) : longest_(longest), thread_([this] { work(); }) {}

WriteQueue::~WriteQueue() {
  {
    const std::lock_guard lock(mutex_);
    ends_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void WriteQueue::push(std::function<void()> job) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return failure_ || jobs_.size() <= longest_; });
  require_success();
  jobs_.push_back(std::move(job));
  changed_.notify_all();
}

void WriteQueue::finish() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return failure_ || jobs_.empty(); });
  require_success();
}

void WriteQueue::require_success() {
  if (failure_) std::rethrow_exception(failure_);
}

void WriteQueue::work() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [&] { return ends_ || (!failure_ && !jobs_.empty()); });
    if (ends_) return;
    auto& job = jobs_.front();  // stays in its place while others are added behind it
    lock.unlock();
    std::exception_ptr failure;
    try {
      job();
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    jobs_.pop_front();
    failure_ = failure;
    changed_.notify_all();
  }
}

}  // namespace raywave
