// SPDX-License-Identifier: Apache-2.0
#include "host/refine/sample_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace raywave::refinement {
namespace {

/// A box narrower than this is as good as one of this width, in pixels.
constexpr double least_width_px = 0.5;

/// Parts of the window along an axis (sampling.visibility), at most.
constexpr std::size_t most_parts = 16;

/// Where the light of a sample's samples counts as equal over the hologram, over its mean.
constexpr float equal_light = 0.1f;

/// Both ends of a box along one axis, as first differences of its mean over each pixel.
struct Ends {
  std::array<int, 4> at{};
  std::array<float, 4> weights{};  // per pixel of the box's width
  bool is_empty = true;
  double open_m = 0;  // of the hologram, or of the pupil's plane
};

/// Of a box from a to b, in pixels from the first one's edge, of which `count` are kept.
Ends ends_of(double a, double b, int count, double open_m) {
  if (a > b) std::swap(a, b);
  const double middle = (a + b) / 2, half = std::max(b - a, least_width_px) / 2;
  const double low = std::clamp(middle - half, 0.0, 1.0 * count),
               high = std::clamp(middle + half, 0.0, 1.0 * count);
  Ends ends;
  if (!(low < high)) return ends;
  ends.is_empty = false;
  ends.open_m = open_m;
  const auto put = [&](std::size_t i, double place, double sign) {
    const int pixel = static_cast<int>(place);
    const double beyond = place - pixel;
    ends.at[i] = pixel;
    ends.at[i + 1] = pixel + 1;
    ends.weights[i] = static_cast<float>(sign * (1 - beyond) / (2 * half));
    ends.weights[i + 1] = static_cast<float>(sign * beyond / (2 * half));
  };
  put(0, low, 1);
  put(2, high, -1);
  return ends;
}

/// Part of the open hologram along one axis, in metres from the hologram's centre, and the numbers
/// of the window's parts that it touches.
struct Stretch {
  double low_m, high_m;
  int first, end;
};

class Raster {
public:
  Raster(const Optics& optics, const PictureGrid& grid, const SampleLight& light)
      : grid_(grid),
        light_(light),
        wide_(grid.wide_size()),
        stride_(wide_.x + 2),
        changes_(static_cast<std::size_t>(stride_) * static_cast<std::size_t>(wide_.y + 2)) {
    const auto side = [&](int axis, double sign) {
      // Rows of pixels count downwards, rows of parts upwards
      const int n_pupil = optics.pupil_plane[axis];
      const double n = light.pupil ? n_pupil : optics.size[axis];
      const double pitch_m =
          light.pupil ? optics.wavelength_m * light.pupil->b_m / (optics.pitch_m[axis] * n_pupil)
                      : optics.pitch_m[axis];
      const double a = sign * (grid.open.first[axis] - n / 2) * pitch_m,
                   b = sign * (grid.open.first[axis] + grid.open.size[axis] - n / 2) * pitch_m;
      Stretch s{std::min(a, b), std::max(a, b), 0, 0};
      const double inside_m = 1e-9 * std::abs(pitch_m);
      s.first = std::clamp(part_at(s.low_m + inside_m, axis), 0, light.parts - 1);
      s.end = std::clamp(part_at(s.high_m - inside_m, axis), 0, light.parts - 1) + 1;
      return s;
    };
    across_ = side(0, 1);
    up_ = side(1, -1);
    per_area_ = 1 / (optics.pitch_m.x * optics.pitch_m.y);
  }

  void add(std::size_t sample) {
    const auto at = glm::dvec3(light_.at_m[sample]);
    const auto parts = static_cast<std::size_t>(light_.parts);
    const float* of_parts = light_.irradiance.data() + sample * parts * parts;
    float least = INFINITY, most = 0, sum = 0;
    for (int j = up_.first; j < up_.end; ++j) {
      for (int i = across_.first; i < across_.end; ++i) {
        const float value = of_parts[static_cast<std::size_t>(j) * parts + i];
        least = std::min(least, value);
        most = std::max(most, value);
        sum += value;
      }
    }
    if (!(most > 0)) return;
    if (const float mean =
            sum / static_cast<float>((up_.end - up_.first) * (across_.end - across_.first));
        most - least <= equal_light * mean)
      return add_box(ends_across(at, across_.low_m, across_.high_m),
                     ends_up(at, up_.low_m, up_.high_m), mean);
    // Both ends of a part's box are those of its column and its row
    for (int i = across_.first; i < across_.end; ++i) {
      const auto [low_u, high_u] = within(across_, i, 0);
      columns_[static_cast<std::size_t>(i)] = ends_across(at, low_u, high_u);
    }
    for (int j = up_.first; j < up_.end; ++j) {
      const auto [low_v, high_v] = within(up_, j, 1);
      const auto row = ends_up(at, low_v, high_v);
      for (int i = across_.first; i < across_.end; ++i)
        if (const float value = of_parts[static_cast<std::size_t>(j) * parts + i]; value > 0)
          add_box(columns_[static_cast<std::size_t>(i)], row, value);
    }
  }

