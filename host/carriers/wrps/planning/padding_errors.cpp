// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/wrps/planning/padding_errors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <glm/common.hpp>
#include <map>
#include <numbers>
#include <random>

#include "host/common/fft_backend.hpp"
#include "host/common/plane_fft.hpp"
#include "host/plan/footprint.hpp"
#include "host/plan/padded_plane.hpp"

namespace raywave {
namespace {

using std::numbers::pi;
using Complex = std::complex<double>;

constexpr std::size_t most_lines = 32;  // WRPs of an axis
constexpr int samples_of_a_line = 64;   // enough that the error's own scatter is some per cent
constexpr int waves_of_a_sample = 192;  // near ones
constexpr int wide = 4;                 // windows: what goes astray farther is taken to be lost
constexpr int wide_fringes = 8;         // ... beside a window and what it lights

/// Squares of the light in a window: of its error, and of all of it.
struct Squares {
  double wrong = 0, all = 0;
  void add(const Squares& other) {
    wrong += other.wrong;
    all += other.all;
  }
  double relative() const { return all > 0 ? wrong / all : 0; }
};

/// One axis of a layer, everything along it seen from a tile's centre.
class AxisOfLayer {
public:
  /// tile_m  the tile's centre, along this axis
  /// padded  sizes of padded planes, likewise
  AxisOfLayer(const Plan& plan, const DepthLayer& layer, int axis, double tile_m,
              std::vector<int> padded)
      : plan_(plan),
        layer_(layer),
        axis_(axis),
        padded_(std::move(padded)),
        n_(plan.tiling.tile_size[axis]),
        pitch_m_(plan.hologram.pitch_m[axis]),
        half_m_(n_ * pitch_m_ / 2),
        largest_sine_(plan.hologram.largest_sine[axis]),
        fan_(plan.tiling.cone[axis]),
        edge_(plan.tiling.apodization[axis]),
        low_m_(layer.min_m[axis] - tile_m),
        high_m_(layer.max_m[axis] - tile_m),
        fft_(next_fast_size(static_cast<std::size_t>(
                 std::max({wide * n_, 2 * *std::ranges::max_element(padded_),
                           2 * n_ + static_cast<int>(wide_fringes * fringe_m() / pitch_m_)}))),
             false),
        wanted_(static_cast<std::size_t>(n_)),
        got_(padded_.size(), wanted_) {}

  /// Leaves samples out whose light crosses the layer's plane beyond these places.
  void look_between(double low_m, double high_m) {
    const double scale = layer_.min_m.z / layer_.distance_m,
                 reach_m = footprint_of(plan_, axis_, layer_.distance_m, layer_.min_m.z).reach_m();
    low_m_ = std::max(low_m_, (low_m + reach_m) * scale);
    high_m_ = std::max(low_m_, std::min(high_m_, (high_m - reach_m) * scale));
  }

  /// Adds what arrives in the tile's window from the WRP at centre_m, rightly and with every
  /// padding. WRPs side by side cut the same waves, so that their edges cancel.
  void add_padded(double centre_m) {
    const auto light = line();
    fill(light.get() + first(), centre_m, n_, pitch_m_);
    const auto spectrum = propagated(light, centre_m);
    add(wanted_, transformed_back(spectrum));
    for (std::size_t i = 0; i < padded_.size(); ++i) {
      const auto kept = kept_of({padded_[i], pitch_m_, n_}, spectrum, centre_m);
      add(got_[i], transformed_back(kept), padded_[i]);
    }
  }

  Squares squares_of_field(std::size_t padding) const { return squares(got_[padding], wanted_); }

