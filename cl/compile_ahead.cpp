// SPDX-License-Identifier: Apache-2.0
#include "cl/compile_ahead.hpp"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <exception>
#include <fstream>
#include <thread>

#include "host/common/rehearsal.hpp"

namespace raywave::cl {
namespace {

std::atomic<int> wakes{-1};  // descriptor to the sleeping process

[[noreturn]] void compile_when_woken(int woken, const std::function<void()>& rehearse) {
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  // Where memory ends, this is the process to go
  std::ofstream("/proc/self/oom_score_adj") << "1000";
  const int nowhere = ::open("/dev/null", O_RDWR);
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) ::dup2(nowhere, stream);
  char byte = 0;
  if (::read(woken, &byte, 1) != 1) _exit(0);
  try {
    is_rehearsal = true;
    rehearse();
  } catch (const std::exception&) {
    // What it has asked for is known
  }
  is_rehearsal = false;
  try {
    compile_rehearsed();
  } catch (const std::exception&) {
    // The other process says what is wrong
  }
  _exit(0);
}

}  // namespace

CompileAhead::CompileAhead(const std::function<void()>& rehearse) {
  int ends[2];
  if (std::thread::hardware_concurrency() < 2 ||
      ::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    return;
  process_ = ::fork();
  if (process_ == 0) {
    ::close(ends[1]);
    compile_when_woken(ends[0], rehearse);
  }
  ::close(ends[0]);
  if (process_ > 0)
    wakes = ends[1];
  else
    ::close(ends[1]);
}

CompileAhead::~CompileAhead() {
  if (process_ < 0) return;
  if (const int to = wakes.exchange(-1); to >= 0) ::close(to);
  ::kill(process_, SIGKILL);
  ::waitpid(process_, nullptr, 0);
}

void CompileAhead::begin() {
  const int to = wakes.exchange(-1);
  if (to < 0) return;
  ::send(to, "", 1, MSG_NOSIGNAL);
  ::close(to);
}

}  // namespace raywave::cl
