// SPDX-License-Identifier: Apache-2.0
#include "host/reference/gathering.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "host/carriers/virtual_planes/planning/planes.hpp"
#include "host/reference/looks.hpp"
#include "host/reference/surfaces.hpp"

namespace raywave::reference {
namespace {

using Complex = std::complex<double>;
using glm::dvec2;
using glm::dvec3;

/// Middle of a part of the window, in half windows.
double middle_of(const Gathering& what, int part) {
  return (part + 0.5) * 2 / what.visibility_parts - 1;
}

/// Amplitude towards a place of the hologram's plane, over the distance to it.
double amplitude_at(const Gathering& what, std::size_t sample, dvec2 place_m) {
  const auto path = dvec3(place_m, 0) - (place(what.samples[sample]) + what.plan.extent.origin_m);
  return amplitude_towards(what, sample, path / -path.z) / glm::length(path);
}

/// Share of light of an axis that is not too steep. The integral of its square over the step is
/// 13 / 35, so that the step's middle lies as far beyond the limit as keeps the energy. The width
/// is COMPACT_EDGE / 2 of kernels/gather/compact_layout.h, on purpose a number of its own here.
double shown(const Plan& plan, int axis, double offset_m, double length_m) {
  if (!plan.beyond_diffraction) return 1;
  const double width_m = 0.175 * plan.tile_window_m()[axis];
  const double e = std::clamp(
      (plan.hologram.largest_sine[axis] * length_m - std::abs(offset_m)) / width_m + 1 - 13.0 / 35,
      0.0, 1.0);
  return e * e * (3 - 2 * e);
}

/// The light of one sample, or of the mirror image of one before the hologram, on the virtual plane
/// of a tile.
class Footprint {
public:
  Footprint(const Gathering& what, std::size_t sample, const Wrp& wrp,
            const device::CompactFootprint& at)
      : what_(what),
        plan_(what.plan),
        planes_(*plan_.virtual_planes()),
        sample_(sample),
        z0_m_(std::abs(wrp.centre_m.z)),
        at_(at) {
    const auto p = place(what.samples[sample]) + plan_.extent.origin_m;
    origin_m_ = origin_of_tile(plan_, plan_.tile_of(wrp));
    place_m_ = {(p.x - origin_m_.x), -(p.y - origin_m_.y), std::abs(p.z)};
    is_hidden_ = what.samples[sample].hidden != 0;
  }

  /// Light that it adds to pixel (u, v) of the tile, counted from the origin pixel, before the
  /// reference wave and the window function.
  Complex transform_at(glm::ivec2 pixel) {
    if (across_.empty()) make();
    Complex sum = 0;
    for (std::size_t line = 0; line < across_.size(); ++line)
      sum += dft(across_[line], 0, at_.left, pixel.x) * dft(up_[line], 1, at_.top, pixel.y);
    return sum / (static_cast<double>(planes_.size.x) * planes_.size.y);
  }

private:
  double psi_turns(double u, double v) const {
    const double r = glm::length(place_m_ - dvec3(u, v, 0)), c = std::hypot(u, v, z0_m_);
    return (r - c) / plan_.hologram.wavelength_m;
  }

  Complex dft(const std::vector<Complex>& profile, int axis, int first, int pixel) const {
    Complex sum = 0;
    for (std::size_t i = 0; i < profile.size(); ++i)
      sum += profile[i] * turned(-(first + static_cast<double>(i)) * pixel / planes_.size[axis]);
    return sum;
  }

  /// A profile of light at nodes, as kernels/gather/compact_layout.h has them.
  template <class Light>
  std::vector<Complex> profile(int axis, int first, int count, const Light& light) const {
    const int n = (count + 6 + 7) / 8 * 8;
    const double period_m = planes_.size[axis] * plan_.hologram.pitch_m[axis],
                 step_m = period_m / n;
    const int size = planes_.size[axis],
              half = (n * (2 * size - plan_.tiling.tile_size[axis]) - 1) / (2 * size);
    std::vector<Complex> pixels(static_cast<std::size_t>(count));
    for (int node = -half; node <= half; ++node) {
      const double at_m = node * step_m;
      const double window = window_function(plan_, axis)(at_m / (plan_.tile_window_m()[axis] / 2));
      const auto value = window * step_m / plan_.hologram.pitch_m[axis] * light(at_m);
      for (int i = 0; i < count; ++i)
        pixels[static_cast<std::size_t>(i)] += value * turned((first + i) * at_m / period_m);
    }
    return pixels;
  }

  void make() {
    const auto half_m = plan_.tile_window_m() / 2.0, window_m = plan_.window_m() / 2.0;
    const int parts = what_.visibility_parts;
    for (int line = 0; line < at_.lines; ++line) {
      // Parts of the window count in the world's frame, upwards.
      const int part = parts + 1 - line;
      const double row_m = is_hidden_
                               ? origin_m_.y - middle_of(what_, part) * window_m.y
                               : std::cos(std::numbers::pi * (line + 0.5) / at_.lines) * half_m.y;
      across_.push_back(profile(0, at_.left, at_.columns, [&](double u) {
        double share = 1;
        if (is_hidden_) {
          share = 0;
          for (int i = -2; i < parts + 2; ++i)
            share +=
                is_seen(what_, sample_, i, part) *
                cubic_spline(((origin_m_.x + u) / window_m.x - middle_of(what_, i)) * parts / 2);
        }
        const double length_m = glm::length(place_m_ - dvec3(u, row_m, 0));
        return share * shown(plan_, 0, u - place_m_.x, length_m) *
               amplitude_at(what_, sample_, origin_m_ + dvec2(u, -row_m)) *
               turned(psi_turns(u, row_m) - psi_turns(0, row_m));
      }));
      up_.push_back(profile(1, at_.top, at_.rows, [&](double v) {
        double basis = 1;
        if (is_hidden_) {
          basis =
              cubic_spline(((origin_m_.y - v) / window_m.y - middle_of(what_, part)) * parts / 2);
        } else {
          for (int other = 0; other < at_.lines; ++other) {
            const double there = std::cos(std::numbers::pi * (other + 0.5) / at_.lines) * half_m.y;
            if (other != line) basis *= (v - there) / (row_m - there);
          }
        }
        return basis * shown(plan_, 1, v - place_m_.y, glm::length(place_m_ - dvec3(0, v, 0))) *
               turned(psi_turns(0, v));
      }));
    }
  }

