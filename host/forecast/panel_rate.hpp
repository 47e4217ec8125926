// SPDX-License-Identifier: Apache-2.0
/// How many frames the SLM's panel shows within the time of a picture.
#pragma once

#include <string>
#include <vector>

#include "host/scene/scene.hpp"

namespace raywave {

/// Of the lasers that are shown in turn.
std::vector<double> wavelengths_m_of(const Scene& scene);

/// Pictures a second: those of the animation; where nothing moves 30, which an eye takes for one.
double pictures_per_s(const Scene& scene);

/// Frames of each laser that slm.rate allows a picture, maybe none; infinite where it is not given.
double frames_shown(const Scene& scene, double pictures_per_s);

/// Why a picture has so many frames at most; empty without slm.rate.
std::string why_frames_shown(const Scene& scene, double pictures_per_s);

/// A line where the scene has more frames than the panel shows; else empty.
std::string panel_warning(const Scene& scene, double pictures_per_s);

}  // namespace raywave
