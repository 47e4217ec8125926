// SPDX-License-Identifier: Apache-2.0
#include "host/common/memory_need.hpp"

#include <array>

#include "host/common/text.hpp"

namespace raywave {

std::string format_bytes(std::uint64_t bytes) {
  static constexpr std::array units{"B", "KiB", "MiB", "GiB", "TiB"};
  double value = static_cast<double>(bytes);
  std::size_t unit = 0;
  for (; value >= 1024 && unit + 1 < units.size(); ++unit) value /= 1024;
  return format(unit ? "%.1f %s" : "%.0f %s", value, units[unit]);
}

}  // namespace raywave
