// SPDX-License-Identifier: Apache-2.0
// read_edid: whatever bytes come, none or texts that can be printed. Header and sum are made right,
// which chance would not find.
#include "host/display/edid.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

#include "tests/fuzz/fuzz.hpp"

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace raywave;
  std::vector<std::uint8_t> bytes(data, data + size);
  for (const bool is_repaired : {false, true}) {
    if (is_repaired && size >= 128) {
      std::fill(bytes.begin(), bytes.begin() + 8, 0xff);
      bytes[0] = bytes[7] = bytes[127] = 0;
      bytes[127] =
          static_cast<std::uint8_t>(-std::accumulate(bytes.begin(), bytes.begin() + 128, 0));
    }
    const auto edid = read_edid(bytes);
    if (!edid) continue;
    fuzz::require(edid->maker.size() == 3);
    for (const char c : edid->id() + edid->name) fuzz::require(c >= ' ' && c <= '~');
  }
  return 0;
}
