// SPDX-License-Identifier: Apache-2.0
#include "host/display/edid.hpp"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

#include "host/common/text.hpp"

namespace raywave {
namespace {

constexpr std::size_t block_size = 128, descriptor_size = 18;
constexpr std::uint8_t tag_serial = 0xff, tag_name = 0xfc;

/// Text of a descriptor: ends with a line feed, is padded with spaces.
std::string text_of(std::span<const std::uint8_t> descriptor) {
  std::string text;
  for (const auto c : descriptor.subspan(5)) {
    if (c == '\n') break;
    text += c >= ' ' && c <= '~' ? static_cast<char>(c) : '?';
  }
  text.erase(text.find_last_not_of(' ') + 1);
  return text;
}

}  // namespace

std::string Edid::id() const {
  return format("%s-%04X", maker.c_str(), product) + (serial.empty() ? "" : "-" + serial);
}

std::optional<Edid> read_edid(std::span<const std::uint8_t> bytes) {
  constexpr std::array<std::uint8_t, 8> header{0, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0};
  if (bytes.size() < block_size) return {};
  const auto block = bytes.first(block_size);
  if (!std::equal(header.begin(), header.end(), block.begin()) ||
      std::accumulate(block.begin(), block.end(), 0u) % 256 != 0)
    return {};
  Edid edid;
  const unsigned letters = block[8] * 256u + block[9];
  for (const int shift : {10, 5, 0}) {
    const unsigned letter = letters >> shift & 31;
    if (letter < 1 || letter > 26) return {};
    edid.maker += static_cast<char>('A' + letter - 1);
  }
  edid.product = block[10] + block[11] * 256u;
  unsigned number = 0;
  for (const std::size_t at : {15, 14, 13, 12}) number = number * 256 + block[at];
  if (number > 0) edid.serial = std::to_string(number);
  for (std::size_t at = 54; at + descriptor_size <= 126; at += descriptor_size) {
    const auto descriptor = block.subspan(at, descriptor_size);
    if (descriptor[0] != 0 || descriptor[1] != 0) continue;  // a mode
    if (descriptor[3] == tag_name) edid.name = text_of(descriptor);
    if (descriptor[3] == tag_serial)
      if (auto text = text_of(descriptor); !text.empty()) edid.serial = std::move(text);
  }
  return edid;
}

}  // namespace raywave
