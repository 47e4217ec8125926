// SPDX-License-Identifier: Apache-2.0
/// Pictures that a hologram is refined towards.
#pragma once

#include "host/refine/picture_grid.hpp"

namespace raywave::test {

/// A white picture of so many pixels.
inline refinement::Key key_at(double z_m, glm::dvec2 view, glm::dvec2 aperture, glm::ivec2 size,
                              glm::dvec2 pixel_m) {
  refinement::Key key{z_m, view, aperture, {size.x, size.y, {}}, pixel_m, 1};
  key.picture.pixels.assign(static_cast<std::size_t>(size.x) * size.y, 1.0f);
  return key;
}

}  // namespace raywave::test
