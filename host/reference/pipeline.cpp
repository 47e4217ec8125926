// SPDX-License-Identifier: Apache-2.0
#include "host/reference/pipeline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "host/plan/lattice.hpp"
#include "host/reference/looks.hpp"
#include "host/reference/rays.hpp"

namespace raywave::reference {

using glm::dvec2;
using glm::dvec3;
using Complex = std::complex<double>;
using std::numbers::pi;

Complex turned(double turns) { return std::polar(1.0, 2 * pi * std::remainder(turns, 1.0)); }

double cubic_spline(double x) {
  x = std::abs(x);
  return x < 1 ? 2.0 / 3 - x * x + x * x * x / 2 : std::pow(std::max(2 - x, 0.0), 3) / 6;
}

bool is_seen(const Gathering& what, std::size_t sample, int i, int j) {
  const int parts = what.visibility_parts;
  const auto bit =
      static_cast<std::size_t>(std::clamp(j, 0, parts - 1) * parts + std::clamp(i, 0, parts - 1));
  const auto words = static_cast<std::size_t>(std::max(1, parts * parts / 32));
  return what.visibility_masks[sample * words + bit / 32] >> (bit % 32) & 1u;
}

namespace {

constexpr double undecided = 1e-5;     // relative error of a float's comparisons
constexpr int most_plane_waves = 96;   // kernels/gather/plane_waves.h
constexpr double plane_wave_tail = 4;  // host/trace/gatherer.cpp

dvec3 place(const device::Sample& s) { return {s.x, s.y, s.z}; }
dvec3 normal(const device::Sample& s) { return {s.nx, s.ny, s.nz}; }

dvec2 half_window(const Plan& plan) {
  return dvec2(plan.hologram.size) * plan.hologram.pitch_m / 2.0;
}

/// Apodization of the cone; at: position on the hologram, in half windows.
double edge_weight(const Plan& plan, double at) {
  if (plan.cone.apodization <= 0) return std::abs(at) <= plan.cone.half_width ? 1 : 0;
  const double e =
      std::clamp((plan.cone.half_width - std::abs(at)) / plan.cone.apodization, 0.0, 1.0);
  return e * e * (3 - 2 * e);
}

/// Part of the window's side, in half windows of the view from its middle, and whether a float may
/// find another.
std::pair<int, bool> visibility_part(const Gathering& what, double at) {
  const double place =
      (at / std::max(1.0, what.plan.cone.half_width) + 1) / 2 * what.visibility_parts;
  return {std::clamp(static_cast<int>(std::floor(place)), 0, what.visibility_parts - 1),
          std::abs(place - std::round(place)) < 1e-4};
}

/// Parts of the window's sides that the waves of near samples keep apart.
int plane_wave_parts(const Gathering& what) { return std::clamp(what.visibility_parts, 1, 8); }

/// Share of part (i, j) of plane_wave_parts x plane_wave_parts of the window that sees the sample.
double seen_share(const Gathering& what, std::size_t index, int part_i, int part_j) {
  if (what.samples[index].hidden == 0) return 1;
  const int side = what.visibility_parts / plane_wave_parts(what);
  int seen = 0;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i)
      seen += is_seen(what, index, part_i * side + i, part_j * side + j);
  return static_cast<double>(seen) / (side * side);
}

/// The direction in which the highlight of a light on a sample is brightest.
struct Highlight {
  dvec3 direction;  // unit length
  double intensity;
};

std::vector<Highlight> highlights(const Gathering& what, std::size_t index) {
  const auto& s = what.samples[index];
  // Floats round its length; for a sharp highlight that would be another direction.
  const auto n = normalize(normal(s));
  std::vector<Highlight> all;
  std::size_t number = 0;
  for (const auto& light : what.lights) {
    const auto seen =
        seen_light(light, what.plan.extent.origin_m + place(s), static_cast<int>(s.key & 15u));
    const auto l = seen.direction;
    const bool is_lit = what.lit[index * what.light_words + number / 32] >> (number % 32) & 1u;
    if (is_lit && seen.intensity > 0 && seen.highlights)
      all.push_back({2 * dot(n, l) * n - l, seen.intensity});
    ++number;
  }
  return all;
}

/// Geometry of one axis of a sample before a plane, world coordinates.
struct Aimed {
  double chief_tangent;  // towards the hologram's centre
  double half_tangent;   // tangent of half the window
  double centre_m;       // where the chief ray meets the plane
  double spot_m;         // diffraction spot on the plane
  double half_m;         // half footprint
  double extent_m;       // half footprint of the near wave
};

Aimed aimed(const Plan& plan, dvec3 p, double plane_z_m, int axis) {
  Aimed a;
  a.chief_tangent = -p[axis] / p.z;
  a.half_tangent = half_window(plan)[axis] / std::abs(p.z);
  a.centre_m = p[axis] + a.chief_tangent * (p.z - plane_z_m);
  a.spot_m = plan.hologram.wavelength_m / (2 * plan.cone.half_width * a.half_tangent);
  a.half_m = plan.cone.half_width * a.half_tangent * std::abs(p.z - plane_z_m);
  a.extent_m = a.half_m + plane_wave_tail * a.spot_m;
  return a;
}

struct Decision {
  bool yes = false, unsure = false;
};

Decision is_less(double a, double b) { return {a < b, std::abs(a - b) <= undecided * std::abs(b)}; }

/// Plane waves along an axis, and whether a float may give another number of them.
std::pair<int, bool> wave_count(const Aimed& a) {
  const double eighths = std::min(0.25 * a.extent_m / a.spot_m, 1e6), nearest = std::round(eighths);
  return {8 * static_cast<int>(eighths) + 32, std::abs(eighths - nearest) <= undecided * nearest};
}

Decision is_plane_wave_sample(const Aimed& x, const Aimed& y, double plane_wave_spots) {
  const auto narrow_x = is_less(x.half_m, plane_wave_spots * x.spot_m),
             narrow_y = is_less(y.half_m, plane_wave_spots * y.spot_m);
  const auto [count_x, unsure_x] = wave_count(x);
  const auto [count_y, unsure_y] = wave_count(y);
  const bool fits = count_x <= most_plane_waves && count_y <= most_plane_waves;
  return {(narrow_x.yes || narrow_y.yes) && fits,
          plane_wave_spots > 0 && (narrow_x.unsure || narrow_y.unsure || unsure_x || unsure_y)};
}

/// g of plane_waves.h in its parts, for each of `count` pixels from `first_m`, `step_m` apart.
///
/// side  1; -1 of samples before the hologram, where larger sines belong to smaller places on it
using Parts = std::array<Complex, 8>;
std::vector<Parts> plane_wave_sums(const Plan& plan, const Aimed& a, int parts, double place_m,
                                   double depth_m, double side, int axis, double first_m,
                                   double step_m, int pixels,
                                   const std::function<double(double tangent)>& amplitude_at) {
  const auto sine_of = [](double tangent) { return tangent / std::hypot(1.0, tangent); };
  const double low = sine_of(a.chief_tangent - plan.cone.half_width * a.half_tangent),
               high = sine_of(a.chief_tangent + plan.cone.half_width * a.half_tangent);
  const int count = std::min(wave_count(a).first, most_plane_waves);
  const double visibility_half = std::max(1.0, plan.cone.half_width);
  std::vector<Parts> sums(static_cast<std::size_t>(pixels));
  for (int n = 0; n < count; ++n) {
    const double step = (high - low) / count, sine = low + (n + 0.5) * step,
                 cosine = std::sqrt(1 - sine * sine);
    if (std::abs(sine) > plan.hologram.largest_sine[axis]) continue;
    const double at = side * (sine / cosine - a.chief_tangent) / a.half_tangent;
    const auto part = static_cast<std::size_t>(std::clamp(
        static_cast<int>(std::floor((at / visibility_half + 1) / 2 * parts)), 0, parts - 1));
    const double weight = step / cosine * (plan.cone.apodization > 0 ? edge_weight(plan, at) : 1) *
                          amplitude_at(sine / cosine);
    for (int i = 0; i < pixels; ++i) {
      const double offset_m = first_m + i * step_m - place_m;
      sums[static_cast<std::size_t>(i)][part] +=
          weight * turned((sine * offset_m - depth_m * (1 - cosine)) / plan.hologram.wavelength_m);
    }
  }
  return sums;
}

/// The direction nearest to a highlight's that the fan holds.
dvec3 within_fan(const Plan& plan, const Aimed& x, const Aimed& y, dvec3 direction) {
  const auto nearest = [&](const Aimed& a, double part) {
    const double reach = plan.cone.half_width * a.half_tangent;
    return std::clamp(part / std::max(-direction.z, 1e-6), a.chief_tangent - reach,
                      a.chief_tangent + reach);
  };
  return {nearest(x, direction.x), nearest(y, direction.y), -1};
}

/// Pixels of an axis within `half_m` of `centre_m`: [first, last].
std::pair<int, int> pixels_within(double first_m, double step_m, int count, double centre_m,
                                  double half_m) {
  const double a = (centre_m - half_m - first_m) / step_m,
               b = (centre_m + half_m - first_m) / step_m;
  return {static_cast<int>(std::clamp(std::ceil(std::min(a, b)), 0.0, static_cast<double>(count))),
          static_cast<int>(std::clamp(std::floor(std::max(a, b)), -1.0, count - 1.0))};
}

class Plane {
public:
  Plane(const Gathering& what, const Wrp& wrp, std::uint32_t seed)
      : what_(what),
        plan_(what.plan),
        centre_(wrp.centre_m),
        corner_(reference::pixel_m(plan_, centre_, 0)),
        bounds_(layer_bounds(plan_, plan_.layer_of(wrp))),
        seed_(seed) {
    const auto pixels = static_cast<std::size_t>(plan_.hologram.size.x) *
                        static_cast<std::size_t>(plan_.hologram.size.y);
    result_.field.resize(pixels);
    result_.unsure.resize(pixels);
  }

