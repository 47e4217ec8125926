// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader/serve.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <new>
#include <string_view>

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

void confine(unsigned seconds, std::uint64_t bytes) {
  for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGILL, SIGBUS, SIGTERM, SIGINT, SIGALRM})
    std::signal(signal, SIG_DFL);
  std::signal(SIGPIPE, SIG_IGN);  // a write to nobody fails
  set_limit(RLIMIT_CORE, 0);
  set_limit(RLIMIT_CPU, seconds);
  alarm(10 * seconds);  // one that waits uses no processor time
  if (!kAddressSanitizer) set_limit(RLIMIT_DATA, data_bytes() + bytes);
}

/// Takes the reply's pipe off stdout, where libraries print.
ReaderPipe take_stdout() {
  const int reply = fcntl(STDOUT_FILENO, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  const int nowhere = open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (reply < 0 || nowhere < 0) _exit(1);
  dup2(nowhere, STDOUT_FILENO);
  dup2(nowhere, STDERR_FILENO);
  return ReaderPipe(reply);
}

template <class Number>
bool parse(std::string_view text, Number& number) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

void serve(int argc, char** argv, const std::function<void(const std::vector<std::string>&)>& work,
           const std::function<void(ReaderPipe&)>& send) {
  unsigned seconds = 0;
  std::uint64_t bytes = 0;
  if (argc < 3 || !parse(argv[1], seconds) || !parse(argv[2], bytes)) {
    std::fputs("raywave starts this program to read a file; it is not called by hand\n", stderr);
    _exit(2);
  }
  auto pipe = take_stdout();
  try {
    std::string failure;
    try {
      confine(seconds, bytes);
      work({argv + 3, argv + argc});
    } catch (const std::bad_alloc&) {
      failure = "it asks for too much memory";
    } catch (const std::exception& error) {
      failure = error.what();
      if (failure.empty()) failure = "it cannot be read";
      // Libraries pass on what the standard library said to them.
      const auto says = [&](const char* word) { return failure.find(word) != std::string::npos; };
      if (says("bad_alloc") || says("length_error") || says("max_size()") ||
          says("_M_default_append"))
        failure = "it asks for too much memory";
    }
    pipe.write_value(failure.empty() ? Verdict::done : Verdict::failed);
    if (failure.empty())
      send(pipe);
    else
      pipe.write_vector(std::vector<char>(failure.begin(), failure.end()));
  } catch (...) {  // the other side hears the pipe close
    _exit(1);
  }
  _exit(0);
}

}  // namespace raywave
