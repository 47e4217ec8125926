// SPDX-License-Identifier: Apache-2.0
/// A reader program that behaves as its argument says: "numbers COUNT" sends so many sevens, "fail
/// MESSAGE" throws, the others are names of ways to fail.
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <stdexcept>

#include "host/scene/reader/serve.hpp"

int main(int argc, char** argv) {
  std::vector<int> result;
  raywave::serve(
      argc, argv,
      [&](const auto& arguments) {
        const auto& how = arguments.at(0);
        std::puts("readers print what they like");
        std::fflush(stdout);
        if (how == "numbers") result.assign(std::stoul(arguments.at(1)), 7);
        if (how == "fail") throw std::runtime_error(arguments.at(1));
        if (how == "abort") std::abort();
        if (how == "segv") std::raise(SIGSEGV);
        if (how == "exit") _exit(3);
        if (how == "not started") _exit(127);
        if (how == "spin") {
          for (volatile bool spin = true; spin;) {
          }
        }
        if (how == "wait") sleep(60);
        if (how == "bad_alloc") throw std::bad_alloc();
      },
      [&](raywave::ReaderPipe& pipe) { pipe.write_vector(result); });
}