  /// Of what arrives over the WRPs with a padding against the samples' waves, as `cone` weighs.
  Squares squares_of_waves(std::size_t padding) const {
    std::vector<Complex> waves(wanted_.size());
    const double k = 2 * pi / plan_.hologram.wavelength_m,
                 unit = static_cast<double>(fft_.size());  // transforms are not normalised
    for_each_sample([&](const Point& point, Complex phasor) {
      const bool is_near = footprint_of(plan_, axis_, layer_.distance_m, point.z_m).is_near();
      // A line's wave is an eighth of a turn ahead of its spherical wave, which `fill` takes
      const double turned = is_near ? -pi / 4 : point.depth_m < 0 ? -pi / 2 : 0;
      for (int i = 0; i < n_; ++i) {
        const double at_m = (i - (n_ - 1) / 2.0) * pitch_m_, across_m = at_m - point.x_m,
                     length_m = std::hypot(across_m, point.z_m);
        if (std::abs(across_m) > largest_sine_ * length_m) continue;
        waves[static_cast<std::size_t>(i)] +=
            phasor *
            std::polar(unit * cone(at_m, 0, 0) / std::sqrt(length_m * plan_.hologram.wavelength_m),
                       k * (length_m - point.depth_m) + turned);
      }
    });
    return squares(got_[padding], waves);
  }

private:
  struct Point {
    double x_m, z_m, depth_m;
  };

  static Squares squares(const std::vector<Complex>& got, const std::vector<Complex>& wanted) {
    Squares sum;
    for (std::size_t i = 0; i < wanted.size(); ++i)
      sum.add({std::norm(got[i] - wanted[i]), std::norm(wanted[i])});
    return sum;
  }

  /// Of the light's edges at the hologram.
  double fringe_m() const {
    return std::sqrt(plan_.hologram.wavelength_m * std::abs(layer_.distance_m));
  }

  /// Calls f(place, phasor) for samples in the layer's box, with random phases.
  void for_each_sample(const auto& f) const {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int i = 0; i < samples_of_a_line; ++i) {
      const double z_m = layer_.min_m.z + (layer_.max_m.z - layer_.min_m.z) * uniform(random);
      const double x_m = low_m_ + (high_m_ - low_m_) * (i + uniform(random)) / samples_of_a_line;
      const Complex phasor = std::polar(1.0, 2 * pi * uniform(random));
      f(Point{x_m, z_m, z_m - layer_.distance_m}, phasor);
    }
  }

  Lines line() const { return make_zero_lines(fft_.size(), "line across the WRPs"); }

  /// Frequency of number i of a transform, in cycles per metre.
  double frequency(std::ptrdiff_t i) const {
    const auto count = static_cast<std::ptrdiff_t>(fft_.size());
    return static_cast<double>(i <= (count - 1) / 2 ? i : i - count) /
           (static_cast<double>(count) * pitch_m_);
  }
  /// The other component of the wave's direction, over the wavelength; 0 of waves that do not
  /// travel.
  double along_axis(double u) const {
    return std::sqrt(
        std::max(1 / (plan_.hologram.wavelength_m * plan_.hologram.wavelength_m) - u * u, 0.0));
  }

  /// Spectrum at the hologram of a line of light at centre_m.
  Lines propagated(const Lines& light, double centre_m) {
    auto spectrum = line();
    fft_.forward(light.get(), spectrum.get());
    for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(fft_.size()); ++i) {
      const double u = frequency(i), w = along_axis(u),
                   turns = layer_.distance_m * w - centre_m * u;
      auto& value = spectrum[static_cast<std::size_t>(i)];
      value =
          w > 0 ? value * std::complex<float>(std::polar(1.0, 2 * pi * (turns - std::round(turns))))
                : 0;
    }
    return spectrum;
  }

  /// Without the waves that move sideways too far for a padded plane.
  Lines kept_of(const Axis& plane, const Lines& spectrum, double centre_m) const {
    auto kept = line();
    const double reach_m = plane.reach_m(),
                 edge_m = std::max(reach_m - plane.whole_reach_m(), 1e-9 * reach_m);
    for (std::ptrdiff_t i = 0; i < static_cast<std::ptrdiff_t>(fft_.size()); ++i) {
      const double u = frequency(i), w = along_axis(u);
      if (w <= 0) continue;
      const double beyond_m = std::abs(-centre_m - layer_.distance_m * u / w) - reach_m,
                   t = std::clamp(-beyond_m / edge_m, 0.0, 1.0);
      kept[static_cast<std::size_t>(i)] =
          spectrum[static_cast<std::size_t>(i)] * static_cast<float>(t * t * (3 - 2 * t));
    }
    return kept;
  }

  Lines transformed_back(const Lines& spectrum) {
    auto result = line();
    fft_.inverse(spectrum.get(), result.get());
    return result;
  }

