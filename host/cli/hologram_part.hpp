// SPDX-License-Identifier: Apache-2.0
/// A part of a hologram that lies in tiles (render --tiles).
#pragma once

#include <glm/vec2.hpp>

#include "host/cli/holograms.hpp"
#include "host/common/npy.hpp"
#include "host/scene/scene.hpp"

namespace raywave::cli {

/// What the SLM, or the print, shows there.
struct HologramPart {
  FieldStack field;
  HologramSpec spec;          // with the part's resolution
  glm::dvec2 centre_m{0, 0};  // of the part on the hologram
};

/// Reads the tiles that hold the part that lets light through, and no others.
///
/// options   of the report
/// view      as ReconstructSpec's
/// throws    InputError where tiles are missing or another render's, naming them
HologramPart load_part(const HologramOptions& options, glm::dvec2 view, glm::dvec2 aperture);

}  // namespace raywave::cli
