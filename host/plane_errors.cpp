// SPDX-License-Identifier: Apache-2.0
#include "host/plane_errors.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <glm/common.hpp>
#include <numbers>
#include <random>

#include "cl/fft.hpp"
#include "host/gatherer.hpp"
#include "host/refiner.hpp"

namespace raywave {
namespace {

using std::numbers::pi;
using Complex = std::complex<double>;

constexpr std::size_t most_lines = 32;  // WRPs of an axis
constexpr int samples_of_a_line = 64;   // enough that the error's own scatter is some per cent
constexpr int waves_of_a_sample = 192;  // near ones
constexpr int wide = 4;                 // windows: what goes astray farther is taken to be lost

/// One axis of a slab, everything along it seen from the hologram's centre.
class AxisOfSlab {
public:
  AxisOfSlab(const Plan& plan, const Slab& slab, int axis, int padded)
      : plan_(plan),
        slab_(slab),
        padded_(padded),
        n_(plan.size[axis]),
        pitch_m_(plan.pitch_m[axis]),
        half_m_(n_ * pitch_m_ / 2),
        low_m_(slab.min_m[axis]),
        high_m_(slab.max_m[axis]),
        fft_(cl::next_fast_size(static_cast<std::size_t>(std::max(wide * n_, 2 * padded))), false),
        wanted_(static_cast<std::size_t>(n_)),
        got_(wanted_.size()) {}

  /// Adds what arrives in the hologram's window from the WRP at centre_m, rightly and with the plan's padding. WRPs side by side cut the
  /// same waves, so that their edges cancel.
  void add_padded(double centre_m) {
    const auto light = line();
    fill(light.get() + first(), centre_m, n_, pitch_m_);
    auto spectrum = propagated(light, centre_m);
    add(wanted_, transformed_back(spectrum), false);
    drop_beyond(spectrum, centre_m, std::max(padded_ / 2.0, 1.0 * n_) * pitch_m_);
    add(got_, transformed_back(spectrum), true);
  }

  /// The same, with samples of the plane made from those that are gathered.
  void add_refined(double centre_m) {
    const auto light = line(), refined = line();
    fill(light.get() + first(), centre_m, n_, pitch_m_);
    std::vector<std::complex<float>> gathered(static_cast<std::size_t>(slab_.rows.count));
    fill(gathered.data(), centre_m, slab_.rows.count, slab_.rows.pitch_m);
    const auto r = refinement_of(plan_, slab_, -centre_m);  // rows count downwards
    for (int i = 0; i < n_; ++i) {
      for (int tap = 0; tap < r.taps; ++tap) {
        const auto row = static_cast<std::size_t>(r.first[static_cast<std::size_t>(i)] + tap);
        refined[static_cast<std::size_t>(first() + i)] += r.coefficients[static_cast<std::size_t>(i * r.taps + tap)] * gathered[row];
      }
    }
    add(wanted_, transformed_back(propagated(light, centre_m)), false);
    add(got_, transformed_back(propagated(refined, centre_m)), false);
  }

  /// Square of the relative error; 0 without light.
  double square() const {
    double wrong = 0, all = 0;
    for (std::size_t i = 0; i < wanted_.size(); ++i) {
      wrong += std::norm(got_[i] - wanted_[i]);
      all += std::norm(wanted_[i]);
    }
    return all > 0 ? wrong / all : 0;
  }

private:
  cl::Lines line() const { return cl::make_zero_lines(fft_.size(), "line across the WRPs"); }

  /// Frequency of number i of a transform, in cycles per metre.
  double frequency(std::ptrdiff_t i) const {
    const auto count = static_cast<std::ptrdiff_t>(fft_.size());
    return static_cast<double>(i <= (count - 1) / 2 ? i : i - count) / (static_cast<double>(count) * pitch_m_);
  }
  /// The other component of the wave's direction, over the wavelength; 0 of waves that do not travel.
  double along_axis(double u) const { return std::sqrt(std::max(1 / (plan_.wavelength_m * plan_.wavelength_m) - u * u, 0.0)); }

