// SPDX-License-Identifier: Apache-2.0
// Writers of pictures by the library of each kind: OpenImageIO, which has all kinds, takes longer
// to load than most commands take. All are made in memory, so that a full disk is noticed.
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfOutputFile.h>
#include <png.h>
#include <tiffio.h>

#include <bit>
#include <csetjmp>
#include <cstdio>
#include <cstring>
#include <exception>
#include <limits>
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

/// Bytes of a file that a library writes; throws out of no library's frame.
struct Memory {
  Bytes bytes;
  std::size_t place = 0;

  void write(const void* data, std::size_t size) {
    if (place + size > bytes.size()) bytes.resize(place + size);
    std::memcpy(bytes.data() + place, data, size);
    place += size;
  }
};

/// A PNG that libpng writes. It leaves its functions by longjmp, over no object of C++.
class PngWriter {
public:
  PngWriter(const Picture& picture, int level, Bytes memory)
      : picture_(picture),
        memory_(std::move(memory)),
        png_(png_create_write_struct(PNG_LIBPNG_VER_STRING, this, &PngWriter::leave,
                                     [](png_structp, png_const_charp) {})),
        info_(png_ ? png_create_info_struct(png_) : nullptr) {
    memory_.clear();
    for (std::size_t y = 0; y < picture.height; ++y)
      rows_.push_back(const_cast<png_bytep>(picture.row(y).data()));
    const bool is_done = info_ && write(level);
    png_destroy_write_struct(&png_, &info_);
    if (!is_done) throw std::runtime_error(reason_);
  }

  Bytes& bytes() { return memory_; }

private:
  [[noreturn]] static void leave(png_structp png, png_const_charp message) {
    auto* self = static_cast<PngWriter*>(png_get_error_ptr(png));
    std::snprintf(self->reason_, sizeof self->reason_, "%s", message);
    png_longjmp(png, 1);
  }

  static void append(png_structp png, png_bytep data, std::size_t size) {
    auto& bytes = static_cast<PngWriter*>(png_get_io_ptr(png))->memory_;
    try {
      bytes.insert(bytes.end(), data, data + size);
      return;
    } catch (const std::exception&) {
    }
    png_error(png, "out of memory");
  }

  bool write(int level) {
    if (setjmp(png_jmpbuf(png_)) != 0) return false;
    constexpr png_uint_32 most = std::numeric_limits<std::int32_t>::max();
    png_set_user_limits(png_, most, most);
    png_set_write_fn(png_, this, &PngWriter::append, [](png_structp) {});
    png_set_compression_level(png_, level);
    png_set_compression_buffer_size(png_, 1 << 20);
    png_set_filter(png_, PNG_FILTER_TYPE_BASE,
                   level == 0 ? PNG_FILTER_NONE : PNG_FILTER_NONE | PNG_FILTER_SUB | PNG_FILTER_UP);
    png_set_IHDR(png_, info_, static_cast<png_uint_32>(picture_.width),
                 static_cast<png_uint_32>(picture_.height), static_cast<int>(8 * picture_.size),
                 picture_.channels == 1 ? PNG_COLOR_TYPE_GRAY : PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    // Levels hardly deflate: 16384 x 16384 take 8 s and 86 MB with the least effort, else 45 s
    // and 71 MB
    constexpr std::size_t large = std::size_t{1} << 25;
    if (level > 0 && picture_.row_bytes() * picture_.height > large)
      png_set_compression_level(png_, 1);
    png_write_info(png_, info_);
    if (picture_.size == 2) png_set_swap(png_);
    png_write_image(png_, rows_.data());
    png_write_end(png_, nullptr);
    return true;
  }

  const Picture& picture_;
  Bytes memory_;
  std::vector<png_bytep> rows_;
  char reason_[160] = "out of memory";
  png_structp png_;
  png_infop info_;
};

template <class... Numbers>
void put(Bytes& to, Numbers... numbers) {
  const auto one = [&](auto number) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(&number);
    to.insert(to.end(), bytes, bytes + sizeof number);
  };
  (one(numbers), ...);
}

