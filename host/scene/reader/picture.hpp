// SPDX-License-Identifier: Apache-2.0
/// Pictures as readers of their kinds open them, and the channels that raywave asks for.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "host/scene/image.hpp"

namespace raywave {

struct StoredPicture {
  int width = 0, height = 0, channels = 0;
  int alpha_channel = -1;  // -1: none
  std::string kind;        // "png", "openexr"
  std::string type;        // of a number: "uint8", "float"
  bool is_float = false;
  /// A channel; integers are divided by their largest number. Is called after the size was found
  /// good.
  std::function<std::vector<float>(int channel)> read;
};

/// Opens a picture, and reads none of its pixels yet.
///
/// throws  std::exception with the reason
using OpenPicture = std::function<StoredPicture(const std::filesystem::path& file)>;

/// Kinds that OpenImageIO reads.
StoredPicture open_oiio(const std::filesystem::path& file);

/// PNG, which is read often and is quick to open (libpng).
StoredPicture open_png(const std::filesystem::path& file);

/// True when a file begins as PNGs do.
bool is_png(const std::filesystem::path& file);

/// Channels of a picture.
///
/// arguments  "texture" FILE CHANNEL as load_texture reads it, "channels" FILE LETTERS as
///            load_channels does, "grey" FILE as load_grey, "numbers" FILE as load_numbers, or
///            "levels" FILE as load_levels
std::vector<Image> read_image(const OpenPicture& open, const std::vector<std::string>& arguments);

}  // namespace raywave