  GatheredField gathered() {
    for (std::size_t i = 0; i < what_.samples.size(); ++i) {
      if (bounds_.first <= what_.samples[i].z && what_.samples[i].z < bounds_.second) add(i);
    }
    return std::move(result_);
  }

private:
  void add(std::size_t index) {
    const auto& s = what_.samples[index];
    const auto p = place(s) + plan_.extent.origin_m;
    const auto x = aimed(plan_, p, centre_.z, 0), y = aimed(plan_, p, centre_.z, 1);
    const auto near =
        centre_.z != 0 ? is_plane_wave_sample(x, y, what_.plane_wave_spots) : Decision{};
    const auto phasor = phasor_of(what_, index, seed_);
    if (near.unsure) {
      doubt(x.centre_m, y.centre_m, x.extent_m, y.extent_m);
    } else if (near.yes) {
      add_near(index, p, x, y, phasor);
    } else {
      const double margin = 1 + 10 * undecided;
      each(x.centre_m, y.centre_m, centre_.z != 0 ? x.half_m * margin : INFINITY,
           centre_.z != 0 ? y.half_m * margin : INFINITY, [&](std::size_t at) {
             const auto ray = aimed_ray(what_, index, reference::pixel_m(plan_, centre_, at));
             result_.field[at] += ray.wave * phasor;
             if (ray.unsure) result_.unsure[at] = true;
           });
    }
  }

