// SPDX-License-Identifier: Apache-2.0
/// Pictures of what lasers show, in linear sRGB, and how alike two of them are
/// (docs/colour.md).
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <span>
#include <string>
#include <vector>

#include "host/common/colour.hpp"
#include "host/scene/image.hpp"
#include "host/view/compare.hpp"

namespace raywave {

/// Linear sRGB; white may have any value.
struct RgbPicture {
  std::array<Image, 3> channels;  // red, green, blue, of one size

  int width() const { return channels[0].width; }
  int height() const { return channels[0].height; }
};

/// The colours that the light of lasers has.
///
/// light  of each laser, as pictures of one size, in the unit that is 1 for all where it is white
RgbPicture picture_of_lasers(const LaserSet& lasers, const std::vector<Image>& light);

/// Y of each pixel, >= 0.
Image luminance_of(const RgbPicture& picture);

/// The value that `percentile` (0..100) of the pixels' largest channels stay at or below; the
/// largest of all where that is not > 0.
///
/// channels  of one size: one, which is grey, or those of an RgbPicture
double white_of(std::span<const Image> channels, double percentile);

/// 8-bit sRGB, channels interleaved; what is below 0 or above `white` is cut off. Black where white
/// is not > 0.
std::vector<std::uint8_t> expose_to(std::span<const Image> channels, double white);

/// The channels of each pixel side by side.
std::vector<float> interleaved(std::span<const Image> channels);

/// Reads a picture as linear sRGB; a grey one has three equal channels.
///
/// throws  InputError as load_texture
RgbPicture load_rgb(const std::filesystem::path& file, const std::string& where);
bool is_grey(const RgbPicture& picture);

struct ColourComparison {
  PictureComparison luminance;  // of the luminances
  // CIEDE2000 of the pixels, after blur and scale. The brightest luminance of A has L* = 100
  double mean = 0, median = 0, most = 0;
  double most_of_95 = 0;  // 95 % of the pixels are at or below
  double scale = 0;       // least-squares scale of B's luminances to A's, as intensities
};

/// Compares two pictures; a common factor of the brightness does not count, one of a colour does.
///
/// options  as of compare_pictures; the domain is of the luminances
/// throws   InputError as compare_pictures
ColourComparison compare_colours(const RgbPicture& a, const RgbPicture& b,
                                 const PictureOptions& options = {});

// From where pictures show a plane (docs/conventions.md#as-seen). All else, from fields to poses,
// is in the hologram's frame.

enum class Frame {
  eye,      // of a viewer at z < 0 who looks towards +z: x to the left
  sensor,   // of a bare sensor there, whose camera turns pictures by half a turn: y down
  hologram  // along the light: x to the right, y up, as arrays
};
constexpr auto names_of(Frame) { return std::array{"eye", "sensor", "hologram"}; }

/// A picture in the hologram's frame as the other shows it, or back: each is its own inverse.
Image in_frame(Image picture, Frame frame);
/// The same of a place, x to the right and y up in both.
glm::dvec2 in_frame(glm::dvec2 place, Frame frame);

}  // namespace raywave
