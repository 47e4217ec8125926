// SPDX-License-Identifier: Apache-2.0
/// Memory that a computation is going to take.
#pragma once

#include <cstdint>
#include <string>

namespace raywave {

struct MemoryNeed {
  std::string name;  // for messages ("WRP field")
  std::uint64_t bytes = 0;
  std::string advice;  // a setting that would need less
};

/// "2.0 GiB"
std::string format_bytes(std::uint64_t bytes);

}  // namespace raywave
