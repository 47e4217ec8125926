// SPDX-License-Identifier: Apache-2.0
#include "host/plan/placed_lights.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <iterator>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <span>
#include <stdexcept>
#include <utility>

#include "host/common/colour.hpp"

namespace raywave {
namespace {

using std::numbers::pi;

/// Solid angle of a pixel in a row of an equirectangular picture.
double pixel_angle(const Image& picture, int row) {
  const double step = pi / picture.height;
  return 2 * pi / picture.width * (std::cos(row * step) - std::cos((row + 1) * step));
}

/// Sums up to each entry, from 0 on.
std::vector<double> running_sums(const std::vector<double>& weights) {
  std::vector<double> sums(weights.size() + 1, 0);
  std::partial_sum(weights.begin(), weights.end(), sums.begin() + 1);
  return sums;
}

/// The entry, and the place in it from 0 to 1, below which a share of the whole sum lies.
std::pair<int, double> draw(const std::vector<double>& sums, double share) {
  const double wanted = share * sums.back();
  const auto above = std::upper_bound(sums.begin(), sums.end() - 1, wanted);
  const auto entry = std::max<std::ptrdiff_t>(0, above - sums.begin() - 1);
  const auto at = static_cast<std::size_t>(entry);
  const double width = sums[at + 1] - sums[at];
  return {static_cast<int>(entry),
          width > 0 ? std::clamp((wanted - sums[at]) / width, 0.0, 1.0) : 0.5};
}

/// Directions of an environment drawn by their light: by its luminance, where it has colours.
class EnvironmentDraw {
public:
  struct Drawn {
    glm::dvec2 place;   // of the picture
    glm::dvec3 colour;  // red, green and blue there, over the luminance; 1 where it has no colours
  };

  explicit EnvironmentDraw(const Image& picture)
      : picture_(picture), channels_{picture.channel(0), picture.channel(1), picture.channel(2)} {
    const auto xyz = xyz_from_srgb();
    // Y is the luminance
    if (picture.channels > 1) luminance_ = {xyz[0][1], xyz[1][1], xyz[2][1]};
    std::vector<double> rows;
    for (int row = 0; row < picture.height; ++row) {
      glm::dvec3 sum(0);
      for (int column = 0; column < picture.width; ++column) sum += colour_at(row, column);
      sum *= pixel_angle(picture, row);
      light_in_colour_ += sum;
      rows.push_back(glm::dot(sum, luminance_));
    }
    rows_ = running_sums(rows);
  }

  /// Integral of the radiance over all directions.
  double light() const { return rows_.back(); }
  /// The same in red, green and blue, over `light`; 1 where there is none.
  glm::dvec3 colour() const { return light() > 0 ? light_in_colour_ / light() : glm::dvec3(1); }

  /// What a place of the unit square stands for, in proportion to light.
  Drawn draw(glm::dvec2 square) {
    if (light() <= 0) return {square, glm::dvec3(1)};
    const auto [row, down] = raywave::draw(rows_, square.y);
    auto& sums = columns_[row];
    if (sums.empty()) {
      std::vector<double> columns;
      for (int column = 0; column < picture_.width; ++column)
        columns.push_back(glm::dot(colour_at(row, column), luminance_));
      sums = running_sums(columns);
    }
    const auto [column, across] = raywave::draw(sums, square.x);
    // Even in solid angle within the row
    const double step = pi / picture_.height,
                 cosine = std::lerp(std::cos(row * step), std::cos((row + 1) * step), down);
    const auto colour = colour_at(row, column);
    const double luminance = glm::dot(colour, luminance_);
    return {{(column + across) / picture_.width, std::acos(std::clamp(cosine, -1.0, 1.0)) / pi},
            luminance > 0 ? colour / luminance : glm::dvec3(1)};
  }

private:
  glm::dvec3 colour_at(int row, int column) const {
    const auto at = static_cast<std::size_t>(row) * static_cast<std::size_t>(picture_.width) +
                    static_cast<std::size_t>(column);
    return {channels_[0][at], channels_[1][at], channels_[2][at]};
  }

