// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/imageio.h>

#include <memory>
#include <stdexcept>

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

void save(const std::filesystem::path& file, int width, int height, int channels,
          OIIO::TypeDesc format, const void* pixels) {
  stay_in_one_thread();
  write_whole(file, [&](const std::filesystem::path& temporary) {
    const auto output = OIIO::ImageOutput::create(temporary.string());
    const auto check = [&](bool done) {
      if (!done)
        throw InputError(in_quotes(file.string()) + ": cannot be written: " +
                         one_line(output ? output->geterror() : OIIO::geterror()));
    };
    check(output != nullptr);
    check(output->open(temporary.string(), OIIO::ImageSpec(width, height, channels, format)));
    check(output->write_image(format, pixels));
    check(output->close());
  });
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

void save_exr(const std::filesystem::path& file, int width, int height,
              std::span<const float> pixels) {
  require_size(width, height, 1, pixels);
  save(file, width, height, 1, OIIO::TypeFloat, pixels.data());
}

}  // namespace raywave
