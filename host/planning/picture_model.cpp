// SPDX-License-Identifier: Apache-2.0
#include "host/planning/picture_model.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <numbers>

#include "host/quality.hpp"

namespace raywave {
namespace {

using std::numbers::pi;

/// Fitted to the demo scenes (docs/planning.md): what the formulas below leave out.
constexpr double speckle_factor = 0.85;
constexpr double edge_factor = 8e-4;
constexpr double cell_factor = 3e-4;
constexpr double background = 0.3;

using Raster = std::vector<float>;

/// Mean over a box of 2 half + 1 cells (a fraction of the outermost ones), along both axes; what lies outside is dark.
void blur_box(Raster& raster, glm::ivec2 size, glm::dvec2 half) {
  for (int axis = 0; axis < 2; ++axis) {
    if (half[axis] <= 0) continue;
    const int n = size[axis], stride = axis == 0 ? 1 : size.x, lines = size[1 - axis], next = axis == 0 ? size.x : 1;
    const int whole = static_cast<int>(std::min(half[axis], 1.0 * n)), margin = whole + 1;
    const double part = half[axis] - std::floor(half[axis]), weight = 1 / (2 * half[axis] + 1);
    std::vector<double> sums(static_cast<std::size_t>(n + 2 * margin + 1));  // of the cells before each, the margins' dark ones first
    for (int line = 0; line < lines; ++line) {
      float* const cells = raster.data() + std::ptrdiff_t{line} * next;
      double* const before = sums.data() + margin;
      for (int i = 0; i < n; ++i) before[i + 1] = before[i] + cells[std::ptrdiff_t{i} * stride];
      std::fill(before + n + 1, before + n + margin + 1, before[n]);
      for (int i = 0; i < n; ++i) {
        const double* const at = before + i;
        const double inner = at[whole + 1] - at[-whole], ends = at[-whole] - at[-whole - 1] + at[whole + 2] - at[whole + 1];
        cells[std::ptrdiff_t{i} * stride] = static_cast<float>((inner + part * ends) * weight);
      }
    }
  }
}

/// Three boxes of the Gaussian's variance.
void blur_gaussian(Raster& raster, glm::ivec2 size, double sigma) {
  const double half = (std::sqrt(4 * sigma * sigma + 1) - 1) / 2;
  for (int i = 0; i < 3; ++i) blur_box(raster, size, glm::dvec2(half));
}

/// What a lens of the hologram's size focused on z_m sees of the front view's cells, every depth on its own: what hides what is the view's.
Raster lens_view(const FrontView& view, const Raster& radiance, const Plan& plan, double z_m) {
  constexpr int layers = 12;
  const auto window = glm::dvec2(plan.size) * plan.pitch_m;
  const double span = std::max(plan.far_m - plan.near_m, 1e-12);
  Raster sum(radiance.size(), 0);
  for (int layer = 0; layer < layers; ++layer) {
    Raster one(radiance.size(), 0);
    bool any = false;
    for (std::size_t i = 0; i < one.size(); ++i) {
      if (view.depth_m[i] == 0) continue;
      const auto at = static_cast<int>((static_cast<double>(view.depth_m[i]) - plan.near_m) / span * layers);
      if (std::clamp(at, 0, layers - 1) != layer) continue;
      one[i] = radiance[i];
      any = true;
    }
    if (!any) continue;
    const double depth = plan.near_m + (layer + 0.5) / layers * (plan.far_m - plan.near_m);
    const auto half = window * (std::abs(depth - z_m) / depth / z_m / 2 / view.step);
    blur_box(one, view.size, half);
    for (std::size_t i = 0; i < one.size(); ++i) sum[i] += one[i];
  }
  return sum;
}

/// What hologram and WRPs show of the cells' radiance.
Raster radiance_shown(const FrontView& view, const Plan& plan) {
  Raster shown(view.radiance);
  for (int y = 0; y < view.size.y; ++y) {
    for (int x = 0; x < view.size.x; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(view.size.x) + static_cast<std::size_t>(x);
      const double z = view.depth_m[i];
      if (z == 0) continue;
      const auto at = view.tangent(x, y) * z;
      shown[i] *= static_cast<float>(share_seen(plan, 0, at.x, z) * share_seen(plan, 1, at.y, z));
    }
  }
  return shown;
}

PictureRow row_of(const FrontView& view, const Raster& radiance_shown, const Plan& plan, double z_m, double blur_m, double edges) {
  PictureRow row;
  row.z_m = z_m;
  auto lens = lens_view(view, view.radiance, plan, z_m), shown = lens_view(view, radiance_shown, plan, z_m);
  blur_gaussian(lens, view.size, blur_m / z_m / view.step);
  blur_gaussian(shown, view.size, blur_m / z_m / view.step);
  const auto window = glm::dvec2(plan.size * plan.grid) * plan.pitch_m;
  const auto border = static_cast<double>(QualitySpec{}.border_px) * plan.pitch_m;
  double peak = 0, ll = 0, ls = 0, ss = 0;
  for (int y = 0; y < view.size.y; ++y) {
    for (int x = 0; x < view.size.x; ++x) {
      if (glm::any(glm::greaterThan(glm::abs(view.tangent(x, y)) * z_m, window / 2.0 - border))) continue;
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(view.size.x) + static_cast<std::size_t>(x);
      const double l = lens[i], s = shown[i];
      peak = std::max(peak, l);
      ll += l * l;
      ls += l * s;
      ss += s * s;
    }
  }
  if (peak == 0) return row;
  const double cells = window.x * window.y / (z_m * view.step * z_m * view.step), unit = 1 / (cells * peak * peak);
  row.light = ll * unit;
  row.missing = ss > 0 ? std::max(0.0, ll - ls * ls / ss) * unit : row.light;
  row.edges_m = edges * z_m * view.step / (window.x * window.y * peak * peak);
  return row;
}

/// The part of the window from -half to half.
std::pair<double, double> within_pixels(const Plan& plan, int axis, double x_m, double z_m) {
  const double half = plan.size[axis] * plan.pitch_m[axis] / 2;
  const double sine = std::min(plan.largest_sine[axis], 0.999), reach = z_m * sine / std::sqrt(1 - sine * sine);
  return {std::max(-half, x_m - reach), std::min(half, x_m + reach)};
}

}  // namespace

double share_within_pixels(const Plan& plan, int axis, double x_m, double z_m) {
  const auto [low, high] = within_pixels(plan, axis, x_m, z_m);
  return std::max(0.0, high - low) / (plan.size[axis] * plan.pitch_m[axis]);
}

double share_seen(const Plan& plan, int axis, double x_m, double z_m) {
  auto [low, high] = within_pixels(plan, axis, x_m, z_m);
  const double half = plan.size[axis] * plan.pitch_m[axis] / 2;
  const auto& slab = plan.slab_at(z_m);
  const auto [first, last] = wrps_extent(plan, slab);
  // The line from h on the hologram through x crosses the WRPs at h + (x - h) distance / z.
  const double share = slab.distance_m / z_m, left = first[axis] - x_m * share, right = last[axis] - x_m * share;
  if (std::abs(1 - share) < 1e-9) {
    if (left > 0 || right < 0) return 0;
  } else {
    const double a = left / (1 - share), b = right / (1 - share);
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
  }
  return std::max(0.0, high - low) / (2 * half);
}

PictureModel picture_model(const FrontView& view, const Plan& plan, double resolution_m) {
  PictureModel model;
  model.resolution_m = resolution_m;
  model.spot_m = plan.wavelength_m * plan.lattice.full_z_m / (glm::dvec2(plan.size) * plan.pitch_m);
  double edges = 0;
  for (int y = 0; y < view.size.y; ++y) {
    for (int x = 0; x < view.size.x; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(view.size.x) + static_cast<std::size_t>(x);
      const double here = view.radiance[i];
      if (x + 1 < view.size.x) edges += std::pow(here - view.radiance[i + 1], 2);
      if (y + 1 < view.size.y) edges += std::pow(here - view.radiance[i + static_cast<std::size_t>(view.size.x)], 2);
    }
  }
  const auto shown = radiance_shown(view, plan);
  for (const double z_m : quality_depths_m(plan))
    model.rows.push_back(row_of(view, shown, plan, z_m, blur_of_resolution * resolution_m, edges));
  return model;
}

PicturePrediction predict_pictures(const PictureModel& model, double pitch_m, int frames, double padding_error) {
  PicturePrediction prediction;
  const double blur_m = blur_of_resolution * model.resolution_m, p = pitch_m;
  // Dots: what the blur leaves of the lattice, whose dots are as wide as the hologram's limit.
  double dots = 0, waves = 1, alone = 1;
  for (int axis = 0; axis < 2; ++axis) {
    const double spot = model.spot_m[axis];
    const double ripple = 2 * std::exp(-2 * pi * pi * blur_m * blur_m / (p * p)) * std::max(0.0, 1 - spot / p);
    dots += ripple * ripple / 2;
    // Speckle: pairs of samples interfere as much as their spots overlap: the sum of sinc^2 over the lattice.
    waves *= p <= spot ? spot / p : 1 + spot * spot / (6 * p * p);
    alone *= p / (2 * std::sqrt(pi) * std::hypot(blur_m, std::max(p, spot) / 4));
  }
  const double speckle = speckle_factor * alone * (waves - 1) / frames;
  // Light that comes round the padded plane: its own, spread over the picture, and where it interferes with the picture.
  const double wrapped = std::min(1.0, padding_error * padding_error);
  const double grain = std::min(1.0, model.spot_m.x * model.spot_m.y / (4 * pi * blur_m * blur_m));
  for (const auto& row : model.rows) {
    const double dots_here = row.light * std::min(dots, 4.0), speckle_here = row.light * speckle;
    const double edges_here = edge_factor * row.edges_m * std::pow(p, 4) / std::pow(blur_m, 3) + cell_factor * row.light * p / blur_m;
    const double padding_here = row.light * wrapped * (background * wrapped + 2 * grain / frames);
    const double error = dots_here + speckle_here + edges_here + row.missing + padding_here;
    prediction.psnr_db.push_back(error > 0 ? -10 * std::log10(error) : 200);
    prediction.mean_psnr_db += prediction.psnr_db.back() / static_cast<double>(model.rows.size());
    prediction.dots += dots_here;
    prediction.speckle += speckle_here;
    prediction.edges += edges_here;
    prediction.missing += row.missing;
    prediction.padding += padding_here;
  }
  const double all = prediction.dots + prediction.speckle + prediction.edges + prediction.missing + prediction.padding;
  for (double* part : {&prediction.dots, &prediction.speckle, &prediction.edges, &prediction.missing, &prediction.padding})
    *part /= std::max(all, 1e-300);
  return prediction;
}

}  // namespace raywave
