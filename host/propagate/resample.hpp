// SPDX-License-Identifier: Apache-2.0
/// A propagated field at points of another pitch: finer, coarser, or in a wider window.
#pragma once

#include <complex>
#include <functional>
#include <glm/vec2.hpp>
#include <vector>

namespace raywave {

/// Points in rows, row 0 on top, about a centre relative to the source's (x right, y up).
struct PointGrid {
  glm::ivec2 size{1, 1};
  glm::dvec2 pitch_m{1, 1};
  glm::dvec2 centre_m{0, 0};
};

/// The source's own pitch and size take one propagation, as it is. For others, the field is taken
/// on four grids of the source's pitch, half a pitch apart, whose samples hold twice its band, and
/// a sinc with a Kaiser window interpolates. The grids reach beyond the points by half of the sinc,
/// so that no edge of a window counts. Points farther apart than a window of the source's size are
/// covered by several windows, side by side.
///
/// accuracy  relative L2 error of the interpolation, measured: 3e-11
class Resampler {
public:
  /// size, pitch_m  of the source
  /// throws  InputError when the points need more than 4096 windows
  Resampler(glm::ivec2 size, glm::dvec2 pitch_m, const PointGrid& points);

  glm::ivec2 points() const { return points_.size; }
  /// Samples of the grids: the source's, and a margin.
  glm::ivec2 grid_size() const { return size_ + 2 * margin_; }
  /// Of the grids, relative to the source's.
  std::vector<glm::dvec2> centres_m() const;
  /// The source with its margin, which is dark.
  template <class Complex>
  std::vector<Complex> padded(const Complex* source) const;

  /// The field at the points.
  ///
  /// arrived  samples of the grid that is centred there; none where no light gets to
  template <class Complex>
  std::vector<Complex> at_points(
      const std::function<std::vector<Complex>(glm::dvec2 centre_m)>& arrived) const;

private:
  /// Some columns or rows of the points.
  struct Part {
    int first = 0, count = 0;
    double centre = 0;  // of these points, in points from that of all
  };
  static std::vector<Part> parts_of(int points, double pitch_m, double window_m);
  struct Weights;
  /// Of `count` points, point_pitch_m apart, along one axis of a grid of so many samples.
  ///
  /// half  of a pitch on that the grid lies
  static Weights weights_of(int count, double point_pitch_m, int grid, double pitch_m, int half);
  glm::dvec2 centre_m(const Part& columns, const Part& rows, glm::ivec2 half) const;

  glm::ivec2 size_;
  glm::dvec2 pitch_m_;
  PointGrid points_;
  int margin_ = 0;                  // samples on each side
  std::vector<glm::ivec2> halves_;  // of pitches to the right and down that the grids lie apart
  std::vector<Part> columns_, rows_;
};

}  // namespace raywave
