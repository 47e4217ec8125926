// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/picture_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/vector_relational.hpp>
#include <numbers>
#include <numeric>

#include "host/forecast/eye.hpp"
#include "host/forecast/slm_light.hpp"
#include "host/plan/key_places.hpp"
#include "host/plan/lattice.hpp"
#include "host/planning/light_shown.hpp"

namespace raywave {
namespace {

using std::numbers::pi;

/// Fitted to the demo scenes (scripts/fit, docs/planning.md): what the formulas below leave out.
constexpr double speckle_factor = 0.9;
// Some waves are cut off hard whatever the cone: by the pixels' reach, by an occluder
constexpr double cut_factor = 0.28;
constexpr double edge_factor = 6.3e-4;
constexpr double spot_factor = 9e-3;
constexpr double cell_factor = 3.2e-4;  // 3.6e-4 fitted, before cells of fine meshes averaged them
constexpr double background = 0.3;
// A surface ends where the next cell lies so many cells deeper; what a step of its pattern weighs
// over one at its end
constexpr double end_in_cells = 6, step_of_pattern = 0.5;

/// Error of refined pictures: of their light, of light that cannot be shown, and of what a cell's
/// one sample misses at edges; for 6 depths and 1 frame. Light, over powers of the spots that a
/// blur holds: where these are few, phases have too little freedom for all depths. Scenes on a
/// third of the hologram are within 2.5 dB; those of all of it have 2 dB less to 9 more.
constexpr double refined_light = 0.017, refined_missing = 0.04, refined_edges = 0.19;
/// What stays of the field's error at edges, at depths between those refined towards, however many
/// frames and iterations; between the teapot (0.15) and the study (0.05), in 4 and 16 frames.
constexpr double left_of_edges = 0.1;
/// What n iterations towards pictures made of samples leave of the error of phases: paced_rest +
/// paced_first / n^paced_power, more where parts and depths contradict each other, less where
/// frames mend what others leave. Fitted to six demo scenes on two panels at 1 to 16 frames.
constexpr double paced_rest = 0.095, paced_first = 0.39, paced_power = 1.3;
constexpr double paced_parts = 0.09, paced_depth = 0.038, paced_frames = 0.37;
constexpr double refined_by_grain = 0.75, refined_crowded = 25, crowded_by_grain = 3.2,
                 refined_by_depths = 1.2, refined_by_frames = 1.0, refined_by_rounds = 0.5;

/// Light that a stop cuts off is missing unevenly: mean square over that of the picture, for each
/// share of light cut off. Fitted to two scenes behind three stops, within 3 dB.
constexpr double stop_factor = 0.14;

/// What an encoding adds to the light of the field: a haze about the picture, and grain where it
/// interferes with the picture. Mean squares over that of the picture, fitted like the others.
/// `copies` is the light of copies of the picture around the band's corners, over that of the
/// picture; fitted to eleven scenes on two panels, within 1.6 dB.
struct EncodingNoise {
  double haze = 0, grain = 0, copies = 0;
};

/// What double phase throws around the band's corners is wider than the picture and fades towards
/// it; what unlit pixels throw lies everywhere. Mean of the haze over that of the picture,
/// fitted to 19 pictures on two panels: levels within 3.1 dB, 14 of them within 2.
///
/// spread     mean of |x| + |y| from the picture's middle, by brightness, over what pixels show
/// share_lit  of the hologram
double haze_of_spread(double spread, double share_lit) {
  return std::clamp(0.018 * std::exp(30 * (spread - 0.124)) + 0.165 * (1 - share_lit), 0.009, 0.2);
}

/// The same near the hologram, where a point has light of all directions: mean squares.
double haze_near_hologram(double band_filled) {
  return std::clamp(0.06 * (band_filled - 0.33), 0.001, 0.016);
}

EncodingNoise noise_of(Encoding encoding, const PictureRow& row) {
  if (encoding == Encoding::phase) return {6.2e-3, 0.25};
  return {row.haze, 0.06, 1.1};
}

/// Mean square of all the light that double phase throws aside, over that of white: dark pixels do
/// most of it. Fitted, with the reaches between which a pupil comes to see it, to a teapot through
/// pupils of 1.6 to 3.2 mm, within 2.5 dB.
constexpr double haze_in_pupil = 0.0045, haze_begins = 0.365, haze_is_whole = 0.45;

/// The same of refined phases, for each band that a pupil reaches farther, and the share of the
/// SLM's light that one sees over the picture that reaches beyond the band's edges, but not its
/// corners. Fitted to a coin and a teapot through pupils of 1.2 to 3.8 mm, within 2.5 dB.
constexpr double refined_haze = 0.016, refined_haze_begins = 0.27, seen_beyond_edges = 0.23;

/// Share of the error of phases that refinement at the pace of frames leaves.
double left_by(const Pace& pace, int frames) {
  if (pace.iterations == 0) return 1;
  const double left = paced_rest + paced_first / std::pow(pace.iterations, paced_power);
  return std::min(1.0, left *
                           (1 + paced_parts * pace.parts + paced_depth * pace.depth * pace.depth) /
                           std::pow(frames, paced_frames));
}

using Raster = std::vector<float>;

/// Side of the view's cells at a depth.
double cell_m(const FrontView& view, double z_m) {
  return view.step * std::abs(z_m - view.eye_z_m);
}

/// Mean over a box of 2 half + 1 cells (a fraction of the outermost ones), along both axes; what
/// lies outside is dark.
void blur_box(Raster& raster, glm::ivec2 size, glm::dvec2 half) {
  constexpr int block = 16;  // lines side by side: columns of a raster share lines of memory
  for (int axis = 0; axis < 2; ++axis) {
    if (half[axis] <= 0) continue;
    const int n = size[axis], stride = axis == 0 ? 1 : size.x, lines = size[1 - axis],
              next = axis == 0 ? size.x : 1;
    const int whole = static_cast<int>(std::min(half[axis], 1.0 * n)), margin = whole + 1;
    const double part = half[axis] - std::floor(half[axis]), weight = 1 / (2 * half[axis] + 1);
    // Sums of the cells before each one; those in the margins are dark
    std::vector<std::array<double, block>> sums(static_cast<std::size_t>(n + 2 * margin + 1));
    for (int first = 0; first < lines; first += block) {
      const int count = std::min(block, lines - first);
      float* const cells = raster.data() + std::ptrdiff_t{first} * next;
      auto* const before = sums.data() + margin;
      for (int i = 0; i < n; ++i)
        for (int k = 0; k < count; ++k)
          before[i + 1][k] = before[i][k] + cells[std::ptrdiff_t{i} * stride + k * next];
      std::fill(before + n + 1, before + n + margin + 1, before[n]);
      for (int i = 0; i < n; ++i) {
        const auto* const at = before + i;
        for (int k = 0; k < count; ++k) {
          const double inner = at[whole + 1][k] - at[-whole][k],
                       ends =
                           at[-whole][k] - at[-whole - 1][k] + at[whole + 2][k] - at[whole + 1][k];
          cells[std::ptrdiff_t{i} * stride + k * next] =
              static_cast<float>((inner + part * ends) * weight);
        }
      }
    }
  }
}

/// Three boxes of the Gaussian's variance.
void blur_gaussian(Raster& raster, glm::ivec2 size, double sigma) {
  const double half = (std::sqrt(4 * sigma * sigma + 1) - 1) / 2;
  for (int i = 0; i < 3; ++i) blur_box(raster, size, glm::dvec2(half));
}

/// The picture that a lens of the hologram's size, focused on z_m, makes of the front view's cells.
/// Every depth is blurred on its own; occlusion is that of the front view.
///
/// layers  filled with what lies where, unless null
Raster lens_view(const FrontView& view, const Raster& radiance, const Plan& plan, double z_m,
                 std::vector<PictureLayer>* layers = nullptr) {
  constexpr int count = 12;
  const double wavelength_m = plan.hologram.wavelength_m;
  const double span = std::max(plan.extent.far_m - plan.extent.near_m, 1e-12);
  Raster sum(radiance.size(), 0);
  std::vector<Raster> seen;
  for (int layer = 0; layer < count; ++layer) {
    Raster one(radiance.size(), 0);
    bool any = false;
    for (std::size_t i = 0; i < one.size(); ++i) {
      if (view.depth_m[i] == 0) continue;
      const auto at = static_cast<int>((static_cast<double>(view.depth_m[i]) - plan.extent.near_m) /
                                       span * count);
      if (std::clamp(at, 0, count - 1) != layer) continue;
      one[i] = radiance[i];
      any = true;
    }
    if (!any) continue;
    double depth =
        plan.extent.near_m + (layer + 0.5) / count * (plan.extent.far_m - plan.extent.near_m);
    if (std::abs(depth) < plan.extent.closest_m)
      depth = std::copysign(plan.extent.closest_m, depth);
    const double away_m = std::abs(depth - z_m);
    const auto open = wavelength_m / limit_m(plan, z_m);  // tangents
    blur_box(one, view.size, open * (away_m / 2 / cell_m(view, depth)));
    for (std::size_t i = 0; i < one.size(); ++i) sum[i] += one[i];
    if (!layers) continue;
    layers->push_back({open * away_m / limit_m(plan, depth)});
    seen.push_back(std::move(one));
  }
  if (!layers) return sum;
  const double all = std::inner_product(sum.begin(), sum.end(), sum.begin(), 0.0);
  for (std::size_t i = 0; i < seen.size() && all > 0; ++i)
    (*layers)[i].share = std::inner_product(seen[i].begin(), seen[i].end(), sum.begin(), 0.0) / all;
  return sum;
}

/// Light that a cone lets through, up to each place of the hologram.
class LightOfCone {
public:
  explicit LightOfCone(const Cone& cone) {
    for (std::size_t i = 0; i + 1 < sums_.size(); ++i) {
      const double passed = cone.passed((static_cast<double>(i) + 0.5) / places * 2 - 1);
      sums_[i + 1] = sums_[i] + passed * passed;
    }
  }

