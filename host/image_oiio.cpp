// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "host/error.hpp"
#include "host/image.hpp"
#include "host/output.hpp"
#include "host/text.hpp"

namespace raywave {
namespace {

constexpr int kMaxTextureSide = 16384, kMaxLevelsSide = 65536;  // levels: a hologram's resolution
constexpr int kMaxChannels = 64;

float linear_from_srgb(float s) { return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f); }

/// An opened picture whose claims about its size have been checked.
struct Reader {
  std::string subject;  // the start of messages
  std::unique_ptr<OIIO::ImageInput> input;

  Reader(const std::filesystem::path& file, const std::string& where, int max_side)
      : subject((where.empty() ? "" : where + ": ") + "picture " + in_quotes(file.string())) {
    std::error_code error;
    if (!std::filesystem::is_regular_file(file, error)) throw InputError(subject + ": there is no such file");
    OIIO::ImageSpec as_stored;
    as_stored["oiio:UnassociatedAlpha"] = 1;  // colours not multiplied by alpha
    input = OIIO::ImageInput::open(file.string(), &as_stored);
    if (!input) throw InputError(subject + ": cannot be read: " + one_line(OIIO::geterror()));
    const OIIO::ImageSpec& s = spec();
    if (s.width < 1 || s.height < 1 || s.depth > 1 || s.width > max_side || s.height > max_side)
      throw InputError(subject + ": its size is " + std::to_string(s.width) + " x " + std::to_string(s.height) +
                       ", and each side must be 1 to " + std::to_string(max_side));
    if (s.nchannels < 1 || s.nchannels > kMaxChannels || s.deep)
      throw InputError(subject + ": must have 1 to " + std::to_string(kMaxChannels) + " channels");
  }

  const OIIO::ImageSpec& spec() const { return input->spec(); }

  /// One channel as float; of integer formats, shares of the format's largest number.
  Image read(int channel) {
    Image image{spec().width, spec().height, {}};
    image.pixels.resize(std::size_t{1} * image.width * image.height);
    if (!input->read_image(0, 0, channel, channel + 1, OIIO::TypeFloat, image.pixels.data()))
      throw InputError(subject + ": cannot be read: " + one_line(input->geterror()));
    if (!std::all_of(image.pixels.begin(), image.pixels.end(), [](float v) { return std::isfinite(v); }))
      throw InputError(subject + ": holds NaN or infinity");
    return image;
  }
};

void save(const std::filesystem::path& file, int width, int height, int channels, OIIO::TypeDesc format, const void* pixels) {
  write_whole(file, [&](const std::filesystem::path& temporary) {
    const auto output = OIIO::ImageOutput::create(temporary.string());
    const auto check = [&](bool done) {
      if (!done)
        throw InputError(in_quotes(file.string()) + ": cannot be written: " + one_line(output ? output->geterror() : OIIO::geterror()));
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

Image load_texture(const std::filesystem::path& file, int channel, const std::string& where) {
  Reader reader(file, where, kMaxTextureSide);
  const bool is_grey = reader.spec().nchannels < 3;
  const bool is_linear = reader.spec().format.is_floating_point();
  Image image = reader.read(is_grey ? 0 : channel);
  if (!is_linear) std::transform(image.pixels.begin(), image.pixels.end(), image.pixels.begin(), linear_from_srgb);
  return image;
}

Image load_grey(const std::filesystem::path& file, const std::string& where) {
  Reader reader(file, where, kMaxTextureSide);
  if (reader.spec().nchannels != 1)
    throw InputError(reader.subject + ": must be grey; it has " + std::to_string(reader.spec().nchannels) + " channels");
  return load_texture(file, 0, where);
}

Image load_levels(const std::filesystem::path& file, const std::string& where) {
  Reader reader(file, where, kMaxLevelsSide);
  const OIIO::TypeDesc format = reader.spec().format;
  if (reader.spec().nchannels != 1 || (format != OIIO::TypeUInt8 && format != OIIO::TypeUInt16))
    throw InputError(reader.subject + ": must be grey of 8 or 16 bits; it has " + std::to_string(reader.spec().nchannels) +
                     " channels of type " + format.c_str());
  return reader.read(0);
}

void save_png(const std::filesystem::path& file, int width, int height, std::span<const std::uint8_t> pixels) {
  require_size(width, height, 1, pixels);
  save(file, width, height, 1, OIIO::TypeUInt8, pixels.data());
}

void save_png_rgb(const std::filesystem::path& file, int width, int height, std::span<const std::uint8_t> pixels) {
  require_size(width, height, 3, pixels);
  save(file, width, height, 3, OIIO::TypeUInt8, pixels.data());
}

void save_exr(const std::filesystem::path& file, int width, int height, std::span<const float> pixels) {
  require_size(width, height, 1, pixels);
  save(file, width, height, 1, OIIO::TypeFloat, pixels.data());
}

}  // namespace raywave
