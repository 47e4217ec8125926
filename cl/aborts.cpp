// SPDX-License-Identifier: Apache-2.0
#include "cl/aborts.hpp"

#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstring>

namespace raywave::cl {
namespace {

int exit_code = 0;  // 0: aborts are left alone
std::array<char, 512> work{};

void end_at_abort(int) {
  if (work[0] == '\0') return;  // no driver's fault: the usual end
  const char* at = work.data();
  for (const char* text :
       {"raywave: the OpenCL driver has ended the program while it compiled or ran ", at,
        "; its own message stands above. Another driver or --device may do it (raywave devices "
        "lists them)\n"})
    if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) break;
  ::_exit(exit_code);
}

}  // namespace

void explain_aborts(int code) { exit_code = code; }

void driver_works_on(const std::string& what, const std::string& lacks) {
  if (exit_code == 0) return;  // a library's host program may call this from several threads
  std::snprintf(work.data(), work.size(), "%s%s", what.c_str(), lacks.c_str());
  // Once more each time: LLVM puts its own handler there, which goes on to abort.
  std::signal(SIGABRT, end_at_abort);
}

void driver_is_done() {
  if (exit_code != 0) work[0] = '\0';
}

}  // namespace raywave::cl
