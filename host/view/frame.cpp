// SPDX-License-Identifier: Apache-2.0
#include "host/view/frame.hpp"

#include <algorithm>
#include <cstddef>

namespace raywave {

const char* name_of(Frame frame) {
  return frame == Frame::eye ? "eye" : frame == Frame::sensor ? "sensor" : "hologram";
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