  /// Spectrum at the hologram of a line of light at centre_m.
  cl::Lines propagated(const cl::Lines& light, double centre_m) {
    auto spectrum = line();
    fft_.forward(light.get(), spectrum.get());
    for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(fft_.size()); ++i) {
      const double u = frequency(i), w = along_axis(u), turns = slab_.distance_m * w - centre_m * u;
      auto& value = spectrum[static_cast<std::size_t>(i)];
      value = w > 0 ? value * std::complex<float>(std::polar(1.0, 2 * pi * (turns - std::round(turns)))) : 0;
    }
    return spectrum;
  }

  /// Waves that move sideways farther than reach_m.
  void drop_beyond(cl::Lines& spectrum, double centre_m, double reach_m) const {
    for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(fft_.size()); ++i) {
      const double u = frequency(i), w = along_axis(u);
      if (!(w > 0) || std::abs(-centre_m - slab_.distance_m * u / w) > reach_m) spectrum[static_cast<std::size_t>(i)] = 0;
    }
  }

  cl::Lines transformed_back(const cl::Lines& spectrum) {
    auto result = line();
    fft_.inverse(spectrum.get(), result.get());
    return result;
  }

  /// Adds the hologram's window of a line; with `round`, what comes round to it on a padded plane too.
  void add(std::vector<Complex>& window, const cl::Lines& line, bool round) const {
    const auto count = static_cast<std::ptrdiff_t>(fft_.size());
    for (int i = 0; i < n_; ++i) {
      const std::ptrdiff_t here = first() + i;
      auto& sum = window[static_cast<std::size_t>(i)];
      if (!round) sum += Complex(line[static_cast<std::size_t>(here)]);
      for (std::ptrdiff_t j = here % padded_; round && j < count; j += padded_) sum += Complex(line[static_cast<std::size_t>(j)]);
    }
  }

  std::ptrdiff_t first() const { return (static_cast<std::ptrdiff_t>(fft_.size()) - n_) / 2; }

  /// How much of the light that lands at x on the hologram a pixel at `pixel_m` gathers.
  double cone(double x_m, double pixel_m, double centre_m) const {
    if (!plan_.aimed) {
      const bool perspective = plan_.wrps[0].convergence_per_m > 0;
      return std::abs(perspective ? x_m : x_m - (pixel_m - centre_m)) <= half_m_;
    }
    const double inside = plan_.fan - std::abs(x_m) / half_m_;
    if (plan_.edge <= 0) return inside >= 0;
    const double e = std::clamp(inside / plan_.edge, 0.0, 1.0);
    return e * e * (3 - 2 * e);
  }

