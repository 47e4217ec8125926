// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/scene/image.hpp"

namespace raywave {
namespace {

/// Holograms are small for OpenImageIO: its threads take longer to end than they save.
void stay_in_one_thread() {
  [[maybe_unused]] static const bool once =
      OIIO::attribute("threads", 1) && OIIO::attribute("exr_threads", -1);
}

/// True when a picture file holds these pixels.
bool holds(const std::filesystem::path& file, const OIIO::ImageSpec& spec, const void* pixels) {
  const auto input = OIIO::ImageInput::open(file.string());
  if (!input || input->spec().width != spec.width || input->spec().height != spec.height ||
      input->spec().nchannels != spec.nchannels)
    return false;
  std::vector<unsigned char> read(spec.image_bytes());
  return input->read_image(0, 0, 0, spec.nchannels, spec.format, read.data()) &&
         std::memcmp(read.data(), pixels, read.size()) == 0;
}

/// OpenImageIO's writers do not say when a disk is full. So it writes to memory; where a format
/// cannot, the file is read again.
void save(const std::filesystem::path& file, int width, int height, int channels,
          OIIO::TypeDesc format, const void* pixels) {
  stay_in_one_thread();
  const auto output = OIIO::ImageOutput::create(file.string());
  const auto check = [&](bool done) {
    if (!done)
      throw InputError(in_quotes(file.string()) + ": cannot be written: " +
                       one_line(output ? output->geterror() : OIIO::geterror()));
  };
  check(output != nullptr);
  const OIIO::ImageSpec spec(width, height, channels, format);
  const auto write = [&](const std::string& name) {
    check(output->open(name, spec));
    check(output->write_image(format, pixels));
    check(output->close());
  };
  if (output->supports("ioproxy")) {
    std::vector<unsigned char> bytes;
    bytes.reserve(spec.image_bytes());
    OIIO::Filesystem::IOVecOutput memory(bytes);
    check(output->set_ioproxy(&memory));
    write(file.string());
    write_whole(file, [&](OutputFile& to) { to.write(bytes.data(), bytes.size()); });
  } else {
    write_whole_by_name(file, [&](const std::filesystem::path& temporary) {
      write(temporary.string());
      if (!holds(temporary, spec, pixels))
        throw InputError(in_quotes(file.string()) +
                         ": cannot be written: what lies there is another picture; is the disk "
                         "full?");
    });
  }
}

template <class T>
void require_size(int width, int height, int channels, std::span<const T> pixels) {
  if (width < 1 || height < 1 || pixels.size() != std::size_t{1} * width * height * channels)
    throw std::invalid_argument("save: the pixels do not fill width * height");
}

}  // namespace

void save_png(const std::filesystem::path& file, int width, int height,
              std::span<const std::uint8_t> pixels) {
  require_size(width, height, 1, pixels);
  save(file, width, height, 1, OIIO::TypeUInt8, pixels.data());
}

void save_png_rgb(const std::filesystem::path& file, int width, int height,
                  std::span<const std::uint8_t> pixels) {
  require_size(width, height, 3, pixels);
  save(file, width, height, 3, OIIO::TypeUInt8, pixels.data());
}

void save_grey(const std::filesystem::path& file, int width, int height,
               std::span<const std::uint8_t> pixels) {
  require_size(width, height, 1, pixels);
  save(file, width, height, 1, OIIO::TypeUInt8, pixels.data());
}

void save_png16(const std::filesystem::path& file, int width, int height,
                std::span<const std::uint16_t> pixels) {
  require_size(width, height, 1, pixels);
  save(file, width, height, 1, OIIO::TypeUInt16, pixels.data());
}

void save_exr(const std::filesystem::path& file, int width, int height,
              std::span<const std::complex<float>> pixels) {
  require_size(width, height, 1, pixels);
  save(file, width, height, 2, OIIO::TypeFloat, pixels.data());
}

void save_exr_rgb(const std::filesystem::path& file, int width, int height,
                  std::span<const float> pixels) {
  require_size(width, height, 3, pixels);
  save(file, width, height, 3, OIIO::TypeFloat, pixels.data());
}

void save_exr(const std::filesystem::path& file, int width, int height,
              std::span<const float> pixels) {
  require_size(width, height, 1, pixels);
  save(file, width, height, 1, OIIO::TypeFloat, pixels.data());
}

}  // namespace raywave
