// SPDX-License-Identifier: Apache-2.0
/// From where pictures show a plane (docs/conventions.md#as-seen). All else, from fields to poses,
/// is in the hologram's frame.
#pragma once

#include <array>
#include <glm/vec2.hpp>
#include <string>

#include "host/scene/image.hpp"

namespace raywave {

enum class Frame {
  eye,      // of a viewer at z < 0 who looks towards +z: x to the left
  sensor,   // of a bare sensor there, whose camera turns pictures by half a turn: y down
  hologram  // along the light: x to the right, y up, as arrays
};
inline constexpr std::array all_frames{Frame::eye, Frame::sensor, Frame::hologram};

/// "eye", "sensor", "hologram"
const char* name_of(Frame frame);

/// A picture in the hologram's frame as the other shows it, or back: each is its own inverse.
Image in_frame(Image picture, Frame frame);
/// The same of a place, x to the right and y up in both.
glm::dvec2 in_frame(glm::dvec2 place, Frame frame);

}  // namespace raywave