  /// The sum of all boxes.
  std::vector<float> picture() const {
    std::vector<float> result(area_of(wide_));
    std::vector<double> column(static_cast<std::size_t>(wide_.x));
    for (int y = 0; y < wide_.y; ++y) {
      const float* changes = changes_.data() + static_cast<std::ptrdiff_t>(y) * stride_;
      float* row = result.data() + static_cast<std::ptrdiff_t>(y) * wide_.x;
      double sum = 0;
      for (std::size_t x = 0; x < column.size(); ++x) {
        sum += static_cast<double>(changes[x]);
        column[x] += sum;
        row[x] = static_cast<float>(std::max(column[x], 0.0));
      }
    }
    return result;
  }

private:
  int part_at(double place_m, int axis) const {
    return static_cast<int>(std::floor(
        ((place_m - light_.middle_m[axis]) / light_.half_m[axis] + 1) * light_.parts / 2.0));
  }

  /// What of a part of the window is open.
  std::pair<double, double> within(const Stretch& side, int part, int axis) const {
    const auto edge = [&](int number) {
      return light_.middle_m[axis] + (2.0 * number / light_.parts - 1) * light_.half_m[axis];
    };
    return {std::max(side.low_m, part == 0 ? side.low_m : edge(part)),
            std::min(side.high_m, part + 1 == light_.parts ? side.high_m : edge(part + 1))};
  }

  /// Where the transform puts a ray: the place on the plane that its sine alone points to.
  ///
  /// beside  from the open part's middle, where the ray is across the other axis
  double place(const glm::dvec3& at, double from, double to, double beside) const {
    if (const auto& pupil = light_.pupil)
      return to + (at.z - grid_.z_m) * (from - pupil->a * to) / (pupil->a * at.z + pupil->b_m);
    const double length = std::sqrt((to - from) * (to - from) + beside * beside + at.z * at.z);
    return from + grid_.z_m * (to - from) / std::copysign(length, grid_.side * at.z);
  }

  // Of light through a stretch of the hologram, or to one of the pupil's plane.

  Ends ends_across(const glm::dvec3& at, double low_u, double high_u) const {
    const double beside = at.y - (up_.low_m + up_.high_m) / 2;
    const auto column = [&](double from) {
      return (place(at, from, at.x, beside) - grid_.middle_m.x) / grid_.pixel_m.x +
             grid_.size.x / 2.0 - grid_.region_first.x + grid_.margin_x();
    };
    return ends_of(column(low_u), column(high_u), wide_.x, high_u - low_u);
  }

  Ends ends_up(const glm::dvec3& at, double low_v, double high_v) const {
    const double beside = at.x - (across_.low_m + across_.high_m) / 2;
    const auto row = [&](double from) {
      return grid_.size.y / 2.0 -
             (place(at, from, at.y, beside) - grid_.middle_m.y) / grid_.pixel_m.y -
             grid_.region_first.y + grid_.radius_y();
    };
    return ends_of(row(low_v), row(high_v), wide_.y, high_v - low_v);
  }

  void add_box(const Ends& x, const Ends& y, float irradiance) {
    if (x.is_empty || y.is_empty) return;
    const auto energy =
        static_cast<float>(static_cast<double>(irradiance) * x.open_m * y.open_m * per_area_);
    for (std::size_t j = 0; j < 4; ++j) {
      float* row_of = changes_.data() + static_cast<std::ptrdiff_t>(y.at[j]) * stride_;
      const float share = energy * y.weights[j];
      for (std::size_t i = 0; i < 4; ++i) row_of[x.at[i]] += share * x.weights[i];
    }
  }

  const PictureGrid& grid_;
  const SampleLight& light_;
  glm::ivec2 wide_;
  int stride_;
  Stretch across_{}, up_{};
  double per_area_ = 1;
  std::array<Ends, most_parts> columns_;  // of the sample that is added
  std::vector<float> changes_;            // second differences of the picture
};

}  // namespace

std::vector<float> sample_picture(const Optics& optics, const PictureGrid& grid,
                                  const SampleLight& light) {
  Raster raster(optics, grid, light);
  for (std::size_t i = 0; i < light.at_m.size(); ++i) raster.add(i);
  return raster.picture();
}

}  // namespace raywave::refinement
