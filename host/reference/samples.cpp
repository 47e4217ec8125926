// SPDX-License-Identifier: Apache-2.0
#include "host/reference/samples.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>

#include "host/geometry/kernel_options.hpp"
#include "host/plan/lattice.hpp"
#include "host/reference/looks.hpp"

namespace raywave::reference {
namespace {

using glm::dvec2;
using glm::dvec3;

constexpr double undecided = 1e-5;  // relative error of a float's comparisons
constexpr double sideways = 1e-6;   // error of a float's ray, as a fraction of its length
// Cosine to the ray below which a layer is steep, and cosine between normals of one steep layer
constexpr double steep = 0.25, alike = 0.9;

dvec3 corner(const float* p) { return {p[0], p[1], p[2]}; }

/// Where a ray from the hologram's centre meets a surface.
struct Meeting {
  double z = 0;  // from the hologram
  dvec3 point{0};
  dvec3 face{0};    // unit normal of the triangle
  dvec3 normal{0};  // for shading, towards the ray
  glm::dvec2 uv{0};
  std::size_t object = 0;
};

class Cell {
public:
  Cell(const Stage& stage, const Rig& rig, std::size_t cell)
      : stage_(stage),
        rig_(rig),
        lights_(lights_of(stage.scene, stage.world)),
        lattice_(rig.plan.lattice),
        gap_m_(1e-3 * lattice_.step * lattice_.full_z_m) {
    const auto nx = static_cast<std::size_t>(lattice_.size.x);
    column_ = static_cast<int>(cell % nx);
    row_ = static_cast<int>(cell / nx);
    middle_ = dvec2(lattice_.first) + dvec2(column_, row_) + 0.5;
  }

  CellSamples found() {
    const int n = rig_.plan.samples.antialias;
    for (const int at : order()) {
      const dvec2 off = (dvec2(at % n, at / n) + 0.5) / double(n) - 0.5;
      parts_.push_back({off, meetings(off)});
    }
    const auto centre = meetings(dvec2(0));
    find_rims(centre);
    for (const auto& layer : centre) add(layer, dvec2(0));
    // Layers that only parts of the cell show
    for (std::size_t part = 0; part < parts_.size(); ++part) {
      while (!parts_[part].meetings.empty()) {
        const auto layer = parts_[part].meetings.front();
        add(layer, parts_[part].off);
      }
    }
    return std::move(result_);
  }

private:
  struct Part {
    dvec2 off;                      // from the cell's middle, in cells
    std::vector<Meeting> meetings;  // that belong to no sample yet, near to far
    double rim_z = INFINITY;
  };

  /// Parts in the order in which they are asked: of 4 x 4, the inner ones first.
  std::vector<int> order() const {
    if (rig_.plan.samples.antialias == 4)
      return {5, 6, 9, 10, 1, 2, 4, 7, 8, 11, 13, 14, 0, 3, 12, 15};
    return {0, 1, 2, 3};
  }

  /// The hits of a ray, as the table keeps it: coincident layers once, closed meshes on their
  /// outside.
  std::vector<Meeting> meetings(dvec2 off) {
    const dvec3 direction((middle_ + off) * lattice_.step, 1);
    const Ray ray{-rig_.plan.extent.origin_m, direction, 0, 2 * rig_.plan.extent.far_m};
    std::vector<std::pair<Hit, std::size_t>> hits, near_edges, doubtful;
    for (std::size_t i = 0; i < rig_.corners.size(); ++i) {
      const auto wide = intersect(rig_.corners[i], ray, sideways);
      if (wide.triangle < 0) continue;
      near_edges.emplace_back(wide, i);
      const auto hit = intersect(rig_.corners[i], ray);
      if (hit.triangle >= 0) hits.emplace_back(hit, i);
      if (intersect(rig_.corners[i], ray, -sideways).triangle < 0) doubtful.emplace_back(wide, i);
    }
    for (const auto& [hit, i] : doubtful) result_.unsure |= !goes_on(hit, i, near_edges);
    std::sort(hits.begin(), hits.end(),
              [](const auto& a, const auto& b) { return a.first.t < b.first.t; });
    std::vector<Meeting> kept;
    double last = -INFINITY;
    for (const auto& [hit, i] : hits) {
      if (hit.t <= last + gap_m_) continue;
      last = hit.t;
      if (const auto met = meeting(ray, hit, i)) kept.push_back(*met);
    }
    return kept;
  }

