// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader/picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "host/common/error.hpp"
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

constexpr int kMaxTextureSide = 16384;
constexpr int kMaxChannels = 64;

/// Checks the size that a picture claims.
StoredPicture checked(StoredPicture picture, int max_side) {
  if (picture.width < 1 || picture.height < 1 || picture.width > max_side ||
      picture.height > max_side)
    throw InputError("its size is " + std::to_string(picture.width) + " x " +
                     std::to_string(picture.height) + ", and each side must be 1 to " +
                     std::to_string(max_side));
  if (picture.channels < 1 || picture.channels > kMaxChannels)
    throw InputError("must have 1 to " + std::to_string(kMaxChannels) + " channels");
  return picture;
}

StoredPicture of_one_channel(StoredPicture picture) {
  if (picture.channels != 1)
    throw InputError("must be grey; it has " + std::to_string(picture.channels) + " channels");
  return picture;
}

Image read(const StoredPicture& picture, int channel) {
  Image image{picture.width, picture.height, picture.read(channel)};
  if (!std::all_of(image.pixels.begin(), image.pixels.end(),
                   [](float v) { return std::isfinite(v); }))
    throw InputError("holds NaN or infinity");
  return image;
}

/// One channel as linear light: integer formats are sRGB.
Image read_linear(const StoredPicture& picture, int channel) {
  Image image = read(picture, channel);
  if (!picture.is_float)
    std::transform(image.pixels.begin(), image.pixels.end(), image.pixels.begin(),
                   linear_from_srgb);
  return image;
}

/// The channel of a letter, as load_channels has them.
Image read_channel(const StoredPicture& picture, char letter) {
  const std::string_view light = "rgb", data = "RGB";
  const auto place = [&](std::string_view letters) {
    return picture.channels < 3 ? 0 : static_cast<int>(letters.find(letter));
  };
  if (light.find(letter) != std::string_view::npos) return read_linear(picture, place(light));
  if (data.find(letter) != std::string_view::npos) return read(picture, place(data));
  if (letter != 'A') throw std::invalid_argument("no such channel");
  if (picture.alpha_channel >= 0) return read(picture, picture.alpha_channel);
  return {picture.width, picture.height,
          std::vector<float>(std::size_t{1} * picture.width * picture.height, 1.0f)};
}

/// Floats as they are, integers as they are stored.
Image read_numbers(const StoredPicture& picture) {
  const bool is_small = picture.type == "uint8";
  if (!picture.is_float && !is_small && picture.type != "uint16")
    throw InputError("must be of floats, or integers of 8 or 16 bits, and is of " + picture.type);
  Image image = read(picture, 0);
  if (!picture.is_float)
    for (float& pixel : image.pixels) pixel = std::round(pixel * (is_small ? 255.0f : 65535.0f));
  return image;
}

Image read_levels(const StoredPicture& picture) {
  constexpr std::array lossless{"png", "bmp", "tiff"};
  if (std::find(lossless.begin(), lossless.end(), picture.kind) == lossless.end())
    throw InputError("is a picture of kind " + picture.kind +
                     ", which may lose levels; give png, bmp or tiff");
  if (picture.channels != 1 || (picture.type != "uint8" && picture.type != "uint16"))
    throw InputError("must be grey of 8 or 16 bits; it has " + std::to_string(picture.channels) +
                     " channels of type " + picture.type);
  return read(picture, 0);
}

}  // namespace

std::vector<Image> read_image(const OpenPicture& open, const std::vector<std::string>& arguments) {
  const auto& kind = arguments.at(0);
  auto picture =
      checked(open(arguments.at(1)), kind == "levels" ? largest_picture_side : kMaxTextureSide);
  if (kind == "texture")
    return {read_linear(picture, picture.channels < 3 ? 0 : std::stoi(arguments.at(2)))};
  if (kind == "channels") {
    std::vector<Image> channels;
    for (const char letter : arguments.at(2)) channels.push_back(read_channel(picture, letter));
    return channels;
  }
  if (kind == "grey") return {read_linear(of_one_channel(std::move(picture)), 0)};
  if (kind == "numbers") return {read_numbers(of_one_channel(std::move(picture)))};
  if (kind == "levels") return {read_levels(picture)};
  throw std::invalid_argument("raywave and its reader are not of the same version");
}

}  // namespace raywave
