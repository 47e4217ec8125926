// SPDX-License-Identifier: Apache-2.0
/// The pictures that a scene's hologram is refined towards: which depths and views, and what a lens
/// sees there.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/plan/plan.hpp"
#include "host/refine/refine.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave {

/// A depth, and the part of the hologram that looks there.
struct KeyPlace {
  double z_m = 0;
  glm::dvec2 view{0, 0}, aperture{1, 1};
  int times = 1;
};

struct KeySpec {
  std::vector<double> depths_m;  // of whole pictures; empty: refine_depths_m
  int views = 0;                 // seen through quarters of the hologram
  std::uint32_t seed = 1;        // of the views' places
};

/// Depths through the scene and beyond: a picture holds what lies within some 2.4 blurs of depth
/// times distance over hologram. At least five.
std::vector<double> refine_depths_m(const Plan& plan, double blur_m);

/// The depths, those amid the scene drawn more often than the outermost, and the views: spread over
/// all places of a quarter and over the depths, one depth each.
std::vector<KeyPlace> key_places(const Plan& plan, double blur_m, const KeySpec& what);

/// Iterations per frame that so many pictures need.
int refine_iterations(const std::vector<RefineKey>& keys);

struct KeyPictures {
  std::optional<glm::dvec2> window_m;  // empty: what the WRPs cover
  int lens_points = 8;                 // per axis of the whole hologram; views take half of them
  // Pixels per blur; pictures need no more, and rays are what they cost
  double pixels_per_blur = 1.5;
};

/// What a lens sees from the places.
///
/// progress  called with the picture at work and the completed share, 0 to 1, when given
RefineKey lens_key(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
                   const KeyPlace& place, double blur_m, const KeyPictures& how,
                   const std::function<void(double)>& progress = {});

/// Size of the pictures: what the WRPs cover.
glm::dvec2 refine_window_m(const Plan& plan);

}  // namespace raywave
