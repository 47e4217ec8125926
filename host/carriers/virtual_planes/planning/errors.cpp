// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/virtual_planes/planning/errors.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <glm/common.hpp>
#include <numbers>
#include <numeric>
#include <set>
#include <vector>

#include "host/carriers/virtual_planes/planning/planes.hpp"
#include "kernels/gather/compact_layout.h"

namespace raywave {
namespace {

using Complex = std::complex<double>;

constexpr double tau = 2 * std::numbers::pi;

/// Error of a line of light that spreads over `fresnel` (a Fresnel number), relative, squared.
/// `offset`: of its pixels from those of the plane.
double squared_window_error(const WindowFunction& window, double guard, double margin_px,
                            double fresnel, double offset) {
  const int nodes = std::min(256 + 8 * static_cast<int>(guard * fresnel), 4096);
  const double rays_px = 2 * guard * fresnel + margin_px;
  std::vector<Complex> pixels;
  const int first = static_cast<int>(std::ceil(offset - rays_px)),
            count_px = static_cast<int>(std::floor(offset + rays_px)) + 1 - first,
            last = first + count_px + count_px % 2 - 1;  // an even number of pixels
  const auto at = [&](int node) { return ((node + 0.5) / nodes * 2 - 1) * window.reach; };
  std::vector<Complex> light;
  for (int node = 0; node < nodes; ++node) {
    const double t = at(node);
    light.push_back(window(t) * std::polar(1.0, tau / 2 * (fresnel * t * t - offset * t / guard)));
  }
  const auto twiddle = [&](int pixel, double t) {
    return std::polar(1.0, tau / 2 * pixel * t / guard);
  };
  for (int pixel = first; pixel <= last; ++pixel) {
    Complex sum = 0;
    for (int node = 0; node < nodes; ++node)
      sum += light[static_cast<std::size_t>(node)] * twiddle(pixel, at(node));
    pixels.push_back(sum * (window.reach / guard / nodes));
  }
  double wrong = 0;
  int count = 0;
  for (int node = 0; node < nodes; node += 2) {
    const double t = at(node);
    if (std::abs(t) > 1) continue;
    Complex back = 0;
    for (int pixel = first; pixel <= last; ++pixel)
      back += pixels[static_cast<std::size_t>(pixel - first)] * std::conj(twiddle(pixel, t));
    wrong += std::norm((back - light[static_cast<std::size_t>(node)]) / window(t));
    ++count;
  }
  return wrong / std::max(count, 1);
}

double length(double x, double y, double z) { return std::sqrt(x * x + y * y + z * z); }

/// Place number i of `count`, evenly spread over -1 to 1.
double place_of(int i, int count) { return (i + 0.5) * 2 / count - 1; }

/// Van der Corput's numbers in a base: evenly spread over 0 to 1.
double spread(int i, int base) {
  double value = 0, share = 1;
  for (; i > 0; i /= base) value += (i % base) * (share /= base);
  return value;
}

/// Mean over layers and four depths of what `squared_error(axis, depth, guard, fresnel)` says of
/// both axes, the root of it. `fresnel`: Fresnel number of the light of a sample at that depth.
template <class F>
double rms_over_depths(const Plan& plan, const F& squared_error) {
  constexpr int depths = 4;
  double sum = 0;
  for (const auto& layer : plan.layers) {
    for (int axis = 0; axis < 2; ++axis) {
      const double half_m = plan.tile_window_m()[axis] / 2,
                   guard = 1.0 * plan.virtual_planes()->size[axis] / plan.tiling.tile_size[axis];
      for (int i = 0; i < depths; ++i) {
        const double z_m = glm::mix(layer.min_m.z, layer.max_m.z, i / (depths - 1.0)),
                     z0_m = layer.distance_m;
        const double fresnel = half_m * half_m * std::abs(z_m - z0_m) /
                               (plan.hologram.wavelength_m * std::abs(z_m * z0_m));
        sum += squared_error(axis, (i + 0.5) / depths, guard, fresnel) / depths;
      }
    }
  }
  return std::sqrt(sum / static_cast<double>(plan.layers.size()));
}

/// Share of a line of light that is cut off a footprint.
double share_cut_off(const VirtualPlanes& plane, double guard, double fresnel) {
  return std::max(0.0, 1 - (COMPACT_WIDEST - 2 * plane.margin_px) / (4 * guard * fresnel));
}

/// Scan lines, and Lagrange's polynomials of them at places along the column.
struct ScanLines {
  std::vector<double> rows_m;
  std::vector<std::vector<double>> lagrange;  // by place

