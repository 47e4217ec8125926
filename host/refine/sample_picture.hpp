// SPDX-License-Identifier: Apache-2.0
/// Pictures made of samples: the light of each, spread over its disc of defocus, part by part of
/// the hologram. No rays are traced: what hides a sample from a part is known.
#pragma once

#include <vector>

#include "host/refine/picture_grid.hpp"
#include "host/trace/sample_light.hpp"

namespace raywave::refinement {

/// Light of the samples on a key's picture, not blurred: energy per hologram pixel of the field's
/// squares, on the pixels of grid.wide_size(), row by row from the top. Fresnel grids alone.
///
/// A ray from a sample is placed where the grid's transform puts its frequency, so no angle is too
/// steep. Light beyond the plane is left out.
///
/// accuracy  of a sample's light in a picture: docs/refine.md#at-the-pace-of-frames
std::vector<float> sample_picture(const Optics& optics, const PictureGrid& grid,
                                  const SampleLight& light);

}  // namespace raywave::refinement
