// SPDX-License-Identifier: Apache-2.0
/// EDIDs as monitors have them.
#pragma once

#include <numeric>
#include <string>

namespace raywave::test {

/// A first block whose sum is right.
inline std::string edid(const std::string& maker, unsigned product, unsigned serial,
                        const std::string& name, const std::string& serial_text) {
  std::string block(128, '\0');
  block.replace(0, 8, std::string("\0\xff\xff\xff\xff\xff\xff\0", 8));
  unsigned letters = 0;
  for (const char c : maker) letters = letters * 32 + static_cast<unsigned>(c - 'A' + 1) % 32;
  block[8] = static_cast<char>(letters >> 8);
  block[9] = static_cast<char>(letters);
  block[10] = static_cast<char>(product);
  block[11] = static_cast<char>(product >> 8);
  for (std::size_t i = 0; i < 4; ++i) block[12 + i] = static_cast<char>(serial >> (8 * i));
  block[54] = 1;  // a mode
  const auto describe = [&](std::size_t at, char tag, const std::string& text) {
    block[at + 3] = tag;
    block.replace(at + 5, 13, (text + "\n" + std::string(13, ' ')).substr(0, 13));
  };
  if (!name.empty()) describe(72, '\xfc', name);
  if (!serial_text.empty()) describe(90, '\xff', serial_text);
  block[127] = static_cast<char>(
      -std::accumulate(block.begin(), block.end(), 0, [](int sum, char c) { return sum + c; }));
  return block;
}

}  // namespace raywave::test
