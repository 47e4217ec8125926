// SPDX-License-Identifier: Apache-2.0
#include "host/plan/plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <iterator>
#include <limits>
#include <span>
#include <sstream>
#include <tuple>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/geometry/extents.hpp"
#include "host/plan/propagation_errors.hpp"
#include "host/propagate/propagator.hpp"
#include "host/trace/gatherer.hpp"
#include "host/trace/interpolator.hpp"

namespace raywave {
namespace {

constexpr int largest_grid = 1024;

/// How many steps p lie, on the nearest surface, under the cone that a pixel sees. Three keep
/// neighbouring samples apart in direction (docs/pipeline.md, "Where the WRPs stand"); more only
/// cost rays.
constexpr double samples_across_nearest = 3;

/// The same in pixels: fewer do not resolve the cone.
constexpr double pixels_across_nearest = 8;

/// How far beyond its geometric footprint the light of a sample is kept, in diffraction spots.
constexpr double tail_spots = Gatherer::near_tail;

/// Mirrors show things up to this many times as deep as the scene: rays are spaced for it.
constexpr double deepest_virtual_picture = 2;

constexpr double largest_lattice = 1 << 28;
// From the axis: floats count no farther and still tell places within a cell
constexpr double farthest_lattice_ray = 1 << 22;
constexpr std::size_t largest_fan = 1 << 24;

std::string millimetres(double metres) {
  std::ostringstream text;
  text.precision(6);
  text << metres * 1e3 << " mm";
  return text.str();
}

/// All digits of a count, as long as they are few.
std::string count_text(double count) {
  std::ostringstream text;
  text.precision(count < 1e15 ? 15 : 3);
  text << count;
  return text.str();
}

/// Rays across a fan, as fan_tangents makes them.
double fan_count(double window_m, double distance_m, double depth_m, double pitch_m) {
  return std::max(1.0, std::ceil(window_m / distance_m * depth_m / pitch_m - 1e-9));
}

bool holds(const DepthLayer& layer, double z_m) {
  return layer.begin_m <= z_m && z_m < layer.end_m;
}

/// The corners of all surfaces in a layer that has an end: vertices of the meshes, and where edges
/// enter or leave it.
///
/// positions_m  of all vertices
std::vector<glm::dvec3> corners_in(const World& world, std::span<const glm::dvec3> positions_m,
                                   const DepthLayer& layer) {
  std::vector<glm::dvec3> all;
  for (const auto& p : positions_m) {
    if (holds(layer, p.z)) all.push_back(p);
  }
  for (const double at : {layer.begin_m, layer.end_m}) {
    if (!std::isfinite(at)) continue;
    for (const auto& corners : world.triangles) {
      for (int i = 0; i < 3; ++i) {
        const auto &a = positions_m[corners[i]], &b = positions_m[corners[(i + 1) % 3]];
        if ((a.z < at) != (b.z < at)) all.push_back(glm::mix(a, b, (at - a.z) / (b.z - a.z)));
      }
    }
  }
  return all;
}

/// Rays of the sample lattice towards everything in the scene whose light the hologram can show.
///
/// lit  tangents of the chief rays (to the hologram's centre) of whatever light can fall onto a
///      WRP, low and high per axis
LatticePlan lattice_over(const Scene& scene, const Extents& extents, const Plan& plan,
                         glm::dvec2 largest_tangent, const std::array<Interval, 2>& lit) {
  LatticePlan lattice;
  lattice.full_z_m = (plan.near_m + plan.far_m) / 2;
  lattice.step = scene.sampling.pitch_m / lattice.full_z_m;
  const auto window = plan.window_m();
  double cells = 1;
  for (int axis = 0; axis < 2; ++axis) {
    const auto& tangents = extents.tangents[axis];
    const double reach = largest_tangent[axis] +
                         std::max(1.0, plan.cone_half_width) * window[axis] / (2 * plan.near_m);
    const double low = std::max(-reach, lit[axis].low),
                 high = std::max(low, std::min(reach, lit[axis].high));
    const double first = std::floor(std::clamp(tangents.low, low, high) / lattice.step - 0.5);
    const double last = std::ceil(std::clamp(tangents.high, low, high) / lattice.step - 0.5);
    cells *= last - first + 1;
    const std::string asked =
        one_line(scene.file.string()) + ": sampling.pitch " + millimetres(scene.sampling.pitch_m);
    if (!(cells <= largest_lattice))
      throw InputError(
          asked + " needs " + count_text(cells) +
          " lattice cells or more, at most 268435456 are allowed; give a larger pitch");
    if (const double farthest = std::max(std::abs(first), std::abs(last));
        farthest > farthest_lattice_ray)
      throw InputError(asked + " puts the scene " + count_text(farthest) +
                       " pitches off the axis, at most 4194304 are allowed; give a larger pitch");
    lattice.first[axis] = static_cast<int>(first);
    lattice.size[axis] = static_cast<int>(last - first + 1);
  }
  return lattice;
}

/// Directions of a fan that the SLM's pixels can show; steeper ones are left out.
std::vector<glm::dvec2> fan_of(const std::vector<double>& across, const std::vector<double>& up,
                               glm::dvec2 largest_sine) {
  std::vector<glm::dvec2> fan;
  for (const double ty : up) {
    for (const double tx : across) {
      const double length = std::sqrt(1 + tx * tx + ty * ty);
      // As floats, which is what devices are given: every reader of the plan has the same rays.
      if (std::abs(tx) <= largest_sine.x * length && std::abs(ty) <= largest_sine.y * length)
        fan.emplace_back(static_cast<float>(tx), static_cast<float>(ty));
    }
  }
  return fan;
}

/// WRPs side by side.
struct Planes {
  glm::ivec2 grid{1, 1};
  glm::dvec2 middle_m{0, 0};
};

/// Adds the chief rays, of the sample lattice, of the light that falls onto a tile's WRPs,
/// diffraction at their edges included.
void add_chief_tangents(const Plan& plan, const DepthLayer& layer, const Tile& tile,
                        const Planes& planes, std::array<Interval, 2>& lit) {
  for (int axis = 0; axis < 2; ++axis) {
    const double window = plan.tile_window_m()[axis],
                 middle = planes.middle_m[axis] - tile.centre_m[axis];
    const auto narrowed = [&](double z) { return std::abs(z - layer.distance_m) / z; };
    const double fan = plan.tile_cone[axis],
                 spot = plan.wavelength_m * layer.max_m.z / (std::max(fan, 1e-3) * window);
    const double footprint =
        fan * window / 2 * std::max(narrowed(layer.min_m.z), narrowed(layer.max_m.z)) + 16 * spot;
    const double half = planes.grid[axis] * window / 2 + footprint;
    // A way to the tile's centre that crosses the plane at x comes from the tangent (x - centre) /
    // distance + centre / z.
    for (const double z : {layer.min_m.z, layer.max_m.z}) {
      for (const double side : {-half, half})
        lit[static_cast<std::size_t>(axis)].add((middle + side) / layer.distance_m +
                                                tile.centre_m[axis] / z);
    }
  }
}

/// Layers around these distances, without those in which there is no surface; every sample belongs
/// to the one whose WRPs its cone meets with the smallest footprint, which is as wide as 1 -
/// distance / depth.
///
/// positions_m  of all vertices; one layer needs none
std::vector<DepthLayer> layers_around(std::vector<double> distances_m, const World& world,
                                      std::span<const glm::dvec3> positions_m) {
  for (;;) {
    std::vector<DepthLayer> layers(distances_m.size());
    for (std::size_t i = 0; i < layers.size(); ++i) {
      layers[i].distance_m = distances_m[i];
      if (i > 0)
        layers[i].begin_m = layers[i - 1].end_m = (distances_m[i - 1] + distances_m[i]) / 2;
    }
    if (layers.size() == 1) {
      layers[0].min_m = world.min_m;
      layers[0].max_m = world.max_m;
      return layers;
    }
    std::vector<double> kept;
    for (auto& layer : layers) {
      layer.min_m = glm::dvec3(std::numeric_limits<double>::infinity());
      layer.max_m = -layer.min_m;
      for (const auto& p : corners_in(world, positions_m, layer)) {
        layer.min_m = glm::min(layer.min_m, p);
        layer.max_m = glm::max(layer.max_m, p);
      }
      if (layer.min_m.z <= layer.max_m.z) kept.push_back(layer.distance_m);
    }
    if (kept.size() == distances_m.size()) return layers;
    distances_m = kept.empty() ? std::vector{distances_m[0]} : kept;
  }
}

/// The part of a triangle that lies in a layer: a convex polygon of at most five corners.
struct Polygon {
  std::array<glm::dvec3, 5> corners;
  std::size_t count = 0;
};

Polygon within(const DepthLayer& layer, const std::array<glm::dvec3, 3>& triangle) {
  Polygon part{{triangle[0], triangle[1], triangle[2]}, 3};
  for (const double side : {1.0, -1.0}) {
    const double at = side > 0 ? layer.begin_m : layer.end_m;
    const auto before = part;
    part.count = 0;
    for (std::size_t i = 0; i < before.count; ++i) {
      const auto &a = before.corners[i], &b = before.corners[(i + 1) % before.count];
      const bool a_inside = side * a.z >= side * at, b_inside = side * b.z >= side * at;
      if (a_inside) part.corners[part.count++] = a;
      if (a_inside != b_inside)
        part.corners[part.count++] = glm::mix(a, b, (at - a.z) / (b.z - a.z));
    }
  }
  return part;
}

/// Whether a rectangle around `middle` meets a convex polygon, by the separating axes of both.
bool meets(glm::dvec2 middle, glm::dvec2 half, std::span<const glm::dvec2> polygon) {
  const auto apart = [&](glm::dvec2 axis) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const auto& corner : polygon) {
      low = std::min(low, glm::dot(corner - middle, axis));
      high = std::max(high, glm::dot(corner - middle, axis));
    }
    const double reach = std::abs(axis.x) * half.x + std::abs(axis.y) * half.y;
    return low > reach || high < -reach;
  };
  if (apart({1, 0}) || apart({0, 1})) return false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const auto side = polygon[(i + 1) % polygon.size()] - polygon[i];
    if (apart({-side.y, side.x})) return false;
  }
  return true;
}

