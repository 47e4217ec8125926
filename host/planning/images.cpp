// SPDX-License-Identifier: Apache-2.0
#include "host/planning/images.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "host/geometry/ray_tree.hpp"
#include "host/plan/lattice.hpp"

namespace raywave {
namespace {

/// Rays along the longer side of what mirrors and glass cover.
constexpr int rays_along = 24;

/// Paths that carry less of the light end, as in kernels/samples/paths.cl.
constexpr double least_share = 1e-3;

/// Of all light, so much may lie in images nearer, and as much farther, than the depths kept.
constexpr double share_beyond = 0.01;

/// Rays along the longer side of the whole scene, which tell how much light needs no mirror.
constexpr int direct_rays_along = 16;

struct PathRay {
  glm::dvec3 origin, direction;
  double share = 1, from = 0;  // hits nearer than `from` are ignored
};

/// As in kernels/samples/fit_path.h: its outermost nodes, in half sides of the window, and when the
/// paths to them fold.
constexpr double node = 0.861136311594053, most_brighter = 8, most_darker = 32;
constexpr int path_steps = 4;

/// The polynomial of a path's amplitude holds less of its spread.
constexpr double most_held = 4, folded = std::numeric_limits<double>::infinity();

/// Turns of paths that couple x and y which virtual planes follow (kernels/gather/seen.h).
constexpr double most_coupling_turns = 0.9;

/// The wavefront of a ray's light at the hologram's middle.
struct Bend {
  double rate = 0;  // mean curvature, 1/m
  // Light per solid angle at the window's corners over that at its middle, or the inverse, the
  // largest; infinite where light folds over the window, so that no path is fitted
  double spread = 1;
  double twist = 0;  // second derivative of the path by x and y, beyond a sphere's, 1/m
  int ray = 0, surfaces = 0;
  double share = 1;
  double front_m = 0;  // depth of the first surface
};

/// Where a ray's light starts, and how far others pass it, across the ray.
struct Aim {
  glm::dvec3 source_m, direction, e1, e2;

  Aim(const PathRay& ray, double t)
      : source_m(ray.origin + t * ray.direction), direction(ray.direction) {
    const auto other = std::abs(direction.x) < 0.7 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
    e1 = glm::normalize(glm::cross(direction, other));
    e2 = glm::cross(direction, e1);
  }
  glm::dvec2 off(const PathRay& moved) const {
    const auto way = source_m - moved.origin;
    const auto miss =
        way - moved.direction * (glm::dot(way, direction) / glm::dot(moved.direction, direction));
    return -glm::dvec2(glm::dot(miss, e1), glm::dot(miss, e2));
  }
};

/// A mirror or a clear surface on a path.
struct Turn {
  std::int32_t object = 0;
  bool refracts = false;
};

class Paths {
public:
  Paths(const World& world, const Plan& plan)
      : world_(world),
        plan_(plan),
        tree_(world.ray_tree ? world.ray_tree
                             : std::make_shared<const RayTree>(ray_tree_of(world))),
        bias_m_(ray_bias_m(world, plan)) {
    const double size_m = glm::length(world.max_m - world.min_m);
    reach_m_ = 2 * (plan.extent.farthest_m() + size_m);
    if (plan.extent.near_m < 0) start_m_ = plan.extent.near_m - 0.01 * size_m;
  }

  /// Adds what a ray with these tangents leads to.
  void explore(int ray, glm::dvec2 tangents, Images& images) {
    turns_.clear();
    ray_ = ray;
    explore(start(glm::dvec2(0), tangents), tangents, images);
  }

  const std::vector<Bend>& bends() const { return bends_; }

  /// Light of surfaces under these tangents, without mirrors and glass.
  double direct_light(glm::dvec2 tangents) const {
    const auto hit = meet(start(glm::dvec2(0), tangents));
    return hit ? std::max(0.0, 1 - specular_of(*hit)) : 0;
  }

private:
  double specular_of(const RayHit& hit) const {
    const auto& m = material_of(hit);
    return m.reflectivity.at(plan_.hologram.wavelength_m) +
           m.transparency.at(plan_.hologram.wavelength_m);
  }