  /// Adds the tile's window of a line, and what wraps around to it on a plane of `padded` samples.
  void add(std::vector<Complex>& window, const Lines& line, std::ptrdiff_t padded = 0) const {
    const auto count = static_cast<std::ptrdiff_t>(fft_.size());
    if (padded == 0) padded = count;
    for (int i = 0; i < n_; ++i) {
      for (std::ptrdiff_t j = (first() + i) % padded; j < count; j += padded)
        window[static_cast<std::size_t>(i)] += Complex(line[static_cast<std::size_t>(j)]);
    }
  }

  std::ptrdiff_t first() const { return (static_cast<std::ptrdiff_t>(fft_.size()) - n_) / 2; }

  /// How much of the light that lands at x on the tile a pixel at `pixel_m` gathers.
  double cone(double x_m, double pixel_m, double centre_m) const {
    if (!plan_.samples.aimed) return std::abs(x_m - (pixel_m - centre_m)) <= half_m_;
    return Cone{fan_, edge_}.passed(x_m / half_m_);
  }

  /// Fills a line with the waves of samples in the layer's box, with random phases, at `count`
  /// places around centre_m.
  void fill(std::complex<float>* light, double centre_m, int count, double pitch_m) const {
    const double k = 2 * pi / plan_.hologram.wavelength_m;
    for_each_sample([&](const Point& point, Complex phasor) {
      const auto& [x_m, z_m, depth_m] = point;
      const auto footprint = footprint_of(plan_, axis_, layer_.distance_m, z_m);
      const bool is_near = plan_.samples.aimed && footprint.is_near();
      const double reach_m = footprint.reach_m(), middle_m = x_m * layer_.distance_m / z_m;
      int first = 0, last = count - 1;
      if (plan_.samples.aimed) {
        const auto place = [&](double at_m) {
          return std::clamp((at_m - centre_m) / pitch_m + (count - 1) / 2.0, -1.0, 1.0 * count);
        };
        first = static_cast<int>(std::max(std::ceil(place(middle_m - reach_m)), 0.0));
        last = static_cast<int>(std::min(std::floor(place(middle_m + reach_m)), count - 1.0));
      }
      const double first_m = centre_m + (first - (count - 1) / 2.0) * pitch_m;
      if (is_near) {
        add_near(light + first, last - first + 1, first_m - x_m, pitch_m, point,
                 phasor / footprint.spot_m);
        return;
      }
      for (int p = first; p <= last; ++p) {
        const double pixel_m = first_m + (p - first) * pitch_m, across_m = pixel_m - x_m;
        const double amount = cone(x_m + across_m * z_m / depth_m, pixel_m, centre_m),
                     length_m = std::hypot(across_m, depth_m);
        if (amount == 0 || std::abs(across_m) > largest_sine_ * length_m) continue;
        const double way_m = std::copysign(length_m - std::abs(depth_m), depth_m);
        light[p] += std::complex<float>(
            phasor * std::polar(amount / std::sqrt(std::abs(depth_m) * plan_.hologram.wavelength_m),
                                k * way_m));
      }
    });
  }

  /// kernels/gather/plane_waves.h in its plain form: plane waves towards the window, at `count`
  /// pixels from offset_m beside the point on. Each wave is turned on from pixel to pixel.
  void add_near(std::complex<float>* light, int count, double offset_m, double pitch_m, Point point,
                Complex factor) const {
    std::array<double, waves_of_a_sample> re, im, step_re, step_im;
    for (std::size_t i = 0; i < waves_of_a_sample; ++i) {
      const double at_m =
          ((static_cast<double>(i) + 0.5) / waves_of_a_sample * 2 - 1) * fan_ * half_m_;
      const double tangent = (at_m - point.x_m) / point.z_m,
                   cosine = 1 / std::sqrt(1 + tangent * tangent), sine = tangent * cosine;
      const double way_m = sine * offset_m - point.depth_m * (1 - cosine),
                   k = 2 * pi / plan_.hologram.wavelength_m;
      const double amount =
          std::abs(sine) <= largest_sine_ ? cone(at_m, 0, 0) / waves_of_a_sample : 0;
      re[i] = amount * std::cos(k * way_m);
      im[i] = amount * std::sin(k * way_m);
      step_re[i] = std::cos(k * sine * pitch_m);
      step_im[i] = std::sin(k * sine * pitch_m);
    }
    for (int p = 0; p < count; ++p) {
      double sum_re = 0, sum_im = 0;
      for (std::size_t i = 0; i < waves_of_a_sample; ++i) {
        sum_re += re[i];
        sum_im += im[i];
        const double turned = re[i] * step_re[i] - im[i] * step_im[i];
        im[i] = re[i] * step_im[i] + im[i] * step_re[i];
        re[i] = turned;
      }
      light[p] += std::complex<float>(factor * Complex(sum_re, sum_im));
    }
  }