  /// True when the surface goes on beyond the edge of a triangle that a ray meets there: another
  /// triangle is met as well, and faces the same way.
  bool goes_on(const Hit& hit, std::size_t triangle,
               const std::vector<std::pair<Hit, std::size_t>>& near_edges) const {
    return std::any_of(near_edges.begin(), near_edges.end(), [&](const auto& other) {
      return other.second != triangle && std::abs(other.first.t - hit.t) < gap_m_ / 2 &&
             dot(face(other.second), face(triangle)) > 0;
    });
  }

  dvec3 face(std::size_t triangle) const {
    const auto& c = rig_.corners[triangle];
    return normalize(cross(corner(c.b) - corner(c.a), corner(c.c) - corner(c.a)));
  }

  std::optional<Meeting> meeting(const Ray& ray, const Hit& hit, std::size_t triangle) const {
    const auto& t = rig_.triangles[triangle];
    Meeting met;
    met.z = hit.t;
    met.point = ray.origin + hit.t * ray.direction;
    met.face = face(triangle);
    if (dot(met.face, ray.direction) * t.side > 0) return {};
    const double weights[] = {1 - hit.u - hit.v, hit.u, hit.v};
    const int corners[] = {t.corner_a, t.corner_b, t.corner_c};
    for (int i = 0; i < 3; ++i) {
      const auto vertex = static_cast<std::size_t>(corners[i]);
      met.normal += weights[i] * dvec3(stage_.world.normals[vertex]);
      met.uv += weights[i] * dvec2(stage_.world.uvs[vertex]);
    }
    const bool inside = (dot(met.face, ray.direction) > 0) == (dot(met.face, met.normal) > 0);
    met.normal = normalize(inside ? -met.normal : met.normal);
    met.object = static_cast<std::size_t>(t.material);
    return met;
  }

  /// Distance within which hits belong to one layer.
  double reach_m(double z) const { return 4 * lattice_.step * z; }

  /// True when another ray's meeting lies on the layer that a ray of this place has met.
  bool belongs(const Meeting& met, const Meeting& layer, dvec2 off) {
    const double reach = reach_m(layer.z), apart = std::abs(met.z - layer.z);
    if (std::abs(apart / reach - 1) < undecided) result_.unsure = true;
    if (apart < reach) return true;
    const double along = std::abs(dot(layer.face, dvec3((middle_ + off) * lattice_.step, 1)));
    if (std::abs(along - steep) < undecided) result_.unsure = true;
    return along < steep && std::abs(dot(layer.face, met.face)) > alike &&
           std::abs(dot(layer.face, met.point - layer.point)) < reach / 4;
  }

  /// A hit of a part's ray that the centre ray misses is the edge of an object that hides what
  /// lies behind it in this part.
  void find_rims(const std::vector<Meeting>& centre) {
    for (auto& part : parts_) {
      for (const auto& met : part.meetings) {
        if (std::none_of(centre.begin(), centre.end(),
                         [&](const Meeting& layer) { return belongs(met, layer, dvec2(0)); }))
          part.rim_z = std::min(part.rim_z, met.z);
      }
    }
  }

