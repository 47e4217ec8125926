// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <span>
#include <vector>

namespace raywave {

/// Makes the bytes of an 8-bit grey PNG without compression, values as they are. Holograms look
/// like noise, of which compression saves nothing.
///
/// levels  size_px.x * size_px.y, rows from the top
/// png     gets the bytes; its memory is used again
/// source  PNG specification, third edition; RFC 1950 and 1951 (stored blocks)
void plain_png(glm::ivec2 size_px, std::span<const std::uint8_t> levels,
               std::vector<std::uint8_t>& png);

}  // namespace raywave