  ScanLines(int count, double half_m, int places) : lagrange(static_cast<std::size_t>(places)) {
    for (int line = 0; line < count; ++line)
      rows_m.push_back(std::cos(tau / 2 * (line + 0.5) / count) * half_m);
    for (int j = 0; j < places; ++j) {
      const double v = place_of(j, places) * half_m;
      for (const double row_m : rows_m) {
        double product = 1;
        for (const double other_m : rows_m) {
          if (other_m != row_m) product *= (v - other_m) / (row_m - other_m);
        }
        lagrange[static_cast<std::size_t>(j)].push_back(product);
      }
    }
  }
};

// Relative L2 errors of the field at the hologram, of samples that nothing hides: within a factor
// of 1.6 of what scenes show (tests/trace/compact.cpp); the scene is taken to fill its box.

/// Error of the window and of cutting footprints off: along each axis, the wave of samples at some
/// depths is cut, carried to the hologram and back.
double predicted_window_error(const Plan& plan) {
  const auto& plane = *plan.virtual_planes();
  constexpr double longest = 30;  // Fresnel number; longer footprints are no harder
  return rms_over_depths(plan, [&](int axis, double offset, double guard, double fresnel) {
    return squared_window_error(window_function(plan, axis), guard, plane.margin_px,
                                std::min(fresnel, longest), offset) +
           share_cut_off(plane, guard, fresnel);
  });
}

/// The part of it that comes from cutting long footprints off, in no time.
double predicted_cut_error(const Plan& plan) {
  return rms_over_depths(plan, [&](int, double, double guard, double fresnel) {
    return share_cut_off(*plan.virtual_planes(), guard, fresnel);
  });
}

/// a: how much sharper than the tile the amplitude of the sharpest highlight is; 0 where there is
/// none. Phong's lobe cos^m over an angle v / z is exp(-m v^2 / (2 z^2)), its amplitude the root.
double sharpest_highlight(const Plan& plan) {
  const auto& all = plan.lighting;
  const bool is_lit =
      std::ranges::any_of(all.lights, [](auto& l) { return l.type != LightType::ambient; });
  double exponent = 0;
  for (const auto number : all.used) {
    const auto& material = all.materials[static_cast<std::size_t>(number)];
    if (is_lit && has_highlights(material, plan.channels()))
      exponent = std::max(exponent, sharpest_shininess(material));
  }
  const double angle = plan.tile_window_m().y / 2 / plan.extent.closest_m;
  return exponent / 4 * angle * angle;
}

/// Error of so many scan lines in light that is a highlight alone, the sharpest of the scene's
/// materials: what interpolation leaves of its lobe exp(-a (t - t0)^2), t in half tiles up or down.
double predicted_highlights_error(const Plan& plan, int lines) {
  const double sharpness = sharpest_highlight(plan);
  constexpr int places = 24, middles = 17;
  const ScanLines scan(lines, 1, places);
  double wrong = 0, all = 0;
  for (int i = 0; i < middles; ++i) {
    const double middle = 2.0 * i / (middles - 1) - 1;
    const auto lobe = [&](double t) { return std::exp(-sharpness * (t - middle) * (t - middle)); };
    std::vector<double> on_rows;
    for (const double row : scan.rows_m) on_rows.push_back(lobe(row));
    for (int j = 0; j < places; ++j) {
      const auto& weights = scan.lagrange[static_cast<std::size_t>(j)];
      const double made = std::inner_product(on_rows.begin(), on_rows.end(), weights.begin(), 0.0);
      const double wanted = lobe(place_of(j, places));
      wrong += std::pow(made - wanted, 2);
      all += std::pow(wanted, 2);
    }
  }
  return std::sqrt(wrong / all);
}

/// Error of so many scan lines, or fewer for samples within VirtualPlanes::lines_tolerance: what
/// interpolation between them leaves of the phases of samples spread through each layer's box.
double predicted_lines_error(const Plan& plan, int lines) {
  constexpr int samples = 24, places = 12;
  const auto half_m = plan.tile_window_m() / 2.0;
  const double wave_number = tau / plan.hologram.wavelength_m;
  std::vector<ScanLines> of_count;
  for (int count = 1; count <= lines; ++count) of_count.emplace_back(count, half_m.y, places);
  double sum = 0;
  const glm::dvec2 first(plan.lattice.first), size(plan.lattice.size);
  const std::set<std::size_t> tiles{0, plan.tiling.tiles.size() / 2, plan.tiling.tiles.size() - 1};
  for (const auto number : tiles) {
    const auto& tile = plan.tiling.tiles[number];
    for (const auto& layer : plan.layers) {
      const double z0_m = layer.distance_m;
      for (int i = 1; i <= samples; ++i) {
        // Within the box and what the lattice sees of it
        const double z_m = glm::mix(layer.min_m.z, layer.max_m.z, spread(i, 2));
        glm::dvec2 at_m;
        for (int axis = 0; axis < 2; ++axis) {
          const double low = std::max(layer.min_m[axis], first[axis] * plan.lattice.step * z_m),
                       high = std::min(layer.max_m[axis],
                                       (first[axis] + size[axis]) * plan.lattice.step * z_m);
          at_m[axis] = glm::mix(low, std::max(low, high), spread(i, axis == 0 ? 3 : 5)) -
                       tile.centre_m[axis];
        }
        at_m.y = -at_m.y;
        const auto psi = [&](double u, double v) {
          return wave_number * (length(u - at_m.x, v - at_m.y, z_m) - length(u, v, z0_m));
        };
        const int count = scan_lines_of(plan, lines, {at_m, z_m}, z0_m);
        const auto& [rows_m, lagrange] = of_count[static_cast<std::size_t>(count - 1)];
        // The lines, then the places between them
        std::vector<double> v_m = rows_m, on_middle;
        for (int j = 0; j < places; ++j) v_m.push_back(place_of(j, places) * half_m.y);
        for (const double v : v_m) on_middle.push_back(psi(0, v));
        std::vector<Complex> coupled(v_m.size());
        for (int column = 0; column < places; ++column) {
          const double u = place_of(column, places) * half_m.x;
          for (std::size_t k = 0; k < v_m.size(); ++k)
            coupled[k] = std::polar(1.0, psi(u, v_m[k]) - on_middle[k]);
          for (std::size_t j = 0; j < lagrange.size(); ++j) {
            Complex made = 0;
            for (std::size_t line = 0; line < rows_m.size(); ++line)
              made += coupled[line] * lagrange[j][line];
            sum += std::norm(coupled[rows_m.size() + j] - made);
          }
        }
      }
    }
  }
  return std::sqrt(
      sum / (static_cast<double>(tiles.size() * plan.layers.size()) * samples * places * places));
}

/// Of the scan lines, too: footprints that are cut off are no reason for fewer.
constexpr double largest_window_error = 0.03;

/// As few scan lines as add little to what the window leaves wrong, where they do at all.
void choose_fewest_lines(const Plan& plan, VirtualPlanes& planes) {
  const double enough = 0.5 * std::min(planes.window_error, largest_window_error);
  planes.lines_tolerance = enough;
  const auto error = [&](int lines) { return predicted_lines_error(plan, lines); };
  planes.lines_error = error(planes.lines);
  while (planes.lines_error > enough && planes.lines < COMPACT_MOST_LINES)
    planes.lines_error = error(++planes.lines);
  // A scan line less has four times the error, and more: no need to look closer at every frame
  while (planes.lines > 1 && planes.lines_error <= enough / 4) {
    const double fewer = error(planes.lines - 1);
    if (fewer > enough) break;
    --planes.lines;
    planes.lines_error = fewer;
  }
}

/// Light that is the scene's sharpest highlights alone may be off by this between scan lines.
constexpr double most_highlights_error = 0.01;

/// Highlights that change as much over half a tile need room for their diffraction.
constexpr double sharp_highlight = 0.25;

/// Scan lines and margin of samples with highlights.
void choose_for_highlights(const Plan& plan, bool lines_are_given, VirtualPlanes& planes) {
  const double sharpness = sharpest_highlight(plan);
  planes.highlight_margin_px =
      sharpness > sharp_highlight ? planes.rough_margin_px : planes.margin_px;
  planes.highlight_lines = lines_are_given ? planes.lines : 1;
  const auto error = [&] {
    return sharpness > 0 ? predicted_highlights_error(plan, planes.highlight_lines) : 0;
  };
  planes.highlights_error = error();
  while (!lines_are_given && planes.highlights_error > most_highlights_error &&
         planes.highlight_lines < COMPACT_MOST_LINES) {
    ++planes.highlight_lines;
    planes.highlights_error = error();
  }
}

}  // namespace

int scan_lines_of(const Plan& plan, int most, glm::dvec3 at_m, double z0_m) {
  const double tolerance = plan.virtual_planes()->lines_tolerance;
  const auto half_m = plan.tile_window_m() / 2.0;
  const auto r = [&](double u, double v) { return length(u - at_m.x, v - at_m.y, at_m.z); };
  const auto c = [&](double u, double v) { return length(u, v, z0_m); };
  double odd = 0, even = 0;  // radians
  for (const double u : {-half_m.x, half_m.x}) {
    const auto coupled = [&](double v) {
      return tau / plan.hologram.wavelength_m * (r(u, v) - r(0, v) - c(u, v) + c(0, v));
    };
    const double up = coupled(half_m.y), down = coupled(-half_m.y);
    odd = std::max(odd, std::abs(up - down) / 2);
    even = std::max(even, std::abs((up + down) / 2 - coupled(0)));
  }
  int count = most;
  while (count > 1 &&
         COMPACT_LINES_ERROR(count - 1, even, std::pow(odd + even, count - 1)) <= tolerance)
    --count;
  return count;
}

void choose_lines(Plan& plan, bool lines_are_given, const Plan* moved_from) {
  auto& planes = std::get<VirtualPlanes>(plan.carrier);
  if (const auto* before = moved_from ? moved_from->virtual_planes() : nullptr) {
    planes = *before;
    planes.window_error = std::max(planes.window_error, predicted_cut_error(plan));
  } else {
    planes.window_error = predicted_window_error(plan);
  }
  if (lines_are_given)
    planes.lines_error = predicted_lines_error(plan, planes.lines);
  else
    choose_fewest_lines(plan, planes);
  choose_for_highlights(plan, lines_are_given, planes);
}

}  // namespace raywave