  const Plan& plan_;
  const DepthLayer& layer_;
  int axis_;
  std::vector<int> padded_;
  int n_;
  double pitch_m_, half_m_, largest_sine_, fan_, edge_, low_m_, high_m_;
  LineFft fft_;
  std::vector<Complex> wanted_;
  std::vector<std::vector<Complex>> got_;  // with each padding
};

/// Middles of a layer's WRPs, or of the most_lines in the middle of them, from that of the tiles
/// whose light they carry: by the tiles' own.
std::map<double, std::vector<double>> lines_along(const Plan& plan, const DepthLayer& layer,
                                                  int axis) {
  std::map<double, std::vector<double>> lines;
  for (const auto& wrp : plan.wrps) {
    const double tile_m = plan.tile_of(wrp).centre_m[axis];
    if (&plan.layer_of(wrp) == &layer) lines[tile_m].push_back(wrp.centre_m[axis] - tile_m);
  }
  for (auto& [tile_m, centres] : lines) {
    std::ranges::sort(centres);
    centres.erase(std::unique(centres.begin(), centres.end()), centres.end());
    const std::size_t count = std::min(centres.size(), most_lines),
                      first = (centres.size() - count) / 2;
    centres = {centres.begin() + static_cast<std::ptrdiff_t>(first),
               centres.begin() + static_cast<std::ptrdiff_t>(first + count)};
  }
  return lines;
}

/// How much of the samples a layer has: the more, the more of the hologram's view its box fills.
double share_of(const Plan& plan, const DepthLayer& layer) {
  const auto side = [&](const DepthLayer& s) {
    return glm::max(glm::dvec2(s.max_m - s.min_m), plan.hologram.pitch_m) / s.min_m.z;
  };
  double all = 0;
  for (const auto& each : plan.layers) all += side(each).x * side(each).y;
  return side(layer).x * side(layer).y / all;
}

/// Along both axes of all layers, squares are added up over the lines of WRPs.
///
/// squares_of  an axis with its lines' light, by the number of a padding
std::vector<double> predicted_errors(const Plan& plan, const std::vector<glm::ivec2>& padded,
                                     Squares (AxisOfLayer::*squares_of)(std::size_t) const) {
  std::vector<double> errors(padded.size());  // squares, at first
  for (const auto& layer : plan.layers) {
    for (int axis = 0; axis < 2; ++axis) {
      std::vector<int> sizes;
      for (const auto& size : padded) sizes.push_back(size[axis]);
      std::vector<Squares> squares(padded.size());
      for (const auto& [tile_m, centres] : lines_along(plan, layer, axis)) {
        AxisOfLayer line(plan, layer, axis, tile_m, sizes);
        if (centres.size() == most_lines) {
          const double half_m = plan.tiling.tile_size[axis] * plan.hologram.pitch_m[axis] / 2;
          line.look_between(centres.front() - half_m, centres.back() + half_m);
        }
        for (const double centre_m : centres) line.add_padded(centre_m);
        for (std::size_t i = 0; i < padded.size(); ++i) squares[i].add((line.*squares_of)(i));
      }
      for (std::size_t i = 0; i < padded.size(); ++i)
        errors[i] += share_of(plan, layer) * squares[i].relative();
    }
  }
  for (auto& error : errors) error = std::sqrt(error);
  return errors;
}

}  // namespace

std::vector<double> predicted_padding_errors(const Plan& plan,
                                             const std::vector<glm::ivec2>& padded) {
  return predicted_errors(plan, padded, &AxisOfLayer::squares_of_field);
}

double predicted_wave_error(const Plan& plan, glm::ivec2 padded) {
  return predicted_errors(plan, {padded}, &AxisOfLayer::squares_of_waves)[0];
}

}  // namespace raywave
