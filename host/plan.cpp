// SPDX-License-Identifier: Apache-2.0
#include "host/plan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <sstream>

#include "host/error.hpp"
#include "host/gatherer.hpp"
#include "host/outline.hpp"
#include "host/plane_errors.hpp"
#include "host/propagator.hpp"
#include "host/refiner.hpp"
#include "host/text.hpp"

namespace raywave {
namespace {

constexpr int largest_grid = 1024;

/// How many steps p lie, on the nearest surface, under the cone that a pixel sees. Three keep neighbouring samples apart in direction
/// (docs/pipeline.md, "Where the WRPs stand"); more only cost rays.
constexpr double samples_across_nearest = 3;

/// The same in pixels: fewer do not resolve the cone.
constexpr double pixels_across_nearest = 8;

/// How far beyond its geometric footprint the light of a sample is kept, in diffraction spots.
constexpr double tail_spots = Gatherer::near_tail;

/// Mirrors show things up to this many times as deep as the scene: rays are spaced for it.
constexpr double deepest_virtual_picture = 2;

constexpr double largest_lattice = 1 << 28;
constexpr double farthest_lattice_ray = 1 << 22;  // from the axis: floats count no farther and still tell places within a cell
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

/// Rays of the sample lattice towards everything in the scene whose light the hologram can show.
///
/// lit  tangents of the chief rays (to the hologram's centre) of whatever light can fall onto a WRP, low and high per axis
LatticePlan lattice_over(const Scene& scene, const Outline& outline, const Plan& plan, glm::dvec2 largest_tangent,
                         const std::array<Interval, 2>& lit) {
  LatticePlan lattice;
  lattice.full_z_m = (plan.near_m + plan.far_m) / 2;
  lattice.step = scene.sampling.pitch_m / lattice.full_z_m;
  const glm::dvec2 window = glm::dvec2(plan.size) * plan.pitch_m;
  double cells = 1;
  for (int axis = 0; axis < 2; ++axis) {
    const auto& tangents = outline.tangents[axis];
    const double reach = largest_tangent[axis] + std::max(1.0, plan.fan) * window[axis] / (2 * plan.near_m);
    const double low = std::max(-reach, lit[axis].low), high = std::max(low, std::min(reach, lit[axis].high));
    const double first = std::floor(std::clamp(tangents.low, low, high) / lattice.step - 0.5);
    const double last = std::ceil(std::clamp(tangents.high, low, high) / lattice.step - 0.5);
    cells *= last - first + 1;
    const std::string asked = one_line(scene.file.string()) + ": sampling.pitch " + millimetres(scene.sampling.pitch_m);
    if (!(cells <= largest_lattice))
      throw InputError(asked + " needs " + count_text(cells) +
                       " lattice cells or more, at most 268435456 are allowed; give a larger pitch");
    if (const double farthest = std::max(std::abs(first), std::abs(last)); farthest > farthest_lattice_ray)
      throw InputError(asked + " puts the scene " + count_text(farthest) +
                       " pitches off the axis, at most 4194304 are allowed; give a larger pitch");
    lattice.first[axis] = static_cast<int>(first);
    lattice.size[axis] = static_cast<int>(last - first + 1);
  }
  return lattice;
}

/// Directions of a fan that the SLM's pixels can show; steeper ones are left out.
std::vector<glm::dvec2> fan_of(const std::vector<double>& across, const std::vector<double>& up, glm::dvec2 largest_sine) {
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

/// Chief rays of the light that falls onto the planned WRPs, diffraction at its edges included.
std::array<Interval, 2> chief_tangents(const Plan& plan, glm::dvec2 middle) {
  std::array<Interval, 2> lit;
  for (int axis = 0; axis < 2; ++axis) {
    const double window = plan.size[axis] * plan.pitch_m[axis];
    const auto narrowed = [&](double z) { return std::abs(z - plan.distance_m) / z; };
    const double spot = plan.wavelength_m * plan.far_m / (std::max(plan.fan, 1e-3) * window);
    const double footprint = plan.fan * window / 2 * std::max(narrowed(plan.near_m), narrowed(plan.far_m)) + 16 * spot;
    const double half = plan.grid[axis] * window / 2 + footprint;
    lit[axis].add((middle[axis] - half) / plan.distance_m);
    lit[axis].add((middle[axis] + half) / plan.distance_m);
  }
  return lit;
}

/// Whether a rectangle around `middle` meets the triangle, by the separating axes of both.
bool meets(glm::dvec2 middle, glm::dvec2 half, const std::array<glm::dvec2, 3>& triangle) {
  const auto apart = [&](glm::dvec2 axis) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const auto& corner : triangle) {
      low = std::min(low, glm::dot(corner - middle, axis));
      high = std::max(high, glm::dot(corner - middle, axis));
    }
    const double reach = std::abs(axis.x) * half.x + std::abs(axis.y) * half.y;
    return low > reach || high < -reach;
  };
  if (apart({1, 0}) || apart({0, 1})) return false;
  for (std::size_t i = 0; i < 3; ++i) {
    const auto side = triangle[(i + 1) % 3] - triangle[i];
    if (apart({-side.y, side.x})) return false;
  }
  return true;
}

/// The WRPs into which light of some triangle falls on its way to the hologram; all of them when there is none at all, so that whoever
/// looks at them finds out why.
std::vector<Wrp> lit_wrps(const Plan& plan, const World& world, std::vector<Wrp> wrps) {
  const glm::dvec2 window = glm::dvec2(plan.size) * plan.pitch_m;
  std::vector<bool> lit(wrps.size(), false);
  std::size_t dark = wrps.size();
  const auto look_at = [&](glm::uvec3 corners) {
    std::array<glm::dvec2, 3> crossing;  // of the chief rays with the WRPs
    glm::dvec2 half = window / 2.0;
    for (int i = 0; i < 3; ++i) {
      const auto& p = world.positions[corners[i]];
      crossing[static_cast<std::size_t>(i)] = glm::dvec2(p) * (plan.distance_m / p.z);
      const auto spot = plan.wavelength_m * p.z / (std::max(plan.fan, 1e-3) * window);
      half =
          glm::max(half, window / 2.0 + std::max(plan.fan, 1.0) * window / 2.0 * std::abs(1 - plan.distance_m / p.z) + tail_spots * spot);
    }
    for (std::size_t i = 0; i < wrps.size(); ++i) {
      if (lit[i] || !meets(wrps[i].centre_m, half, crossing)) continue;
      lit[i] = true;
      --dark;
    }
  };
  // A few from everywhere first: mostly they light all.
  for (const std::size_t step : {std::size_t{64}, std::size_t{1}}) {
    for (std::size_t i = 0; i < world.triangles.size(); i += step) {
      if (dark == 0) return wrps;
      look_at(world.triangles[i]);
    }
  }
  if (dark == wrps.size()) return wrps;
  std::vector<Wrp> kept;
  for (std::size_t i = 0; i < wrps.size(); ++i) {
    if (lit[i]) kept.push_back(std::move(wrps[i]));
  }
  return kept;
}

std::vector<Wrp> wrps_side_by_side(const Scene& scene, const Plan& plan, glm::dvec2 middle) {
  const glm::dvec2 window = glm::dvec2(plan.size) * plan.pitch_m;
  // Aimed gathering uses its fan for what mirrors and glass show.
  const bool perspective = plan.aimed || scene.sampling.shape == FanShape::perspective;
  const double depth = (plan.far_m - plan.distance_m) * (plan.bounces > 0 ? deepest_virtual_picture : 1);
  std::vector<Wrp> wrps;
  for (int row = 0; row < plan.grid.y; ++row) {
    for (int column = 0; column < plan.grid.x; ++column) {
      Wrp wrp;
      wrp.centre_m = {middle.x + (column - (plan.grid.x - 1) / 2.0) * window.x, middle.y - (row - (plan.grid.y - 1) / 2.0) * window.y,
                      plan.distance_m};
      if (plan.aimed && plan.bounces == 0) {
        wrps.push_back(std::move(wrp));
        continue;
      }
      const double p = scene.sampling.pitch_m;
      const auto rays = [&](int axis) { return fan_count(window[axis], plan.distance_m, depth, p); };
      if (!(rays(0) * rays(1) <= largest_fan)) {
        throw InputError(one_line(scene.file.string()) + ": sampling.pitch " + millimetres(p) + " needs " + count_text(rays(0)) + " x " +
                         count_text(rays(1)) + " rays per pixel, at most 16777216 are allowed; give a larger pitch");
      }
      std::array<std::vector<double>, 2> tangents;
      for (int axis = 0; axis < 2; ++axis) {
        // Perspective views turn with the pixel, parallel ones with the WRP.
        const double shift = perspective ? 0 : wrp.centre_m[axis];
        tangents[axis] = fan_tangents(window[axis], plan.distance_m, shift, depth, p);
        wrp.fan_step[axis] = window[axis] / plan.distance_m / static_cast<double>(tangents[axis].size());
      }
      wrp.fan = fan_of(tangents[0], tangents[1], perspective ? glm::dvec2(1) : plan.largest_sine);
      if (perspective) wrp.convergence_per_m = 1 / plan.distance_m;
      wrps.push_back(std::move(wrp));
    }
  }
  return wrps;
}

Wrp plane_at_hologram(const Plan& plan, glm::dvec2 largest_tangent, int rays_per_axis) {
  Wrp plane;
  std::array<std::vector<double>, 2> tangents;
  for (int axis = 0; axis < 2; ++axis) {
    plane.fan_step[axis] = 2 * largest_tangent[axis] / rays_per_axis;
    for (int i = 0; i < rays_per_axis; ++i) tangents[axis].push_back((i - (rays_per_axis - 1) / 2.0) * plane.fan_step[axis]);
  }
  plane.fan = fan_of(tangents[0], tangents[1], plan.largest_sine);
  return plane;
}

/// About how many rays are aimed at samples: as if one surface at the middle depth filled the lattice.
std::uint64_t aimed_rays(const Plan& plan) {
  const double narrowed = std::abs(plan.lattice.full_z_m - plan.wrps[0].centre_m.z) / plan.lattice.full_z_m;
  double rays = static_cast<double>(plan.lattice.size.x) * plan.lattice.size.y;
  for (int axis = 0; axis < 2; ++axis)
    rays *= std::max(1.0, std::min(narrowed * (plan.wrps[0].centre_m.z > 0 ? plan.fan : 1.0), 1.0) * plan.size[axis]);
  return static_cast<std::uint64_t>(rays);
}

}  // namespace