  /// The waves of samples in the slab's box, with random phases, at `count` places around centre_m.
  void fill(std::complex<float>* light, double centre_m, int count, double pitch_m) const {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0, 1);
    const double k = 2 * pi / plan_.wavelength_m;
    for (int i = 0; i < samples_of_a_line; ++i) {
      const double z_m = slab_.min_m.z + (slab_.max_m.z - slab_.min_m.z) * uniform(random), depth_m = z_m - slab_.distance_m;
      const double x_m = low_m_ + (high_m_ - low_m_) * (i + uniform(random)) / samples_of_a_line;
      const Complex phasor = std::polar(1.0, 2 * pi * uniform(random));
      const double half_m = plan_.fan * half_m_ * std::abs(depth_m) / z_m;  // of the footprint
      const double spot_m = plan_.wavelength_m * z_m / (2 * plan_.fan * half_m_);
      const bool is_near = plan_.aimed && half_m < Gatherer::default_near_spots * spot_m;
      for (int p = 0; p < count; ++p) {
        const double pixel_m = centre_m + (p - (count - 1) / 2.0) * pitch_m, across_m = pixel_m - x_m * slab_.distance_m / z_m;
        Complex wave;
        if (is_near) {
          if (std::abs(across_m) > half_m + Gatherer::near_tail * spot_m) continue;
          wave = near_wave(pixel_m - x_m, x_m, z_m, depth_m) / spot_m;
        } else {
          if (plan_.aimed && std::abs(across_m) > half_m) continue;
          const double amount = cone(x_m + (pixel_m - x_m) * z_m / depth_m, pixel_m, centre_m);
          if (amount == 0) continue;
          const double way_m = std::copysign(std::hypot(pixel_m - x_m, depth_m) - std::abs(depth_m), depth_m);
          wave = std::polar(amount / std::sqrt(std::abs(depth_m) * plan_.wavelength_m), k * way_m);
        }
        light[p] += std::complex<float>(phasor * wave);
      }
    }
  }

  /// kernels/near.h in its plain form: plane waves towards the window.
  Complex near_wave(double offset_m, double x_m, double z_m, double depth_m) const {
    Complex sum = 0;
    for (int i = 0; i < waves_of_a_sample; ++i) {
      const double at_m = ((i + 0.5) / waves_of_a_sample * 2 - 1) * plan_.fan * half_m_, tangent = (at_m - x_m) / z_m;
      const double cosine = 1 / std::hypot(1, tangent), turns = tangent * cosine * offset_m - depth_m * (1 - cosine);
      sum += std::polar(cone(at_m, 0, 0), 2 * pi / plan_.wavelength_m * turns);
    }
    return sum / static_cast<double>(waves_of_a_sample);
  }

  const Plan& plan_;
  const Slab& slab_;
  int padded_, n_;
  double pitch_m_, half_m_, low_m_, high_m_;
  cl::LineFft fft_;
  std::vector<Complex> wanted_, got_;
};

/// Middles of a slab's WRPs, or of the most_lines in the middle of them.
std::vector<double> lines_along(const Plan& plan, const Slab& slab, int axis) {
  std::vector<double> centres;
  for (const auto& wrp : plan.wrps) {
    if (&plan.slab_of(wrp) == &slab) centres.push_back(wrp.centre_m[axis]);
  }
  std::sort(centres.begin(), centres.end());
  centres.erase(std::unique(centres.begin(), centres.end()), centres.end());
  const std::size_t lines = std::min(centres.size(), most_lines), first = (centres.size() - lines) / 2;
  return {centres.begin() + static_cast<std::ptrdiff_t>(first), centres.begin() + static_cast<std::ptrdiff_t>(first + lines)};
}

/// The error of all slabs from the squares of each: the more of the hologram's view a slab's box fills, the more samples it has.
template <class Square>
double error_of_slabs(const Plan& plan, Square square_of) {
  double sum = 0, all = 0;
  for (const auto& slab : plan.slabs) {
    const auto side = glm::max(glm::dvec2(slab.max_m - slab.min_m), plan.pitch_m) / slab.min_m.z;
    sum += side.x * side.y * square_of(slab);
    all += side.x * side.y;
  }
  return std::sqrt(sum / all);
}

}  // namespace

double predicted_padding_error(const Plan& plan, glm::ivec2 padded) {
  return error_of_slabs(plan, [&](const Slab& slab) {
    double square = 0;
    for (int axis = 0; axis < 2; ++axis) {
      AxisOfSlab line(plan, slab, axis, padded[axis]);
      for (const double centre_m : lines_along(plan, slab, axis)) line.add_padded(centre_m);
      square += line.square();
    }
    return square;
  });
}

double predicted_rows_error(const Plan& plan) {
  return error_of_slabs(plan, [&](const Slab& slab) {
    if (!slab.refines()) return 0.0;
    AxisOfSlab line(plan, slab, 1, plan.size.y);
    for (const double centre_m : lines_along(plan, slab, 1)) line.add_refined(centre_m);
    return line.square();
  });
}

}  // namespace raywave
