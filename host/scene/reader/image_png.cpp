// SPDX-License-Identifier: Apache-2.0
#include <png.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <fstream>
#include <memory>

#include "host/common/error.hpp"
#include "host/scene/reader/picture.hpp"

namespace raywave {
namespace {

constexpr std::array<char, 8> signature{'\x89', 'P', 'N', 'G', '\r', '\n', '\x1a', '\n'};

/// A PNG that is being read. libpng leaves its functions by longjmp, over no object of C++.
class PngFile {
public:
  explicit PngFile(const std::filesystem::path& file)
      : file_(std::fopen(file.c_str(), "rb")),
        png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, this, &PngFile::leave,
                                    [](png_structp, png_const_charp) {})),
        info_(png_ ? png_create_info_struct(png_) : nullptr) {
    const bool can_read = file_ && info_ && read_head();
    if (!can_read) {
      close();
      throw InputError(reason_);
    }
  }
  ~PngFile() { close(); }
  PngFile(const PngFile&) = delete;
  PngFile& operator=(const PngFile&) = delete;

  StoredPicture facts() const {
    const int channels = png_get_channels(png_, info_);
    StoredPicture picture;
    // What an int does not hold is too large anyway
    picture.width = static_cast<int>(std::min(png_get_image_width(png_, info_), 1u << 30));
    picture.height = static_cast<int>(std::min(png_get_image_height(png_, info_), 1u << 30));
    picture.channels = channels;
    picture.alpha_channel = channels % 2 == 0 ? channels - 1 : -1;
    picture.kind = "png";
    picture.type = png_get_bit_depth(png_, info_) == 16 ? "uint16" : "uint8";
    return picture;
  }

  std::vector<float> read(int channel) {
    const std::size_t width = png_get_image_width(png_, info_),
                      height = png_get_image_height(png_, info_),
                      row_bytes = png_get_rowbytes(png_, info_),
                      channels = png_get_channels(png_, info_);
    const bool is_deep = png_get_bit_depth(png_, info_) == 16;
    if (bytes_.empty()) {
      bytes_.resize(row_bytes * height);
      for (std::size_t y = 0; y < height; ++y) rows_.push_back(bytes_.data() + y * row_bytes);
      if (!read_pixels()) throw InputError(reason_);
    }
    std::vector<float> numbers;
    numbers.reserve(width * height);
    for (const auto* row : rows_)
      for (std::size_t x = 0; x < width; ++x) {
        const auto* number =
            row + (x * channels + static_cast<std::size_t>(channel)) * (is_deep ? 2 : 1);
        numbers.push_back(is_deep ? static_cast<float>(number[0] * 256 + number[1]) * (1 / 65535.0f)
                                  : static_cast<float>(number[0]) * (1 / 255.0f));
      }
    return numbers;
  }

private:
  [[noreturn]] static void leave(png_structp png, png_const_charp message) {
    auto* self = static_cast<PngFile*>(png_get_error_ptr(png));
    std::snprintf(self->reason_, sizeof self->reason_, "%s", message);
    png_longjmp(png, 1);
  }

  bool read_head() {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_init_io(png_, file_);
    png_read_info(png_, info_);
    png_set_expand(png_);  // palettes to colours, few bits to 8, a transparent colour to alpha
    png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    return true;
  }

  bool read_pixels() {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    png_read_image(png_, rows_.data());
    png_read_end(png_, nullptr);
    return true;
  }

  void close() {
    png_destroy_read_struct(&png_, &info_, nullptr);
    if (file_) std::fclose(file_);
  }

  char reason_[160] = "cannot be opened";
  std::FILE* file_;
  png_structp png_;
  png_infop info_;
  std::vector<png_byte> bytes_;
  std::vector<png_bytep> rows_;
};

}  // namespace

bool is_png(const std::filesystem::path& file) {
  std::array<char, signature.size()> first{};
  std::ifstream(file, std::ios::binary).read(first.data(), first.size());
  return first == signature;
}

StoredPicture open_png(const std::filesystem::path& file) {
  const auto png = std::make_shared<PngFile>(file);
  auto picture = png->facts();
  picture.read = [png](int channel) { return png->read(channel); };
  return picture;
}

}  // namespace raywave