  const Material& material_of(const RayHit& hit) const {
    const auto& lighting = plan_.lighting;
    const auto material = lighting.material_of(static_cast<std::size_t>(hit.object),
                                               world_.material_of(hit.triangle));
    return lighting.materials[static_cast<std::size_t>(material)];
  }

  PathRay start(glm::dvec2 place_m, glm::dvec2 tangents) const {
    return {
        {place_m + start_m_ * tangents, start_m_}, glm::normalize(glm::dvec3(tangents, 1)), 1, 0};
  }

  std::optional<RayHit> meet(const PathRay& ray) const {
    return tree_->nearest(world_.motions, ray.origin, ray.direction, ray.from, reach_m_);
  }

  /// The ray onwards; nothing where it is reflected totally.
  std::optional<PathRay> turned(const PathRay& ray, const RayHit& hit, bool refracts) const {
    const auto& m = material_of(hit);
    const bool entering =
        (glm::dot(hit.face, ray.direction) > 0) != (glm::dot(hit.face, hit.normal) > 0);
    const auto normal = entering ? hit.normal : -hit.normal;
    const double slope = glm::dot(ray.direction, normal),
                 ior = m.ior.at(plan_.hologram.wavelength_m), ratio = entering ? 1 / ior : ior,
                 squared = 1 - ratio * ratio * (1 - slope * slope);
    double reflected = 1;
    if (squared > 0) {
      const double beyond = std::sqrt(squared), cosine = std::abs(slope),
                   s = (ratio * cosine - beyond) / (ratio * cosine + beyond),
                   p = (cosine - ratio * beyond) / (cosine + ratio * beyond);
      reflected = (s * s + p * p) / 2;
    }
    const double clear = m.transparency.at(plan_.hologram.wavelength_m);
    PathRay next = ray;
    next.origin += hit.t * ray.direction;
    if (refracts) {
      if (squared <= 0) return std::nullopt;
      next.direction = ratio * ray.direction - (ratio * slope + std::sqrt(squared)) * normal;
      next.share *= clear * (1 - reflected);
    } else {
      next.direction -= 2 * slope * normal;
      next.share *= m.reflectivity.at(plan_.hologram.wavelength_m) + clear * reflected;
    }
    next.from = bias_m_ / std::max(std::abs(glm::dot(next.direction, normal)), 0x1p-6);
    return next;
  }

  void explore(const PathRay& ray, glm::dvec2 tangents, Images& images) {
    const auto hit = meet(ray);
    if (!turns_.empty()) ++(hit ? images.segments : images.lost);
    if (!hit) return;
    const auto object = hit->object;
    const double specular = specular_of(*hit);
    if (turns_.empty()) {
      if (!(specular > 0)) return;
      ++images.rays;
      front_m_ = ray.origin.z + hit->t * ray.direction.z;
    } else if (specular < 1) {
      const double share = ray.share * (1 - specular);
      auto bend = bend_of(Aim(ray, hit->t), tangents);
      const int surfaces = static_cast<int>(turns_.size());
      if (bend && (bend->rate > 0 ? plan_.extent.far_m > 0 : plan_.extent.near_m < 0))
        images.all.push_back(
            {ray_, glm::normalize(glm::dvec3(tangents, 1)) / bend->rate, share, surfaces});
      else
        images.beyond += share;
      if (bend) {
        bend->ray = ray_;
        bend->surfaces = surfaces;
        bend->share = share;
        bend->front_m = front_m_;
        bends_.push_back(*bend);
      }
    }
    if (!(specular > 0) || static_cast<int>(turns_.size()) >= plan_.specular.bounces) return;
    for (const bool refracts : {false, true}) {
      const auto next = turned(ray, *hit, refracts);
      if (!next || next->share < least_share) continue;
      turns_.push_back({object, refracts});
      explore(*next, tangents, images);
      turns_.pop_back();
    }
  }

  /// The ray after the same surfaces, from another place or with other tangents.
  std::optional<PathRay> followed(glm::dvec2 place_m, glm::dvec2 tangents) const {
    std::optional ray(start(place_m, tangents));
    for (const auto& turn : turns_) {
      const auto hit = meet(*ray);
      if (!hit || hit->object != turn.object) return std::nullopt;
      ray = turned(*ray, *hit, turn.refracts);
      if (!ray) return std::nullopt;
    }
    return ray;
  }