/// How far from a WRP's middle, along each axis, chief rays of samples at these depths cross it or
/// leave light on it.
glm::dvec2 reach_of_light(const Plan& plan, const DepthLayer& layer, double z_m) {
  const auto window = plan.tile_window_m();
  const auto spot = plan.wavelength_m * z_m / (glm::max(plan.tile_cone, 1e-3) * window);
  return window / 2.0 +
         glm::max(plan.tile_cone, 1.0) * window / 2.0 * std::abs(1 - layer.distance_m / z_m) +
         tail_spots * spot;
}

/// The WRPs into which light of some triangle falls on its way to the hologram; all of them when
/// there is none at all, so that whoever looks at them finds out why.
std::vector<Wrp> lit_wrps(const Plan& plan, const World& world, std::vector<Wrp> wrps) {
  std::vector<bool> lit(wrps.size(), false);
  std::size_t dark = wrps.size();
  const auto look_at = [&](std::size_t triangle) {
    const auto corners = world.corners_m(triangle);
    for (std::size_t s = 0; s < plan.layers.size(); ++s) {
      const auto& layer = plan.layers[s];
      const auto part = within(layer, corners);
      if (part.count == 0) continue;
      glm::dvec2 half(0);
      for (std::size_t i = 0; i < part.count; ++i)
        half = glm::max(half, reach_of_light(plan, layer, part.corners[i].z));
      // Of the chief rays with the WRPs of the tile that they go to
      std::array<glm::dvec2, 5> crossing;
      const Tile* to = nullptr;
      for (std::size_t i = 0; i < wrps.size(); ++i) {
        if (lit[i] || wrps[i].layer != s) continue;
        if (const auto* tile = &plan.tile_of(wrps[i]); tile != to) {
          to = tile;
          for (std::size_t j = 0; j < part.count; ++j) {
            const auto& p = part.corners[j];
            crossing[j] = to->centre_m + (glm::dvec2(p) - to->centre_m) * (layer.distance_m / p.z);
          }
        }
        if (!meets(wrps[i].centre_m, half, std::span(crossing).first(part.count))) continue;
        lit[i] = true;
        --dark;
      }
    }
  };
  // A few from everywhere first: mostly they light all. Primes keep out of step with the rows of
  // meshes.
  for (const std::size_t step : {10007, 1009, 101, 1}) {
    for (std::size_t i = 0; i < world.triangles.size(); i += step) {
      if (dark == 0) return wrps;
      look_at(i);
    }
  }
  if (dark == wrps.size()) return wrps;
  std::vector<Wrp> kept;
  for (std::size_t i = 0; i < wrps.size(); ++i) {
    if (lit[i]) kept.push_back(std::move(wrps[i]));
  }
  return kept;
}