  const Gathering& what_;
  const Plan& plan_;
  const VirtualPlanes& planes_;
  std::size_t sample_;
  double z0_m_;
  device::CompactFootprint at_;
  dvec2 origin_m_{0};
  dvec3 place_m_{0};  // of the sample from the origin, y downwards
  bool is_hidden_ = false;
  std::vector<std::vector<Complex>> across_, up_;  // by line
};

}  // namespace

Gathering gathering(const Rig& rig, double plane_wave_spots) {
  return {rig.plan,
          rig.lights,
          rig.samples,
          rig.lit,
          rig.arrays.light_words(),
          plane_wave_spots,
          rig.visibility_masks,
          rig.table.visibility_parts};
}

Agreement against_direct_sum(const Rig& rig, std::span<const std::complex<float>> fields,
                             int frames, std::uint32_t seed, glm::dvec3 centre_m, int count,
                             double unit_m) {
  const auto what = gathering(rig);
  Random random(1);
  const auto pixels = static_cast<std::size_t>(rig.plan.hologram.size.x) *
                      static_cast<std::size_t>(rig.plan.hologram.size.y);
  Agreement result;
  double difference = 0, energy = 0;
  for (int n = 0; n < count; ++n) {
    const auto pixel = std::size_t{random()} % pixels;
    std::vector<std::complex<double>> sums(static_cast<std::size_t>(frames));
    bool unsure = false, dark = true;
    for (std::size_t i = 0; i < rig.samples.size() && !unsure; ++i) {
      const auto wave = aimed_ray(what, i, pixel_m(rig.plan, centre_m, pixel));
      unsure |= wave.unsure;
      if (wave.wave == 0.0) continue;
      dark = false;
      for (int f = 0; f < frames; ++f)
        sums[static_cast<std::size_t>(f)] +=
            unit_m * wave.wave * phasor_of(what, i, seed + static_cast<std::uint32_t>(f));
    }
    if (unsure) {
      ++result.unsure;
      continue;
    }
    ++result.pixels;
    for (int f = 0; f < frames; ++f) {
      const std::complex<double> got(fields[static_cast<std::size_t>(f) * pixels + pixel]);
      difference += std::norm(got - sums[static_cast<std::size_t>(f)]);
      energy += std::norm(sums[static_cast<std::size_t>(f)]);
      if (dark) result.dark_error = std::max(result.dark_error, std::abs(got));
    }
  }
  result.error = std::sqrt(difference / energy);
  return result;
}

Complex smooth_wave(const Gathering& what, std::size_t sample, const Tile& tile, dvec2 place_m) {
  const auto& plan = what.plan;
  const auto& s = what.samples[sample];
  const auto p = place(s) + plan.extent.origin_m;
  const auto path = p - dvec3(place_m, 0);
  const double r = glm::length(path);
  double share = s.hidden ? smooth_share(what, sample, place_m) : 1;
  // Along y light fades with its slope on the tile's middle column.
  const double column_m = origin_of_tile(plan, tile).x;
  share *=
      shown(plan, 0, path.x, r) * shown(plan, 1, path.y, std::hypot(p.x - column_m, path.y, p.z));
  const auto wave = turned(r / plan.hologram.wavelength_m);
  return share * amplitude_at(what, sample, place_m) * (p.z < 0 ? std::conj(wave) : wave);
}

std::vector<Complex> compact_field(const Gathering& what, const Wrp& wrp, std::uint32_t seed,
                                   std::span<const device::CompactFootprint> footprints,
                                   std::span<const glm::ivec2> pixels) {
  const auto& plan = what.plan;
  std::vector<Complex> field(pixels.size());
  for (std::size_t i = 0; i < what.samples.size(); ++i) {
    if (footprints[i].lines == 0) continue;
    Footprint footprint(what, i, wrp, footprints[i]);
    const auto phasor = turned(phase_turns_of_key(what.samples[i].key, seed));
    for (std::size_t n = 0; n < pixels.size(); ++n)
      field[n] += phasor * footprint.transform_at(pixels[n] - plan.tiling.tile_size / 2);
  }
  for (std::size_t n = 0; n < pixels.size(); ++n) {
    const auto at = dvec2(pixels[n] - plan.tiling.tile_size / 2);
    const auto m = at * plan.hologram.pitch_m, share = at / (dvec2(plan.tiling.tile_size) / 2.0);
    field[n] *= turned(std::hypot(m.x, m.y, wrp.centre_m.z) / plan.hologram.wavelength_m) /
                (window_function(plan, 0)(share.x) * window_function(plan, 1)(share.y));
    if (wrp.centre_m.z < 0) field[n] = std::conj(field[n]);
  }
  return field;
}

}  // namespace raywave::reference
