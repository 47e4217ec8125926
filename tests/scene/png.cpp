// SPDX-License-Identifier: Apache-2.0
// PNGs of every kind, written by libpng, against what OpenImageIO reads of them.
#include <png.h>

#include <cstdio>

#include "host/scene/reader/picture.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"

namespace raywave {
namespace {

struct Kind {
  int colour, bits;
  bool has_transparency, interlaced;
};

/// Random pixels, 13 x 7, with a gamma that readers must not use.
void write_png(const std::filesystem::path& file, const Kind& kind) {
  constexpr png_uint_32 width = 13, height = 7;
  std::mt19937 random(static_cast<unsigned>(16 * kind.colour + kind.bits));
  auto* to = std::fopen(file.c_str(), "wb");
  auto* png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  auto* info = png_create_info_struct(png);
  png_init_io(png, to);
  png_set_IHDR(png, info, width, height, kind.bits, kind.colour,
               kind.interlaced ? PNG_INTERLACE_ADAM7 : PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_gAMA(png, info, 0.3);
  if (kind.colour == PNG_COLOR_TYPE_PALETTE) {
    std::vector<png_color> palette(std::size_t{1} << kind.bits);
    for (auto& colour : palette)
      for (auto* part : {&colour.red, &colour.green, &colour.blue})
        *part = static_cast<png_byte>(random());
    png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
  }
  if (kind.has_transparency) {
    png_byte alphas[] = {0, 128};
    png_color_16 key{1, 1, 1, 1, 1};
    png_set_tRNS(png, info, alphas, 2, &key);
  }
  png_write_info(png, info);
  std::vector<std::vector<png_byte>> rows(height);
  std::vector<png_bytep> pointers;
  for (auto& row : rows) {
    row.resize(png_get_rowbytes(png, info));
    for (auto& byte : row) byte = static_cast<png_byte>(random());
    pointers.push_back(row.data());
  }
  png_write_image(png, pointers.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  std::fclose(to);
}

TEST_CASE(
    "PNGs of every colour type, depth, transparency and interlace are read as by OpenImageIO") {
  const Folder folder;
  const auto file = folder / "a.png";
  const std::vector<std::pair<int, std::vector<int>>> kinds{{PNG_COLOR_TYPE_GRAY, {1, 2, 4, 8, 16}},
                                                            {PNG_COLOR_TYPE_PALETTE, {1, 2, 4, 8}},
                                                            {PNG_COLOR_TYPE_RGB, {8, 16}},
                                                            {PNG_COLOR_TYPE_GRAY_ALPHA, {8, 16}},
                                                            {PNG_COLOR_TYPE_RGB_ALPHA, {8, 16}}};
  for (const auto& [colour, depths] : kinds)
    for (const int bits : depths)
      for (const bool has_transparency : {false, true})
        for (const bool interlaced : {false, true}) {
          if (has_transparency && (colour & PNG_COLOR_MASK_ALPHA) != 0) continue;
          CAPTURE(colour, bits, has_transparency, interlaced);
          write_png(file, {colour, bits, has_transparency, interlaced});
          REQUIRE(is_png(file));
          const auto ours = open_png(file), theirs = open_oiio(file);
          CHECK(ours.channels == theirs.channels);
          CHECK(ours.alpha_channel == theirs.alpha_channel);
          CHECK(ours.kind == theirs.kind);
          CHECK(ours.type == theirs.type);
          for (const char letter : std::string("RGBArgb")) {
            const std::vector<std::string> words{"channels", file.string(), {letter}};
            const auto one = read_image(open_png, words), other = read_image(open_oiio, words);
            CAPTURE(letter);
            CHECK(one[0].width == 13);
            CHECK(one[0].height == 7);
            const bool is_same = one[0].pixels == other[0].pixels;
            CHECK(is_same);
          }
        }
}

}  // namespace
}  // namespace raywave
