// SPDX-License-Identifier: Apache-2.0
// Writers of pictures: a few plain kinds, for a library of all kinds takes longer to load than
// most commands take. All are made in memory, so that a full disk is noticed.
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/scene/image.hpp"

namespace raywave {
namespace {

static_assert(std::endian::native == std::endian::little);

using Bytes = std::vector<std::uint8_t>;

/// Pixels, as their bytes lie in memory.
struct Picture {
  std::size_t width, height, channels;
  std::size_t size;  // of a number: 1 or 2 bytes are integers, 4 a float
  std::span<const std::uint8_t> bytes;

  std::size_t row_bytes() const { return width * channels * size; }
  std::span<const std::uint8_t> row(std::size_t y) const {
    return bytes.subspan(y * row_bytes(), row_bytes());
  }
};

template <class Number>
Picture picture_of(int width, int height, std::span<const Number> numbers) {
  const auto pixels = width < 1 || height < 1 ? 0 : std::size_t{1} * width * height;
  if (pixels == 0 || numbers.size() < pixels || numbers.size() > 3 * pixels ||
      numbers.size() % pixels != 0)
    throw std::invalid_argument("save_picture: the pixels do not fill width * height");
  return {static_cast<std::size_t>(width),
          static_cast<std::size_t>(height),
          numbers.size() / pixels,
          sizeof(Number),
          {reinterpret_cast<const std::uint8_t*>(numbers.data()), numbers.size_bytes()}};
}

template <class... Numbers>
void put(Bytes& to, Numbers... numbers) {
  const auto one = [&](auto number) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&number);
    to.insert(to.end(), bytes, bytes + sizeof number);
  };
  (one(numbers), ...);
}

void put_text(Bytes& to, std::string_view text) { to.insert(to.end(), text.begin(), text.end()); }

/// PNG is big-endian.
void put_reversed(Bytes& to, std::uint32_t number) {
  for (const int shift : {24, 16, 8, 0}) to.push_back(static_cast<std::uint8_t>(number >> shift));
}

Bytes deflated(std::span<const std::uint8_t> bytes, int level) {
  uLongf size = compressBound(bytes.size());
  Bytes packed(size);
  if (compress2(packed.data(), &size, bytes.data(), bytes.size(), level) != Z_OK)
    throw std::bad_alloc();
  packed.resize(size);
  return packed;
}

void put_chunk(Bytes& png, std::string_view kind, std::span<const std::uint8_t> data) {
  put_reversed(png, static_cast<std::uint32_t>(data.size()));
  const auto first = png.size();
  put_text(png, kind);
  png.insert(png.end(), data.begin(), data.end());
  put_reversed(png, static_cast<std::uint32_t>(crc32_z(0, png.data() + first, png.size() - first)));
}

/// A PNG's row behind the number of its filter: as it is (0), less the pixel to the left (1) or the
/// one above (2).
void filter_row(int filter, std::span<const std::uint8_t> row, std::span<const std::uint8_t> above,
                std::size_t pixel, Bytes& to) {
  to.assign(1, static_cast<std::uint8_t>(filter));
  for (std::size_t i = 0; i < row.size(); ++i) {
    const int less = filter == 1                     ? (i < pixel ? 0 : row[i - pixel])
                     : filter == 2 && !above.empty() ? above[i]
                                                     : 0;
    to.push_back(static_cast<std::uint8_t>(row[i] - less));
  }
}

/// How far bytes lie from 0, as signed numbers: what compresses well is small.
std::size_t size_of(const Bytes& filtered) {
  std::size_t sum = 0;
  for (const auto byte : filtered)
    sum += static_cast<std::size_t>(std::abs(static_cast<std::int8_t>(byte)));
  return sum;
}

/// level  of the compression; 0: none
Bytes png_of(const Picture& picture, int level, Bytes png = {}) {
  Bytes rows, turned[2], best, other;
  rows.reserve(picture.bytes.size() + picture.height);
  for (std::size_t y = 0; y < picture.height; ++y) {
    auto& row = turned[y % 2];
    row.assign(picture.row(y).begin(), picture.row(y).end());
    if (picture.size == 2)
      for (std::size_t i = 0; i < row.size(); i += 2) std::swap(row[i], row[i + 1]);
    const auto above = y == 0 ? std::span<const std::uint8_t>() : turned[(y + 1) % 2];
    const auto pixel = picture.channels * picture.size;
    filter_row(0, row, above, pixel, best);
    for (const int filter : {1, 2}) {
      if (level == 0) break;
      filter_row(filter, row, above, pixel, other);
      if (size_of(other) < size_of(best)) best.swap(other);
    }
    rows.insert(rows.end(), best.begin(), best.end());
  }
  png.clear();
  put_text(png, "\x89PNG\r\n\x1a\n");
  Bytes head;
  put_reversed(head, static_cast<std::uint32_t>(picture.width));
  put_reversed(head, static_cast<std::uint32_t>(picture.height));
  const std::uint8_t grey = 0, rgb = 2;
  put(head, static_cast<std::uint8_t>(8 * picture.size), picture.channels == 1 ? grey : rgb);
  head.resize(head.size() + 3);
  put_chunk(png, "IHDR", head);
  put_chunk(png, "IDAT", deflated(rows, level));
  put_chunk(png, "IEND", {});
  return png;
}