bool is_within(double x, const Interval& interval, double margin) {
  return interval.low - margin <= x && x <= interval.high + margin;
}

/// Appends those of a tile in a layer; when rays are aimed, without those too far from where its
/// light passes, unless all are.
void add_wrps_side_by_side(const Scene& scene, const Plan& plan, std::size_t tile,
                           std::size_t number, const Planes& planes,
                           const std::array<Interval, 2>& passed, std::vector<Wrp>& wrps) {
  const auto& layer = plan.layers[number];
  const auto window = plan.tile_window_m();
  const auto reach = glm::max(reach_of_light(plan, layer, layer.min_m.z),
                              reach_of_light(plan, layer, layer.max_m.z));
  // Aimed gathering uses its fan for what mirrors and glass show.
  const bool perspective = plan.aimed || scene.sampling.shape == FanShape::perspective;
  const double depth =
      (plan.far_m - layer.distance_m) * (plan.bounces > 0 ? deepest_virtual_picture : 1);
  const bool aims = plan.aimed && plan.bounces == 0;
  std::vector<Wrp> all;
  for (int row = 0; row < planes.grid.y; ++row) {
    for (int column = 0; column < planes.grid.x; ++column) {
      Wrp wrp;
      wrp.layer = number;
      wrp.tile = tile;
      wrp.centre_m = {planes.middle_m.x + (column - (planes.grid.x - 1) / 2.0) * window.x,
                      planes.middle_m.y - (row - (planes.grid.y - 1) / 2.0) * window.y,
                      layer.distance_m};
      if (aims) {
        all.push_back(std::move(wrp));
        continue;
      }
      const double p = scene.sampling.pitch_m;
      const auto rays = [&](int axis) {
        return fan_count(window[axis], layer.distance_m, depth, p);
      };
      if (!(rays(0) * rays(1) <= largest_fan)) {
        throw InputError(one_line(scene.file.string()) + ": sampling.pitch " + millimetres(p) +
                         " needs " + count_text(rays(0)) + " x " + count_text(rays(1)) +
                         " rays per pixel, at most 16777216 are allowed; give a larger pitch");
      }
      std::array<std::vector<double>, 2> tangents;
      for (int axis = 0; axis < 2; ++axis) {
        // Perspective views turn with the pixel, parallel ones with the WRP.
        const double shift = perspective ? 0 : wrp.centre_m[axis];
        tangents[axis] = fan_tangents(window[axis], layer.distance_m, shift, depth, p);
        wrp.fan_step[axis] =
            window[axis] / layer.distance_m / static_cast<double>(tangents[axis].size());
      }
      wrp.fan = fan_of(tangents[0], tangents[1], perspective ? glm::dvec2(1) : plan.largest_sine);
      if (perspective) wrp.convergence_per_m = 1 / layer.distance_m;
      all.push_back(std::move(wrp));
    }
  }
  const auto is_near = [&](const Wrp& wrp) {
    return is_within(wrp.centre_m.x, passed[0], reach.x) &&
           is_within(wrp.centre_m.y, passed[1], reach.y);
  };
  if (aims && std::any_of(all.begin(), all.end(), is_near))
    std::erase_if(all, [&](const Wrp& wrp) { return !is_near(wrp); });
  std::move(all.begin(), all.end(), std::back_inserter(wrps));
}