  /// Share between two places, in half holograms.
  double between(double low, double high) const {
    return high > low && sums_.back() > 0 ? (up_to(high) - up_to(low)) / sums_.back() : 0;
  }

private:
  static constexpr std::size_t places = 512;

  double up_to(double at) const {
    const double place = std::clamp((at + 1) / 2, 0.0, 1.0) * places;
    const auto i = std::min(static_cast<std::size_t>(place), places - 1);
    return sums_[i] + (place - static_cast<double>(i)) * (sums_[i + 1] - sums_[i]);
  }

  std::array<double, places + 1> sums_{};
};

/// The cells' radiance times what a place shows of it.
///
/// share  of a place x, y, z
Raster radiance_times(const FrontView& view, const auto& share) {
  Raster shown(view.radiance);
  for (int y = 0; y < view.size.y; ++y) {
    for (int x = 0; x < view.size.x; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(view.size.x) +
                     static_cast<std::size_t>(x);
      const double z_m = view.depth_m[i];
      if (z_m != 0) shown[i] *= static_cast<float>(share(view.place_m(x, y, z_m), z_m));
    }
  }
  return shown;
}

/// The part of the cells' radiance that hologram and WRPs show.
Raster radiance_shown(const FrontView& view, const Plan& plan) {
  const LightOfCone light(plan.cone);
  const auto half = glm::dvec2(plan.hologram.size) * plan.hologram.pitch_m / 2.0;
  return radiance_times(view, [&](glm::dvec2 at, double z) {
    double share = 1;
    for (int axis = 0; axis < 2; ++axis) {
      const auto [low, high] = part_seen(plan, axis, at[axis], z);
      share *= light.between(low / half[axis], high / half[axis]);
    }
    return share;
  });
}

/// The cells' radiance as pixels of slm.fill weaken it.
Raster radiance_fallen(const FrontView& view, const Plan& plan) {
  return radiance_times(view, [&](glm::dvec2 at, double z) { return fall_off(plan, at, z); });
}

/// Light on the hologram as phases alone show it: as bright where few surfaces light it as where
/// many do.
class EvenedLight {
public:
  EvenedLight(const FrontView& view, const Plan& plan)
      : plan_(plan), half_m_(glm::dvec2(plan.hologram.size) * plan.hologram.pitch_m / 2.0) {
    constexpr double most_looks = 1e4;
    std::array<std::array<double, places>, places> light{};
    const int step =
        std::max(1, static_cast<int>(std::sqrt(view.size.x * view.size.y / most_looks)));
    for (int y = step / 2; y < view.size.y; y += step) {
      for (int x = step / 2; x < view.size.x; x += step) {
        const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(view.size.x) +
                       static_cast<std::size_t>(x);
        const double z_m = view.depth_m[i];
        if (z_m == 0) continue;
        const auto [across, down] = lit(view.place_m(x, y, z_m), z_m);
        for (auto u = across.first; u < across.second; ++u)
          for (auto v = down.first; v < down.second; ++v) light[u][v] += double{view.radiance[i]};
      }
    }
    double sum = 0, squares = 0;
    for (const auto& column : light) {
      sum += std::accumulate(column.begin(), column.end(), 0.0);
      squares += std::inner_product(column.begin(), column.end(), column.begin(), 0.0);
    }
    if (squares > 0) lit_ = sum * sum / (squares * places * places);
    for (std::size_t u = 0; u < places; ++u)
      for (std::size_t v = 0; v < places; ++v)
        sums_[u + 1][v + 1] = sums_[u][v + 1] + sums_[u + 1][v] - sums_[u][v] +
                              (light[u][v] > 0 ? 1 / light[u][v] : 0);
  }

