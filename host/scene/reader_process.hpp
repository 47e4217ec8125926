// SPDX-License-Identifier: Apache-2.0
/// Untrusted input in a process of its own, so that a crash or a hang of a third-party reader stays
/// there.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <stdexcept>
#include <vector>

namespace raywave {

/// One end of the pipe from child to parent. Both throw std::runtime_error when the other side is
/// gone.
class ChildPipe {
public:
  explicit ChildPipe(int descriptor) : descriptor_(descriptor) {}

  void write(std::span<const std::byte> bytes);
  void read(std::span<std::byte> bytes);

  template <class T>
  void write_vector(const std::vector<T>& values) {
    const std::uint64_t count = values.size();
    write(std::as_bytes(std::span(&count, 1)));
    write(std::as_bytes(std::span(values)));
  }

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

struct ChildLimits {
  unsigned seconds;     // of processor time; ten times as much by the clock
  std::uint64_t bytes;  // of memory, beyond what this process has
};

/// Calls `work` and then `send` in a forked child whose output is discarded, and `receive` here on
/// the other end of the pipe.
///
/// throws  std::runtime_error with what() of the exception that `work` threw, or saying how the
///         child ended
void run_in_child(const ChildLimits& limits, const std::function<void()>& work,
                  const std::function<void(ChildPipe&)>& send,
                  const std::function<void(ChildPipe&)>& receive);

}  // namespace raywave
