// SPDX-License-Identifier: Apache-2.0
/// The lights of a scene as surfaces see them: places and directions. Area lights and environments
/// become as many as they have samples, each with several places for neighbouring rays to choose
/// from, so that soft shadows are smooth.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "host/scene/image.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// Places of a light that has a size: 4 x 4 in each part of it.
inline constexpr int places_of_light = 16;

/// One light of a device: a place or a direction, or several alike.
struct PlacedLight {
  bool is_point = true;
  // World; places, or directions of unit length towards the light. One, or places_of_light
  std::vector<glm::dvec3> places;
  double intensity = 1;
  glm::dvec3 colour{1};    // as in Light
  bool falls_off = false;  // intensity over the square of the distance in metres
  bool highlights = true;
  // Of spots: full within, dark from there on; cosines to the axis, which points along the light.
  // Others are spots of all directions: -2, -3
  glm::dvec3 axis{0, 0, 1};
  double inner_cosine = -2, outer_cosine = -3;

  bool is_spot() const { return outer_cosine > -1; }
};

/// All lights but ambient ones: those with highlights first, else in the scene's order.
///
/// environments  their pictures, by light; those of other lights may be missing
std::vector<PlacedLight> placed_lights(
    const std::vector<Light>& lights,
    const std::vector<std::shared_ptr<const Image>>& environments);

/// The same of one light.
std::vector<PlacedLight> placed_light(const Light& light, const Image* environment);

/// Part `part` of `count` of a unit square, in one of its places_of_light places. Parts make a grid
/// of a x b, a <= b, and their places one of 4 x 4, in an order of the part's own. No two of all
/// places share a row or a column, so that shadows of straight edges have as many steps.
glm::dvec2 place_in_square(int part, int count, int place);

/// Mean radiance of an environment over all directions, without Light::intensity; its luminance,
/// where it has colours.
double mean_radiance(const Image& environment);

/// The direction that a place of an equirectangular picture stands for, which is the way to it:
/// (1/2, 1/2) is +z, u grows to the viewer's right, which is -x, and v = 0 is +y.
glm::dvec3 direction_of_environment(glm::dvec2 place, double rotation_deg);

}  // namespace raywave
