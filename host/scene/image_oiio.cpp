// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string_view>

#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/scene/image.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

constexpr int kMaxTextureSide = 16384;
constexpr int kMaxChannels = 64;

float linear_from_srgb(float s) {
  return s <= 0.04045f ? s / 12.92f : std::pow((s + 0.055f) / 1.055f, 2.4f);
}

/// One thread: a forked child has no other, and would wait for those that its parent had. To read,
/// the child says so itself: the threads that OpenImageIO ends by it take their time, and what they
/// hold at a fork stays held in the child.
void stay_in_one_thread() {
  [[maybe_unused]] static const bool once =
      OIIO::attribute("threads", 1) && OIIO::attribute("exr_threads", -1);
}

/// An opened picture whose claims about its size have been checked.
std::unique_ptr<OIIO::ImageInput> open(const std::filesystem::path& file, int max_side) {
  OIIO::ImageSpec as_stored;
  as_stored["oiio:UnassociatedAlpha"] = 1;  // colours not multiplied by alpha
  auto input = OIIO::ImageInput::open(file.string(), &as_stored);
  if (!input) throw InputError(OIIO::geterror());
  const OIIO::ImageSpec& spec = input->spec();
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.width > max_side ||
      spec.height > max_side)
    throw InputError("its size is " + std::to_string(spec.width) + " x " +
                     std::to_string(spec.height) + ", and each side must be 1 to " +
                     std::to_string(max_side));
  if (spec.nchannels < 1 || spec.nchannels > kMaxChannels || spec.deep)
    throw InputError("must have 1 to " + std::to_string(kMaxChannels) + " channels");
  return input;
}

/// One channel as float; of integer formats, shares of the format's largest number.
Image read(OIIO::ImageInput& input, int channel) {
  Image image{input.spec().width, input.spec().height, {}};
  image.pixels.resize(std::size_t{1} * image.width * image.height);
  if (!input.read_image(0, 0, channel, channel + 1, OIIO::TypeFloat, image.pixels.data()))
    throw InputError(input.geterror());
  if (!std::all_of(image.pixels.begin(), image.pixels.end(),
                   [](float v) { return std::isfinite(v); }))
    throw InputError("holds NaN or infinity");
  return image;
}

/// One channel as linear light: integer formats are sRGB.
Image read_linear(OIIO::ImageInput& input, int channel) {
  Image image = read(input, channel);
  if (!input.spec().format.is_floating_point())
    std::transform(image.pixels.begin(), image.pixels.end(), image.pixels.begin(),
                   linear_from_srgb);
  return image;
}

/// Calls `make` in a child, because readers of pictures print, and may crash, on damaged files.
Image load_safely(const std::filesystem::path& file, const std::string& where,
                  const std::function<Image()>& make) {
  const auto fail = [&](std::string_view what) {
    throw InputError((where.empty() ? "" : where + ": ") + "picture " + in_quotes(file.string()) +
                     ": " + one_line(what));
  };
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) fail("there is no such file");
  Image image;
  try {
    run_in_child(
        {30, std::uint64_t{6} << 30},
        [&] {
          stay_in_one_thread();
          image = make();
        },
        [&](ChildPipe& pipe) { send(pipe, image); },
        [&](ChildPipe& pipe) { image = receive_image(pipe); });
  } catch (const std::exception& failure) {
    fail(failure.what());
  }
  return image;
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

Image load_texture(const std::filesystem::path& file, int channel, const std::string& where) {
  return load_safely(file, where, [&] {
    const auto input = open(file, kMaxTextureSide);
    return read_linear(*input, input->spec().nchannels < 3 ? 0 : channel);
  });
}

Image load_grey(const std::filesystem::path& file, const std::string& where) {
  return load_safely(file, where, [&] {
    const auto input = open(file, kMaxTextureSide);
    if (input->spec().nchannels != 1)
      throw InputError("must be grey; it has " + std::to_string(input->spec().nchannels) +
                       " channels");
    return read_linear(*input, 0);
  });
}

Image load_levels(const std::filesystem::path& file, const std::string& where) {
  return load_safely(file, where, [&] {
    const auto input = open(file, largest_picture_side);
    const OIIO::ImageSpec& spec = input->spec();
    if (spec.nchannels != 1 || (spec.format != OIIO::TypeUInt8 && spec.format != OIIO::TypeUInt16))
      throw InputError("must be grey of 8 or 16 bits; it has " + std::to_string(spec.nchannels) +
                       " channels of type " + spec.format.c_str());
    return read(*input, 0);
  });
}

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

void save_exr(const std::filesystem::path& file, int width, int height,
              std::span<const float> pixels) {
  require_size(width, height, 1, pixels);
  save(file, width, height, 1, OIIO::TypeFloat, pixels.data());
}

}  // namespace raywave
