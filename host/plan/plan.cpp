// SPDX-License-Identifier: Apache-2.0
#include "host/plan/plan.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "host/geometry/world.hpp"

namespace raywave {
namespace {

/// Lighting::textures of one material.
///
/// maps  its pictures, if a mesh brings it
int textures_of(const Material& material, const MaterialMaps* maps) {
  constexpr int none = 0, plain = 1, looks = 2;
  if (material.emission != glm::dvec3(0) || material.vertex_colours) return looks;
  if (!maps) return material.texture ? plain : none;
  if (material.metallic_roughness || maps->normal[0] || !maps->colour.place.is_plain())
    return looks;
  return maps->colour ? plain : none;
}

}  // namespace

double Cone::passed(double at) const {
  const double inside = half_width - std::abs(at);
  if (apodization <= 0) return inside >= 0 ? 1 : 0;
  const double e = std::clamp(inside / apodization, 0.0, 1.0);
  return e * e * (3 - 2 * e);
}

double Cone::field_error() const {
  constexpr int places = 1024;
  double first = 0, second = 0;  // means of what passes, and of its square
  for (int i = 0; i < places; ++i) {
    const double share = passed((i + 0.5) / places);
    first += share / places;
    second += share * share / places;
  }
  return std::sqrt(std::max(0.0, 1 - 2 * first * first + second * second));
}

Lighting lighting_of(const Scene& scene, const World& world) {
  Lighting lighting{scene.lights,        scene.materials,         {},
                    scene.trace.shadows, scene.trace.shadow_rays, scene.trace.diffuse_rays};
  for (const auto& object : scene.objects) lighting.material_of_object.push_back(object.material);
  lighting.first_of_meshes = static_cast<std::int32_t>(scene.materials.size());
  lighting.materials.insert(lighting.materials.end(), world.materials.begin(),
                            world.materials.end());
  std::vector<bool> is_used(lighting.materials.size(), false);
  if (world.triangle_material.empty()) {
    for (const auto material : lighting.material_of_object)
      is_used[static_cast<std::size_t>(material)] = true;
  } else {
    for (std::size_t i = 0; i < world.triangles.size(); ++i)
      is_used[static_cast<std::size_t>(lighting.material_of(
          static_cast<std::size_t>(world.triangle_object[i]), world.triangle_material[i]))] = true;
  }
  for (std::size_t i = 0; i < is_used.size(); ++i) {
    if (!is_used[i]) continue;
    lighting.used.push_back(static_cast<std::int32_t>(i));
    const auto* maps =
        i < scene.materials.size() ? nullptr : &world.maps[i - scene.materials.size()];
    lighting.textures = std::max(lighting.textures, textures_of(lighting.materials[i], maps));
    lighting.normal_maps |= maps && maps->normal[0];
    lighting.alpha = std::max(lighting.alpha, lighting.materials[i].alpha_mode);
    if (has_highlights(lighting.materials[i], scene.channels()))
      lighting.gloss_rays = scene.trace.gloss_rays;
  }
  return lighting;
}

std::vector<std::shared_ptr<const Image>> environments_of(const Textures& textures,
                                                          const Lighting& lighting) {
  const auto first = std::min(static_cast<std::size_t>(lighting.first_of_meshes), textures.size());
  return {textures.begin() + static_cast<std::ptrdiff_t>(first), textures.end()};
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
  std::vector<std::size_t> counts(tiling.tiles.size(), 0);
  for (const auto& wrp : wrps) ++counts[wrp.tile];
  return *std::ranges::max_element(counts);
}

std::size_t Plan::gathered_pixels() const {
  const int columns =
      std::visit([&](const auto& c) { return c.row_stride(tiling.tile_size); }, carrier);
  return area_of({columns, gathered_size().y});
}

double cone_error_of(const Plan& plan) {
  return plan.samples.aimed && !plan.is_at_hologram() ? plan.cone.field_error() : 0;
}

bool encodes_transforms(const Plan& plan, bool keep_field) {
  return plan.holds_all_light() && !keep_field && !encodes_whole(plan) &&
         plan.most_wrps_of_a_tile() == 1;
}

bool encodes_whole(const Plan& plan) {
  return plan.refine || plan.slm.band != glm::dvec2(1) ||
         (plan.tiling.tiles.size() > 1 && plan.slm.encoding != Encoding::phase);
}

WrpsExtent wrps_extent(const Plan& plan, const DepthLayer& layer) {
  WrpsExtent extent{glm::dvec2(std::numeric_limits<double>::infinity()),
                    glm::dvec2(-std::numeric_limits<double>::infinity())};
  if (plan.holds_all_light()) return {-extent.first, -extent.last};
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
    return static_cast<float>(std::clamp(z_m - plan.extent.origin_m.z, -largest, largest));
  };
  return {in_frame(layer.begin_m), in_frame(layer.end_m)};
}

}  // namespace raywave