std::vector<double> fan_tangents(double window_m, double distance_m, double shift_m, double depth_m, double pitch_m) {
  const double width = window_m / distance_m;
  const auto count = static_cast<std::size_t>(std::min(fan_count(window_m, distance_m, depth_m, pitch_m), double{largest_fan}));
  std::vector<double> tangents(count);
  for (std::size_t i = 0; i < count; ++i)
    tangents[i] = shift_m / distance_m + (static_cast<double>(i) - static_cast<double>(count - 1) / 2) * width / static_cast<double>(count);
  return tangents;
}

Plan make_plan(const Scene& scene, const World& world, Method method, int rays_per_axis, bool has_doubles, const Plan* moved_from) {
  const auto& hologram = scene.hologram;
  Plan plan;
  plan.size = hologram.resolution;
  plan.pitch_m = hologram.pitch_m;
  plan.wavelength_m = hologram.wavelength_m;
  plan.near_m = world.min_m.z;
  plan.far_m = world.max_m.z;

  const glm::dvec2 window = glm::dvec2(plan.size) * plan.pitch_m;
  for (int axis = 0; axis < 2; ++axis) plan.largest_sine[axis] = std::min(1.0, plan.wavelength_m / (2 * plan.pitch_m[axis]));
  const auto largest_tangent = [&](int axis) {
    const double sine = std::min(plan.largest_sine[axis], 0.999);
    return sine / std::sqrt(1 - sine * sine);
  };
  plan.aimed = method == Method::points || (method == Method::wrp && scene.sampling.mode == SamplingMode::aimed);
  const bool has_bounces = std::any_of(scene.objects.begin(), scene.objects.end(), [&](const Object& o) {
    const auto& m = scene.materials[static_cast<std::size_t>(o.material)];
    return m.reflectivity > 0 || m.transparency > 0;
  });
  plan.bounces = has_bounces ? scene.trace.depth : 0;
  plan.antialias = scene.sampling.antialias;
  plan.view_parts = scene.sampling.visibility;
  plan.fan = scene.sampling.fan;
  plan.edge = scene.sampling.edge;

  if (scene.wrp.distance_m) {
    plan.distance_m = *scene.wrp.distance_m;
    if (!plan.aimed && plan.distance_m >= plan.far_m) {  // rays of a fan go forwards; aimed ones meet samples on either side
      throw InputError(one_line(scene.file.string()) + ": wrp.distance " + millimetres(plan.distance_m) +
                       " puts the WRPs behind the whole scene, which ends at " + millimetres(plan.far_m) + "; give less, or \"auto\"");
    }
  } else if (plan.aimed && plan.bounces == 0) {
    plan.distance_m = middle_of_surfaces(world);
  } else {
    const double cone = std::max(window.x, window.y) / plan.near_m;
    const double across =
        std::max(samples_across_nearest * scene.sampling.pitch_m, pixels_across_nearest * std::max(plan.pitch_m.x, plan.pitch_m.y));
    plan.distance_m = plan.near_m - std::min(across / cone, plan.near_m / 2);
  }

  const glm::dvec2 tangents{largest_tangent(0), largest_tangent(1)};
  const auto outline = outline_of(world, plan.distance_m, window, std::max(1.0, plan.fan), 0.99 * tangents);
  plan.beyond_diffraction = outline.steepest[0] > 0 || outline.steepest[1] > 0;
  glm::dvec2 middle;
  for (int axis = 0; axis < 2; ++axis) {
    auto passed = outline.passed[axis];
    const double reach = window[axis] / 2 + plan.distance_m * tangents[axis];
    passed.low = std::clamp(passed.low, -reach, reach);
    passed.high = std::clamp(passed.high, -reach, reach);
    middle[axis] = passed.middle();
    const double wanted = std::max(1.0, std::ceil(passed.extent() / window[axis] - 0.01));
    plan.grid[axis] = scene.wrp.grid ? (*scene.wrp.grid)[axis] : static_cast<int>(std::min(wanted, largest_grid + 1.0));
  }
  if (method == Method::wrp && static_cast<double>(plan.grid.x) * plan.grid.y > largest_grid) {
    throw InputError(scene.file.string() + ": the scene needs " + std::to_string(plan.grid.x) + " x " + std::to_string(plan.grid.y) +
                     " or more WRPs of the hologram's size, " + std::to_string(largest_grid) +
                     " are allowed; give wrp.grid, a larger hologram or a smaller scene");
  }
  plan.origin_m = {(world.min_m.x + world.max_m.x) / 2, (world.min_m.y + world.max_m.y) / 2, (plan.near_m + plan.far_m) / 2};

  std::array<Interval, 2> lit = {Interval{-1e9, 1e9}, Interval{-1e9, 1e9}};
  if (method == Method::wrp && plan.aimed && plan.bounces == 0) lit = chief_tangents(plan, middle);
  plan.lattice = lattice_over(scene, outline, plan, tangents, lit);
  if (method == Method::wrp) {
    plan.wrps = wrps_side_by_side(scene, plan, middle);
    if (plan.aimed && plan.bounces == 0) plan.wrps = lit_wrps(plan, world, std::move(plan.wrps));
  } else {
    plan.grid = {1, 1};
    plan.wrps = {plane_at_hologram(plan, tangents, rays_per_axis)};
  }
  plan.rows = {plan.size.y, plan.pitch_m.y, 0};
  if (method == Method::wrp && plan.aimed && plan.bounces == 0 && scene.wrp.oversampling)
    plan.rows = rows_for_band(plan, *scene.wrp.oversampling);
  for (const auto& wrp : plan.wrps) {
    if (!plan.aimed) plan.rays += wrp.fan.size() * static_cast<std::uint64_t>(plan.size.x) * static_cast<std::uint64_t>(plan.size.y);
  }
  if (plan.aimed) plan.rays = aimed_rays(plan);

  plan.phase_errors = predict_phase_errors(plan);
  plan.precision = choose_precision(scene.accuracy, plan.phase_errors, has_doubles);

  plan.padded = padded_size(plan.size, scene.wrp.padding);
  if (method == Method::wrp && moved_from) {
    plan.padding_error = moved_from->padding_error;
    plan.rows_error = moved_from->rows_error;
  } else if (method == Method::wrp) {
    plan.padding_error = predicted_padding_error(plan, world, plan.padded);
    if (plan.refines()) plan.rows_error = predicted_rows_error(plan, world);
  }
  return plan;
}

}  // namespace raywave