  /// Adds the sample of a layer, and takes the layer's meetings from the parts.
  void add(const Meeting& layer, dvec2 off) {
    const bool shaded = shades_parts(rig_.plan, rig_.triangles.size());
    int covered = 0;
    double light = 0, area = 0, nearness = 0, dark_nearness = 0;
    dvec3 colours(0);
    dvec2 lit_place(0), place(0);
    for (auto& part : parts_) {
      const auto met =
          std::find_if(part.meetings.begin(), part.meetings.end(),
                       [&](const Meeting& other) { return belongs(other, layer, off); });
      if (met == part.meetings.end()) continue;
      if (met->z <= part.rim_z) {
        const auto colour =
            radiance_of(shaded ? *met : layer, light_place_of(&part - parts_.data()));
        // Sums over all colours: the sample is at the same place for each laser
        const double radiance = stage_.scene.colour ? colour.r + colour.g + colour.b : colour.r;
        colours += colour;
        ++covered;
        light += radiance;
        lit_place += radiance * part.off;
        nearness += radiance / met->z;
        area += 1;
        place += part.off;
        dark_nearness += 1 / met->z;
      }
      part.meetings.erase(met);
    }
    CellSample sample{layer.point, 0};
    if (covered > 0) {
      const dvec2 to = light > 0 ? lit_place / light : place / area;
      const double z = light > 0 ? light / nearness : area / dark_nearness;
      const double moved = std::max(std::abs(to.x - off.x), std::abs(to.y - off.y));
      if (moved > 1e-6)
        sample.place = -rig_.plan.extent.origin_m + z * dvec3((middle_ + to) * lattice_.step, 1);
      if (moved > 1e-7 && moved < 1e-5) result_.unsure = true;
      sample.radiance = shown_radiance(stage_.scene, colours / static_cast<double>(parts_.size()));
    }
    result_.samples.push_back(sample);
  }

  /// Phong's radiance without highlights.
  ///
  /// light_place  of lights that have a size
  dvec3 radiance_of(const Meeting& met, int light_place) {
    const auto& scene = stage_.scene;
    const auto material = static_cast<std::size_t>(scene.objects[met.object].material);
    const auto& m = scene.materials[material];
    SurfaceMap map;
    if (m.texture) map.image = stage_.world.textures.at(material);
    dvec3 texel(1);
    for (int i = 0; i < 3; ++i) texel[i] = map_at(map, met.uv, i);
    const auto seen = [&](dvec3 colour) { return seen_colour(scene, colour); };
    auto radiance = seen(m.ambient) * texel * ambient_light_of(scene) + seen(m.emission);
    for (const auto& one : lights_) {
      const auto light = seen_light(one, met.point + rig_.plan.extent.origin_m, light_place);
      const auto way =
          light.direction * light.distance_m.value_or(2 * rig_.plan.extent.farthest_m());
      const double facing = dot(met.normal, light.direction);
      if (std::abs(facing) < undecided) result_.unsure = true;
      if (facing <= 0 || light.intensity == 0) continue;
      if (scene.trace.shadows) {
        const auto free =
            free_path(rig_.corners, met.point, met.normal, rig_.arrays.bias_m, met.point + way);
        if (free == Seen::unsure) result_.unsure = true;
        if (free == Seen::no) continue;
      }
      radiance += light.intensity * light.colour * seen(m.diffuse) * texel * facing;
    }
    return radiance;
  }

  /// Where a part of the cell looks for lights that have a size: all places, or a quarter of them
  /// and the neighbours the rest.
  int light_place_of(std::ptrdiff_t part) const {
    if (rig_.plan.samples.antialias == 4) return static_cast<int>(part);
    return static_cast<int>(part) + 4 * ((column_ & 1) | (row_ & 1) << 1);
  }

  const Stage& stage_;
  const Rig& rig_;
  std::vector<PlacedLight> lights_;
  int column_ = 0, row_ = 0;
  const LatticePlan& lattice_;
  double gap_m_;
  dvec2 middle_{0};  // middle of the cell, in cells from the axis
  std::vector<Part> parts_;
  CellSamples result_;
};

}  // namespace

CellSamples samples_of_cell(const Stage& stage, const Rig& rig, std::size_t cell) {
  return Cell(stage, rig, cell).found();
}

}  // namespace raywave::reference