  void add_near(std::size_t index, dvec3 p, const Aimed& x, const Aimed& y, Complex phasor) {
    const auto& s = what_.samples[index];
    const double depth_m = p.z - centre_.z, side = p.z < 0 ? -1 : 1;
    // A product of amplitudes along the axes through the brightest direction.
    dvec3 best(x.chief_tangent, y.chief_tangent, -1);
    double most = amplitude_towards(what_, index, best);
    for (const auto& h : highlights(what_, index)) {
      if (s.specular <= 0) break;
      const auto towards = within_fan(plan_, x, y, h.direction);
      const double there = amplitude_towards(what_, index, towards);
      // Like the kernel: otherwise rounding would choose among equal values.
      if (there <= 1.01 * most) continue;
      most = there;
      best = towards;
    }
    if (most <= 0) return;
    const auto [left, right] = pixels_within(corner_.x, plan_.hologram.pitch_m.x,
                                             plan_.hologram.size.x, x.centre_m, x.extent_m);
    const auto [top, bottom] = pixels_within(corner_.y, -plan_.hologram.pitch_m.y,
                                             plan_.hologram.size.y, y.centre_m, y.extent_m);
    if (left > right || top > bottom) return;
    const int parts = plane_wave_parts(what_);
    const auto across = plane_wave_sums(plan_, x, parts, p.x, depth_m, side, 0,
                                        corner_.x + left * plan_.hologram.pitch_m.x,
                                        plan_.hologram.pitch_m.x, right - left + 1, [&](double t) {
                                          return amplitude_towards(what_, index, {t, best.y, -1});
                                        });
    const auto up = plane_wave_sums(plan_, y, parts, p.y, depth_m, side, 1,
                                    corner_.y - top * plan_.hologram.pitch_m.y,
                                    -plan_.hologram.pitch_m.y, bottom - top + 1, [&](double t) {
                                      return amplitude_towards(what_, index, {best.x, t, -1});
                                    });
    const auto common = Complex(0, side) * turned(depth_m / plan_.hologram.wavelength_m) * phasor /
                        (most * plan_.hologram.wavelength_m);
    std::array<double, 64> shares{};
    for (int part = 0; part < parts * parts; ++part)
      shares[static_cast<std::size_t>(part)] = seen_share(what_, index, part % parts, part / parts);
    // Sums along x for each part along y
    std::vector<Parts> seen(across.size());
    for (std::size_t column = 0; column < across.size(); ++column)
      for (int part = 0; part < parts * parts; ++part)
        seen[column][static_cast<std::size_t>(part / parts)] +=
            shares[static_cast<std::size_t>(part)] *
            across[column][static_cast<std::size_t>(part % parts)];
    for (int row = top; row <= bottom; ++row) {
      const auto& y_parts = up[static_cast<std::size_t>(row - top)];
      for (int column = left; column <= right; ++column) {
        const auto& x_parts = seen[static_cast<std::size_t>(column - left)];
        Complex sum = 0;
        for (std::size_t part = 0; part < static_cast<std::size_t>(parts); ++part)
          sum += x_parts[part] * y_parts[part];
        result_.field[index_of(column, row)] += common * sum;
      }
    }
    // The edge of the footprint cuts the wave off.
    doubt_rim(x, y);
  }

