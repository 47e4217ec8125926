// SPDX-License-Identifier: Apache-2.0
#include "host/animate/plain_png.hpp"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string_view>

namespace raywave {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Most significant byte first.
std::array<std::uint8_t, 4> bytes_of(std::size_t number) {
  std::array<std::uint8_t, 4> bytes{};
  for (auto& byte : bytes) {
    byte = static_cast<std::uint8_t>(number >> 24 & 0xff);
    number <<= 8;
  }
  return bytes;
}

template <class Range>
void add(Bytes& to, const Range& bytes) {
  to.insert(to.end(), bytes.begin(), bytes.end());
}

/// Adds a chunk whose bytes `fill` appends.
template <class Fill>
void add_chunk(Bytes& png, std::string_view name, Fill fill) {
  const auto begin = png.size();
  add(png, bytes_of(0));  // its length, which is not known yet
  const auto named = png.size();
  add(png, name);
  fill();
  const auto size = png.size() - named;
  const auto length = bytes_of(size - name.size());
  std::copy(length.begin(), length.end(), &png[begin]);
  add(png, bytes_of(crc32_z(0, &png[named], size)));
}

}  // namespace

void plain_png(glm::ivec2 size_px, std::span<const std::uint8_t> levels, Bytes& png) {
  const auto width = static_cast<std::size_t>(size_px.x),
             height = static_cast<std::size_t>(size_px.y);
  if (levels.size() != width * height)
    throw std::invalid_argument("plain_png: the levels do not fill the picture");

  constexpr std::array<std::uint8_t, 8> signature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  png.assign(signature.begin(), signature.end());
  add_chunk(png, "IHDR", [&] {
    add(png, bytes_of(width));
    add(png, bytes_of(height));
    // Bits; grey, deflate, filters, not interlaced
    add(png, std::array<std::uint8_t, 5>{8, 0, 0, 0, 0});
  });

  // Rows, each behind the number of its filter (0: none), in stored blocks. Each block is a chunk
  constexpr std::size_t largest_block = 0xffff;
  std::size_t left = (width + 1) * height, in_row = 0;
  auto sum = adler32_z(0, nullptr, 0);
  const auto add_rows = [&](std::size_t count) {
    const auto begin = png.size();
    while (count > 0) {
      if (in_row == 0) {
        png.push_back(0);
        in_row = width;
        --count;
      }
      const auto part = levels.first(std::min(count, in_row));
      add(png, part);
      levels = levels.subspan(part.size());
      in_row -= part.size();
      count -= part.size();
    }
    sum = adler32_z(sum, &png[begin], png.size() - begin);
  };
  for (bool is_first = true; left > 0; is_first = false) {
    const auto size = std::min(left, largest_block);
    left -= size;
    add_chunk(png, "IDAT", [&] {
      if (is_first) add(png, std::array<std::uint8_t, 2>{0x78, 0x01});  // zlib, fastest
      const auto low = static_cast<std::uint8_t>(size & 0xff),
                 high = static_cast<std::uint8_t>(size >> 8);
      const auto is_last = static_cast<std::uint8_t>(left == 0);
      const auto not_low = static_cast<std::uint8_t>(~low),
                 not_high = static_cast<std::uint8_t>(~high);
      add(png, std::array<std::uint8_t, 5>{is_last, low, high, not_low, not_high});
      add_rows(size);
      if (left == 0) add(png, bytes_of(sum));
    });
  }
  add_chunk(png, "IEND", [] {});
}

}  // namespace raywave