Wrp plane_at_hologram(const Plan& plan, std::size_t tile, glm::dvec2 largest_tangent,
                      int rays_per_axis) {
  Wrp plane;
  plane.tile = tile;
  plane.centre_m = {plan.tiles[tile].centre_m, 0};
  std::array<std::vector<double>, 2> tangents;
  for (int axis = 0; axis < 2; ++axis) {
    plane.fan_step[axis] = 2 * largest_tangent[axis] / rays_per_axis;
    for (int i = 0; i < rays_per_axis; ++i)
      tangents[axis].push_back((i - (rays_per_axis - 1) / 2.0) * plane.fan_step[axis]);
  }
  plane.fan = fan_of(tangents[0], tangents[1], plan.largest_sine);
  return plane;
}

/// About how many rays are aimed at samples: as if one surface filled the lattice, the layers'
/// middle depths in equal parts.
std::uint64_t aimed_rays(const Plan& plan) {
  double rays = 0;
  for (const auto& layer : plan.layers) {
    const double middle = (layer.min_m.z + layer.max_m.z) / 2,
                 narrowed = std::abs(middle - layer.distance_m) / middle;
    double of_layer = static_cast<double>(plan.lattice.size.x) * plan.lattice.size.y /
                      static_cast<double>(plan.layers.size());
    for (int axis = 0; axis < 2; ++axis)
      of_layer *= std::max(
          1.0, std::min(narrowed * (layer.distance_m > 0 ? plan.cone_half_width : 1.0), 1.0) *
                   plan.size[axis]);
    rays += of_layer;
  }
  return static_cast<std::uint64_t>(rays);
}

