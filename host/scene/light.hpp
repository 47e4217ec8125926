// SPDX-License-Identifier: Apache-2.0
/// The lights of a scene.
#pragma once

#include <array>
#include <filesystem>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace raywave {

enum class LightType { ambient, directional, point, spot, area, environment };
constexpr auto names_of(LightType) {
  return std::array{"ambient", "directional", "point", "spot", "area", "environment"};
}

struct Light {
  LightType type = LightType::directional;
  // Direction in which light travels, of any length > 0; of directional lights and spots, and the
  // normal of an area light that is a disc
  glm::dvec3 direction{0, 0, 1};
  // Of points and spots, and the middle of area lights
  glm::dvec3 position_m{0};
  double intensity = 1.0;  // >= 0
  // In scenes in colour: of red, green and blue, over the intensity. Otherwise the intensity is of
  // the hologram's channel
  glm::dvec3 colour{1};
  // Intensity over the square of the distance in metres; otherwise, as in Phong's model, light does
  // not weaken with distance. Of points, spots and area lights
  bool falls_off = false;
  // Of spots: angles to the direction up to which the light is full, and from which it is dark
  double inner_deg = 0, outer_deg = 45;
  // Of area lights: a rectangle's sides, or a disc's radius; 0: a rectangle
  std::array<glm::dvec3, 2> edges_m{glm::dvec3(0), glm::dvec3(0)};
  double radius_m = 0;
  // Directions in which a surface looks for an area light or an environment, 1 to most_lights
  int samples = 1;
  // Materials show highlights of it
  bool highlights = true;
  // Of environments: an equirectangular picture, and how far it is turned about the y axis
  std::filesystem::path picture{};
  double rotation_deg = 0;
  std::string where{};  // the start of messages about its picture

  bool operator==(const Light&) const = default;
};

/// Directions of all lights besides ambient ones, at most: an area light or an environment counts
/// as many times as it has samples.
inline constexpr int most_lights = 1024;

/// Least outer angle of a spot, in degrees: floats tell the light's share between its angles to
/// 0.003 there, and to 0.08 at 0.1 degrees.
inline constexpr double least_spot_deg = 0.5;

/// A light that surfaces look for in several directions.
inline bool has_size(const Light& light) {
  return light.type == LightType::area || light.type == LightType::environment;
}

/// How many times a light counts.
inline int directions_of(const Light& light) {
  return light.type == LightType::ambient ? 0 : has_size(light) ? light.samples : 1;
}

/// The same of all lights that pass a test.
template <class Test>
int directions_of(const std::vector<Light>& lights, const Test& test) {
  int sum = 0;
  for (const auto& light : lights) sum += test(light) ? directions_of(light) : 0;
  return sum;
}

}  // namespace raywave
