// SPDX-License-Identifier: Apache-2.0
#include "host/plan/predict/cost.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "host/plan/footprint.hpp"
#include "host/plan/key_places.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/predict/memory.hpp"

namespace raywave {
namespace {

// Weights, fitted to the stages of the demo scenes on PoCL (docs/predictions.md).

/// Work of a ray beside its descent into the tree, in levels of depth.
constexpr double levels_of_a_ray = 4;

/// Rays that a lattice cell without a surface costs, since most of them end near the tree's root.
constexpr double rays_of_an_empty_cell = 2.6;

/// What a sample costs in a cell without breaks (kernels/samples/breaks.h), in rays, and the share
/// of cells with breaks: so many over the square root of the samples.
constexpr double rays_of_an_unbroken_cell = 8, broken_share = 25;

/// Rays that the visibility mask of a sample costs, and the cells around a break in which samples
/// need them.
constexpr double views_of_a_sample = 16, views_near_breaks = 4;

/// The launches of a picture, in levels of rays.
constexpr double levels_of_a_picture = 9e5;

/// Cost of a pair in each further frame, and what a light's highlight adds to a pair.
constexpr double further_frame = 0.08, highlight = 0.65;

/// Gathering goes by tiles, so many pixels wide and, of all frames together, high; a tile's rim
/// costs as much as its middle.
constexpr double tile_width = 16, tile_pixels_high = 16;

/// Cost of a plane-wave sample in pairs: per pixel of each frame, and per pixel of its width and
/// height to make its profiles.
constexpr double near_pixel = 0.093, profile_of_a_pixel = 7;

/// On virtual planes, in pairs: a pixel of a scan line, a node for a pixel of a profile, a pixel of
/// a frame, and placing a sample.
constexpr double compact_pixel = 0.1, compact_node = 0.1, compact_frame = 0.1, compact_sample = 60;

/// Projecting a sample onto a WRP and finding it from the tiles, each frame, in pairs.
constexpr double aim_of_a_sample = 29;

/// Passes over a pixel beside the transforms, in butterflies.
constexpr double butterflies_of_a_pixel = 9;

/// Padding of the refinement's planes, and passes over their pixels per iteration, in butterflies.
constexpr double refine_padding = 1.25, butterflies_of_a_refined_pixel = 18;

/// The same of pictures that are propagated exactly.
constexpr double exact_padding = 2, exact_transforms = 2;

/// A ray of a lens's picture over one of the sample lattice: it is shaded as well.
constexpr double lens_ray = 1;

/// Share of a scene's cells that have breaks; 1 where breaks are not looked for.
double share_of_broken_cells(const World& world, const Plan& plan, double samples) {
  const bool finds_breaks =
      !plan.lighting.shadows &&
      !plan.lighting.any_material([](const Material& m) { return m.texture.has_value(); }) &&
      breaks_pay(plan.lattice, world.triangles.size());
  return finds_breaks && samples > 0 ? std::min(broken_share / std::sqrt(samples), 1.0) : 1;
}

/// Adds what plan.refine costs.
void add_refinement(const Plan& plan, int frames, double levels_of_a_descent, Work& work) {
  const auto& settings = plan.refine.value();
  const double blur_m = settings.blur_m.value();
  const auto places = key_places(plan, blur_m, {settings.depths_m, settings.views});
  const auto window_m = settings.window_m.value_or(refine_window_m(plan));
  const auto pixels = key_pixels(plan, window_m, blur_m);
  for (const auto& place : places)
    work.lens_rays += lens_ray * levels_of_a_descent * pixels.x * pixels.y *
                      std::pow(key_lens_points(place, settings.lens_points), 2);
  // Butterflies of a look at each picture, and of both ways of an iteration
  const double area = static_cast<double>(plan.size.x) * plan.size.y;
  const auto looking = [&](double padding, double transforms) {
    const double plane = padding * padding * area;
    return plane * (transforms * std::log2(plane) + butterflies_of_a_refined_pixel / 2);
  };
  double draws = 0, all_looks = 0, drawn_looks = 0;
  for (const auto& place : places) {
    const auto open = place.aperture.x * place.aperture.y;
    const bool fresnel =
        fresnel_limits(plan.size, plan.pitch_m, plan.wavelength_m, blur_m, place.z_m, window_m)
            .hold();
    const double look =
        fresnel ? open * looking(refine_padding, 1) : looking(exact_padding, exact_transforms);
    all_looks += look;
    drawn_looks += place.times * look;
    draws += place.times;
  }
  const double iterations = settings.iterations.value_or(refine_iterations(places));
  work.refine_butterflies =
      frames * iterations * 2 * drawn_looks / draws + (frames - 1) * all_looks;
}

/// Pixels of all WRPs of a layer that the light of a sample crosses, along one axis.
struct Crossing {
  double pixels = 0;
  bool near = false;  // the sample's wave is made of plane waves
};

/// at_m  where the sample's ray to a tile's centre crosses the WRPs, which reach from first to last
Crossing crossing(const Plan& plan, const DepthLayer& layer, int axis, double at_m, double z_m,
                  double first_m, double last_m) {
  const auto footprint = footprint_of(plan, axis, layer.distance_m, z_m);
  const double low = std::max(at_m - footprint.reach_m(), first_m),
               high = std::min(at_m + footprint.reach_m(), last_m);
  return low < high
             ? Crossing{(high - low) / plan.gathered_pitch_m(layer)[axis], footprint.is_near()}
             : Crossing{};
}

/// Pixels of a WRP, one for each that a pass writes: gathered, and with all rows.
double pixels_written(const Plan& plan, const DepthLayer& layer) {
  const glm::dvec2 few = plan.gathered_size(layer), all = plan.tile_size;
  return few.x * few.y + (layer.interpolates() ? all.x * all.y : 0);
}

}  // namespace

double count_butterflies(const Plan& plan, int frames) {
  if (plan.compact) {
    const glm::dvec2 plane(plan.compact->size), tile(plan.tile_size);
    return frames * static_cast<double>(plan.wrps.size()) *
           (plane.x * plane.y * std::log2(plane.x) + tile.x * plane.y * std::log2(plane.y) +
            butterflies_of_a_pixel * tile.x * tile.y);
  }
  const glm::dvec2 padded(plan.padded), size(plan.tile_size);
  double forward = 0, widest = 0;
  for (const auto& wrp : plan.wrps) {
    const double rows = rows_kept(plan, wrp).count();
    forward += size.x * padded.y * std::log2(padded.y) + rows * padded.x * std::log2(padded.x) +
               butterflies_of_a_pixel * size.x * size.y;
    widest = std::max(widest, rows);
  }
  const double back = size.x * padded.y * std::log2(padded.y) +
                      widest * padded.x * std::log2(padded.x) +
                      butterflies_of_a_pixel * size.x * size.y;
  return frames * (forward + static_cast<double>(plan.tiles.size()) * back);
}

/// Footprints on virtual planes.
Footprints compact_footprints(const Plan& plan, const FrontView& view) {
  Footprints footprints;
  const auto& compact = plan.compact.value();
  const auto half_m = plan.tile_window_m() / 2.0,
             guard = glm::dvec2(compact.size) / glm::dvec2(plan.tile_size);
  for (const double z_m : view.depth_m) {
    if (z_m == 0) continue;
    const double z0_m = plan.layer_at(z_m).distance_m;
    const auto fresnel =
        half_m * half_m * (std::abs(z_m - z0_m) / (plan.wavelength_m * z_m * z0_m));
    const auto sides =
        glm::min(4.0 * guard * fresnel + 2 * compact.margin_px, glm::dvec2(compact.size));
    const auto tiles = static_cast<double>(plan.tiles.size());
    footprints.compact_pixels += tiles * (sides.x + tile_width) * sides.y;
    footprints.compact_squares += tiles * (sides.x * sides.x + sides.y * sides.y);
  }
  return footprints;
}

Footprints footprints_of(const Plan& plan, const FrontView& view) {
  Footprints footprints;
  if (!plan.aimed) return footprints;
  if (plan.compact) return compact_footprints(plan, view);
  std::vector<WrpsExtent> extents;
  for (const auto& layer : plan.layers) extents.push_back(wrps_extent(plan, layer));
  for (int y = 0; y < view.size.y; ++y) {
    for (int x = 0; x < view.size.x; ++x) {
      const auto cell = static_cast<std::size_t>(y) * static_cast<std::size_t>(view.size.x) +
                        static_cast<std::size_t>(x);
      const double z = view.depth_m[cell];
      if (z == 0) continue;
      const auto& layer = plan.layer_at(z);
      const auto& [first, last] = extents[static_cast<std::size_t>(&layer - plan.layers.data())];
      for (const auto& tile : plan.tiles) {
        const auto at =
            tile.centre_m + (view.tangent(x, y) * z - tile.centre_m) * (layer.distance_m / z);
        const auto across = crossing(plan, layer, 0, at.x, z, first.x, last.x),
                   up = crossing(plan, layer, 1, at.y, z, first.y, last.y);
        if (across.pixels == 0 || up.pixels == 0) continue;
        const double width = across.pixels + tile_width;
        if (across.near || up.near) {
          footprints.near_pixels += width * up.pixels;
          footprints.near_sides += across.pixels + up.pixels;
          continue;
        }
        footprints.far_pixels += width * up.pixels;
        footprints.far_widths += width;
        if (!view.shiny[cell]) continue;
        footprints.shiny_pixels += width * up.pixels;
        footprints.shiny_widths += width;
      }
    }
  }
  return footprints;
}

Work count_work(const Scene& scene, const World& world, const Plan& plan, const FrontView& view,
                const Footprints& footprints) {
  Work work;
  const double frames = scene.sampling.frames,
               pixels = static_cast<double>(plan.size.x) * plan.size.y;
  const double samples_of_a_cell = std::pow(view.step / plan.lattice.step, 2);
  for (const auto& wrp : plan.wrps)
    work.pixels += pixels_written(plan, plan.layer_of(wrp)) * frames;
  work.levels = pixels * frames;
  work.butterflies = count_butterflies(plan, scene.sampling.frames);
  const double levels =
      levels_of_a_ray + std::log2(static_cast<double>(world.triangles.size()) + 1);
  if (plan.refine) add_refinement(plan, scene.sampling.frames, levels, work);
  if (!plan.aimed) {
    work.pairs = static_cast<double>(plan.rays) * levels * frames;
    return work;
  }
  work.samples = view.covered * samples_of_a_cell;
  const double cells = static_cast<double>(plan.lattice.size.x) * plan.lattice.size.y,
               parts = 1 + plan.antialias * plan.antialias,
               broken = share_of_broken_cells(world, plan, work.samples);
  const double views =
      plan.visibility_parts > 0 ? views_of_a_sample * std::min(broken * views_near_breaks, 1.0) : 0;
  work.rays =
      levels * (std::max(0.0, cells - work.samples) * std::min(rays_of_an_empty_cell, parts) +
                work.samples * std::min(rays_of_an_unbroken_cell + parts * broken, parts) +
                view.pierced * samples_of_a_cell * views) +
      levels_of_a_picture;
  const double gatherings = plan.bounces > 0 ? frames : std::ceil(frames / most_frames_together);
  const auto lights = static_cast<double>(
      std::count_if(scene.lights.begin(), scene.lights.end(),
                    [](const Light& l) { return l.type != LightType::ambient; }));
  const double tile_height =
      std::clamp(std::floor(tile_pixels_high * gatherings / frames), 2.0, 16.0);
  if (plan.compact) {
    const double tiles = static_cast<double>(plan.tiles.size()), lines = plan.compact->lines;
    work.pairs = samples_of_a_cell * (gatherings * lines *
                                          (compact_pixel * footprints.compact_pixels +
                                           compact_node * footprints.compact_squares) +
                                      frames * compact_frame * footprints.compact_pixels) +
                 gatherings * tiles * compact_sample * work.samples;
    return work;
  }
  const double far_tiles = footprints.far_pixels + tile_height * footprints.far_widths;
  const double shiny_tiles = footprints.shiny_pixels + tile_height * footprints.shiny_widths;
  const double wrps_of_a_sample =
      static_cast<double>(plan.wrps.size()) / static_cast<double>(plan.layers.size());
  work.pairs = samples_of_a_cell * (gatherings * (far_tiles + highlight * lights * shiny_tiles +
                                                  profile_of_a_pixel * footprints.near_sides) +
                                    (frames - gatherings) * further_frame * far_tiles +
                                    frames * near_pixel * footprints.near_pixels) +
               frames * aim_of_a_sample * work.samples * wrps_of_a_sample;
  if (plan.bounces > 0) {
    for (const auto& wrp : plan.wrps)
      work.pairs += static_cast<double>(wrp.fan.size()) * pixels * levels * frames;
  }
  return work;
}

Band rows_kept(const Plan& plan, const Wrp& wrp) {
  const Axis axis{plan.padded.y, plan.pitch_m.y, plan.tile_size.y};
  return axis.sampled(
      // Rows count downwards
      band_m(plan.wavelength_m, wrp.centre_m.z, wrp.centre_m.y - plan.tile_of(wrp).centre_m.y,
             axis.reach_m()));
}

PredictedTimes predict_times(const Work& work, const DeviceRates& rates) {
  return {work.rays * rates.ray_s, work.pairs * rates.pair_s + work.pixels * rates.pixel_s,
          work.butterflies * rates.butterfly_s,
          work.lens_rays * rates.ray_s + work.refine_butterflies * rates.butterfly_s,
          work.levels * rates.level_s};
}

}  // namespace raywave