/// Depths at which the WRPs stand, front to back.
std::vector<double> distances_of(const Scene& scene, const World& world, const Plan& plan) {
  const auto& given = scene.wrp.distances_m;
  const bool gathers_fans = !plan.aimed || plan.bounces > 0;
  if (const auto layers = std::max(given.size(), static_cast<std::size_t>(scene.wrp.layers));
      gathers_fans && layers > 1) {
    throw InputError(one_line(scene.file.string()) + ": wrp.layers " + std::to_string(layers) +
                     ": rays of fans, mirrors and glass pass from layer to layer, which needs all "
                     "WRPs at one distance; give wrp.layers 1" +
                     (given.empty() ? "" : " and one wrp.distance"));
  }
  if (!given.empty()) {
    // Rays of a fan go forwards; aimed ones meet samples on either side
    if (!plan.aimed && given[0] >= plan.far_m) {
      throw InputError(one_line(scene.file.string()) + ": wrp.distance " + millimetres(given[0]) +
                       " puts the WRPs behind the whole scene, which ends at " +
                       millimetres(plan.far_m) + "; give less, or \"auto\"");
    }
    return given;
  }
  if (!gathers_fans) return middles_of_surfaces(world, scene.wrp.layers);
  const auto window = plan.window_m();
  const double cone = std::max(window.x, window.y) / plan.near_m;
  const double across = std::max(samples_across_nearest * scene.sampling.pitch_m,
                                 pixels_across_nearest * std::max(plan.pitch_m.x, plan.pitch_m.y));
  return {plan.near_m - std::min(across / cone, plan.near_m / 2)};
}

/// Of a tile, through a plane at distance_m.
SeenThrough seen_through(double distance_m, glm::dvec2 largest_tangent, const Plan& plan,
                         const Tile& tile) {
  const double wider = std::max({1.0, plan.tile_cone.x, plan.tile_cone.y});
  return {distance_m, tile.centre_m, plan.tile_window_m() / 2.0, 0.99 * largest_tangent, wider};
}

/// The part of where a tile's light passes through a layer's plane that is no steeper than the
/// pixels can show.
std::array<Interval, 2> shown_part(std::array<Interval, 2> passed, const Plan& plan,
                                   const Tile& tile, double distance_m,
                                   glm::dvec2 largest_tangent) {
  for (int axis = 0; axis < 2; ++axis) {
    auto& along = passed[static_cast<std::size_t>(axis)];
    const double reach = plan.tile_window_m()[axis] / 2 + distance_m * largest_tangent[axis],
                 centre = tile.centre_m[axis];
    along.low = std::clamp(along.low, centre - reach, centre + reach);
    along.high = std::clamp(along.high, centre - reach, centre + reach);
  }
  return passed;
}

/// The WRPs side by side that a tile needs for a layer. A given grid is the hologram's: the same
/// area, divided like the hologram.
///
/// tile  where its light passes; all: that of all tiles
Planes planes_of(const Scene& scene, const Plan& plan, const std::array<Interval, 2>& tile,
                 const std::array<Interval, 2>& all) {
  Planes planes;
  for (int axis = 0; axis < 2; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    planes.middle_m[axis] = scene.wrp.grid ? all[i].middle() : tile[i].middle();
    const double wanted =
        std::max(1.0, std::ceil(tile[i].extent() / plan.tile_window_m()[axis] - 0.01));
    planes.grid[axis] = scene.wrp.grid ? (*scene.wrp.grid)[axis] * plan.tile_grid[axis]
                                       : static_cast<int>(std::min(wanted, largest_grid + 1.0));
  }
  return planes;
}

