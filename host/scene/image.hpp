// SPDX-License-Identifier: Apache-2.0
/// Reading and writing of pictures. Row 0 is the top.
#pragma once

#include <complex>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "host/scene/read_data.hpp"

namespace raywave {

/// Reads one channel (0 red, 1 green, 2 blue; a grey picture has one for all) as linear values:
/// integer formats are decoded from sRGB, float formats are taken as they are.
///
/// throws  InputError, starting with `where`, when the file is unreadable, larger than 16384 x
///         16384, or holds NaN or infinity
Image load_texture(const std::filesystem::path& file, int channel, const std::string& where);

/// Reads several channels of a picture in one go, one for each letter: r, g or b as load_texture
/// reads them; R, G or B as stored, integers divided by the format's largest number; A its alpha, 1
/// everywhere where it has none.
std::vector<Image> load_channels(const std::filesystem::path& file, const std::string& letters,
                                 const std::string& where);

/// The same of a picture that is in memory.
///
/// bytes  of the picture's file
/// name   for messages
std::vector<Image> load_channels(std::span<const char> bytes, const std::string& name,
                                 const std::string& letters, const std::string& where);

/// Prepares a channel for light: what filters of other programs ring below black becomes 0.
///
/// name    of the picture, for messages
/// throws  InputError, starting with `where`, when a texel is brighter than 1e30
void limit_texels(Image& image, const std::string& name, const std::string& where);

/// Red, green and blue of a picture as the channels of one, from its first three.
Image stacked(std::span<const Image> channels);

/// Reads a grey picture, as `raywave reconstruct` writes them, as linear values: integer formats
/// are decoded from sRGB, float formats are taken as they are.
///
/// throws  InputError like load_texture, and when the picture has more than one channel
Image load_grey(const std::filesystem::path& file, const std::string& where);

/// Reads a grey picture of numbers: floats as they are, integers as they are stored, 0 to 255 or
/// 65535.
Image load_numbers(const std::filesystem::path& file, const std::string& where);

/// Reads the grey levels of a hologram: an 8-bit or 16-bit grey picture, as stored numbers divided
/// by the format's largest number, without sRGB decoding.
Image load_levels(const std::filesystem::path& file, const std::string& where);

/// Writes a picture, values as they are, in the format that the file's extension tells: integers as
/// PNG, BMP or TIFF, floats, which are linear, as OpenEXR. The file appears complete or not at all
/// (temporary name, then rename).
///
/// pixels  one number for each pixel (grey) or three side by side (red, green, blue). A complex
///         field has its real part as red, its imaginary part as green
void save_picture(const std::filesystem::path& file, int width, int height,
                  std::span<const std::uint8_t> pixels);
void save_picture(const std::filesystem::path& file, int width, int height,
                  std::span<const std::uint16_t> pixels);
void save_picture(const std::filesystem::path& file, int width, int height,
                  std::span<const float> pixels);
void save_picture(const std::filesystem::path& file, int width, int height,
                  std::span<const std::complex<float>> pixels);

/// Makes the bytes of a grey PNG without compression. Holograms look like noise, of which
/// compression saves nothing.
///
/// png  gets the bytes; its memory is used again
void uncompressed_png(int width, int height, std::span<const std::uint8_t> levels,
                      std::vector<std::uint8_t>& png);

}  // namespace raywave
