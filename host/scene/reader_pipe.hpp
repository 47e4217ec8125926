// SPDX-License-Identifier: Apache-2.0
/// The pipe from a reader process to the process that wants the file.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

namespace raywave {

/// The first byte of a reply: a result follows, or a message that says why there is none.
enum class Verdict : char { done, failed };

/// One end of the pipe. Does not own the descriptor.
///
/// throws  std::runtime_error when the other side is gone
class ReaderPipe {
public:
  explicit ReaderPipe(int descriptor) : descriptor_(descriptor) {}

  void write(std::span<const std::byte> bytes);
  void read(std::span<std::byte> bytes);

  template <class T>
  void write_vector(const std::vector<T>& values) {
    const std::uint64_t count = values.size();
    write(std::as_bytes(std::span(&count, 1)));
    write(std::as_bytes(std::span(values)));
  }

  /// throws  std::runtime_error also for more than `max_count` values
  template <class T>
  void read_vector(std::vector<T>& values, std::uint64_t max_count) {
    std::uint64_t count = 0;
    read(std::as_writable_bytes(std::span(&count, 1)));
    if (count > max_count)
      throw std::runtime_error("more than was agreed on comes through the pipe");
    // A count is only a claim until some of it has come.
    values.resize(std::min<std::uint64_t>(count, (std::size_t{1} << 20) / sizeof(T)));
    read(std::as_writable_bytes(std::span(values)));
    const std::size_t first = values.size();
    values.resize(count);
    read(std::as_writable_bytes(std::span(values).subspan(first)));
  }

private:
  int descriptor_;
};

}  // namespace raywave
