// SPDX-License-Identifier: Apache-2.0
#include <OpenImageIO/imageio.h>
#include <webp/decode.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>

#include "host/common/error.hpp"
#include "host/scene/oiio_name.hpp"
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

constexpr int kMaxTextureSide = 16384;
constexpr int kMaxChannels = 64;

/// A picture, and where OpenImageIO would multiply its colours by alpha (WebP), what libwebp says.
struct Picture {
  std::unique_ptr<OIIO::ImageInput> input;
  std::vector<std::uint8_t> rgba{};

  const OIIO::ImageSpec& spec() const { return input->spec(); }
};

std::vector<std::uint8_t> webp_of(const std::filesystem::path& file, const OIIO::ImageSpec& spec) {
  std::ifstream stream(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(stream)), {});
  std::vector<std::uint8_t> rgba(std::size_t{4} * spec.width * spec.height);
  if (!WebPDecodeRGBAInto(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(),
                          rgba.data(), rgba.size(), 4 * spec.width))
    throw InputError("is a damaged WebP, or an animation");
  return rgba;
}

/// Opens a picture and checks the size that it claims.
Picture open(const std::filesystem::path& file, int max_side) {
  OIIO::ImageSpec as_stored;
  as_stored["oiio:UnassociatedAlpha"] = 1;  // colours not multiplied by alpha
  const OiioName name(file);
  Picture picture{OIIO::ImageInput::open(name.text(), &as_stored)};
  if (!picture.input) {
    const auto reason = OIIO::geterror();
    if (!OIIO::ImageInput::create(name.text())) {
      OIIO::geterror();  // else it is printed at the end
      throw InputError("is no picture of a known format, such as PNG, JPEG, TIFF, TGA or EXR");
    }
    throw InputError(reason);
  }
  const OIIO::ImageSpec& spec = picture.spec();
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.width > max_side ||
      spec.height > max_side)
    throw InputError("its size is " + std::to_string(spec.width) + " x " +
                     std::to_string(spec.height) + ", and each side must be 1 to " +
                     std::to_string(max_side));
  if (spec.nchannels < 1 || spec.nchannels > kMaxChannels || spec.deep)
    throw InputError("must have 1 to " + std::to_string(kMaxChannels) + " channels");
  if (picture.input->format_name() == std::string_view("webp") && spec.nchannels == 4)
    picture.rgba = webp_of(file, spec);
  return picture;
}

/// One channel as float; integer formats are divided by the format's largest number.
Image read(const Picture& picture, int channel) {
  Image image{picture.spec().width, picture.spec().height, {}};
  image.pixels.resize(std::size_t{1} * image.width * image.height);
  if (!picture.rgba.empty()) {
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
      image.pixels[i] = picture.rgba[4 * i + static_cast<std::size_t>(channel)] / 255.0f;
    return image;
  }
  auto& input = *picture.input;
  if (!input.read_image(0, 0, channel, channel + 1, OIIO::TypeFloat, image.pixels.data()))
    throw InputError(input.geterror());
  if (!std::all_of(image.pixels.begin(), image.pixels.end(),
                   [](float v) { return std::isfinite(v); }))
    throw InputError("holds NaN or infinity");
  return image;
}

/// One channel as linear light: integer formats are sRGB.
Image read_linear(const Picture& input, int channel) {
  Image image = read(input, channel);
  if (!input.spec().format.is_floating_point())
    std::transform(image.pixels.begin(), image.pixels.end(), image.pixels.begin(),
                   linear_from_srgb);
  return image;
}

Image read_texture(const std::filesystem::path& file, int channel) {
  const auto input = open(file, kMaxTextureSide);
  return read_linear(input, input.spec().nchannels < 3 ? 0 : channel);
}

/// The channel of a letter, as load_channels has them.
Image read_channel(const Picture& input, char letter) {
  const auto& spec = input.spec();
  const std::string_view light = "rgb", data = "RGB";
  const auto place = [&](std::string_view letters) {
    return spec.nchannels < 3 ? 0 : static_cast<int>(letters.find(letter));
  };
  if (light.find(letter) != std::string_view::npos) return read_linear(input, place(light));
  if (data.find(letter) != std::string_view::npos) return read(input, place(data));
  if (letter != 'A') throw std::invalid_argument("no such channel");
  if (spec.alpha_channel >= 0) return read(input, spec.alpha_channel);
  Image opaque{spec.width, spec.height, {}};
  opaque.pixels.resize(std::size_t{1} * spec.width * spec.height, 1.0f);
  return opaque;
}

std::vector<Image> read_channels(const std::filesystem::path& file, const std::string& letters) {
  const auto input = open(file, kMaxTextureSide);
  std::vector<Image> channels;
  for (const char letter : letters) channels.push_back(read_channel(input, letter));
  return channels;
}

Picture open_grey(const std::filesystem::path& file) {
  auto input = open(file, kMaxTextureSide);
  if (input.spec().nchannels != 1)
    throw InputError("must be grey; it has " + std::to_string(input.spec().nchannels) +
                     " channels");
  return input;
}

Image read_grey(const std::filesystem::path& file) { return read_linear(open_grey(file), 0); }

/// Floats as they are, integers as they are stored.
Image read_numbers(const std::filesystem::path& file) {
  const auto input = open_grey(file);
  const auto& spec = input.spec();
  if (!spec.format.is_floating_point() && spec.format != OIIO::TypeUInt8 &&
      spec.format != OIIO::TypeUInt16)
    throw InputError(std::string("must be of floats, or integers of 8 or 16 bits, and is of ") +
                     spec.format.c_str());
  Image image = read(input, 0);
  const float largest = spec.format == OIIO::TypeUInt8    ? 255.0f
                        : spec.format == OIIO::TypeUInt16 ? 65535.0f
                                                          : 1.0f;
  for (float& pixel : image.pixels) pixel = largest == 1 ? pixel : std::round(pixel * largest);
  return image;
}

Image read_levels(const std::filesystem::path& file) {
  const auto input = open(file, largest_picture_side);
  constexpr std::array lossless{"png", "bmp", "tiff"};
  if (std::find(lossless.begin(), lossless.end(), std::string(input.input->format_name())) ==
      lossless.end())
    throw InputError(std::string("is a picture of kind ") + input.input->format_name() +
                     ", which may lose levels; give png, bmp or tiff");
  const OIIO::ImageSpec& spec = input.spec();
  if (spec.nchannels != 1 || (spec.format != OIIO::TypeUInt8 && spec.format != OIIO::TypeUInt16))
    throw InputError("must be grey of 8 or 16 bits; it has " + std::to_string(spec.nchannels) +
                     " channels of type " + spec.format.c_str());
  return read(input, 0);
}

}  // namespace

std::vector<Image> read_image(const std::vector<std::string>& arguments) {
  // Threads count against the limits.
  OIIO::attribute("threads", 1);
  OIIO::attribute("exr_threads", -1);
  const auto &kind = arguments.at(0), &file = arguments.at(1);
  if (kind == "texture") return {read_texture(file, std::stoi(arguments.at(2)))};
  if (kind == "channels") return read_channels(file, arguments.at(2));
  if (kind == "grey") return {read_grey(file)};
  if (kind == "numbers") return {read_numbers(file)};
  if (kind == "levels") return {read_levels(file)};
  throw std::invalid_argument("raywave and its reader are not of the same version");
}

}  // namespace raywave