/// Places the WRPs of all tiles and layers: Plan::layers, grid and wrps.
///
/// returns  all of the scene's extents; chief rays of the light that falls onto the WRPs
std::pair<Extents, std::array<Interval, 2>> place_wrps(const Scene& scene, const World& world,
                                                       glm::dvec2 largest_tangent, Plan& plan) {
  auto distances_m = distances_of(scene, world, plan);
  const auto positions_m =
      distances_m.size() > 1 ? positions_now(world) : std::vector<glm::dvec3>();
  plan.layers = layers_around(std::move(distances_m), world, positions_m);
  Extents all;
  std::array<Interval, 2> covered, lit;
  std::vector<std::vector<Wrp>> of_tiles(plan.tiles.size());
  double count = 0;
  for (std::size_t number = 0; number < plan.layers.size(); ++number) {
    auto& layer = plan.layers[number];
    const auto corners =
        plan.layers.size() > 1 ? corners_in(world, positions_m, layer) : std::vector<glm::dvec3>();
    std::vector<std::array<Interval, 2>> passed, shown;
    std::array<Interval, 2> all_shown;
    for (const auto& tile : plan.tiles) {
      const auto seen = seen_through(layer.distance_m, largest_tangent, plan, tile);
      const auto extents =
          plan.layers.size() > 1 ? extents_of(corners, seen) : extents_of(world, seen);
      all.add(extents);
      passed.push_back(extents.passed);
      shown.push_back(shown_part(extents.passed, plan, tile, layer.distance_m, largest_tangent));
      for (std::size_t axis = 0; axis < 2; ++axis) {
        all_shown[axis].add(shown.back()[axis].low);
        all_shown[axis].add(shown.back()[axis].high);
      }
    }
    double most = 0;
    for (std::size_t i = 0; i < plan.tiles.size(); ++i) {
      const auto planes = planes_of(scene, plan, shown[i], all_shown);
      const auto grid = scene.wrp.grid.value_or(planes.grid);
      most = std::max(most, static_cast<double>(grid.x) * grid.y);
      if (count + most > largest_grid) {
        throw InputError(scene.file.string() + ": the scene needs " + std::to_string(grid.x) +
                         " x " + std::to_string(grid.y) + " or more WRPs of the hologram's size, " +
                         std::to_string(largest_grid) +
                         " are allowed; give wrp.grid, a larger hologram or a smaller scene");
      }
      layer.grid = glm::max(layer.grid, planes.grid);
      for (int axis = 0; axis < 2; ++axis) {
        for (const double side : {-0.5, 0.5})
          covered[static_cast<std::size_t>(axis)].add(
              planes.middle_m[axis] + side * planes.grid[axis] * plan.tile_window_m()[axis]);
      }
      add_chief_tangents(plan, layer, plan.tiles[i], planes, lit);
      add_wrps_side_by_side(scene, plan, i, number, planes, passed[i], of_tiles[i]);
    }
    count += most;
  }
  for (int axis = 0; axis < 2; ++axis)
    plan.grid[axis] =
        scene.wrp.grid
            ? (*scene.wrp.grid)[axis]
            : static_cast<int>(std::ceil(
                  covered[static_cast<std::size_t>(axis)].extent() / plan.window_m()[axis] - 0.01));
  for (auto& wrps : of_tiles) std::move(wrps.begin(), wrps.end(), std::back_inserter(plan.wrps));
  if (!plan.aimed || plan.bounces > 0) return {all, {Interval{-1e9, 1e9}, Interval{-1e9, 1e9}}};
  plan.wrps = lit_wrps(plan, world, std::move(plan.wrps));
  return {all, lit};
}

Lighting lighting_of(const Scene& scene) {
  Lighting lighting{scene.lights, scene.materials, {}, scene.trace.shadows};
  for (const auto& object : scene.objects) lighting.material_of_object.push_back(object.material);
  return lighting;
}

}  // namespace

std::vector<double> fan_tangents(double window_m, double distance_m, double shift_m, double depth_m,
                                 double pitch_m) {
  const double width = window_m / distance_m;
  const auto count = static_cast<std::size_t>(
      std::min(fan_count(window_m, distance_m, depth_m, pitch_m), double{largest_fan}));
  std::vector<double> tangents(count);
  for (std::size_t i = 0; i < count; ++i)
    tangents[i] =
        shift_m / distance_m + (static_cast<double>(i) - static_cast<double>(count - 1) / 2) *
                                   width / static_cast<double>(count);
  return tangents;
}

const DepthLayer& Plan::layer_at(double z_m) const {
  return *std::find_if(layers.begin(), layers.end() - 1,
                       [&](const DepthLayer& layer) { return z_m < layer.end_m; });
}

