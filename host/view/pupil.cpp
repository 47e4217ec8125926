// SPDX-License-Identifier: Apache-2.0
#include "host/view/pupil.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host/common/error.hpp"
#include "host/common/fft_backend.hpp"
#include "host/common/plane_fft.hpp"
#include "host/common/text.hpp"
#include "host/scene/units.hpp"

namespace raywave {

/// One axis of the transforms. Samples count from the hologram's first one; the margin lies behind
/// its last, and from the end backwards.
struct PupilAxis {
  int hologram = 1, margin = 0;
  int samples = 1;                          // transformed, on the hologram's pitch
  int finer = 1;                            // samples of the light to the pupil for one of them
  double pitch_m = 1, place_pitch_m = 1;    // in the pupil's plane
  std::vector<std::complex<double>> curve;  // exp(i pi a x^2 / (lambda b))

  int size() const { return hologram + 2 * margin; }
  int all() const { return samples * finer; }
  /// Of number i of n, counted from zero and, past their middle, backwards.
  static int signed_index(int i, int n) { return i < (n + 1) / 2 ? i : i - n; }
};

namespace {

using Samples = std::vector<std::complex<float>>;

/// Widths lambda b / pupil of a point's image around the hologram that are kept: 0.6 % of the light
/// of a point at its edge falls beyond.
constexpr double margin = 8;

/// Fresnel's integral moves the pupil's edge by this share of the pupil at most.
constexpr double most_moved = 0.05;

PupilAxis axis_of(const HologramSpec& hologram, const Pupil& pupil, int axis) {
  PupilAxis of;
  of.hologram = hologram.resolution[axis];
  of.pitch_m = hologram.pitch_m[axis];
  const double eyebox_m = pupil.eyebox_m(hologram)[axis],
               blur_m = hologram.wavelength_m * std::abs(pupil.b_m) / pupil.diameter_m,
               wide = margin * blur_m / of.pitch_m;
  if (!(of.hologram + 2 * wide < 65536))
    throw InputError("pupil: one of " + length_text(pupil.diameter_m) + " blurs points over " +
                     length_text(blur_m) + " of the hologram; give a larger one");
  of.margin = static_cast<int>(std::ceil(wide));
  of.samples = static_cast<int>(next_fast_size(static_cast<std::size_t>(of.size())));
  // Light of a place x lands on the pupil's plane around a x, as wide as the eyebox; sampled more
  // finely, nothing wraps around onto the pupil
  const double half_m = of.hologram * of.pitch_m / 2, aside_m = std::abs(pupil.a) * half_m,
               reach_m = std::min(std::abs(pupil.centre_m[axis]) + pupil.diameter_m / 2,
                                  aside_m + eyebox_m / 2);
  of.finer = static_cast<int>(std::ceil((aside_m + reach_m) / eyebox_m + 0.5 - 1e-9));
  of.place_pitch_m = eyebox_m / of.samples;
  const double turns = pupil.a / (2 * hologram.wavelength_m * pupil.b_m);
  for (int i = 0; i < of.all(); ++i) {
    // The middle of the hologram is between the ends of its samples
    const int from_first = i < (of.hologram + of.margin) * of.finer ? i : i - of.all();
    const double x_m =
        (static_cast<double>(from_first) / of.finer - (of.hologram - 1) / 2.0) * of.pitch_m;
    of.curve.push_back(
        std::polar(1.0, 2 * std::numbers::pi * std::remainder(turns * x_m * x_m, 1.0)));
  }
  return of;
}

void require_fresnel(const HologramSpec& hologram, const Pupil& pupil) {
  for (int axis = 0; axis < 2; ++axis) {
    const double half_m = hologram.resolution[axis] * hologram.pitch_m[axis] / 2,
                 steepest = std::min(hologram.wavelength_m / (2 * hologram.pitch_m[axis]),
                                     (std::abs(pupil.a) * half_m + std::abs(pupil.centre_m[axis]) +
                                      pupil.diameter_m / 2) /
                                         std::abs(pupil.b_m));
    // b (tan - sin) of the steepest light
    if (const double moved_m = std::abs(pupil.b_m) * steepest * steepest * steepest / 2;
        !(moved_m < most_moved * pupil.diameter_m))
      throw InputError("pupil: light to it is as steep as " +
                       number_text(std::round(1000 * steepest) / 1000) +
                       ", where Fresnel's integral moves its edge by " + length_text(moved_m) +
                       "; place it farther away, or nearer to the axis");
  }
}

}  // namespace

struct PupilFilter::Work {
  PupilAxis x, y;
  Pupil pupil;
  PlaneFft coarse, fine;
  Lines plane;

  Work(const HologramSpec& hologram, const Pupil& of)
      : x(axis_of(hologram, of, 0)),
        y(axis_of(hologram, of, 1)),
        pupil(of),
        coarse(static_cast<std::size_t>(x.samples), static_cast<std::size_t>(y.samples),
               static_cast<std::size_t>(x.all())),
        fine(static_cast<std::size_t>(x.all()), static_cast<std::size_t>(y.all())),
        plane(make_lines(std::size_t{1} * x.all() * y.all(), "light in the pupil's plane")) {}

  bool is_finer() const { return x.finer > 1 || y.finer > 1; }
  std::complex<float>& at(int i, int j) { return plane[std::size_t{1} * j * x.all() + i]; }

  static PlanePart whole(int nx, int ny) {
    return {{0, static_cast<std::size_t>(nx)}, {0, static_cast<std::size_t>(ny)}};
  }
  PlanePart all() const { return whole(x.all(), y.all()); }

