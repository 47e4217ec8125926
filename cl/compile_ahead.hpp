// SPDX-License-Identifier: Apache-2.0
/// A second process that compiles kernels: drivers compile one program at a time, and a first
/// picture waits for half a dozen.
#pragma once

#include <sys/types.h>

#include <functional>

namespace raywave::cl {

/// Compiles the kernels that rehearsals have asked for, the last one first (cl/program.cpp).
void compile_rehearsed();

/// While it lives, a process of its own compiles for the cache, PoCL's or ours, what this one will
/// need: the last kernel first, as this one begins with the first.
class CompileAhead {
public:
  /// Forks, so that no thread may run yet. The process sleeps until this one has a program that is
  /// in no cache. What it does is not seen; it ends with this one.
  ///
  /// rehearse  does this process's work as a rehearsal (host/common/rehearsal.hpp)
  explicit CompileAhead(const std::function<void()>& rehearse);
  ~CompileAhead();
  CompileAhead(const CompileAhead&) = delete;
  CompileAhead& operator=(const CompileAhead&) = delete;

  /// Wakes the process, if there is one.
  static void begin();

private:
  pid_t process_ = -1;  // none
};

}  // namespace raywave::cl
