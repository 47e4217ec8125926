// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader_pipe.hpp"

#include <unistd.h>

#include <cerrno>

namespace raywave {

void ReaderPipe::write(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t done = ::write(descriptor_, bytes.data(), bytes.size());
    if (done < 0 && errno != EINTR) throw std::runtime_error("the pipe is closed");
    bytes = bytes.subspan(static_cast<std::size_t>(std::max<ssize_t>(done, 0)));
  }
}

void ReaderPipe::read(std::span<std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t done = ::read(descriptor_, bytes.data(), bytes.size());
    if (done == 0 || (done < 0 && errno != EINTR)) throw std::runtime_error("the pipe is closed");
    bytes = bytes.subspan(static_cast<std::size_t>(std::max<ssize_t>(done, 0)));
  }
}

}  // namespace raywave