  /// Bend::spread: by paths from the window's corners to where a ray ends, as in
  /// kernels/samples/fit_path.h.
  ///
  /// by_tangents, turn  of the ray: how its end moves with its tangents, and these with its place
  double spread_of(const Aim& aim, glm::dvec2 tangents, const glm::dmat2& by_tangents,
                   const glm::dmat2& turn, double tangent_step) const {
    const double determinant = glm::determinant(by_tangents),
                 cell = plan_.samples.pitch_m / plan_.extent.farthest_m(),
                 cell_area = cell * cell * std::abs(determinant);
    bool is_missed = false;
    double largest = 1;
    for (int corner = 0; corner < 4; ++corner) {
      const auto at_m =
          glm::dvec2(2 * (corner % 2) - 1, 2 * (corner / 2) - 1) * (node / 2) * plan_.window_m();
      auto t = tangents + turn * at_m;
      for (int step = 0; step <= path_steps; ++step) {
        const auto ray = followed(at_m, t), by_x = followed(at_m, t + glm::dvec2(tangent_step, 0)),
                   by_y = followed(at_m, t + glm::dvec2(0, tangent_step));
        if (!ray || !by_x || !by_y) {
          is_missed = true;
          break;
        }
        const auto off = aim.off(*ray);
        const auto by = glm::dmat2(aim.off(*by_x) - off, aim.off(*by_y) - off) / tangent_step;
        const double spread = glm::determinant(by) / determinant;
        if (step == path_steps || glm::dot(off, off) < cell_area / 256) {
          if (glm::dot(off, off) > cell_area || spread * most_brighter < 1 || spread > most_darker)
            return folded;
          largest = std::max({largest, spread, 1 / spread});
          break;
        }
        t -= glm::inverse(by) * off;
      }
    }
    const auto moves = glm::dmat2(1) + plan_.extent.near_m * turn;
    return is_missed && glm::dot(moves[0], moves[0]) + glm::dot(moves[1], moves[1]) > 2 ? folded
                                                                                        : largest;
  }

  /// The wavefront of a ray's light, from differences of rays: it seems to come from the ray's line
  /// at 1 over its mean curvature, from behind the hologram where that is negative.
  std::optional<Bend> bend_of(const Aim& aim, glm::dvec2 tangents) const {
    const double place_step = 0.01 * std::min(plan_.window_m().x, plan_.window_m().y),
                 tangent_step = place_step / plan_.extent.farthest_m();
    glm::dmat2 by_place, by_tangents;
    // How far the ray misses the source when it is moved by a step, per step; at the edge of a
    // mirror by one to the other side
    const auto miss_by = [&](const auto& moved, double step) -> std::optional<glm::dvec2> {
      for (const double by : {step, -step})
        if (const auto other_ray = moved(by)) return aim.off(*other_ray) / by;
      return std::nullopt;
    };
    for (int axis = 0; axis < 2; ++axis) {
      glm::dvec2 unit(0);
      unit[axis] = 1;
      const auto place =
          miss_by([&](double by) { return followed(by * unit, tangents); }, place_step);
      const auto tangent =
          miss_by([&](double by) { return followed({}, tangents + by * unit); }, tangent_step);
      if (!place || !tangent) return std::nullopt;
      by_place[axis] = *place;
      by_tangents[axis] = *tangent;
    }
    const double determinant = glm::determinant(by_tangents);
    if (!(std::abs(determinant) > 0)) return std::nullopt;
    const auto turn = -glm::inverse(by_tangents) * by_place;  // columns: by x, by y
    const double q = std::sqrt(1 + glm::dot(tangents, tangents));
    const auto d = tangents / q;
    // Second derivatives of the path, and their mean over the metric of a sphere
    double sum = 0, all = 0, twist = 0;
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) {
        const double bend = -(turn[j][i] - d[i] * glm::dot(d, turn[j])) / q,
                     metric = (i == j) - d[i] * d[j];
        sum += bend * metric;
        if (i != j) twist += bend / 2;
        all += metric * metric;
      }
    }
    if (!std::isfinite(sum / all) || sum == 0) return std::nullopt;
    return Bend{.rate = sum / all,
                .spread = spread_of(aim, tangents, by_tangents, turn, tangent_step),
                .twist = twist + sum / all * d.x * d.y};
  }