  std::size_t index_of(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(plan_.hologram.size.x) +
           static_cast<std::size_t>(column);
  }

  template <class Use>
  void each(double x_m, double y_m, double half_x_m, double half_y_m, Use use) {
    const auto [left, right] =
        pixels_within(corner_.x, plan_.hologram.pitch_m.x, plan_.hologram.size.x, x_m, half_x_m);
    const auto [top, bottom] =
        pixels_within(corner_.y, -plan_.hologram.pitch_m.y, plan_.hologram.size.y, y_m, half_y_m);
    for (int row = top; row <= bottom; ++row)
      for (int column = left; column <= right; ++column) use(index_of(column, row));
  }

  void doubt(double x_m, double y_m, double half_x_m, double half_y_m) {
    each(x_m, y_m, half_x_m * (1 + undecided), half_y_m * (1 + undecided),
         [&](std::size_t at) { result_.unsure[at] = true; });
  }

  void doubt_rim(const Aimed& x, const Aimed& y) {
    each(x.centre_m, y.centre_m, x.extent_m * (1 + undecided), y.extent_m * (1 + undecided),
         [&](std::size_t at) {
           const auto pixel = reference::pixel_m(plan_, centre_, at);
           if (std::abs(pixel.x - x.centre_m) > x.extent_m * (1 - undecided) ||
               std::abs(pixel.y - y.centre_m) > y.extent_m * (1 - undecided))
             result_.unsure[at] = true;
         });
  }

  const Gathering& what_;
  const Plan& plan_;
  dvec3 centre_, corner_;
  std::pair<float, float> bounds_;
  std::uint32_t seed_;
  GatheredField result_;
};

}  // namespace

Complex phasor_of(const Gathering& what, std::size_t sample, std::uint32_t seed) {
  const auto& s = what.samples[sample];
  const auto phasor = turned(phase_turns_of_key(s.key, seed));
  return place(s).z + what.plan.extent.origin_m.z < 0 ? std::conj(phasor) : phasor;
}

double amplitude_towards(const Gathering& what, std::size_t index, glm::dvec3 towards) {
  const auto& s = what.samples[index];
  double radiance = s.radiance;
  for (const auto& h : highlights(what, index))
    radiance += h.intensity * s.specular *
                power_of_cosine(dot(h.direction, normalize(towards)), s.shininess);
  // A surface that is turned away shows less area.
  const double area = std::clamp(s.tilt_x * towards.x + s.tilt_y * towards.y - s.tilt_z, 0.0, 4.0);
  return s.weight * std::sqrt(radiance * area);
}

