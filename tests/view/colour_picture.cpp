// SPDX-License-Identifier: Apache-2.0
#include "host/view/colour_picture.hpp"

#include <cmath>

#include "host/common/error.hpp"
#include "host/view/flip.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"

using namespace raywave;

namespace {

RgbPicture filled(int width, int height, glm::dvec3 colour) {
  RgbPicture picture;
  for (int c = 0; c < 3; ++c)
    picture.channels[c] = {width, height,
                           std::vector<float>(static_cast<std::size_t>(width * height),
                                              static_cast<float>(colour[c]))};
  return picture;
}

}  // namespace

TEST_CASE("the light that lasers have for a colour makes a picture of that colour") {
  const auto lasers = laser_set({638e-9, 520e-9, 450e-9});
  const glm::dvec3 colours[] = {glm::dvec3(1), {0.2, 0.7, 0.1}, {0.9, 0.3, 0.4}, {0, 0.5, 0}};
  std::vector<Image> light(3);
  for (auto& image : light) image = {2, 2, std::vector<float>(4)};
  for (std::size_t pixel = 0; pixel < 4; ++pixel)
    for (std::size_t laser = 0; laser < 3; ++laser)
      light[laser].pixels[pixel] =
          static_cast<float>(glm::dot(lasers.from_rgb[laser], colours[pixel]));
  const auto picture = picture_of_lasers(lasers, light);
  for (std::size_t pixel = 0; pixel < 4; ++pixel)
    for (std::size_t c = 0; c < 3; ++c)
      CHECK(double{picture.channels[c].pixels[pixel]} ==
            Catch::Approx(colours[pixel][static_cast<int>(c)]).margin(1e-6));
  light[1].width = 1;
  light[1].height = 4;
  CHECK_THROWS_AS(picture_of_lasers(lasers, light), InputError);
}

TEST_CASE("pictures in colour are sRGB on screens, and linear sRGB in EXR") {
  auto picture = filled(2, 1, {0.5, 0.25, -0.1});
  picture.channels[0].pixels[1] = 2;
  CHECK(white_of(picture.channels, 100) == 2);
  CHECK(white_of(picture.channels, 0) == 0.5);
  // sRGB of 0.5 is 187.5, of 0.25 136.9; no light below 0, none above white
  CHECK(expose_to(picture.channels, 1) == std::vector<std::uint8_t>{188, 137, 0, 255, 137, 0});
  CHECK(expose_to(picture.channels, 0) == std::vector<std::uint8_t>(6, 0));

  const Folder folder;
  save_picture(folder / "a.exr", 2, 1, interleaved(picture.channels));
  const auto read = load_rgb(folder / "a.exr", "");
  for (std::size_t c = 0; c < 3; ++c) CHECK(read.channels[c].pixels == picture.channels[c].pixels);
  CHECK(!is_grey(read));
  save_picture(folder / "grey.exr", 2, 1, picture.channels[0].pixels);
  CHECK(is_grey(load_rgb(folder / "grey.exr", "")));
}

TEST_CASE("a factor of the brightness is no difference of colours, another hue is") {
  auto a = filled(24, 20, {0.3, 0.5, 0.2}), b = filled(24, 20, {0.9, 1.5, 0.6});
  const auto same = compare_colours(a, b);
  CHECK(same.most < 1e-4);
  CHECK(same.luminance.scale == Catch::Approx(1.0 / 3).epsilon(1e-5));

  // A patch of another colour and the same luminance: its CIEDE2000 by the formula
  const auto xyz = xyz_from_srgb();
  const glm::dvec3 colour(0.3, 0.5, 0.2);
  const glm::dvec3 other = colour + glm::dvec3(0.05, -0.05 * 0.2126 / 0.7152, 0);
  const auto white = glm::dvec3((xyz * colour).y) * (xyz * glm::dvec3(1));
  const double expected = delta_e_2000(lab_of(xyz * colour, white), lab_of(xyz * other, white));
  auto c = a;
  for (std::size_t i = 0; i < 48; ++i)  // two of 20 rows
    for (int k = 0; k < 3; ++k) c.channels[k].pixels[i] = static_cast<float>(other[k]);
  const auto found = compare_colours(a, c);
  CHECK(found.median < 1e-3);
  CHECK(found.most == Catch::Approx(expected).epsilon(1e-3));
  CHECK(found.mean == Catch::Approx(expected / 10).epsilon(2e-3));
  CHECK(found.most_of_95 == Catch::Approx(expected).epsilon(1e-3));

  // The border is left out
  CHECK(compare_colours(a, c, PictureOptions{.border_px = 3}).most < 1e-3);
}

TEST_CASE("FLIP is 1 between green and blue, the farthest colours, and 0.95 at 0.4 of that") {
  const auto green = filled(9, 7, {0, 1, 0}), blue = filled(9, 7, {0, 0, 1});
  CHECK(flip_of(green.channels, blue.channels, 1) == Catch::Approx(1).epsilon(1e-5));
  CHECK(flip_of(green.channels, green.channels, 1) == 0);
  // Greys differ in L* alone. L*, a*, b* of green: 87.735, -86.183, 83.180, of blue: 32.297,
  // 79.188, -107.860; a* and b* count L* / 100 times
  const double farthest =
      87.735 - 32.297 +
      std::hypot(0.87735 * 86.183 + 0.32297 * 79.188, 0.87735 * 83.180 + 0.32297 * 107.860);
  for (const double grey : {0.1, 0.18, 0.5}) {
    const double lightness = 100 - (116 * std::cbrt(grey) - 16);
    const auto a = filled(9, 7, glm::dvec3(1)), b = filled(9, 7, glm::dvec3(grey));
    const double share = std::pow(lightness / farthest, 0.7);
    CHECK(flip_of(a.channels, b.channels, 1) ==
          Catch::Approx(share < 0.4 ? 0.95 * share / 0.4 : 0.95 + 0.05 * (share - 0.4) / 0.6)
              .epsilon(1e-4));
  }
}