  const World& world_;
  const Plan& plan_;
  std::shared_ptr<const RayTree> tree_;
  double bias_m_, reach_m_ = 0;
  double start_m_ = 0;       // z where rays start: the hologram, or before a scene before it
  int ray_ = 0;              // that is being explored
  double front_m_ = 0;       // depth of the first surface that it meets
  std::vector<Turn> turns_;  // of its path
  std::vector<Bend> bends_;  // by ray
};

/// The middle of values by their light, and that light.
std::pair<double, double> median(std::vector<std::pair<double, double>>& values) {
  std::ranges::sort(values);
  double all = 0, before = 0;
  for (const auto& value : values) all += value.second;
  for (const auto& [value, light] : values)
    if ((before += light) >= all / 2) return {value, all};
  return {0, 0};
}

/// What light folds over the window, and how densely its places see virtual points, from the
/// curvatures of neighbouring rays.
void find_folds(const std::vector<Bend>& bends, const Plan& plan, Images& images) {
  const double off_m = glm::length(plan.window_m()) / std::sqrt(12.0);
  const auto neighbour = [&](const Bend& bend, int ray) -> const Bend* {
    auto at = std::ranges::lower_bound(bends, ray, {}, &Bend::ray);
    for (; at != bends.end() && at->ray == ray; ++at)
      if (at->surfaces == bend.surfaces && at->share > bend.share / 2 && at->share < bend.share * 2)
        return &*at;
    return nullptr;
  };
  double all = 0;
  std::vector<std::pair<double, double>> depths, fronts;  // of what folds, with its light
  for (const auto& bend : bends) {
    double slopes = 0;
    for (const int step : {1, images.size.x}) {
      // The smaller change of both sides: on the other, another object may begin
      double slope = std::numeric_limits<double>::infinity();
      for (const int by : {-step, step})
        if (const auto* other = neighbour(bend, bend.ray + by))
          slope = std::min(slope, std::abs(other->rate - bend.rate) / images.step);
      if (std::isfinite(slope)) slopes += slope * slope;
    }
    all += bend.share;
    // Places on both sides of the middle make up for each other in part. Rays at outlines, whose
    // neighbours are of other paths, must not outweigh the rest
    const double error = std::min(0.5, off_m * std::sqrt(slopes) / 2),
                 squares = bend.share * error * error;
    images.points_error += squares;
    if (bend.spread != folded) {
      const double turns = std::abs(bend.twist) * plan.window_m().x * plan.window_m().y /
                           (4 * plan.hologram.wavelength_m);
      if (bend.spread > most_held) images.paths_error += squares;
      if (bend.spread > most_held || turns > most_coupling_turns) images.coupled_error += squares;
      continue;
    }
    images.folded += bend.share;
    fronts.emplace_back(bend.front_m, bend.share);
    if (bend.rate * bend.front_m > 0 && 1 / bend.rate > bend.front_m)
      depths.emplace_back(1 / bend.rate, bend.share);
  }
  if (all > 0) {
    for (auto* error : {&images.points_error, &images.paths_error, &images.coupled_error})
      *error = std::sqrt(*error / all);
    images.folded /= all;
  }
  // Images behind their mirror or glass pass into those of other paths there; the outlines of
  // mirrors and glass are right where light shines from them. No image lies much nearer to the
  // hologram than its mirror, nor much farther off
  const auto [front_m, front_light] = median(fronts);
  const auto [depth_m, light] = median(depths);
  images.folded_m = fronts.empty() ? images.near_m
                    : light < front_light / 4
                        ? front_m
                        : std::min(depth_m, front_m < 0 ? front_m / 2 : 2 * front_m);
}

