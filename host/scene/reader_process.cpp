// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader_process.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <new>
#include <string>

namespace raywave {
namespace {

#ifdef __SANITIZE_ADDRESS__
constexpr bool kAddressSanitizer = true;  // its tables are larger than any limit
#else
constexpr bool kAddressSanitizer = false;
#endif

void set_limit(decltype(RLIMIT_CPU) resource, rlim_t value) {
  rlimit limits{};
  getrlimit(resource, &limits);
  limits.rlim_cur = std::min(value, limits.rlim_max);
  setrlimit(resource, &limits);
}

/// What RLIMIT_DATA counts; /proc has it in pages as the sixth number.
std::uint64_t data_bytes() {
  std::ifstream stream("/proc/self/statm");
  std::uint64_t pages = 0;
  for (int i = 0; i < 6; ++i) stream >> pages;
  return stream ? pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)) : 0;
}

void confine(const ChildLimits& limits) {
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGILL, SIGBUS, SIGTERM, SIGINT, SIGALRM})
    std::signal(signal, SIG_DFL);
  std::signal(SIGPIPE, SIG_IGN);  // a write to nobody fails
  if (const int nowhere = open("/dev/null", O_WRONLY); nowhere >= 0) {
    dup2(nowhere, STDERR_FILENO);
    dup2(nowhere, STDOUT_FILENO);  // what this process had buffered is not the child's to print
  }
  set_limit(RLIMIT_CORE, 0);
  set_limit(RLIMIT_CPU, limits.seconds);
  alarm(10 * limits.seconds);  // one that waits uses no processor time
  if (!kAddressSanitizer) set_limit(RLIMIT_DATA, data_bytes() + limits.bytes);
}

/// What the child says before anything else: that `send` follows, or that a message does.
enum class Verdict : char { done, failed };

[[noreturn]] void be_child(ChildPipe pipe, const ChildLimits& limits,
                           const std::function<void()>& work,
                           const std::function<void(ChildPipe&)>& send) {
  const auto say = [&](Verdict verdict) { pipe.write(std::as_bytes(std::span(&verdict, 1))); };
  try {
    std::string failure;
    try {
      confine(limits);
      work();
    } catch (const std::bad_alloc&) {
      failure = "it asks for too much memory";
    } catch (const std::exception& error) {
      failure = error.what();
    }
    say(failure.empty() ? Verdict::done : Verdict::failed);
    failure.empty() ? send(pipe)
                    : pipe.write_vector(std::vector<char>(failure.begin(), failure.end()));
  } catch (...) {  // the parent hears the pipe close
    _exit(1);
  }
  _exit(0);
}

/// Waits, and says in words how the child ended when it did not say so itself.
std::string end_of(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  return signal == SIGXCPU || signal == SIGALRM ? "its reader took too long" : "its reader crashed";
}

}  // namespace

void ChildPipe::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t done = ::write(descriptor_, bytes.data(), bytes.size());
    if (done < 0 && errno != EINTR) throw std::runtime_error("the pipe is closed");
    bytes = bytes.subspan(static_cast<std::size_t>(std::max<ssize_t>(done, 0)));
  }
}

void ChildPipe::read(std::span<std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t done = ::read(descriptor_, bytes.data(), bytes.size());
    if (done == 0 || (done < 0 && errno != EINTR)) throw std::runtime_error("the pipe is closed");
    bytes = bytes.subspan(static_cast<std::size_t>(std::max<ssize_t>(done, 0)));
  }
}

void run_in_child(const ChildLimits& limits, const std::function<void()>& work,
                  const std::function<void(ChildPipe&)>& send,
                  const std::function<void(ChildPipe&)>& receive) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("no pipe can be made");
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    be_child(ChildPipe(ends[1]), limits, work, send);
  }
  close(ends[1]);
  if (child < 0) {
    close(ends[0]);
    throw std::runtime_error("no process can be started");
  }

  std::string failure;
  ChildPipe pipe(ends[0]);
  try {
    Verdict verdict{};
    pipe.read(std::as_writable_bytes(std::span(&verdict, 1)));
    if (verdict == Verdict::done) {
      receive(pipe);
    } else {
      std::vector<char> message;
      pipe.read_vector(message, 1 << 16);
      failure.assign(message.begin(), message.end());
    }
  } catch (const std::exception&) {
    failure = "?";
  }
  close(ends[0]);  // first: a child that still writes then ends too
  const std::string end = end_of(child);
  if (!failure.empty()) throw std::runtime_error(failure == "?" ? end : failure);
}

}  // namespace raywave
