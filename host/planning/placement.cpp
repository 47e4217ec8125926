// SPDX-License-Identifier: Apache-2.0
#include "host/planning/placement.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <iterator>
#include <limits>
#include <span>
#include <vector>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/geometry/extents.hpp"

namespace raywave {
namespace {

/// The part of where a tile's light passes through a layer's plane that is no steeper than the
/// pixels can show.
std::array<Interval, 2> shown_part(std::array<Interval, 2> passed, const Plan& plan,
                                   const Tile& tile, double distance_m,
                                   glm::dvec2 largest_tangent) {
  for (int axis = 0; axis < 2; ++axis) {
    auto& along = passed[static_cast<std::size_t>(axis)];
    const double reach =
                     plan.tile_window_m()[axis] / 2 + std::abs(distance_m) * largest_tangent[axis],
                 centre = tile.centre_m[axis];
    along.low = std::clamp(along.low, centre - reach, centre + reach);
    along.high = std::clamp(along.high, centre - reach, centre + reach);
  }
  return passed;
}

bool holds(const DepthLayer& layer, double z_m) {
  return layer.begin_m <= z_m && z_m < layer.end_m;
}

/// The corners of all surfaces in a layer: vertices of the meshes, and where edges enter or leave
/// the layer; and the images in it.
///
/// positions_m  of all vertices
std::vector<glm::dvec3> corners_in(const World& world, std::span<const glm::dvec3> positions_m,
                                   const DepthLayer& layer, const Images& images) {
  std::vector<glm::dvec3> all;
  for (const auto& image : images.all) {
    if (images.holds(image) && holds(layer, image.at_m.z)) all.push_back(image.at_m);
  }
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

/// Where a layer's light passes through its plane, per tile.
struct PassedLight {
  std::vector<std::array<Interval, 2>> passed;  // all of it
  std::vector<std::array<Interval, 2>> shown;   // what pixels can show
  std::array<Interval, 2> all_shown;            // of all tiles together
};

/// extents  extended by the layer's
PassedLight passed_light(const World& world, std::span<const glm::dvec3> positions_m,
                         glm::dvec2 largest_tangent, const Plan& plan, const DepthLayer& layer,
                         Extents& extents) {
  PassedLight light;
  const bool is_whole = plan.layers.size() == 1;
  const auto corners = is_whole ? std::vector<glm::dvec3>()
                                : corners_in(world, positions_m, layer, plan.specular.images);
  for (const auto& tile : plan.tiling.tiles) {
    const auto seen = seen_through(layer.distance_m, largest_tangent, plan, tile);
    const auto of_tile = is_whole ? extents_of(world, seen) : extents_of(corners, seen);
    extents.add(of_tile);
    light.passed.push_back(of_tile.passed);
    light.shown.push_back(
        shown_part(of_tile.passed, plan, tile, layer.distance_m, largest_tangent));
    for (std::size_t axis = 0; axis < 2; ++axis) {
      light.all_shown[axis].add(light.shown.back()[axis].low);
      light.all_shown[axis].add(light.shown.back()[axis].high);
    }
  }
  return light;
}

/// The WRPs side by side that a tile needs for a layer. A given grid is the hologram's: the same
/// area, divided like the hologram.
///
/// tile  where its light passes; all: that of all tiles
WrpGrid grid_of(const Scene& scene, const Plan& plan, const std::array<Interval, 2>& tile,
                const std::array<Interval, 2>& all) {
  WrpGrid grid;
  for (int axis = 0; axis < 2; ++axis) {
    const auto i = static_cast<std::size_t>(axis);
    grid.middle_m[axis] = scene.wrp.grid ? all[i].middle() : tile[i].middle();
    const double wanted =
        std::max(1.0, std::ceil(tile[i].extent() / plan.tile_window_m()[axis] - 0.01));
    grid.size[axis] = scene.wrp.grid ? (*scene.wrp.grid)[axis] * plan.tiling.grid[axis]
                                     : static_cast<int>(std::min(wanted, most_wrps + 1.0));
  }
  return grid;
}

/// Sampling pitches that the cone of a pixel spans on the nearest surface. Three keep neighbouring
/// samples apart in direction (docs/pipeline.md); more only cost rays.
constexpr double samples_across_nearest = 3;

/// Pixels that the cone spans there at least: fewer do not resolve it.
constexpr double pixels_across_nearest = 8;

/// True for objects without light of their own: all of it passes, or is mirrored.
bool is_dark(const World& world, const Plan& plan, std::size_t object) {
  const auto shines = [&](std::int32_t of_its_mesh) {
    const auto number = plan.lighting.material_of(object, of_its_mesh);
    const auto& m = plan.lighting.materials[static_cast<std::size_t>(number)];
    return m.reflectivity.at(plan.hologram.wavelength_m) +
               m.transparency.at(plan.hologram.wavelength_m) <
           1;
  };
  if (world.triangle_material.empty()) return !shines(-1);
  for (std::size_t i = 0; i < world.triangles.size(); ++i) {
    if (world.triangle_object[i] == static_cast<std::int32_t>(object) &&
        shines(world.triangle_material[i]))
      return false;
  }
  return true;
}

/// Middles of what shines: surfaces with light of their own, and images.
std::vector<double> middles_of_light(const World& world, const Plan& plan, int layers) {
  if (!plan.has_specular_samples()) return middles_of_surfaces(world, layers);
  std::vector<bool> dark;
  bool all_dark = true;
  for (std::size_t i = 0; i < plan.lighting.material_of_object.size(); ++i) {
    dark.push_back(is_dark(world, plan, i));
    all_dark = all_dark && dark.back();
  }
  std::vector<DepthWeight> images;
  for (const auto& image : plan.specular.images.all) {
    if (plan.specular.images.holds(image))
      images.push_back({image.at_m.z, 2 * plan.specular.images.step * plan.specular.images.step *
                                          std::abs(image.at_m.z)});
  }
  if (all_dark && images.empty()) dark.clear();
  return middles_of_surfaces(world, layers, dark, images);
}

/// Distances from the WRPs to the hologram, in metres, front to back. WRPs that gather samples
/// stand amid the surfaces; those that gather fans stand in front of the nearest one.
///
/// throws  InputError for several layers of fans, and for WRPs of fans behind the scene
std::vector<double> distances_of(const Scene& scene, const World& world, const Plan& plan) {
  // Rays of fans pass from layer to layer, so they allow one distance only.
  const auto& given = scene.wrp.distances_m;
  if (const auto layers = std::max(given.size(), static_cast<std::size_t>(scene.wrp.layers));
      !plan.samples.aimed && layers > 1) {
    throw InputError(one_line(scene.file.string()) + ": wrp.layers " + std::to_string(layers) +
                     ": rays of fans pass from layer to layer, which needs all "
                     "WRPs at one distance; give wrp.layers 1" +
                     (given.empty() ? "" : " and one wrp.distance"));
  }

  // Distances that the scene gives are taken. Rays of a fan go forwards and need surfaces behind
  // the WRPs; aimed rays meet samples on either side.
  if (!given.empty()) {
    if (!plan.samples.aimed && given[0] >= plan.extent.far_m) {
      throw InputError(one_line(scene.file.string()) + ": wrp.distance " + millimetres(given[0]) +
                       " puts the WRPs behind the whole scene, which ends at " +
                       millimetres(plan.extent.far_m) + "; give less, or \"auto\"");
    }
    return given;
  }

  // WRPs that gather samples stand amid the surfaces, where footprints are smallest. WRPs that
  // gather fans stand so far in front that a pixel's cone spans a few samples.
  if (plan.samples.aimed && (plan.extent.near_m > 0 || plan.extent.far_m < 0))
    return middles_of_light(world, plan, scene.wrp.layers);
  if (plan.samples.aimed) {
    // As many layers on each side of the hologram
    std::vector<bool> before;
    for (std::size_t i = 0; i < world.object_closed.size(); ++i)
      before.push_back(lies_before(world, i));
    auto beyond = before;
    beyond.flip();
    auto distances = middles_of_surfaces(world, scene.wrp.layers, beyond);
    std::erase_if(distances, [](double distance_m) { return distance_m >= 0; });
    if (distances.empty()) distances.push_back(plan.extent.near_m);
    const auto others = middles_of_surfaces(world, scene.wrp.layers, before);
    const auto first = distances.size();
    std::copy_if(others.begin(), others.end(), std::back_inserter(distances),
                 [](double distance_m) { return distance_m > 0; });
    if (distances.size() == first) distances.push_back(plan.extent.far_m);
    return distances;
  }
  const auto window = plan.window_m();
  const double nearest_m = std::abs(plan.extent.near_m),
               cone = std::max(window.x, window.y) / nearest_m;
  const double across =
      std::max(samples_across_nearest * scene.sampling.pitch_m,
               pixels_across_nearest * std::max(plan.hologram.pitch_m.x, plan.hologram.pitch_m.y));
  return {plan.extent.near_m - std::min(across / cone, nearest_m / 2)};
}

/// Layers around these distances, without those in which there is no surface. Every sample belongs
/// to the layer on whose WRPs it has the smallest footprint.
///
/// positions_m  of all vertices; one layer needs none
std::vector<DepthLayer> layers_around(std::vector<double> distances_m, const World& world,
                                      std::span<const glm::dvec3> positions_m,
                                      const Images& images) {
  for (;;) {
    // Layers meet midway between their WRPs: there footprints, as wide as |1 - distance / depth|,
    // are equal on both. Those on different sides of the hologram meet there.
    std::vector<DepthLayer> layers(distances_m.size());
    for (std::size_t i = 0; i < layers.size(); ++i) {
      layers[i].distance_m = distances_m[i];
      const bool is_side = i > 0 && distances_m[i - 1] < 0 && distances_m[i] > 0;
      if (i > 0)
        layers[i].begin_m = layers[i - 1].end_m =
            is_side ? 0 : (distances_m[i - 1] + distances_m[i]) / 2;
    }
    if (layers.size() == 1) {
      layers[0].min_m = world.min_m;
      layers[0].max_m = world.max_m;
      for (const auto& image : images.all) {
        if (!images.holds(image)) continue;
        layers[0].min_m = glm::min(layers[0].min_m, image.at_m);
        layers[0].max_m = glm::max(layers[0].max_m, image.at_m);
      }
      return layers;
    }

    // Layers without a surface go, and the others share out the depths anew.
    std::vector<double> kept;
    for (auto& layer : layers) {
      layer.min_m = glm::dvec3(std::numeric_limits<double>::infinity());
      layer.max_m = -layer.min_m;
      for (const auto& p : corners_in(world, positions_m, layer, images)) {
        layer.min_m = glm::min(layer.min_m, p);
        layer.max_m = glm::max(layer.max_m, p);
      }
      if (layer.min_m.z <= layer.max_m.z) kept.push_back(layer.distance_m);
    }
    if (kept.size() == distances_m.size()) return layers;
    distances_m = kept.empty() ? std::vector{distances_m[0]} : kept;
  }
}

}  // namespace

SeenThrough seen_through(double distance_m, glm::dvec2 largest_tangent, const Plan& plan,
                         const Tile& tile) {
  const double wider = std::max({1.0, plan.tiling.cone.x, plan.tiling.cone.y});
  return {distance_m, tile.centre_m, plan.tile_window_m() / 2.0, 0.99 * largest_tangent, wider};
}

Placement place_layers(const Scene& scene, const World& world, glm::dvec2 largest_tangent,
                       Plan& plan) {
  // Depths are shared out among the distances at which planes stand.
  auto distances_m = distances_of(scene, world, plan);
  const auto positions_m =
      distances_m.size() > 1 ? positions_now(world) : std::vector<glm::dvec3>();
  plan.layers = layers_around(std::move(distances_m), world, positions_m, plan.specular.images);

  // Each layer has, for every tile, a grid of planes that covers the light which pixels can show.
  Placement placement;
  std::array<Interval, 2> covered;
  for (auto& layer : plan.layers) {
    auto light = passed_light(world, positions_m, largest_tangent, plan, layer, placement.extents);
    auto& grids = placement.grids.emplace_back();
    for (std::size_t i = 0; i < plan.tiling.tiles.size(); ++i) {
      const auto grid = grid_of(scene, plan, light.shown[i], light.all_shown);
      layer.grid = glm::max(layer.grid, grid.size);
      for (int axis = 0; axis < 2; ++axis) {
        for (const double side : {-0.5, 0.5})
          covered[static_cast<std::size_t>(axis)].add(
              grid.middle_m[axis] + side * grid.size[axis] * plan.tile_window_m()[axis]);
      }
      grids.push_back({grid, light.passed[i]});
      add_chief_tangents(plan, layer, plan.tiling.tiles[i], grid, placement.lit);
    }
  }

  // The grid of the plan covers the planes of all layers and tiles.
  for (int axis = 0; axis < 2; ++axis)
    plan.grid[axis] =
        scene.wrp.grid
            ? (*scene.wrp.grid)[axis]
            : static_cast<int>(std::ceil(
                  covered[static_cast<std::size_t>(axis)].extent() / plan.window_m()[axis] - 0.01));

  // Fans, mirrors and glass may bring light from anywhere.
  if (!plan.samples.aimed || plan.has_specular_samples()) placement.lit = all_tangents;
  return placement;
}

}  // namespace raywave