/// 8-bit grey of a palette, or 24-bit colour; rows from the bottom, of a multiple of four bytes.
Bytes bmp_of(const Picture& picture) {
  const bool is_grey = picture.channels == 1;
  const auto row_bytes = (picture.row_bytes() + 3) / 4 * 4;
  if (row_bytes * picture.height > std::numeric_limits<std::int32_t>::max())
    throw std::invalid_argument("a BMP holds 2 GiB; take .png");
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

/// Deflated; a BigTIFF where 32 bits do not reach.
Bytes tiff_of(const Picture& picture) {
  Memory memory;
  const auto read = [](thandle_t, void*, tmsize_t) -> tmsize_t { return -1; };
  const auto write = [](thandle_t to, void* data, tmsize_t size) -> tmsize_t {
    try {
      static_cast<Memory*>(to)->write(data, static_cast<std::size_t>(size));
      return size;
    } catch (const std::exception&) {
      return -1;
    }
  };
  const auto seek = [](thandle_t to, toff_t offset, int from) -> toff_t {
    auto& all = *static_cast<Memory*>(to);
    const auto start = from == SEEK_SET ? 0 : from == SEEK_CUR ? all.place : all.bytes.size();
    return all.place = start + offset;
  };
  const auto close = [](thandle_t) { return 0; };
  const auto size = [](thandle_t of) -> toff_t { return static_cast<Memory*>(of)->bytes.size(); };
  constexpr std::size_t largest_small_tiff = 4'000'000'000;
  TIFFSetErrorHandler(nullptr);
  TIFF* tiff = TIFFClientOpen("memory", picture.bytes.size() > largest_small_tiff ? "w8" : "w",
                              &memory, read, write, seek, close, size, nullptr, nullptr);
  if (!tiff) throw std::bad_alloc();
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(picture.width));
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(picture.height));
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, static_cast<int>(picture.channels));
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * picture.size));
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC,
               picture.channels == 1 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
  TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
  TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, TIFFDefaultStripSize(tiff, 0));
  bool is_done = true;
  Bytes row;  // libtiff changes what it is given
  for (std::size_t y = 0; is_done && y < picture.height; ++y) {
    row.assign(picture.row(y).begin(), picture.row(y).end());
    is_done = TIFFWriteScanline(tiff, row.data(), static_cast<std::uint32_t>(y), 0) == 1;
  }
  is_done = TIFFFlush(tiff) == 1 && is_done;
  TIFFClose(tiff);
  if (!is_done) throw std::bad_alloc();
  return std::move(memory.bytes);
}

class ExrStream : public Imf::OStream {
public:
  ExrStream() : Imf::OStream("memory") {}
  void write(const char data[], int size) override {
    memory_.write(data, static_cast<std::size_t>(size));
  }
  std::uint64_t tellp() override { return memory_.place; }
  void seekp(std::uint64_t place) override { memory_.place = place; }
  Bytes& bytes() { return memory_.bytes; }

private:
  Memory memory_;
};

/// One channel is Y, two or three are R, G and B.
Bytes exr_of(const Picture& picture) {
  Imf::Header header(static_cast<int>(picture.width), static_cast<int>(picture.height));
  header.compression() = Imf::ZIP_COMPRESSION;
  Imf::FrameBuffer numbers;
  for (std::size_t i = 0; i < picture.channels; ++i) {
    const std::string name(1, picture.channels == 1 ? 'Y' : "RGB"[i]);
    header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    auto* first = reinterpret_cast<char*>(const_cast<std::uint8_t*>(picture.bytes.data()));
    numbers.insert(
        name, Imf::Slice(Imf::FLOAT, first + 4 * i, 4 * picture.channels, picture.row_bytes()));
  }
  ExrStream stream;
  {
    Imf::OutputFile file(stream, header, 0);
    file.setFrameBuffer(numbers);
    file.writePixels(static_cast<int>(picture.height));
  }
  return std::move(stream.bytes());
}

void save(const std::filesystem::path& file, const Picture& picture) {
  const auto kind = extension_of(file);
  const auto bytes = [&] {
    if (kind == ".exr" && picture.size == 4) return exr_of(picture);
    if (kind == ".png" && picture.size <= 2) return std::move(PngWriter(picture, 6, {}).bytes());
    if (kind == ".tif" && picture.size <= 2) return tiff_of(picture);
    if (kind == ".bmp" && picture.size == 1) return bmp_of(picture);
    throw std::invalid_argument("integers go to .png, .bmp or .tif, floats to .exr");
  };
  Bytes whole;
  try {
    whole = bytes();
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    throw InputError(in_quotes(file.string()) + ": cannot be written: " + error.what());
  }
  write_whole(file, [&](OutputFile& to) { to.write(whole.data(), whole.size()); });
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
  png = std::move(PngWriter(picture_of(width, height, levels), 0, std::move(png)).bytes());
}

}  // namespace raywave