  const Image& picture_;
  std::array<std::span<const float>, 3> channels_;
  glm::dvec3 luminance_{1, 0, 0};  // of red, green and blue
  glm::dvec3 light_in_colour_{0};
  std::vector<double> rows_;
  std::map<int, std::vector<double>> columns_;
};

/// A square onto a disc of radius 1; equal areas stay equal (Shirley and Chiu, J. Graphics Tools 2,
/// 45 (1997)).
glm::dvec2 disc_of_square(glm::dvec2 square) {
  const auto p = 2.0 * square - 1.0;
  if (p == glm::dvec2(0)) return p;
  const bool is_wide = std::abs(p.x) > std::abs(p.y);
  const double r = is_wide ? p.x : p.y,
               angle = is_wide ? pi / 4 * p.y / p.x : pi / 2 - pi / 4 * p.x / p.y;
  return r * glm::dvec2(std::cos(angle), std::sin(angle));
}

/// Two unit vectors across a direction.
std::array<glm::dvec3, 2> across(glm::dvec3 direction) {
  const auto n = glm::normalize(direction);
  const auto other = std::abs(n.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  const auto first = glm::normalize(glm::cross(n, other));
  return {first, glm::cross(n, first)};
}

}  // namespace

glm::dvec2 place_in_square(int part, int count, int place) {
  int a = static_cast<int>(std::sqrt(static_cast<double>(count)));
  while (count % a != 0) --a;
  const int b = count / a;
  // Places in the parts' own orders: neighbouring rays do not ask the same corner of all parts
  std::uint32_t hash = static_cast<std::uint32_t>(part) * 0x9e3779b9u;
  hash = (hash ^ (hash >> 15)) * 0x846ca68bu;
  const int own = place ^ static_cast<int>((hash >> 16) & 15u);
  // A sheared lattice: no two places lie above or beside each other
  const int columns = 4 * b, rows = 4 * a, column = part % b * 4 + own % 4,
            row = part / b * 4 + own / 4;
  return {(column + (row + 0.5) / rows) / columns, (row + (column + 0.5) / columns) / rows};
}

glm::dvec3 direction_of_environment(glm::dvec2 place, double rotation_deg) {
  const double azimuth = (place.x - 0.5) * 2 * pi - glm::radians(rotation_deg),
               polar = place.y * pi;
  return {-std::sin(azimuth) * std::sin(polar), std::cos(polar),
          std::cos(azimuth) * std::sin(polar)};
}

double mean_radiance(const Image& environment) {
  return EnvironmentDraw(environment).light() / (4 * pi);
}

std::vector<PlacedLight> placed_light(const Light& light, const Image* environment) {
  PlacedLight placed;
  placed.intensity = light.intensity;
  placed.colour = light.colour;
  placed.falls_off = light.falls_off;
  placed.highlights = light.highlights;
  switch (light.type) {
    case LightType::ambient:
      return {};
    case LightType::directional:
      placed.is_point = false;
      placed.places = {-glm::normalize(light.direction)};
      return {placed};
    case LightType::spot:
      placed.axis = glm::normalize(light.direction);
      placed.inner_cosine = std::cos(glm::radians(light.inner_deg));
      placed.outer_cosine = std::cos(glm::radians(light.outer_deg));
      placed.places = {light.position_m};
      return {placed};
    case LightType::point:
      placed.places = {light.position_m};
      return {placed};
    case LightType::area:
    case LightType::environment:
      break;
  }

  // Lights that have a size
  if (light.type == LightType::environment && !environment)
    throw std::logic_error("the picture of an environment has not been read");
  std::optional<EnvironmentDraw> draws;
  if (light.type == LightType::environment) {
    draws.emplace(*environment);
    placed.is_point = false;
    placed.intensity *= draws->light() / pi;
  }
  placed.intensity /= light.samples;
  glm::dvec3 all_colours(0);
  const auto axes = across(light.direction);
  std::vector<PlacedLight> all(static_cast<std::size_t>(light.samples), placed);
  for (int part = 0; part < light.samples; ++part) {
    auto& one = all[static_cast<std::size_t>(part)];
    glm::dvec3 colours(0);
    for (int place = 0; place < places_of_light; ++place) {
      const auto square = place_in_square(part, light.samples, place);
      glm::dvec3 at;
      if (draws) {
        const auto drawn = draws->draw(square);
        at = direction_of_environment(drawn.place, light.rotation_deg);
        colours += drawn.colour;
      } else if (light.radius_m > 0) {
        const auto disc = light.radius_m * disc_of_square(square);
        at = light.position_m + disc.x * axes[0] + disc.y * axes[1];
      } else {
        at = light.position_m + (square.x - 0.5) * light.edges_m[0] +
             (square.y - 0.5) * light.edges_m[1];
      }
      one.places.push_back(at);
    }
    if (draws) one.colour *= colours / double{places_of_light};
    all_colours += one.colour;
  }
  if (!draws) return all;
  // All of them together have the picture's colour
  const auto wanted = light.colour * draws->colour() * static_cast<double>(light.samples);
  for (auto& one : all)
    for (int k = 0; k < 3; ++k)
      if (all_colours[k] > 0) one.colour[k] *= wanted[k] / all_colours[k];
  return all;
}

std::vector<PlacedLight> placed_lights(
    const std::vector<Light>& lights,
    const std::vector<std::shared_ptr<const Image>>& environments) {
  std::vector<PlacedLight> all;
  for (std::size_t i = 0; i < lights.size(); ++i) {
    const auto* environment = i < environments.size() ? environments[i].get() : nullptr;
    auto placed = placed_light(lights[i], environment);
    std::move(placed.begin(), placed.end(), std::back_inserter(all));
  }
  std::stable_partition(all.begin(), all.end(),
                        [](const PlacedLight& light) { return light.highlights; });
  return all;
}

}  // namespace raywave