std::pair<std::size_t, std::size_t> Plan::wrps_of(std::size_t tile) const {
  const auto [first, end] =
      std::equal_range(wrps.begin(), wrps.end(), Wrp{.tile = tile},
                       [](const Wrp& a, const Wrp& b) { return a.tile < b.tile; });
  return {static_cast<std::size_t>(first - wrps.begin()),
          static_cast<std::size_t>(end - wrps.begin())};
}

std::size_t Plan::most_wrps_of_a_tile() const {
  std::vector<std::size_t> counts(tiles.size(), 0);
  for (const auto& wrp : wrps) ++counts[wrp.tile];
  return *std::max_element(counts.begin(), counts.end());
}

std::size_t Plan::gathered_pixels() const {
  std::size_t largest = 0;
  for (const auto& layer : layers) {
    const auto gathered = gathered_size(layer);
    largest = std::max(largest,
                       static_cast<std::size_t>(gathered.x) * static_cast<std::size_t>(gathered.y));
  }
  return largest;
}

WrpsExtent wrps_extent(const Plan& plan, const DepthLayer& layer) {
  WrpsExtent extent{glm::dvec2(std::numeric_limits<double>::infinity()),
                    glm::dvec2(-std::numeric_limits<double>::infinity())};
  const auto half_window = plan.tile_window_m() / 2.0;
  for (const auto& wrp : plan.wrps) {
    if (&plan.layer_of(wrp) != &layer) continue;
    extent.first = glm::min(extent.first, glm::dvec2(wrp.centre_m) - half_window);
    extent.last = glm::max(extent.last, glm::dvec2(wrp.centre_m) + half_window);
  }
  return extent;
}

std::pair<float, float> layer_bounds(const Plan& plan, const DepthLayer& layer) {
  const auto in_frame = [&](double z_m) {
    constexpr double largest = std::numeric_limits<float>::max();
    return static_cast<float>(std::clamp(z_m - plan.origin_m.z, -largest, largest));
  };
  return {in_frame(layer.begin_m), in_frame(layer.end_m)};
}

std::string why_in_one_piece(const Plan& plan, Method method) {
  if (method != Method::wrp) return "";
  if (!plan.aimed || plan.bounces > 0)
    return "the rays of fans, mirrors and glass hang on the whole hologram's window";
  if (plan.cone_half_width - plan.apodization < 1 - 1e-9)
    return "sampling.cone less sampling.apodization is below 1, which would darken the tiles' "
           "borders";
  return "";
}

void divide(Plan& plan, glm::ivec2 tile_grid, double padding) {
  plan.tile_grid = tile_grid;
  plan.tile_size = (plan.size + tile_grid - 1) / tile_grid;
  plan.tiles.clear();
  for (int row = 0; row < tile_grid.y; ++row) {
    for (int column = 0; column < tile_grid.x; ++column) {
      Tile tile;
      tile.first =
          glm::ivec2(column, row) * (plan.size - plan.tile_size) / glm::max(tile_grid - 1, 1);
      const auto off_middle = glm::dvec2(tile.first) + glm::dvec2(plan.tile_size - plan.size) / 2.0;
      tile.centre_m = off_middle * plan.pitch_m * glm::dvec2(1, -1);  // rows count downwards
      plan.tiles.push_back(tile);
    }
  }
  plan.padded = padded_size(plan.tile_size, padding);
  // Light beyond comes round into the tile.
  const auto held = glm::max(2.0 * glm::dvec2(plan.padded) / glm::dvec2(plan.tile_size) - 1.0,
                             plan.cone_half_width);
  const auto smaller = glm::dvec2(plan.size) / glm::dvec2(plan.tile_size);
  const auto wanted = plan.cone_half_width + (plan.cone_half_width - 1) * (smaller - 1.0);
  plan.tile_cone = glm::min(wanted, held);
  plan.tile_apodization = plan.apodization * smaller - (wanted - plan.tile_cone);
}