  /// Share of the hologram that is lit, as if evenly.
  double share_lit() const { return lit_; }

  /// How bright a place is, over its radiance.
  double of(glm::dvec2 at_m, double z_m) const {
    const auto [u, v] = lit(at_m, z_m);
    return sums_[u.second][v.second] - sums_[u.first][v.second] - sums_[u.second][v.first] +
           sums_[u.first][v.first];
  }

private:
  static constexpr std::size_t places = 32;  // of the hologram, along each axis

  /// Of the places that light reaches, the first and the one after the last, by axis.
  std::array<std::pair<std::size_t, std::size_t>, 2> lit(glm::dvec2 at_m, double z_m) const {
    std::array<std::pair<std::size_t, std::size_t>, 2> ends;
    for (int axis = 0; axis < 2; ++axis) {
      const auto place = [&](double to_m) {
        const double share = std::clamp((to_m / half_m_[axis] + 1) / 2, 0.0, 1.0);
        return static_cast<std::size_t>(std::lround(share * places));
      };
      const auto [low, high] = part_seen(plan_, axis, at_m[axis], z_m);
      ends[static_cast<std::size_t>(axis)] = {place(low), place(std::max(low, high))};
    }
    return ends;
  }

  const Plan& plan_;
  glm::dvec2 half_m_;
  double lit_ = 1;
  std::array<std::array<double, places + 1>, places + 1> sums_{};  // before each place
};

/// Light of copies, over that where all of the hologram is lit. What is lit alone is shown up to
/// its own brightness: brighter pixels leave the checkerboard less.
double copies_of_lit(double share_lit) {
  constexpr double shown = 0.36, most = 0.85;  // mean square of amplitudes, over the clip's
  const auto left = [](double squares) { return 1 / squares - 1; };
  return left(std::min(shown / share_lit, most)) / left(shown);
}

PictureRow row_of(const FrontView& view, const Raster& radiance_shown,
                  const Raster& radiance_fallen, const Raster& radiance_evened, const Plan& plan,
                  const PictureWindow& window, double z_m, double blur_m, const Raster& steps,
                  double share_lit) {
  PictureRow row;
  row.z_m = z_m;
  row.spot_m = limit_m(plan, z_m);
  // Light that an encoding throws aside has not left the picture there
  const auto aside = glm::abs(z_m) * plan.hologram.largest_sine / plan.window_m();
  if (is_near_hologram(plan)) row.unshown = std::max(0.0, 1 - aside.x) * std::max(0.0, 1 - aside.y);
  row.pitch = std::abs(z_m - view.eye_z_m) / plan.lattice.full_z_m;
  const double side_m = cell_m(view, z_m);
  const auto sharp = lens_view(view, view.radiance, plan, z_m, &row.layers);
  auto lens = sharp;
  blur_gaussian(lens, view.size, blur_m / side_m);
  const auto picture_of = [&](const Raster& radiance) {
    if (radiance == view.radiance) return lens;
    auto picture = lens_view(view, radiance, plan, z_m);
    blur_gaussian(picture, view.size, blur_m / side_m);
    return picture;
  };
  const auto shown = picture_of(radiance_shown), fallen = picture_of(radiance_fallen),
             evened = picture_of(radiance_evened);
  const auto border = static_cast<double>(picture_border_px) * plan.hologram.pitch_m;
  const auto low_m = window.low_m + border, high_m = window.high_m - border,
             size_m = high_m - low_m;
  double peak = 0, light = 0, ll = 0, ls = 0, ss = 0, lf = 0, ff = 0, le = 0, ee = 0,
         before_blur = 0, edges = 0, copies = 0, on_picture = 0, spread = 0, light_seen = 0;
  glm::dvec2 centre_m(0);
  // The checkerboard throws copies around the corners of the band. Each corner has the part of the
  // hologram whose light goes the other way.
  const auto corner_m = std::abs(z_m) * plan.hologram.largest_sine;
  const auto light_at = [&](glm::dvec2 place_m) {
    const auto at = (place_m / (z_m - view.eye_z_m) - view.low) / view.step;
    if (glm::any(glm::lessThan(at, glm::dvec2(0))) ||
        glm::any(glm::greaterThanEqual(at, glm::dvec2(view.size))))
      return 0.0;
    return double{lens[static_cast<std::size_t>(at.y) * static_cast<std::size_t>(view.size.x) +
                       static_cast<std::size_t>(at.x)]};
  };
  const auto copied = [&](glm::dvec2 place_m) {
    double sum = 0;
    for (const glm::dvec2 side : {glm::dvec2(1, 1), {1, -1}, {-1, 1}, {-1, -1}}) {
      const auto from_m = place_m + side * corner_m;
      double part = light_at(from_m);
      for (int axis = 0; part > 0 && axis < 2; ++axis) {
        const auto [low, high] = part_seen(plan, axis, from_m[axis], z_m);
        const double middle = std::clamp(from_m[axis], low, std::max(low, high));
        part *= high > low ? (side[axis] > 0 ? middle - low : high - middle) / (high - low) : 0;
      }
      sum += part;
    }
    return sum;
  };
  for (int y = 0; y < view.size.y; ++y) {
    for (int x = 0; x < view.size.x; ++x) {
      const auto place_m = view.place_m(x, y, z_m);
      if (glm::any(glm::lessThan(place_m, low_m)) || glm::any(glm::greaterThan(place_m, high_m)))
        continue;
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(view.size.x) +
                     static_cast<std::size_t>(x);
      const double l = lens[i], s = shown[i], f = fallen[i], e = evened[i];
      peak = std::max(peak, l);
      light += l;
      centre_m += l * place_m;
      ll += l * l;
      ls += l * s;
      ss += s * s;
      lf += l * f;
      ff += f * f;
      le += l * e;
      ee += e * e;
      before_blur += double{sharp[i]} * double{sharp[i]};
      edges += double{steps[i]};
    }
  }
  if (peak == 0) return row;
  centre_m /= light;
  constexpr int looks = 128;
  for (int i = 0; !is_near_hologram(plan) && i < looks * looks; ++i) {
    const auto at_m = low_m + size_m * (glm::dvec2(i % looks, i / looks) + 0.5) / double(looks);
    const double here = light_at(at_m);
    const auto bands = glm::abs(at_m - centre_m) / (2.0 * corner_m);
    light_seen += here;
    spread += here * (bands.x + bands.y);
    if (plan.slm.encoding != Encoding::double_phase) continue;
    const double copy = copied(at_m);  // lies beyond the scene, too
    copies += copy * copy;
    on_picture += copy * here;
  }
  const double cells = size_m.x * size_m.y / (side_m * side_m), unit = 1 / (cells * peak * peak);
  row.mean = light / (cells * peak);
  row.light = ll * unit;
  row.haze = light_seen > 0 ? row.mean * row.mean / row.light *
                                  std::pow(haze_of_spread(spread / light_seen, share_lit), 2)
                            : haze_near_hologram(plan.hologram.band_filled);
  row.sharp = before_blur * unit;
  row.missing = ss > 0 ? std::max(0.0, ll - ls * ls / ss) * unit : row.light;
  row.fallen = ff > 0 ? std::max(0.0, ll - lf * lf / ff) * unit : row.light;
  row.uneven = ee > 0 ? std::max(0.0, ll - le * le / ee) * unit : row.light;
  row.copies = copies / (looks * looks * peak * peak);
  row.copies_on_picture = on_picture / (looks * looks * peak * peak);
  row.edges_m = edges * side_m / (size_m.x * size_m.y * peak * peak);
  return row;
}

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

void look_through(const std::vector<Pupil>& pupils, const Plan& plan, PictureModel& model) {
  const auto bands = plan.hologram.pitch_m / plan.hologram.wavelength_m;
  for (const auto& pupil : pupils) {
    auto reach = (glm::abs(pupil.centre_m) + pupil.diameter_m / 2) / std::abs(pupil.b_m) * bands;
    if (const auto& stop = plan.slm.stop)
      reach = glm::min(reach, glm::abs(stop->centre) + stop->size / 2.0);
    model.pupil_reach = std::max({model.pupil_reach, reach.x, reach.y});
    model.sees_band = model.sees_band || sees_band(pupil, plan);
  }
}

void set_refinement(PictureModel& model, const Plan& plan) {
  if (!plan.refine) return;
  const auto& refine = *plan.refine;
  const double blur_m = refine.blur_m.value();
  model.pace = {};
  model.refined_depths = 0;
  if (refines_samples(plan)) {
    const auto parts = refine_parts(plan, blur_m, refine.viewer);
    model.pace = {planned_iterations(plan), parts.x * parts.y,
                  depth_over_held(plan, blur_m, refine.viewer)};
    return;
  }
  const auto places = planned_places(plan);
  for (const auto& place : places) model.refined_depths += place.aperture == glm::dvec2(1);
  const double needed = refine_iterations(places);
  // Four times as many lost 2 to 4 dB of a teapot and a coin, at depths between
  model.refined_rounds = std::min(1.0, refine.iterations.value_or(needed) / needed);
}

PictureModel picture_model(const FrontView& view, const Plan& plan, double resolution_m) {
  PictureModel model;
  model.resolution_m = resolution_m;
  model.cone = plan.cone;
  model.encoding = plan.slm.encoding;
  model.sees_band = glm::any(glm::greaterThan(
      plan.hologram.largest_sine, 0.499 * plan.hologram.wavelength_m / plan.hologram.pitch_m));
  // Phases alone show no brightness, whatever an eyepiece leaves of the band
  model.is_even = plan.slm.encoding == Encoding::phase && !plan.refine;
  const auto& lighting = plan.lighting;
  const auto shines = [&](const auto number) {
    return has_highlights(lighting.materials[static_cast<std::size_t>(number)], plan.channels());
  };
  model.has_detail =
      lighting.textures > 0 || std::any_of(lighting.used.begin(), lighting.used.end(), shines);
  if (plan.slm.stop) model.stopped = 1 - slm_light(plan, view).through_stop;
  set_refinement(model, plan);
  model.spot_m = limit_m(plan, middle_m(plan));
  Raster steps(view.radiance.size(), 0);  // squared, to the next cells right and below
  for (int y = 0; y < view.size.y; ++y) {
    for (int x = 0; x < view.size.x; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(view.size.x) +
                     static_cast<std::size_t>(x);
      const auto squared = [&](std::size_t next) {
        const double step = double{view.radiance[i]} - double{view.radiance[next]},
                     deep_m = std::abs(double{view.depth_m[i]} - double{view.depth_m[next]});
        // A surface's own pattern goes on in the cell; its end does not
        const bool goes_on = deep_m < end_in_cells * cell_m(view, double{view.depth_m[i]});
        return static_cast<float>(step * step * (goes_on ? step_of_pattern : 1));
      };
      if (x + 1 < view.size.x) steps[i] += squared(i + 1);
      if (y + 1 < view.size.y) steps[i] += squared(i + static_cast<std::size_t>(view.size.x));
    }
  }
  const EvenedLight light(view, plan);
  model.copies = copies_of_lit(light.share_lit());
  const auto shown = radiance_shown(view, plan), fallen = radiance_fallen(view, plan),
             evened =
                 radiance_times(view, [&](glm::dvec2 at, double z) { return light.of(at, z); });
  const double blur_m = blur_of_resolution * resolution_m;
  model.window = quality_window(plan, view, blur_m);
  for (const double z_m : quality_depths_m(plan))
    model.rows.push_back(row_of(view, shown, fallen, evened, plan, model.window, z_m, blur_m, steps,
                                light.share_lit()));
  return model;
}

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

double PicturePrediction::sure_db() const {
  // Refined pictures go by the light that there is: what is missing counts for more. Through pupils
  // of 1.6 to 4 mm a coin has 7 dB more to 6 less than predicted
  const double margin_db = refined ? 2.5 * (1 + missing) + (through_pupil ? 3.5 : 0) : 1;
  return std::min(mean_psnr_db - margin_db,
                  -10 * std::log10(std::pow(10, -mean_psnr_db / 10) + left_out));
}

PicturePrediction predict_pictures(const PictureModel& model, const LatticePattern& pattern,
                                   int frames, double padding_error) {
  PicturePrediction prediction;
  prediction.window = model.window;
  prediction.refined = model.refined_depths > 0 || model.pace.iterations > 0;
  prediction.through_pupil = model.pupil_reach > 0;
  // Pictures made by rays hold what samples miss
  prediction.left_out = model.refined_depths > 0 ? 0
                        : model.has_detail       ? 2e-4
                        : prediction.refined     ? 0
                                                 : 1e-4;
  prediction.dark = std::all_of(model.rows.begin(), model.rows.end(),
                                [](const auto& row) { return row.light == 0 && row.missing == 0; });
  const double blur_m = blur_of_resolution * model.resolution_m, p = pattern.pitch_m;
  const double spot2 = model.spot_m.x * model.spot_m.y;
  // Light that wraps around the padded plane: its own, spread over the picture, and where it
  // interferes with the picture.
  const double wrapped = std::min(1.0, padding_error * padding_error);
  // What few iterations leave of the errors that phases alone and the samples' interference make
  const double left = left_by(model.pace, frames);
  const auto encoding = model.pace.iterations > 0 ? Encoding::phase : model.encoding;
  const bool is_even = encoding == Encoding::phase;
  const bool throws_aside = !prediction.refined && model.encoding == Encoding::double_phase;
  const double haze_seen =
      throws_aside ? haze_in_pupil * std::clamp((model.pupil_reach - haze_begins) /
                                                    (haze_is_whole - haze_begins),
                                                0.0, 1.0)
      : prediction.refined
          ? refined_haze * std::clamp(model.pupil_reach - refined_haze_begins, 0.0, 0.5)
          : 0;
  // Refinement leaves light beyond a pupil, where there is such a place
  const double in_pupil = !prediction.refined       ? 0
                          : model.sees_band         ? 1
                          : model.pupil_reach > 0.5 ? seen_beyond_edges
                                                    : 0;
  const double grain = std::min(1.0, spot2 / (4 * pi * blur_m * blur_m));
  for (std::size_t i = 0; i < model.rows.size(); ++i) {
    const auto& row = model.rows[i];
    const double dots_here = row.light * std::min(pattern.dots[i], 4.0);
    const double speckle_here =
        row.sharp * (speckle_factor * pattern.speckle[i] + cut_factor * pattern.cut[i]) / frames;
    const double cells_at_edges = row.edges_m * edge_factor * std::pow(p, 4) / std::pow(blur_m, 3);
    const double edges_here = cells_at_edges + row.edges_m * spot_factor * spot2 / blur_m +
                              cell_factor * row.light * p / blur_m;
    const double padding_here = row.light * wrapped * (background * wrapped + 2 * grain / frames);
    const double field = dots_here + speckle_here + edges_here + row.missing + padding_here;
    // A haze all over the picture is partly taken for the picture, whose brightness is free.
    const double flat = row.light > 0 ? std::min(1.0, row.mean * row.mean / row.light) : 1;
    const auto noise = noise_of(encoding, row);
    // Copies make the picture brighter, which is free, and the rest of them is an error
    const double copies = noise.copies * model.copies,
                 brighter = row.light + copies * row.copies_on_picture,
                 squares = brighter + copies * (row.copies_on_picture + copies * row.copies),
                 copies_here = row.light > 0 ? row.light - brighter * brighter / squares : 0;
    const bool is_unshown = model.is_even || (model.sees_band && !prediction.refined);
    const double encoding_here =
        row.light * (std::max(noise.haze, is_unshown ? row.unshown : 0) * (1 - flat) +
                     noise.grain * grain / frames) +
        (is_even ? std::max(0.0, row.uneven - row.missing) : 0) + copies_here;
    const auto decibels = [](double error) { return error > 0 ? -10 * std::log10(error) : 200; };
    const double rows = static_cast<double>(model.rows.size());
    // Frames and iterations mend the light alone: what was not sampled, or is too steep, stays
    const double by_depths = std::pow(model.refined_depths / 6.0, refined_by_depths),
                 by_rounds = std::pow(frames, refined_by_frames) *
                             std::pow(model.refined_rounds, refined_by_rounds);
    // Refinement knows it, and mends half (tests/refine/showing.cpp)
    const double fallen_here = row.fallen * (prediction.refined ? 0.5 : 1);
    const double stop_here = stop_factor * row.light * model.stopped;
    const bool is_refined = model.refined_depths > 0;
    // Whatever resembles nothing is matched by a dark picture, for brightness is free
    const auto psnr = [&](double error) {
      return decibels(std::min(row.light > 0 ? row.light : 1.0, error));
    };
    prediction.field_psnr_db += psnr(field) / rows;
    const double light_of_grain = refined_light * std::pow(grain, refined_by_grain) +
                                  refined_crowded * std::pow(grain, crowded_by_grain);
    // Refined phases have errors of their own: of light, where light is missing, at edges
    const double of_phases =
        haze_seen + row.light * in_pupil * row.unshown * (1 - flat) +
        (is_refined ? by_depths / by_rounds * light_of_grain * row.light : left * encoding_here);
    const double missing_here = row.missing * (is_refined ? by_depths * refined_missing : 1);
    const double at_edges =
        is_refined ? by_depths * refined_edges * cells_at_edges + left_of_edges * edges_here
                   : edges_here;
    const double of_samples = is_refined ? 0 : left * (dots_here + speckle_here) + padding_here;
    prediction.psnr_db.push_back(
        psnr(of_phases + missing_here + at_edges + of_samples + stop_here + fallen_here));
    prediction.mean_psnr_db += prediction.psnr_db.back() / rows;
    prediction.encoding += of_phases;
    prediction.stop += stop_here;
    prediction.fall_off += fallen_here;
    prediction.edges += at_edges;
    prediction.missing += missing_here;
    if (is_refined) continue;
    prediction.dots += left * dots_here;
    prediction.speckle += left * speckle_here;
    prediction.padding += padding_here;
  }
  const double all = prediction.dots + prediction.speckle + prediction.edges + prediction.missing +
                     prediction.padding + prediction.encoding + prediction.stop +
                     prediction.fall_off;
  for (double* part :
       {&prediction.dots, &prediction.speckle, &prediction.edges, &prediction.missing,
        &prediction.padding, &prediction.encoding, &prediction.stop, &prediction.fall_off})
    *part /= std::max(all, 1e-300);
  return prediction;
}

}  // namespace raywave
