// SPDX-License-Identifier: Apache-2.0
#include "host/common/threads.hpp"

namespace raywave::cl {

Threads& Threads::shared() {
  static Threads threads(std::max(1u, std::thread::hardware_concurrency()));
  return threads;
}

Threads::Threads(std::size_t count) {
  for (std::size_t thread = 1; thread < count; ++thread)
    others_.emplace_back([this, thread] { wait_for_work(thread); });
}

Threads::~Threads() {
  work_ = nullptr;
  ++round_;
  round_.notify_all();
}

void Threads::wait_for_work(std::size_t thread) {
  for (unsigned seen = 0;;) {
    round_.wait(seen);
    seen = round_;
    if (!work_) return;
    if (thread < threads_) (*work_)(thread);
    if (--busy_ == 0) busy_.notify_one();
  }
}

void Threads::run(std::size_t threads, const std::function<void(std::size_t)>& work) {
  if (threads <= 1 || others_.empty()) return work(0);
  const std::lock_guard lock(one_caller_);
  work_ = &work;
  threads_ = threads;
  busy_ = others_.size();
  ++round_;
  round_.notify_all();
  work(0);
  for (std::size_t left; (left = busy_) != 0;) busy_.wait(left);
}

}  // namespace raywave::cl
