// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "host/forecast/picture_model.hpp"

namespace raywave {
namespace {

using std::numbers::pi;

/// How samples on an even lattice, each with a wave of its own phase, interfere along one axis of a
/// picture that a Gaussian blurs. Lengths in spots (wavelength z / width), so that the hologram
/// reaches from -1/2 to 1/2. Through a hologram that passes a(u) of a wave, two samples t apart and
/// out of focus by c make fringes; their part of frequency f is, phases apart, r_f(t + c f), with
///   r_f(t) = integral of a(u) a(u + f) exp(2 pi i u t) du.
/// Its square adds up over all f that the blur leaves and over all pairs. The sum over t = k pitch
/// is one over the harmonics m / pitch of its spectrum (Poisson), the integral of a(u) a(u + f) a(u
/// + v) a(u + v + f) du, of which few are not zero.
class Interference {
public:
  /// Mean squares of the blurred picture over the square of its mean.
  struct Squares {
    double pairs = 0;  // what all pairs of samples add, their phases random
    double alone = 0;  // of that, what each sample makes by itself
  };

  Interference(const Cone& cone, double pitch, double blur)
      : cone_(cone),
        pitch_(pitch),
        blur_(blur),
        step_(std::min(1.0, deviations / (2 * std::sqrt(2.0) * pi * blur)) / frequencies) {
    const double repeat = std::min(pitch, coarsest);
    for (std::size_t i = 0; i < frequencies; ++i) {
      const double f = frequency(i);
      auto& spectrum = spectra_.emplace_back();
      for (int m = 0; m < repeat * (1 - f); ++m) spectrum.push_back(overlap(f, m / repeat));
      passed_twice_.push_back(passed_twice(f));
    }
    light_ = transformed(passed_twice(0), 0, 0);
  }

  Squares at(double defocus) const {
    Squares sums;
    if (light_ <= 0) return sums;
    const double repeat = std::min(pitch_, coarsest);
    for (std::size_t i = 0; i < frequencies; ++i) {
      const double f = frequency(i), weight = 2 * step_ *
                                              std::exp(-4 * pi * pi * blur_ * blur_ * f * f) /
                                              (light_ * light_);
      const auto& spectrum = spectra_[i];
      Cosines cosines(0, 2 * pi * defocus * f / repeat);
      double pairs = -spectrum[0];
      for (const double harmonic : spectrum) pairs += 2 * harmonic * cosines.next();
      sums.pairs += weight * pairs;
      sums.alone += weight * repeat * std::pow(transformed(passed_twice_[i], f, defocus * f), 2);
    }
    return sums;
  }

  /// Mean square of the ripple that the blur leaves of the lattice, over the square of the mean.
  double dots(double defocus) const {
    if (pitch_ <= 1 || light_ <= 0) return 0;
    const double f = 1 / pitch_;
    const double ripple = 2 * std::exp(-2 * pi * pi * blur_ * blur_ * f * f) *
                          transformed(passed_twice(f), f, defocus * f) / light_;
    return ripple * ripple / 2;
  }

private:
  static constexpr std::size_t frequencies = 96, places = 24;
  // Standard deviations of the blur's spectrum, beyond which it leaves nothing
  static constexpr double deviations = 4.5;
  static constexpr double coarsest = 64;  // samples farther apart hardly interfere

  using Places = std::array<double, places>;

  /// Cosines of first, first + step, first + 2 step ...
  class Cosines {
  public:
    Cosines(double first, double step)
        : now_(std::cos(first)), before_(std::cos(first - step)), twice_(2 * std::cos(step)) {}
    double next() {
      const double result = now_;
      now_ = twice_ * now_ - before_;
      before_ = result;
      return result;
    }

  private:
    double now_, before_, twice_;
  };

  double frequency(std::size_t i) const { return (static_cast<double>(i) + 0.5) * step_; }
  double passed(double at) const { return cone_.passed(2 * at); }

  /// a(u) a(u + f) on half of where it is not zero, from its middle on.
  Places passed_twice(double f) const {
    Places values;
    for (std::size_t i = 0; i < places; ++i) {
      const double u = (1 - f) / 2 * (static_cast<double>(i) + 0.5) / places;
      values[i] = passed(u - f / 2) * passed(u + f / 2);
    }
    return values;
  }

  /// r_f(t) but for its phase.
  static double transformed(const Places& twice, double f, double t) {
    const double step = pi * (1 - f) * t / places;
    Cosines cosines(step / 2, step);
    double sum = 0;
    for (const double value : twice) sum += value * cosines.next();
    return (1 - f) * sum / places;
  }

  double overlap(double f, double v) const {
    const double half = (1 - f - v) / 2, far = (f + v) / 2, near = (f - v) / 2;
    double sum = 0;
    for (std::size_t i = 0; i < places; ++i) {
      const double u = half * (static_cast<double>(i) + 0.5) / places;
      sum += passed(u - far) * passed(u - near) * passed(u + near) * passed(u + far);
    }
    return 2 * half * sum / places;
  }

  Cone cone_;
  double pitch_, blur_, step_, light_ = 0;
  std::vector<std::vector<double>> spectra_;  // by frequency, then harmonic
  std::vector<Places> passed_twice_;          // by frequency
};

}  // namespace

LatticePattern lattice_pattern(const PictureModel& model, double pitch_m) {
  LatticePattern pattern{pitch_m, {}, {}, {}};
  for (const auto& row : model.rows) {
    const auto pitch = pitch_m * row.pitch / row.spot_m;
    const auto blur = blur_of_resolution * model.resolution_m / row.spot_m;
    const auto interference = [&](const Cone& cone) {
      return std::array{Interference(cone, pitch.x, blur.x), Interference(cone, pitch.y, blur.y)};
    };
    const auto soft = interference(model.cone), hard = interference(Cone{1, 0});
    double speckle = 0, cut = 0, dots = 0;
    for (const auto& layer : row.layers) {
      const auto of_pairs = [&](const auto& axes) {
        const auto x = axes[0].at(layer.defocus.x), y = axes[1].at(layer.defocus.y);
        return std::max(0.0, x.pairs * y.pairs - x.alone * y.alone);
      };
      speckle += layer.share * of_pairs(soft);
      cut += layer.share * of_pairs(hard);
      dots += layer.share * (soft[0].dots(layer.defocus.x) + soft[1].dots(layer.defocus.y));
    }
    pattern.speckle.push_back(speckle);
    pattern.cut.push_back(cut);
    pattern.dots.push_back(dots);
  }
  return pattern;
}

}  // namespace raywave
