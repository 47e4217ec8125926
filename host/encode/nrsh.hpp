// SPDX-License-Identifier: Apache-2.0
/// The configuration that NRSH, JPEG Pleno's Numerical Reconstruction Software for Holography,
/// reads beside a hologram.
#pragma once

#include <string>

#include "host/scene/scene.hpp"

namespace raywave {

/// Text of a configuration: wavelength, pitch, and the angular spectrum method without apodization
/// or clipping. The depths to look at are arguments of NRSH, no part of it: > 0 is the side of the
/// scene, as in raywave.
///
/// name    of the file, for the comment that says how to call NRSH
/// source  NRSH, core/read_render_cfg.m and core/rec_asm.m, and the configurations of JPEG Pleno's
///         data base, as in the public repository rsbguerra/Single-Phase-Reconstruction
std::string nrsh_configuration(const HologramSpec& hologram, const std::string& name);

}  // namespace raywave
