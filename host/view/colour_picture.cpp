// SPDX-License-Identifier: Apache-2.0
#include "host/view/colour_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <glm/vec3.hpp>
#include <utility>

#include "host/common/colour.hpp"
#include "host/common/error.hpp"
#include "host/common/threads.hpp"
#include "host/view/flip.hpp"

namespace raywave {
namespace {

glm::dvec3 colour_at(const RgbPicture& picture, std::size_t pixel) {
  return {double{picture.channels[0].pixels[pixel]}, double{picture.channels[1].pixels[pixel]},
          double{picture.channels[2].pixels[pixel]}};
}

RgbPicture blurred(const RgbPicture& picture, double sigma_px) {
  RgbPicture result;
  for (std::size_t c = 0; c < 3; ++c)
    result.channels[c] = raywave::blurred(picture.channels[c], sigma_px);
  return result;
}

/// The pixels within the border, times a factor.
RgbPicture part_of(const RgbPicture& picture, int border_px, double factor) {
  RgbPicture part;
  for (std::size_t c = 0; c < 3; ++c) {
    part.channels[c] = cropped(
        picture.channels[c],
        {border_px, border_px, picture.width() - 2 * border_px, picture.height() - 2 * border_px});
    for (float& v : part.channels[c].pixels) v = static_cast<float>(factor * double{v});
  }
  return part;
}

}  // namespace

Image luminance_of(const RgbPicture& picture) {
  const auto xyz = xyz_from_srgb();
  Image image{picture.width(), picture.height(), {}};
  for (std::size_t i = 0; i < picture.channels[0].pixels.size(); ++i)
    image.pixels.push_back(static_cast<float>(std::max(0.0, (xyz * colour_at(picture, i)).y)));
  return image;
}

RgbPicture picture_of_lasers(const LaserSet& lasers, const std::vector<Image>& light) {
  for (const auto& one : light)
    if (one.width != light[0].width || one.height != light[0].height)
      throw InputError("the pictures of the lasers have different sizes");
  RgbPicture picture;
  for (std::size_t c = 0; c < 3; ++c) {
    auto& channel = picture.channels[c] = {light[0].width, light[0].height, {}};
    for (std::size_t i = 0; i < light[0].pixels.size(); ++i) {
      double sum = 0;
      for (std::size_t laser = 0; laser < light.size(); ++laser)
        sum += lasers.rgb[laser][static_cast<int>(c)] * double{light[laser].pixels[i]};
      channel.pixels.push_back(static_cast<float>(sum));
    }
  }
  return picture;
}

double white_of(std::span<const Image> channels, double percentile) {
  std::vector<float> largest = channels[0].pixels;
  for (const auto& channel : channels)
    for (std::size_t i = 0; i < largest.size(); ++i)
      largest[i] = std::max(largest[i], channel.pixels[i]);
  if (largest.empty()) return 0;
  const double last = static_cast<double>(largest.size() - 1);
  const auto nth =
      largest.begin() +
      static_cast<std::ptrdiff_t>(std::lround(last * std::clamp(percentile, 0.0, 100.0) / 100));
  std::nth_element(largest.begin(), nth, largest.end());
  return *nth > 0 ? *nth : *std::max_element(nth, largest.end());
}

std::vector<std::uint8_t> expose_to(std::span<const Image> channels, double white) {
  const std::size_t count = channels.size();
  std::vector<std::uint8_t> pixels(count * channels[0].pixels.size());
  if (!(white > 0)) return pixels;
  cl::Threads::shared().for_ranges(
      pixels.size(), [&](std::size_t, std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i)
          pixels[i] = static_cast<std::uint8_t>(
              std::lround(255 * srgb_of(double{channels[i % count].pixels[i / count]} / white)));
      });
  return pixels;
}

std::vector<float> interleaved(std::span<const Image> channels) {
  std::vector<float> pixels(channels.size() * channels[0].pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i)
    pixels[i] = channels[i % channels.size()].pixels[i / channels.size()];
  return pixels;
}

RgbPicture load_rgb(const std::filesystem::path& file, const std::string& where) {
  auto channels = load_channels(file, "rgb", where);
  return {{std::move(channels[0]), std::move(channels[1]), std::move(channels[2])}};
}

bool is_grey(const RgbPicture& picture) {
  return picture.channels[0].pixels == picture.channels[1].pixels &&
         picture.channels[1].pixels == picture.channels[2].pixels;
}

ColourComparison compare_colours(const RgbPicture& a, const RgbPicture& b,
                                 const PictureOptions& options) {
  ColourComparison result;
  auto of_luminances = options;
  of_luminances.flip = false;
  result.luminance = compare_pictures(luminance_of(a), luminance_of(b), of_luminances);

  // The same blur, border and scale as of the luminances
  const auto blurred_a = blurred(a, options.blur_px), blurred_b = blurred(b, options.blur_px);
  const auto luminance = luminance_of(blurred_a), of_b = luminance_of(blurred_b);
  double product = 0, square = 0, brightest = 0;
  std::vector<std::size_t> inside;
  for (int y = options.border_px; y < a.height() - options.border_px; ++y) {
    for (int x = options.border_px; x < a.width() - options.border_px; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(a.width()) +
                     static_cast<std::size_t>(x);
      inside.push_back(i);
      product += double{luminance.pixels[i]} * double{of_b.pixels[i]};
      square += double{of_b.pixels[i]} * double{of_b.pixels[i]};
      brightest = std::max(brightest, double{luminance.pixels[i]});
    }
  }
  const double scale = result.scale = product / square;
  const auto xyz = xyz_from_srgb();
  const auto white = xyz * glm::dvec3(brightest);
  std::vector<double> differences;
  for (const auto i : inside) {
    // What no screen shows, a negative light, is black
    const auto shown = [&](const RgbPicture& picture, double factor) {
      const auto colour = colour_at(picture, i) * factor;
      return lab_of(xyz * glm::dvec3(std::max(colour.x, 0.0), std::max(colour.y, 0.0),
                                     std::max(colour.z, 0.0)),
                    white);
    };
    differences.push_back(delta_e_2000(shown(blurred_a, 1), shown(blurred_b, scale)));
    result.mean += differences.back();
  }
  result.mean /= static_cast<double>(differences.size());
  std::ranges::sort(differences);
  const auto at = [&](double share) {
    return differences[static_cast<std::size_t>(share *
                                                static_cast<double>(differences.size() - 1))];
  };
  result.median = at(0.5);
  result.most_of_95 = at(0.95);
  result.most = differences.back();
  if (options.flip)
    result.luminance.flip =
        flip_of(part_of(blurred_a, options.border_px, 1).channels,
                part_of(blurred_b, options.border_px, scale).channels, brightest);
  return result;
}

Image in_frame(Image picture, Frame frame) {
  const auto width = static_cast<std::ptrdiff_t>(picture.width);
  const auto row = [&](int y) { return picture.pixels.begin() + y * width; };
  if (frame == Frame::eye)
    for (int y = 0; y < picture.height; ++y) std::reverse(row(y), row(y + 1));
  if (frame == Frame::sensor)
    for (int y = 0; y < picture.height / 2; ++y)
      std::swap_ranges(row(y), row(y + 1), row(picture.height - 1 - y));
  return picture;
}

glm::dvec2 in_frame(glm::dvec2 place, Frame frame) {
  if (frame == Frame::eye) place.x = -place.x;
  if (frame == Frame::sensor) place.y = -place.y;
  return place;
}

}  // namespace raywave