/// 8-bit grey of a palette, or 24-bit colour; rows from the bottom, of a multiple of four bytes.
Bytes bmp_of(const Picture& picture) {
  const bool is_grey = picture.channels == 1;
  const auto row_bytes = (picture.row_bytes() + 3) / 4 * 4;
  const std::uint32_t colours = is_grey ? 256 : 0;
  const auto first = static_cast<std::uint32_t>(54 + 4 * colours);
  const auto size = static_cast<std::uint32_t>(row_bytes * picture.height);
  Bytes bmp{'B', 'M'};
  put(bmp, first + size, std::uint32_t{0}, first, std::uint32_t{40},
      static_cast<std::uint32_t>(picture.width), static_cast<std::uint32_t>(picture.height),
      std::uint16_t{1}, static_cast<std::uint16_t>(8 * picture.channels), std::uint32_t{0}, size,
      std::uint32_t{2835}, std::uint32_t{2835}, colours, colours);
  for (std::uint32_t i = 0; i < colours; ++i) put(bmp, i * 0x010101);
  for (std::size_t y = picture.height; y-- > 0;) {
    const auto row = picture.row(y);
    const auto from = bmp.size();
    bmp.insert(bmp.end(), row.begin(), row.end());
    for (std::size_t i = 0; !is_grey && i < row.size(); i += 3)
      std::swap(bmp[from + i], bmp[from + i + 2]);
    bmp.resize(from + row_bytes);
  }
  return bmp;
}

/// Without compression, in one strip.
Bytes tiff_of(const Picture& picture) {
  constexpr std::uint16_t tags = 12, whole = 4, ratio = 5, small = 3;
  // Behind the tags lie the bits of three channels and the resolution; then the pixels
  const std::uint32_t bits_at = 8 + 2 + 12 * tags + 4, ratio_at = bits_at + 6,
                      pixels_at = ratio_at + 8;
  const auto bits = static_cast<std::uint16_t>(8 * picture.size);
  const auto number = [](std::size_t value) { return static_cast<std::uint32_t>(value); };
  Bytes tiff;
  put_text(tiff, std::string_view("II*\0", 4));
  put(tiff, std::uint32_t{8}, tags);
  const auto tag = [&](std::uint16_t id, std::uint16_t type, std::uint32_t count,
                       std::uint32_t value) { put(tiff, id, type, count, value); };
  tag(256, whole, 1, number(picture.width));
  tag(257, whole, 1, number(picture.height));
  tag(258, small, number(picture.channels), picture.channels == 1 ? bits : bits_at);
  tag(259, small, 1, 1);                              // no compression
  tag(262, small, 1, picture.channels == 1 ? 1 : 2);  // black is 0, or RGB
  tag(273, whole, 1, pixels_at);
  tag(277, small, 1, number(picture.channels));
  tag(278, whole, 1, number(picture.height));
  tag(279, whole, 1, number(picture.bytes.size()));
  tag(282, ratio, 1, ratio_at);
  tag(283, ratio, 1, ratio_at);
  tag(296, small, 1, 1);  // no unit
  put(tiff, std::uint32_t{0}, bits, bits, bits, std::uint32_t{1}, std::uint32_t{1});
  tiff.insert(tiff.end(), picture.bytes.begin(), picture.bytes.end());
  return tiff;
}

/// Rows of an OpenEXR picture from `first` on: each channel's numbers side by side.
Bytes exr_rows(const Picture& picture, std::size_t first, std::size_t rows) {
  Bytes raw;
  for (std::size_t y = first; y < first + rows; ++y)
    for (std::size_t channel = picture.channels; channel-- > 0;)  // B, G, R
      for (std::size_t x = 0; x < picture.width; ++x) {
        const auto number = picture.row(y).subspan(4 * (x * picture.channels + channel), 4);
        raw.insert(raw.end(), number.begin(), number.end());
      }
  return raw;
}

