// SPDX-License-Identifier: Apache-2.0
/// What an eye can see of a plan through its pupil ([viewer] pupil): where it may be, what it finds
/// sharp, and what reaches it. Closed forms of the pupil and the eyepiece, and the scene's light.
#pragma once

#include <algorithm>
#include <glm/vec2.hpp>
#include <string>
#include <vector>

#include "host/plan/front_view.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// Young eyes focus up to 10 D.
inline constexpr double nearest_focus_m = 0.1;

/// One place of the pupil.
struct EyePlace {
  glm::dvec2 centre_m{0, 0};
  double light = 0;  // share of the pupil, mean over the scene's light, that light fills
  double cut = 0;    // share of the scene's light of which nothing enters the pupil
};

struct EyeView {
  glm::dvec2 eyebox_m{0, 0};      // of the SLM's own order; its replicas lie around it
  glm::dvec2 lit_m{0, 0};         // of the eyebox, about its middle: where the plan sends light
  glm::dvec2 zero_order_m{0, 0};  // where undiffracted light meets the pupil's plane
  double acuity = 0;  // angle that the eye makes out: 1 arc minute, or 1.22 lambda / pupil
  // Half the range of dioptres around the one in focus that is sharp: where points blur over the
  // acuity, acuity / pupil, and where the wave is a quarter of a wavelength off, 2 lambda / pupil^2
  double sharp_by_acuity = 0, sharp_by_wave = 0;
  std::vector<EyePlace> places;
  Pupil pupil;          // the first of them
  double detail_m = 0;  // that the eye makes out in the scene's middle

  double sharp() const { return std::max(sharp_by_acuity, sharp_by_wave); }
};

/// True where pictures are looked at through the pupil: behind an eyepiece, or where the scene
/// gives one.
bool has_pupil(const Scene& scene);

EyeView eye_view(const Scene& scene, const Plan& plan, const FrontView& view);

/// Whether a pupil behind an eyepiece sees all of the SLM's band, with its corners.
bool sees_band(const Pupil& pupil, const Plan& plan);

/// What the user should know of it: light that misses the pupil, replicas in it, depths that no eye
/// focuses, dots that it makes out.
std::vector<std::string> eye_warnings(const Scene& scene, const Plan& plan, const EyeView& eye);

}  // namespace raywave