/// Tangents under which the hologram's centre sees objects: mirrors and glass, or all.
std::pair<glm::dvec2, glm::dvec2> tangents_of_objects(const World& world, const Plan& plan,
                                                      bool all) {
  glm::dvec2 low(std::numeric_limits<double>::infinity()), high(-low);
  const auto& lighting = plan.lighting;
  const auto add = [&](glm::dvec3 p_m) {
    if (p_m.z == 0) return;
    low = glm::min(low, glm::dvec2(p_m) / p_m.z);
    high = glm::max(high, glm::dvec2(p_m) / p_m.z);
  };
  const auto counts = [&](std::size_t object, std::int32_t of_its_mesh) {
    const auto material = lighting.material_of(object, of_its_mesh);
    return all || lighting.materials[static_cast<std::size_t>(material)].is_specular();
  };
  // Boxes of objects where each is of one material, else all triangles
  const bool has_boxes = !world.placed.empty() && world.triangle_material.empty();
  for (std::size_t i = 0; has_boxes && i < world.placed.size(); ++i) {
    const auto& placed = world.placed[i];
    for (int corner = 0; corner < 8 && counts(i, -1); ++corner) {
      glm::dvec3 p_m;
      for (int axis = 0; axis < 3; ++axis)
        p_m[axis] = (corner >> axis & 1) != 0 ? placed.max_m[axis] : placed.min_m[axis];
      add(world.motion_of(static_cast<std::int32_t>(i))(p_m));
    }
  }
  for (std::size_t i = 0; !has_boxes && i < world.triangles.size(); ++i) {
    const auto object = static_cast<std::size_t>(world.triangle_object[i]);
    if (!counts(object, world.material_of(i))) continue;
    for (const auto& p_m : world.corners_m(i)) add(p_m);
  }
  return {low, high};
}

/// Rays through even steps of tangents.
struct Raster {
  glm::dvec2 low{0};
  double step = 0;
  glm::ivec2 size{0};
  int rays() const { return size.x * size.y; }
  glm::dvec2 at(int ray) const {
    return low + (glm::dvec2(ray % size.x, ray / size.x) + 0.5) * step;
  }
};

Raster raster_between(glm::dvec2 low, glm::dvec2 high, int along) {
  if (!(low.x < high.x) || !(low.y < high.y)) return {};
  const double step = std::max(high.x - low.x, high.y - low.y) / along;
  return {low, step, glm::ivec2(glm::ceil((high - low) / step - 1e-9))};
}

}  // namespace

Images images_of(const World& world, const Plan& plan) {
  Images images;
  if (!plan.has_specular_samples()) return images;
  images.near_m = plan.extent.near_m;
  images.far_m = plan.extent.far_m;
  const auto reach = steepest_slope(plan) + plan.window_m() / (2 * plan.extent.closest_m);
  const auto raster_of = [&](bool all, int along) {
    const auto [low, high] = tangents_of_objects(world, plan, all);
    return raster_between(glm::clamp(low, -reach, reach), glm::clamp(high, -reach, reach), along);
  };
  const auto mirrors = raster_of(false, rays_along), scene = raster_of(true, direct_rays_along);
  images.low = mirrors.low;
  images.step = mirrors.step;
  images.size = mirrors.size;
  Paths paths(world, plan);
  for (int ray = 0; ray < mirrors.rays(); ++ray) paths.explore(ray, mirrors.at(ray), images);
  find_folds(paths.bends(), plan, images);
  double direct = 0;
  for (int ray = 0; ray < scene.rays(); ++ray) direct += paths.direct_light(scene.at(ray));
  if (mirrors.step > 0) direct *= scene.step * scene.step / (mirrors.step * mirrors.step);

  // The depths that hold nearly all of their light
  std::vector<std::pair<double, double>> by_depth;
  double light = direct;
  for (const auto& image : images.all) {
    by_depth.emplace_back(image.at_m.z, image.share);
    light += image.share;
  }
  std::ranges::sort(by_depth);
  const double most = share_beyond * light;
  double nearer = 0, farther = light - direct;
  for (const auto& [z_m, share] : by_depth) {
    if (nearer <= most && nearer + share > most) images.near_m = std::min(plan.extent.near_m, z_m);
    if (farther > most) images.far_m = std::max(images.far_m, z_m);
    nearer += share;
    farther -= share;
  }
  const double all = light + images.beyond;  // with what has no virtual point before the hologram
  for (const auto& image : images.all) {
    if (!images.holds(image)) images.beyond += image.share;
  }
  if (all > 0) images.beyond /= all;
  return images;
}

}  // namespace raywave