/// OpenEXR's ZIP: bytes of even, then of odd places, each less the one before it, deflated.
///
/// source  OpenEXR, ImfZip.cpp
Bytes exr_packed(const Bytes& raw) {
  Bytes sorted;
  for (const std::size_t start : {0u, 1u})
    for (std::size_t i = start; i < raw.size(); i += 2) sorted.push_back(raw[i]);
  for (std::size_t i = sorted.size(); i-- > 1;)
    sorted[i] = static_cast<std::uint8_t>(sorted[i] - sorted[i - 1] + 128);
  auto packed = deflated(sorted, 4);
  return packed.size() < raw.size() ? packed : raw;
}

Bytes exr_of(const Picture& picture) {
  constexpr std::size_t rows_together = 16;
  Bytes exr;
  put(exr, std::uint32_t{20000630}, std::uint32_t{2});
  const auto attribute = [&](std::string_view name, std::string_view type, const Bytes& value) {
    put_text(exr, name);
    exr.push_back(0);
    put_text(exr, type);
    exr.push_back(0);
    put(exr, static_cast<std::uint32_t>(value.size()));
    exr.insert(exr.end(), value.begin(), value.end());
  };
  Bytes channels, window, two, one;
  for (std::size_t i = picture.channels; i-- > 0;) {
    channels.push_back(static_cast<std::uint8_t>(picture.channels == 1 ? 'Y' : "RGB"[i]));
    channels.push_back(0);
    put(channels, std::uint32_t{2}, std::uint32_t{0}, std::uint32_t{1}, std::uint32_t{1});
  }
  channels.push_back(0);
  put(window, std::uint32_t{0}, std::uint32_t{0}, static_cast<std::uint32_t>(picture.width - 1),
      static_cast<std::uint32_t>(picture.height - 1));
  put(two, 0.0f, 0.0f);
  put(one, 1.0f);
  attribute("channels", "chlist", channels);
  attribute("compression", "compression", {3});
  attribute("dataWindow", "box2i", window);
  attribute("displayWindow", "box2i", window);
  attribute("lineOrder", "lineOrder", {0});
  attribute("pixelAspectRatio", "float", one);
  attribute("screenWindowCenter", "v2f", two);
  attribute("screenWindowWidth", "float", one);
  exr.push_back(0);

  const auto blocks = (picture.height + rows_together - 1) / rows_together;
  const auto places = exr.size();
  exr.resize(places + 8 * blocks);
  for (std::size_t block = 0; block < blocks; ++block) {
    const std::uint64_t place = exr.size();
    std::copy_n(reinterpret_cast<const std::uint8_t*>(&place), 8, exr.data() + places + 8 * block);
    const auto first = block * rows_together;
    const auto data =
        exr_packed(exr_rows(picture, first, std::min(rows_together, picture.height - first)));
    put(exr, static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(data.size()));
    exr.insert(exr.end(), data.begin(), data.end());
  }
  return exr;
}

void save(const std::filesystem::path& file, const Picture& picture) {
  const auto kind = file.extension();
  const auto bytes = [&] {
    if (kind == ".exr" && picture.size == 4) return exr_of(picture);
    if (kind == ".png" && picture.size <= 2) return png_of(picture, 6);
    if (kind == ".tif" && picture.size <= 2) return tiff_of(picture);
    if (kind == ".bmp" && picture.size == 1) return bmp_of(picture);
    throw InputError(in_quotes(file.string()) +
                     ": cannot be written: integers go to .png, .bmp or .tif, floats to .exr");
  }();
  write_whole(file, [&](OutputFile& to) { to.write(bytes.data(), bytes.size()); });
}

}  // namespace

void save_picture(const std::filesystem::path& file, int width, int height,
                  std::span<const std::uint8_t> pixels) {
  save(file, picture_of(width, height, pixels));
}

void save_picture(const std::filesystem::path& file, int width, int height,
                  std::span<const std::uint16_t> pixels) {
  save(file, picture_of(width, height, pixels));
}

void save_picture(const std::filesystem::path& file, int width, int height,
                  std::span<const float> pixels) {
  save(file, picture_of(width, height, pixels));
}

void save_picture(const std::filesystem::path& file, int width, int height,
                  std::span<const std::complex<float>> pixels) {
  save(file,
       picture_of(width, height,
                  std::span(reinterpret_cast<const float*>(pixels.data()), 2 * pixels.size())));
}

void uncompressed_png(int width, int height, std::span<const std::uint8_t> levels,
                      std::vector<std::uint8_t>& png) {
  png = png_of(picture_of(width, height, levels), 0, std::move(png));
}

}  // namespace raywave