Plan make_plan(const Scene& scene, const World& world, Method method, int rays_per_axis,
               bool has_doubles, const Plan* moved_from) {
  const auto& hologram = scene.hologram;
  Plan plan;
  plan.size = hologram.resolution;
  plan.pitch_m = hologram.pitch_m;
  plan.wavelength_m = hologram.wavelength_m;
  plan.near_m = world.min_m.z;
  plan.far_m = world.max_m.z;

  for (int axis = 0; axis < 2; ++axis)
    plan.largest_sine[axis] = std::min(1.0, plan.wavelength_m / (2 * plan.pitch_m[axis]));
  const auto largest_tangent = [&](int axis) {
    const double sine = std::min(plan.largest_sine[axis], 0.999);
    return sine / std::sqrt(1 - sine * sine);
  };
  plan.scene_name = scene.file.string();
  plan.lighting = lighting_of(scene);
  plan.frames = scene.sampling.frames;
  plan.seed = scene.sampling.seed;
  plan.sampling_pitch_m = scene.sampling.pitch_m;
  plan.fan_source = scene.sampling.source;
  plan.padding = scene.wrp.padding;
  plan.aimed = method == Method::points ||
               (method == Method::wrp && scene.sampling.mode == SamplingMode::aimed);
  const bool has_bounces = plan.lighting.any_material(
      [](const Material& m) { return m.reflectivity > 0 || m.transparency > 0; });
  plan.bounces = has_bounces ? scene.trace.depth : 0;
  plan.antialias = scene.sampling.antialias;
  plan.view_parts = scene.sampling.visibility;
  plan.cone_half_width = scene.sampling.cone;
  plan.apodization = scene.sampling.apodization;

  const auto tiles =
      moved_from ? moved_from->tile_grid : scene.hologram.tiles.value_or(glm::ivec2(1));
  if (const auto why = why_in_one_piece(plan, method); tiles != glm::ivec2(1) && !why.empty()) {
    throw InputError(one_line(scene.file.string()) + ": hologram.tiles " + std::to_string(tiles.x) +
                     " x " + std::to_string(tiles.y) + ": " + why + "; give hologram.tiles [1, 1]");
  }
  divide(plan, tiles, scene.wrp.padding);

  const glm::dvec2 steepest(largest_tangent(0), largest_tangent(1));
  std::array<Interval, 2> lit = {Interval{-1e9, 1e9}, Interval{-1e9, 1e9}};
  Extents extents;
  if (method == Method::wrp) {
    std::tie(extents, lit) = place_wrps(scene, world, steepest, plan);
  } else {
    plan.layers = {{.distance_m = 0, .min_m = world.min_m, .max_m = world.max_m}};
    for (std::size_t i = 0; i < plan.tiles.size(); ++i) {
      extents.add(extents_of(world, seen_through(0, steepest, plan, plan.tiles[i])));
      plan.wrps.push_back(plane_at_hologram(plan, i, steepest, rays_per_axis));
    }
  }
  plan.origin_m = {(world.min_m.x + world.max_m.x) / 2, (world.min_m.y + world.max_m.y) / 2,
                   (plan.near_m + plan.far_m) / 2};
  plan.lattice = lattice_over(scene, extents, plan, steepest, lit);
  plan.beyond_diffraction = extents.beyond_m[0] > 0 || extents.beyond_m[1] > 0;

  for (auto& layer : plan.layers) {
    for (int axis = 0; axis < 2; ++axis)
      layer.axes[static_cast<std::size_t>(axis)] = {plan.tile_size[axis], plan.pitch_m[axis], 0};
    if (method == Method::wrp && plan.aimed && plan.bounces == 0 && scene.wrp.oversampling)
      layer.axes = axes_for_band(plan, layer, *scene.wrp.oversampling);
  }
  for (const auto& wrp : plan.wrps) {
    if (!plan.aimed)
      plan.rays += wrp.fan.size() * static_cast<std::uint64_t>(plan.tile_size.x) *
                   static_cast<std::uint64_t>(plan.tile_size.y);
  }
  if (plan.aimed) plan.rays = aimed_rays(plan);

  plan.phase_errors = predict_phase_errors(plan);
  plan.precision = choose_precision(scene.accuracy, plan.phase_errors, has_doubles);

  if (method == Method::wrp && plan.aimed) plan.cone_error = plan.cone().field_error();
  if (method == Method::wrp && moved_from) {
    plan.why_tiles = moved_from->why_tiles;
    plan.padding_error = moved_from->padding_error;
    plan.oversampling_error = moved_from->oversampling_error;
  } else if (method == Method::wrp) {
    plan.padding_error = predicted_padding_errors(plan, {plan.padded})[0];
    plan.oversampling_error = predicted_oversampling_error(plan);
  }
  return plan;
}

}  // namespace raywave