  /// Samples between those of the hologram: its spectrum with zeros around it.
  void refine() {
    const auto own = whole(x.samples, y.samples);
    coarse.forward(plane.get(), whole(x.hologram, y.hologram), own);
    for (int j = y.all() - 1; j >= 0; --j) {
      const int v = PupilAxis::signed_index(j, y.all());
      const bool has_row = -(y.samples / 2) <= v && v < (y.samples + 1) / 2;
      const int from = v < 0 ? v + y.samples : v;
      for (int i = x.all() - 1; i >= 0; --i) {
        const int u = PupilAxis::signed_index(i, x.all());
        const bool is_own = has_row && -(x.samples / 2) <= u && u < (x.samples + 1) / 2;
        at(i, j) = is_own ? at(u < 0 ? u + x.samples : u, from) : 0;
      }
    }
    fine.inverse(plane.get(), all(), all());
  }

  void stop() {
    // Rows count downwards; light of a negative b crosses the axis
    const double side = pupil.b_m > 0 ? 1 : -1, scale = 1.0 / x.all() / y.all();
    for (int j = 0; j < y.all(); ++j) {
      const double y_m = -side * PupilAxis::signed_index(j, y.all()) * y.place_pitch_m;
      for (int i = 0; i < x.all(); ++i) {
        const double x_m = side * PupilAxis::signed_index(i, x.all()) * x.place_pitch_m;
        at(i, j) *= static_cast<float>(
            scale * open_share(pupil, {x_m, y_m}, {x.place_pitch_m, y.place_pitch_m}));
      }
    }
  }

  /// scale  of the samples besides
  void bend(int nx, int ny, bool back, double scale) {
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        const auto turn =
            x.curve[static_cast<std::size_t>(i)] * y.curve[static_cast<std::size_t>(j)];
        at(i, j) = std::complex<float>(std::complex<double>(at(i, j)) * scale *
                                       (back ? std::conj(turn) : turn));
      }
  }
};

PupilFilter::PupilFilter(const HologramSpec& hologram, const Pupil& pupil) {
  require_fresnel(hologram, pupil);
  work_ = std::make_unique<Work>(hologram, pupil);
}
PupilFilter::~PupilFilter() = default;

glm::ivec2 PupilFilter::size() const { return {work_->x.size(), work_->y.size()}; }

Samples PupilFilter::operator()(const Samples& field) {
  auto& work = *work_;
  const auto &x = work.x, &y = work.y;
  std::fill_n(work.plane.get(), std::size_t{1} * x.all() * y.all(), std::complex<float>(0));
  for (int j = 0; j < y.hologram; ++j)
    for (int i = 0; i < x.hologram; ++i) work.at(i, j) = field[std::size_t{1} * j * x.hologram + i];
  const bool is_bent = work.pupil.a != 0;
  if (work.is_finer()) {
    work.refine();
    work.bend(x.all(), y.all(), false, 1.0 / x.samples / y.samples);
  } else if (is_bent) {
    work.bend(x.hologram, y.hologram, false, 1);
  }
  work.fine.forward(work.plane.get(),
                    work.is_finer() ? work.all() : Work::whole(x.hologram, y.hologram), work.all());
  work.stop();
  work.fine.inverse(work.plane.get(), work.all(), work.all());
  if (is_bent) work.bend(x.all(), y.all(), true, 1);
  Samples passed;
  passed.reserve(std::size_t{1} * x.size() * y.size());
  const auto place = [](const PupilAxis& axis, int i) {
    return ((i - axis.margin + axis.samples) % axis.samples) * axis.finer;
  };
  for (int j = 0; j < y.size(); ++j)
    for (int i = 0; i < x.size(); ++i) passed.push_back(work.at(place(x, i), place(y, j)));
  return passed;
}

double open_share(const Pupil& pupil, glm::dvec2 at_m, glm::dvec2 step_m) {
  const auto from_m = at_m - pupil.centre_m;
  const double away_m = std::hypot(from_m.x, from_m.y);
  if (away_m == 0) return 1;
  const double wide_m = std::hypot(from_m.x / away_m * step_m.x, from_m.y / away_m * step_m.y);
  return std::clamp(0.5 + (pupil.diameter_m / 2 - away_m) / wide_m, 0.0, 1.0);
}

std::vector<std::optional<Pupil>> pupils_asked(const std::vector<std::string>& given,
                                               const ViewerSpec& viewer, Frame frame, bool is_part,
                                               const std::string& what) {
  std::vector<std::optional<Pupil>> all;
  const auto add_all = [&](const ViewerSpec& of) {
    for (const auto& pupil : pupils_of(of)) all.emplace_back(pupil);
  };
  for (const auto& text : given) {
    const auto at = text.find('@');
    const auto size = text.substr(0, at);
    auto one = viewer;
    if (size != "scene" && size != "none") {
      one.pupil_m = given_length_m(size, what);
      if (!(one.pupil_m > 0)) throw InputError(what + " " + in_quotes(text) + ": must be > 0");
      one.pupil_places_m.clear();
    }
    if (at != std::string::npos) {
      const auto comma = text.find(',', at);
      if (comma == std::string::npos)
        throw InputError(what + " " + in_quotes(text) + ": a place has two parts, 3mm@1mm,0");
      const glm::dvec2 place_m(given_length_m(text.substr(at + 1, comma - at - 1), what),
                               given_length_m(text.substr(comma + 1), what));
      one.pupil_places_m = {in_frame(place_m, frame)};
    }
    size == "none" ? void(all.emplace_back()) : add_all(one);
  }
  if (given.empty() && viewer.eyepiece_m && !is_part) add_all(viewer);
  if (all.empty()) all.emplace_back();
  return all;
}

}  // namespace raywave
