// SPDX-License-Identifier: Apache-2.0
#include "host/refine/picture_grid.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <numbers>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/plan/padded_plane.hpp"
#include "host/view/compare.hpp"
#include "host/view/reconstruct.hpp"

namespace raywave::refinement {
namespace {

constexpr int packet = PictureGrid::packet;

/// Blur in distances of dots at which none is seen: 0.8 % of their contrast is left.
constexpr double blur_of_dots = 0.5;

std::vector<float> blur_weights(double sigma_px, int most = 1 << 20) {
  const auto weights =
      gaussian_weights(sigma_px, std::min(static_cast<int>(4 * sigma_px + 0.5), most));
  return {weights.begin(), weights.end()};
}

/// First pixel and number of pixels, out of `count`, whose centres lie in the window.
///
/// axis_m  place of the window's middle, from that of the pixels
std::pair<int, int> pixels_in(double window_m, double axis_m, double pixel_m, int count) {
  const double half = window_m / 2 / pixel_m, middle = (count - 1) / 2.0 + axis_m / pixel_m;
  const int first = std::max(0, static_cast<int>(std::ceil(middle - half - 1e-6))),
            last = std::min(count - 1, static_cast<int>(std::floor(middle + half + 1e-6)));
  return {first, std::max(0, last - first + 1)};
}

/// One output pixel's share of consecutive input pixels.
struct Shares {
  int first = 0;
  std::vector<double> weights;
};

/// Gaussian weights of `count` pixels around the axis at a place, summing to 1.
Shares shares_at(double place_m, int count, double pixel_m, double sigma_m) {
  const double at = place_m / pixel_m + (count - 1) / 2.0, sigma = sigma_m / pixel_m;
  const double reach = std::max(4 * sigma, 1.0);
  const int first = std::clamp(static_cast<int>(std::ceil(at - reach)), 0, count - 1),
            last = std::clamp(static_cast<int>(std::floor(at + reach)), first, count - 1);
  Shares shares{first, {}};
  double sum = 0;
  for (int i = first; i <= last; ++i) {
    const double t = (i - at) / sigma;
    shares.weights.push_back(std::exp(-0.5 * t * t));
    sum += shares.weights.back();
  }
  if (!(sum > 0)) {  // beyond the edge by more than the Gaussian reaches
    shares.weights.assign(1, 1.0);
    shares.first = at < 0 ? 0 : count - 1;
    return shares;
  }
  for (double& w : shares.weights) w /= sum;
  return shares;
}

/// f(0), ..., f(count - 1)
std::vector<double> places(int count, const auto& f) {
  std::vector<double> all;
  for (int i = 0; i < count; ++i) all.push_back(f(i));
  return all;
}

/// The key's picture, blurred, at the crossings of columns and rows: metres to the right of the
/// axis and below it.
std::vector<float> blurred_at(const Key& key, double blur_m, const std::vector<double>& columns_m,
                              const std::vector<double>& rows_m) {
  const auto& picture = key.picture;
  // A blur narrower than the picture's pixels still has to reach from pixel to pixel.
  const auto sigma_of = [&](double pixel_m) {
    const double own_m2 = key.area ? pixel_m * pixel_m / 12 : 0;
    return std::max(std::sqrt(std::max(blur_m * blur_m - own_m2, 0.0)), 0.4 * pixel_m);
  };
  std::vector<Shares> columns, rows;
  for (const double x_m : columns_m)
    columns.push_back(shares_at(x_m, picture.width, key.pixel_m.x, sigma_of(key.pixel_m.x)));
  for (const double y_m : rows_m)
    rows.push_back(shares_at(y_m, picture.height, key.pixel_m.y, sigma_of(key.pixel_m.y)));

  std::vector<double> across;
  for (int j = 0; j < picture.height; ++j) {
    const float* row = picture.pixels.data() + std::size_t{1} * j * picture.width;
    for (const auto& shares : columns) {
      double sum = 0;
      for (std::size_t i = 0; i < shares.weights.size(); ++i)
        sum += shares.weights[i] * row[shares.first + static_cast<int>(i)];
      across.push_back(sum);
    }
  }
  std::vector<float> result;
  std::vector<double> line(columns.size());
  for (const auto& shares : rows) {
    std::fill(line.begin(), line.end(), 0.0);
    for (std::size_t j = 0; j < shares.weights.size(); ++j) {
      const double w = shares.weights[j];
      const double* row =
          across.data() + (static_cast<std::size_t>(shares.first) + j) * line.size();
      for (std::size_t x = 0; x < line.size(); ++x) line[x] += w * row[x];
    }
    for (const double value : line) result.push_back(static_cast<float>(std::max(value, 0.0)));
  }
  return result;
}

/// Catmull and Rom's weights for the samples -1, 0, 1 and 2 at a place between 0 and 1.
std::array<double, 4> cubic(double t) {
  return {t * (-0.5 + t * (1 - 0.5 * t)), 1 + t * t * (-2.5 + 1.5 * t),
          t * (0.5 + t * (2 - 1.5 * t)), t * t * (-0.5 + 0.5 * t)};
}

/// The picture as a Fresnel propagation sees it. Light that it brings to x arrives at x + dx, dx
/// being (x - h) |x - h|^2 / (2 z^2) for a pixel h of the hologram: a frequency is a sine, not a
/// tangent. The mean of dx over the open part is made up for here; key_propagation bounds the rest.
std::vector<float> bent_back(const Optics& optics, const PictureGrid& grid,
                             const std::vector<float>& picture) {
  const auto known = grid.known_size;
  const glm::dvec2 middle_px = glm::dvec2(grid.open.first) + glm::dvec2(grid.open.size - 1) / 2.0 -
                               glm::dvec2(optics.size - 1) / 2.0;
  const glm::dvec2 centre_m = middle_px * optics.pitch_m,  // x right, y down
      half_m = glm::dvec2(grid.open.size) * optics.pitch_m / 2.0;
  const double two_z2 = 2 * grid.z_m * grid.z_m;
  std::vector<float> bent;
  bent.reserve(picture.size());
  for (int y = 0; y < known.y; ++y) {
    const double down_m = -grid.y_m(grid.known_first.y + y) - centre_m.y;
    for (int x = 0; x < known.x; ++x) {
      const double right_m = grid.x_m(grid.known_first.x + x) - centre_m.x;
      const double square = right_m * right_m + down_m * down_m;
      const double to_x =
          right_m * (square + half_m.x * half_m.x + half_m.y * half_m.y / 3) / two_z2;
      const double to_y =
          down_m * (square + half_m.y * half_m.y + half_m.x * half_m.x / 3) / two_z2;
      const double at_x = std::clamp(x + to_x / grid.pixel_m.x, 0.0, known.x - 1.0),
                   at_y = std::clamp(y + to_y / grid.pixel_m.y, 0.0, known.y - 1.0);
      const int i = static_cast<int>(at_x), j = static_cast<int>(at_y);
      const auto across = cubic(at_x - i), down = cubic(at_y - j);
      double sum = 0;
      for (int l = 0; l < 4; ++l) {
        const int row = std::clamp(j + l - 1, 0, known.y - 1);
        const float* line = picture.data() + std::ptrdiff_t{row} * known.x;
        double of_line = 0;
        for (int k = 0; k < 4; ++k)
          of_line += across[static_cast<std::size_t>(k)] *
                     static_cast<double>(line[std::clamp(i + k - 1, 0, known.x - 1)]);
        sum += down[static_cast<std::size_t>(l)] * of_line;
      }
      bent.push_back(static_cast<float>(std::max(sum, 0.0)));
    }
  }
  return bent;
}

/// Sample of the pupil's plane; where b is negative, light crosses the axis.
glm::dvec2 part_pitch_m(const Optics& optics, const PictureGrid& grid) {
  return optics.wavelength_m * std::abs(grid.pupil->b_m) /
         (optics.pitch_m * glm::dvec2(optics.pupil_plane));
}

/// The blur of shown pictures: that of wanted ones, and the second moments of what the source's
/// size and spectrum add.
glm::dvec2 shown_blur_m(const Optics& optics, const PictureGrid& grid) {
  const auto& source = optics.showing.source;
  if (!source.any()) return glm::dvec2(optics.blur_m);
  const double disc_m = source.size_rad / 4 * std::abs(grid.z_m),
               change =
                   source.bandwidth_m / (2 * std::sqrt(2 * std::log(2.0))) / optics.wavelength_m;
  // Of the hologram, which light to a part of the pupil passes nearby
  const auto open_m = grid.pupil ? glm::dvec2(grid.open.size) * part_pitch_m(optics, grid) *
                                       std::abs(grid.z_m / grid.distance_m)
                                 : glm::dvec2(grid.open.size) * optics.pitch_m,
             picture_m = glm::dvec2(grid.known_size) * grid.pixel_m,
             turned_m = grid.z_m * optics.wavelength_m * source.per_m;
  return glm::sqrt(optics.blur_m * optics.blur_m + disc_m * disc_m +
                   change * change *
                       ((open_m * open_m + picture_m * picture_m) / 12.0 + turned_m * turned_m));
}

/// Share of the light that pixels of this fill send to places of a picture, along one axis: mean
/// over the part of the open hologram whose pixels show light that steep.
std::vector<double> shown_shares(const Optics& optics, const PictureGrid& grid, int axis,
                                 const std::vector<double>& places_m) {
  constexpr int points = 16;
  const double fill = optics.showing.fill.value()[axis], pitch_m = optics.pitch_m[axis];
  const double sign = axis == 1 ? -1 : 1;  // rows run downwards
  std::vector<double> shares;
  for (const double place_m : places_m) {
    double sum = 0, count = 0;
    for (int i = 0; i < points; ++i) {
      const double sample = grid.open.first[axis] + (i + 0.5) / points * grid.open.size[axis];
      const double across_m = sign * (sample - optics.size[axis] / 2.0) * pitch_m - place_m;
      const double cycles =
          grid.pupil ? sign * (sample / optics.pupil_plane[axis] - 0.5) -
                           grid.pupil->a * place_m / grid.pupil->b_m * pitch_m / optics.wavelength_m
                     : pitch_m / optics.wavelength_m * across_m / std::hypot(across_m, grid.z_m);
      if (std::abs(cycles) > 0.5) continue;
      const double amplitude =
          amplitude_of_pixel(fill, cycles + grid.side * optics.showing.carrier[axis]);
      sum += amplitude * amplitude;
      count += 1;
    }
    shares.push_back(count > 0 && sum > 0 ? sum / count : 1);
  }
  return shares;
}

}  // namespace

glm::ivec2 pupil_plane_size(const Optics& optics, std::span<const Key> keys) {
  glm::dvec2 beyond_m(0);
  bool any = false;
  for (const auto& key : keys) {
    if (!key.pupil) continue;
    any = true;
    // Steepest light of the part, over the distance at which the bent light shows the picture
    const auto sine = glm::min(glm::abs(key.view) + key.aperture, 1.0) * optics.wavelength_m /
                      (2.0 * optics.pitch_m);
    beyond_m = glm::max(beyond_m,
                        std::abs(key.z_m / (1 + key.pupil->a * key.z_m / key.pupil->b_m)) * sine +
                            4 * optics.blur_m);
  }
  if (!any) return {0, 0};
  auto size = padded_size(optics.size + glm::ivec2(glm::ceil(beyond_m / optics.pitch_m)), 1);
  size.x = whole_packets(size.x);
  return size;
}

void ask_for_more(const Optics& optics, const PictureGrid& grid, glm::ivec2 first, glm::ivec2 size,
                  std::vector<float>& picture) {
  if (!optics.showing.fill) return;
  const auto across =
      shown_shares(optics, grid, 0, places(size.x, [&](int x) { return grid.x_m(first.x + x); }));
  const auto down =
      shown_shares(optics, grid, 1, places(size.y, [&](int y) { return grid.y_m(first.y + y); }));
  for (std::size_t y = 0; y < down.size(); ++y)
    for (std::size_t x = 0; x < across.size(); ++x)
      picture[y * across.size() + x] =
          static_cast<float>(double{picture[y * across.size() + x]} / (across[x] * down[y]));
}

OpenPart open_part(glm::ivec2 hologram, glm::dvec2 view, glm::dvec2 aperture) {
  OpenPart part;
  const glm::dvec2 centre(view.x, -view.y);
  for (int axis = 0; axis < 2; ++axis) {
    const int n = hologram[axis];
    int first = 0;
    while (first < n && !lets_through(first, n, centre[axis], aperture[axis])) ++first;
    int end = first;
    while (end < n && lets_through(end, n, centre[axis], aperture[axis])) ++end;
    part.first[axis] = first;
    part.size[axis] = end - first;
  }
  return part;
}

PictureGrid picture_grid(const Optics& optics, const Key& key, Propagation propagation) {
  const auto depth = [&] { return "refinement: the picture at " + length_text(key.z_m); };
  PictureGrid grid;
  grid.propagation = propagation;
  grid.z_m = key.pupil ? key.z_m : std::abs(key.z_m);
  grid.side = key.z_m < 0 && !key.pupil ? -1 : 1;
  grid.pupil = key.pupil;
  grid.is_disc = key.is_disc;
  // Light bent by the eyepiece shows the picture larger, and elsewhere
  const double larger = key.pupil ? 1 + key.pupil->a * key.z_m / key.pupil->b_m : 1;
  grid.distance_m = key.pupil ? key.pupil->b_m * larger : grid.z_m;
  if (!std::isfinite(key.z_m) || !((key.pupil ? larger : grid.z_m) > 0))
    throw InputError(key.pupil ? depth() + " is where the eye's pupil is, or behind it"
                               : "refinement: z must not be 0, the hologram itself");
  const double side = key.pupil && key.pupil->b_m < 0 ? -1 : 1;
  grid.open =
      open_part(key.pupil ? optics.pupil_plane : optics.size, side * key.view, key.aperture);
  if (grid.open.size.x < 1 || grid.open.size.y < 1)
    throw InputError(depth() + ": view and aperture leave no part of the hologram open");
  const glm::dvec2 window_m = key.window_m();
  if (!(window_m.x > 0 && window_m.y > 0)) throw InputError(depth() + " is empty");

  if (key.pupil) {
    const KeyPlace place{key.z_m, key.view, key.aperture, 1, 0, key.pupil};
    const auto plane_m = glm::dvec2(optics.pupil_plane) * optics.pitch_m * larger;
    grid.size = padded_size(
        samples_through_pupil(place, optics.pupil_plane, optics.pitch_m, optics.blur_m), 1);
    grid.size.x = whole_packets(grid.size.x);
    grid.pixel_m = plane_m / glm::dvec2(grid.size);
  } else if (propagation == Propagation::fresnel) {
    grid.size = padded_size(grid.open.size, optics.padding);
    grid.size.x = whole_packets(grid.size.x);
    const auto plane_m = optics.wavelength_m * grid.z_m / optics.pitch_m;
    grid.pixel_m = plane_m / glm::dvec2(grid.size);
    // Before the part, where the farthest places of the window are twice as far from its pixels as
    // these can show: else their light would fold onto places that they do show
    const glm::dvec2 part_m =
        (glm::dvec2(grid.open.first) + glm::dvec2(grid.open.size - optics.size) / 2.0) *
        optics.pitch_m;
    const auto farthest_m =
        glm::abs(part_m) + glm::dvec2(grid.open.size) * optics.pitch_m / 2.0 + window_m / 2.0;
    for (int axis = 0; axis < 2; ++axis)
      if (farthest_m[axis] > plane_m[axis])
        grid.middle_m[axis] = (axis == 0 ? 1 : -1) * part_m[axis];
  } else {
    grid.spectrum =
        propagation == Propagation::exact
            ? exact_planes(optics.size, optics.pitch_m, optics.wavelength_m, grid.z_m, window_m)
            : corrected_planes(optics.size, grid.open.first, grid.open.size, optics.pitch_m,
                               optics.wavelength_m, grid.z_m, window_m, optics.padding);
    grid.size = grid.spectrum.picture;
    grid.pixel_m = grid.spectrum.pixel_m;
  }
  for (int axis = 0; axis < 2; ++axis) {
    const auto [first, count] =
        pixels_in(window_m[axis], (axis == 0 ? -1 : 1) * grid.middle_m[axis], grid.pixel_m[axis],
                  grid.size[axis]);
    if (count < 1) throw InputError(depth() + " is smaller than what the hologram resolves");
    grid.known_first[axis] = first;
    grid.known_size[axis] = count;
  }
  grid.region_first = {grid.known_first.x / packet * packet, grid.known_first.y};
  grid.region_size = {whole_packets(grid.known_first.x + grid.known_size.x) - grid.region_first.x,
                      grid.known_size.y};
  const auto blur_m = shown_blur_m(optics, grid);
  grid.weights_x = blur_weights(blur_m.x / grid.pixel_m.x);
  grid.weights_y = blur_weights(blur_m.y / grid.pixel_m.y);
  if (key.samples) {
    const double dots_m = key.samples->dots * std::abs(key.z_m - key.samples->dots_from_m),
                 sigma_m = std::max(optics.blur_m, blur_of_dots * dots_m);
    grid.sample_weights_x = blur_weights(sigma_m / grid.pixel_m.x, grid.margin_x());
    grid.sample_weights_y = blur_weights(sigma_m / grid.pixel_m.y, grid.radius_y());
  }

  if (key.samples) {
    // All of the plane's pixels in the region are known, in units of light of a hologram pixel.
    grid.known_first = grid.region_first;
    grid.known_size = grid.region_size;
    grid.unit = 1 / (1.0 * grid.size.x * grid.size.y);
    return grid;
  }
  // Light that a radiance L sends through an aperture falls with 1 / z^2 on the picture's plane.
  const auto whole = key.pupil ? optics.pupil_plane : optics.size;
  const double open_share = 1.0 * grid.open.size.x * grid.open.size.y / (1.0 * whole.x * whole.y);
  const double pixels_per_pixel =
      grid.pixel_m.x * grid.pixel_m.y / (optics.pitch_m.x * optics.pitch_m.y);
  const auto fine = grid.spectrum.fine();
  const double per_transform =
      propagation == Propagation::exact ? 1 : fine.x * fine.y / (1.0 * grid.size.x * grid.size.y);
  grid.unit = per_transform / pixels_per_pixel / open_share * grid.distance_m * grid.distance_m;
  return grid;
}

std::vector<std::complex<float>> chirp(const OpenLine& line, double curve, double slope,
                                       double factor) {
  std::vector<std::complex<float>> values(static_cast<std::size_t>(whole_packets(line.count)));
  for (int i = 0; i < line.count; ++i) {
    const double place = line.first + i * line.step - (line.all - 1) / 2.0,
                 turns = curve * place * place + slope * i;
    values[static_cast<std::size_t>(i)] =
        std::complex<float>(std::polar(factor, 2 * std::numbers::pi * (turns - std::round(turns))));
  }
  return values;
}

double to_middle(int n) { return (n - 1.0) / (2.0 * n); }

std::vector<std::complex<float>> chirp_of(const Optics& optics, const PictureGrid& grid, int axis) {
  const double pitch_m = optics.pitch_m[axis], lambda = optics.wavelength_m;
  const int n = optics.size[axis], padded = grid.size[axis];
  OpenLine line{n, 1.0 * grid.open.first[axis], grid.open.size[axis]};
  if (grid.propagation == Propagation::corrected) {
    const auto& sizes = grid.spectrum;
    line = {n, 1.0 * (grid.open.first[axis] - sizes.margin), sizes.finer_open[axis],
            1 / sizes.fine()[axis]};
    // Half a turn per pixel: the spectrum begins with its lowest frequency, not with zero
    auto values = chirp(line, -pitch_m * pitch_m / (2 * lambda * grid.z_m),
                        -to_middle(padded) - line.step / 2);
    values.resize(static_cast<std::size_t>(whole_packets(sizes.finer[axis])));
    return values;
  }
  if (!grid.pupil)
    return chirp(line, -pitch_m * pitch_m / (2 * lambda * grid.z_m),
                 (axis == 0 ? 1 : -1) * grid.middle_m[axis] * pitch_m / (lambda * grid.z_m) -
                     to_middle(padded));
  line.all = optics.pupil_plane[axis];
  const double bent_z_m = grid.z_m * grid.pupil->b_m / grid.distance_m,
               per_sample = 1 / (line.all * pitch_m);  // cycles per metre
  return chirp(line, lambda * bent_z_m * per_sample * per_sample / 2,
               (n - 1.0) / (2.0 * line.all) - to_middle(padded));
}

std::vector<float> blurred_target(const Optics& optics, const Key& key, const PictureGrid& grid) {
  const auto known = grid.known_size, region = grid.region_size;
  auto blurred = blurred_at(
      key, optics.blur_m, places(known.x, [&](int x) { return grid.x_m(grid.known_first.x + x); }),
      places(known.y, [&](int y) { return -grid.y_m(grid.known_first.y + y); }));
  if (grid.propagation == Propagation::fresnel && !grid.pupil)
    blurred = bent_back(optics, grid, blurred);
  std::vector<float> target(area_of(region), -1.0f);
  for (int y = 0; y < known.y; ++y) {
    const auto row = blurred.begin() + std::ptrdiff_t{y} * known.x;
    std::copy(
        row, row + known.x,
        target.begin() + std::ptrdiff_t{y} * region.x + (grid.known_first.x - grid.region_first.x));
  }
  return target;
}

Image blurred_picture(const Key& key, double blur_m, glm::ivec2 size, glm::dvec2 pixel_m) {
  const auto along = [&](int n, double step_m) {
    return places(n, [=](int i) { return (i - (n - 1) / 2.0) * step_m; });
  };
  return {size.x, size.y,
          blurred_at(key, blur_m, along(size.x, pixel_m.x), along(size.y, pixel_m.y))};
}

}  // namespace raywave::refinement