double smooth_share(const Gathering& what, std::size_t sample, glm::dvec2 place_m) {
  const int parts = what.visibility_parts;
  const auto half_m = half_window(what.plan) * std::max(1.0, what.plan.cone.half_width);
  const auto p = place(what.samples[sample]) + what.plan.extent.origin_m;
  // Near the hologram masks divide directions
  const auto in_mask = is_near_hologram(what.plan)
                           ? (place_m - dvec2(p)) / p.z / steepest_of_masks(what.plan)
                           : place_m / half_m;
  const auto at = (in_mask + 1.0) * (parts / 2.0) - 0.5;
  double share = 0;
  for (int j = -2; j < parts + 2; ++j) {
    for (int i = -2; i < parts + 2; ++i) {
      if (is_seen(what, sample, i, j)) share += cubic_spline(at.x - i) * cubic_spline(at.y - j);
    }
  }
  return share;
}

AimedRay aimed_ray(const Gathering& what, std::size_t sample, glm::dvec3 pixel_m) {
  const auto& plan = what.plan;
  const auto& s = what.samples[sample];
  const auto p = place(s) + plan.extent.origin_m;
  const double depth = p.z - pixel_m.z;
  AimedRay ray;
  double edges = 1;
  if (pixel_m.z != 0) {
    for (int axis = 0; axis < 2; ++axis) {
      // The position at which the light meets the hologram, in half holograms.
      const double at =
          (pixel_m[axis] - (p[axis] - pixel_m[axis]) * pixel_m.z / depth) / half_window(plan)[axis];
      if (plan.cone.apodization == 0 && std::abs(std::abs(at) - plan.cone.half_width) < 1e-3)
        ray.unsure = true;
      edges *= edge_weight(plan, at);
    }
    if (edges == 0) return ray;
  }
  const auto towards = (pixel_m - p) / depth;  // towards the hologram, z = -1
  for (int axis = 0; axis < 2; ++axis) {
    const double sine =
        std::abs(towards[axis]) / length(towards) / plan.hologram.largest_sine[axis];
    if (std::abs(sine - 1) < undecided) ray.unsure = true;
    if (plan.hologram.largest_sine[axis] < 1 && sine > 1) return ray;
  }
  if (s.hidden && plan.is_at_hologram()) {
    edges *= smooth_share(what, sample, dvec2(pixel_m));
  } else if (s.hidden) {
    const auto at = (dvec2(pixel_m) + dvec2(towards) * pixel_m.z) / half_window(plan);
    const auto [i, unsure_i] = visibility_part(what, at.x);
    const auto [j, unsure_j] = visibility_part(what, at.y);
    ray.unsure |= unsure_i || unsure_j;
    if (!is_seen(what, sample, i, j)) return ray;
  }
  // Converging light turns by half a period at its focus.
  const double signed_r = std::copysign(length(pixel_m - p), depth), side = p.z < 0 ? -1 : 1;
  ray.wave = edges * amplitude_towards(what, sample, towards) * side / signed_r *
             turned(signed_r / plan.hologram.wavelength_m);
  return ray;
}

glm::dvec3 pixel_m(const Plan& plan, glm::dvec3 centre_m, std::size_t index) {
  const auto nx = static_cast<std::size_t>(plan.hologram.size.x);
  const dvec2 from_middle = dvec2(index % nx, index / nx) - dvec2(plan.hologram.size - 1) / 2.0;
  return centre_m + dvec3(from_middle.x * plan.hologram.pitch_m.x,
                          -from_middle.y * plan.hologram.pitch_m.y, 0);
}

GatheredField gather(const Gathering& what, const Wrp& wrp, std::uint32_t seed) {
  return Plane(what, wrp, seed).gathered();
}

Field hologram(const Plan& plan, std::span<const Field> wrps) {
  Field sum(static_cast<std::size_t>(plan.hologram.size.x) *
            static_cast<std::size_t>(plan.hologram.size.y));
  for (std::size_t i = 0; i < wrps.size(); ++i) {
    const auto centre_m = plan.wrps[i].centre_m;
    const auto arrived =
        shifted_angular_spectrum(wrps[i],
                                 {plan.hologram.size, plan.hologram.pitch_m,
                                  plan.hologram.wavelength_m, -dvec2(centre_m), centre_m.z},
                                 std::get<SpectrumWrps>(plan.carrier).padded);
    for (std::size_t at = 0; at < sum.size(); ++at) sum[at] += arrived[at];
  }
  return sum;
}

}  // namespace raywave::reference
