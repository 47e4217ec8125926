// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/cost.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "host/carriers/wrps/planning/facts.hpp"
#include "host/plan/footprint.hpp"
#include "host/plan/key_places.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/memory.hpp"

namespace raywave {
namespace {

// Weights, fitted to the stages of the demo scenes on PoCL (docs/planning.md#predicted-times).

/// What finds samples, in rays: a cell of the lattice; a sample where no break is near, and for
/// each further sheet that its ray meets; the mask of a sample behind breaks, for 8 x 8 parts; a
/// sample where breaks are not looked for, with all parts of its cell and its mask.
constexpr double ray_of_cell = 3.9, rays_of_sample = 14, rays_of_sheet = 23, rays_of_mask = 20,
                 rays_without_breaks = 170, rays_of_sheet_without_breaks = 20;

/// What finds samples in mirrors and glass, likewise: a cell that shows them, a segment of a path
/// of its parts, one that meets nothing, and a source with each surface on its way; fits of a path
/// over the same. Of 28 scenes all but plane mirrors (3 times too much) and glass without end (a
/// third) take 0.5 to 2.7 times as long.
constexpr double rays_of_mirror = 66, rays_of_segment = 15, rays_of_lost_segment = 140,
                 rays_of_path = 410, fits_of_path = 0.75;

/// The same in rays times depth: a triangle whose breaks are looked for, shading a part of a cell
/// where parts differ in more than coverage, and the launches of a picture.
constexpr double levels_of_triangle = 140, levels_of_part = 37, levels_of_picture = 1.34e6;

/// Depth of the tree over the objects, for rays to lights, over the logarithm of their number.
constexpr double levels_of_objects = 2;

/// Samples that a cell along a surface's end has beside those of the covered cells, and a cell
/// whose surface is partly hidden.
constexpr double samples_at_end = 0.55, samples_behind = 0.4;

/// Work of a ray of a fan beside its descent into the tree, in levels of depth.
constexpr double levels_of_a_ray = 4;

/// Cost of a pair in each further frame, and what a light's highlight adds to a pair.
constexpr double further_frame = 0.08, highlight = 0.65;

/// Gathering goes by tiles, so many pixels wide and, of all frames together, high; a tile's edge
/// costs as much as its middle.
constexpr double tile_width = 16, tile_pixels_high = 16;

/// Cost of a plane-wave sample in pairs: per pixel of each frame, and per pixel of its width and
/// height to make its profiles.
constexpr double near_pixel = 0.18, profile_of_a_pixel = 7;

/// A pair at the hologram over one of WRPs: 1 to 4 frames of the near-eye scene take 0.95 to 1.1 of
/// the time predicted, a coin of slivers behind an eyepiece 1.5.
constexpr double pair_at_hologram = 1.3;

/// Projecting a sample onto a WRP and finding it from the tiles, each frame, in pairs.
constexpr double aim_of_a_sample = 29;

/// Passes over a pixel beside the transforms, in butterflies, and what a butterfly of a padded
/// plane costs over one of a virtual plane.
constexpr double butterflies_of_a_pixel = 9, padded_butterfly = 1.8;

/// Launches of the gathering on virtual planes, in nodes.
constexpr double nodes_of_picture = 2.5e5;

/// A frame's launches of the encoding, in levels.
constexpr double levels_of_a_frame = 1.5e5;

/// Passes over the pixels of the refinement's planes per iteration, in butterflies.
constexpr double butterflies_of_a_refined_pixel = 80;

/// The same towards pictures made of samples, and what a sample adds to the picture of an
/// iteration.
constexpr double butterflies_of_a_paced_pixel = 100, butterflies_of_a_paced_sample = 8000;

/// What a panel shows of a pixel in each iteration, and what each weight of its crosstalk adds: by
/// the processor time of two demo scenes over that without a panel, 1 to 289 weights. Least times
/// are within 7 %, medians of a busy machine within 15 %.
constexpr double butterflies_of_a_panel_pixel = 80, butterflies_of_a_neighbour = 0.65;

/// A ray of a lens's picture, in levels of the tree: each ray, and those that meet a surface for
/// each level and for each triangle in whose box they are. Ten scenes of 4 thousand to 260 thousand
/// triangles take 0.8 to 1.3 of the time predicted, but those under a second.
constexpr double levels_of_lens_ray = 5.8, lens_level = 0.93, levels_of_box = 1.45;

/// A ray that looks for the light of other surfaces, for each level of the tree.
constexpr double levels_of_look = 3;

/// Shares of such a ray's lights over those of a surface that is seen; the second where lights have
/// a size.
constexpr double lights_of_look = 0.3, lights_of_wide_look = 2.5;

/// True where find_samples knows the breaks of the surfaces (host/trace/samples.cpp).
bool knows_breaks(const World& world, const Plan& plan) {
  return breaks_pay(plan.lattice, world.triangles.size()) &&
         ray_bias_m(world, plan) < most_bias_of_breaks * plan.lattice.step * plan.extent.near_m;
}

/// Pixels of all WRPs of a layer that the light of a sample crosses, along one axis.
struct Crossing {
  double pixels = 0;
  bool near = false;  // the sample's wave is made of plane waves
};

/// at_m     where the sample's ray to a tile's centre crosses the WRPs, which reach from first to
///          last
/// place_m  of the sample
Crossing crossing(const Plan& plan, const DepthLayer& layer, int axis, double at_m,
                  glm::dvec3 place_m, double first_m, double last_m) {
  const double z_m = place_m.z;
  const auto footprint = is_near_hologram(plan) ? footprint_at_hologram(plan, axis, z_m)
                                                : footprint_of(plan, axis, layer.distance_m, z_m);
  double low = std::max(at_m - footprint.reach_m(), first_m),
         high = std::min(at_m + footprint.reach_m(), last_m);
  if (plan.beyond_diffraction &&
      !footprint.is_near()) {  // no pixels that its light is too steep for
    const double shown = std::abs(z_m - layer.distance_m) * plan.hologram.largest_sine[axis];
    low = std::max(low, place_m[axis] - shown);
    high = std::min(high, place_m[axis] + shown);
  }
  return low < high ? Crossing{(high - low) / plan.hologram.pitch_m[axis], footprint.is_near()}
                    : Crossing{};
}

/// Rays to lights over those of parts that ask for all. Probes stand for most lights that have a
/// size (TraceSpec::shadow_rays), but not where rays to other surfaces end.
double lights_asked(const Plan& plan, const FrontView& view) {
  const auto& lighting = plan.lighting;
  double all = 0, asked = 0;
  for (const auto& light : lighting.lights) {
    const int directions = directions_of(light);
    all += directions;
    asked += directions * (has_size(light) ? lighting.shadow_rays / 16.0 : 1);
  }
  if (all == 0 || view.covered == 0) return 0;
  const double of_look = asked < all ? lights_of_wide_look : lights_of_look;
  return asked / all + of_look * view.looks / view.covered;
}

/// Adds what the pictures of a lens cost that a refinement goes by.
void add_lens_of_refinement(const World& world, const Plan& plan, const FrontView& view,
                            Work& work) {
  const auto& settings = plan.refine.value();
  const auto window_m = refine_window_m(plan);
  const auto pixels = key_pixels(plan, window_m, settings.blur_m.value());
  double points = 0;
  for (const auto& place : planned_places(plan))
    points += std::pow(key_lens_points(place, settings.lens_points), 2);
  const auto lens = lens_work(world, plan, view, window_m, points * pixels.x * pixels.y);
  work.lens_rays += lens.lens_rays;
  work.shadow_rays += lens.shadow_rays;
}

}  // namespace

void add_refinement(const Plan& plan, int frames, Work& work) {
  const auto& settings = plan.refine.value();
  const double blur_m = settings.blur_m.value();
  const auto places = planned_places(plan);
  const auto window_m = refine_window_m(plan);
  const bool of_samples = refines_samples(plan);
  // Butterflies of a look at each picture, and of both ways of an iteration
  const double area = static_cast<double>(plan.hologram.size.x) * plan.hologram.size.y;
  const double of_pixel =
      (of_samples ? butterflies_of_a_paced_pixel : butterflies_of_a_refined_pixel) / 2;
  const auto of_plane = [&](double plane) { return plane * (std::log2(plane) + of_pixel); };
  const auto looking = [&](double padding) { return of_plane(padding * padding * area); };
  double draws = 0, all_looks = 0, drawn_looks = 0;
  for (const auto& place : places) {
    const auto open = place.aperture.x * place.aperture.y;
    const auto& h = plan.hologram;
    const auto propagation =
        key_propagation(h.size, h.pitch_m, h.wavelength_m, blur_m, place.z_m, window_m);
    const auto through_pupil = [&] {
      const glm::dvec2 sides =
          samples_through_pupil(place, plan.hologram.size, plan.hologram.pitch_m, blur_m);
      return of_plane(sides.x * sides.y);
    };
    const double look =
        place.pupil  ? through_pupil()
        : of_samples ? open * looking(1)
        : propagation == KeyPropagation::fresnel
            ? open * looking(refine_padding)
            : butterflies_of_look(
                  spectrum_planes(propagation, place, h.size, h.pitch_m, h.wavelength_m, window_m),
                  window_m, blur_m);
    all_looks += look;
    drawn_looks += place.times * look;
    draws += place.times;
  }
  const double iterations = planned_iterations(plan);
  // An iteration takes a round: all parts of the hologram, or of the pupil's plane beyond it
  const bool has_pupil = places.back().pupil.has_value();
  const double each = has_pupil    ? looking(1) + all_looks / (places.back().round + 1)
                      : of_samples ? looking(1)
                                   : drawn_looks / draws;
  work.refine_butterflies = frames * iterations * 2 * each + (frames - 1) * all_looks;
  if (adds_to_phases(plan.slm)) {
    const auto crosstalk = kernel_of(plan.slm.crosstalk, plan.hologram.pitch_m);
    work.refine_butterflies +=
        (frames * iterations + frames - 1) * area *
        (butterflies_of_a_panel_pixel +
         butterflies_of_a_neighbour * static_cast<double>(crosstalk.weights.size()));
  }
  if (of_samples)
    work.picture_butterflies = butterflies_of_a_paced_sample * iterations * work.samples;
}

double count_butterflies(const Plan& plan, int frames) {
  if (const auto* planes = plan.virtual_planes()) {
    const glm::dvec2 plane(planes->size), tile(plan.tiling.tile_size);
    return frames * static_cast<double>(plan.wrps.size()) *
           (plane.x * plane.y * std::log2(plane.x) + tile.x * plane.y * std::log2(plane.y) +
            butterflies_of_a_pixel * tile.x * tile.y);
  }
  const auto* wrps = std::get_if<SpectrumWrps>(&plan.carrier);
  if (!wrps) return 0;  // nothing is propagated
  const glm::dvec2 padded(wrps->padded), size(plan.tiling.tile_size);
  const auto one_way = [&](double rows) {
    return size.x * padded.y * std::log2(padded.y) + rows * padded.x * std::log2(padded.x) +
           butterflies_of_a_pixel * size.x * size.y;
  };
  double forward = 0, widest = 0;
  for (const auto& wrp : plan.wrps) {
    const double rows = rows_kept(*wrps, plan, wrp).count();
    forward += one_way(rows);
    widest = std::max(widest, rows);
  }
  return padded_butterfly * frames *
         (forward + static_cast<double>(plan.tiling.tiles.size()) * one_way(widest));
}

Footprints footprints_of(const Plan& plan, const FrontView& view) {
  Footprints footprints;
  if (!plan.samples.aimed) return footprints;
  if (const auto* planes = plan.virtual_planes()) {
    footprints.on_virtual_planes = nodes_of(*planes, plan, view);
    return footprints;
  }
  std::vector<WrpsExtent> extents;
  for (const auto& layer : plan.layers) extents.push_back(wrps_extent(plan, layer));
  view.for_surfaces([&](int x, int y, std::size_t cell, double z) {
    const auto& layer = plan.layer_at(z);
    const auto& [first, last] = extents[static_cast<std::size_t>(&layer - plan.layers.data())];
    for (const auto& tile : plan.tiling.tiles) {
      const auto place = view.place_m(x, y, z);
      const auto at = is_near_hologram(plan)
                          ? place
                          : tile.centre_m + (place - tile.centre_m) * (layer.distance_m / z);
      const auto across = crossing(plan, layer, 0, at.x, {place, z}, first.x, last.x),
                 up = crossing(plan, layer, 1, at.y, {place, z}, first.y, last.y);
      if (across.pixels == 0 || up.pixels == 0) continue;
      const double width = (across.pixels + tile_width) * view.sources[cell];
      if (across.near || up.near) {
        footprints.near_pixels += width * up.pixels;
        footprints.near_sides += (across.pixels + up.pixels) * view.sources[cell];
        continue;
      }
      footprints.far_pixels += width * up.pixels;
      footprints.far_widths += width;
      if (!view.shiny[cell]) continue;
      footprints.shiny_pixels += width * up.pixels;
      footprints.shiny_widths += width;
    }
  });
  return footprints;
}

/// Adds what finding the samples costs.
///
/// descent  depth of the tree
void count_samples(const World& world, const Plan& plan, const FrontView& view, double descent,
                   Work& work) {
  // Lengths in the view are counted in cells of the lattice, and areas in its samples
  const double cells_of_a_cell = view.step / plan.lattice.step,
               samples_of_a_cell = cells_of_a_cell * cells_of_a_cell;
  const double ends = view.ends * cells_of_a_cell;
  work.samples = view.covered * samples_of_a_cell + samples_at_end * ends +
                 samples_behind * view.hidden * samples_of_a_cell;
  const double samples = work.samples, sheets = view.covered > 0 ? view.pierced / view.covered : 1,
               more_sheets = std::max(0.0, sheets - 1),
               masks = std::pow(plan.samples.visibility_parts / 8.0, 2),
               parts = plan.samples.antialias * plan.samples.antialias;
  double rays = ray_of_cell * plan.lattice.size.x * plan.lattice.size.y +
                samples * (rays_of_sample + rays_of_sheet * more_sheets);
  if (knows_breaks(world, plan)) {
    const double near =
        std::min(samples, ends + (view.behind_breaks + view.steep) * samples_of_a_cell);
    rays += rays_of_mask * masks * near * (1 + more_sheets);
    work.rays += levels_of_triangle * static_cast<double>(world.triangles.size());
  } else {
    rays += samples * (1 + masks) / 2 *
            (rays_without_breaks + rays_of_sheet_without_breaks * more_sheets);
  }
  // What mirrors and glass show: rays of all parts of a cell along each path, and to the parts of
  // the hologram from each source
  work.samples += view.images * samples_of_a_cell;
  const double to_parts =
      (view.images + view.image_surfaces) * (1 + (has_fitted_paths(plan) ? fits_of_path : 0));
  rays += samples_of_a_cell * (rays_of_mirror * view.specular + rays_of_segment * view.segments +
                               rays_of_lost_segment * view.lost + rays_of_path * to_parts);
  work.rays += descent * rays + levels_of_picture;
  if (shades_parts(plan, world.triangles.size())) work.rays += levels_of_part * parts * samples;
  work.rays += levels_of_look * descent * (1 + parts) * samples_of_a_cell * view.looks;
  if (plan.lighting.shadows)
    work.shadow_rays =
        (1 + parts) * samples_of_a_cell * lights_asked(plan, view) *
        (view.lights_faced_levels +
         view.lights_faced * levels_of_objects *
             std::log2(static_cast<double>(plan.lighting.material_of_object.size())));
}

Work count_work(const Scene& scene, const World& world, const Plan& plan, const FrontView& view,
                const Footprints& footprints) {
  Work work;
  const double frames = scene.sampling.frames,
               pixels = static_cast<double>(plan.hologram.size.x) * plan.hologram.size.y;
  const double samples_of_a_cell = std::pow(view.step / plan.lattice.step, 2);
  const auto* planes = plan.virtual_planes();
  if (!planes)
    work.pixels = static_cast<double>(plan.wrps.size()) * plan.tiling.tile_size.x *
                  plan.tiling.tile_size.y * frames;
  work.levels = (pixels + levels_of_a_frame) * frames;
  work.butterflies = count_butterflies(plan, scene.sampling.frames);
  const double descent = std::log2(static_cast<double>(world.triangles.size()) + 1),
               levels = levels_of_a_ray + descent;
  if (plan.samples.aimed) count_samples(world, plan, view, descent, work);
  if (plan.refine) add_refinement(plan, scene.sampling.frames, work);
  if (plan.refine && !refines_samples(plan)) add_lens_of_refinement(world, plan, view, work);
  if (!plan.samples.aimed) {
    work.pairs = static_cast<double>(primary_rays(plan)) * levels * frames;
    return work;
  }
  const double gatherings = std::ceil(frames / most_frames_together);
  const double lights =
      directions_of(plan.lighting.lights, [](const Light& light) { return light.highlights; });
  if (planes) {
    const double in_frames = frames > 1 ? frames : 0;
    work.nodes = samples_of_a_cell * (gatherings * footprints.on_virtual_planes.nodes +
                                      in_frames * footprints.on_virtual_planes.frame_nodes) +
                 nodes_of_picture;
    return work;
  }
  const double tile_height =
      std::clamp(std::floor(tile_pixels_high * gatherings / frames), 2.0, 16.0);
  const double far_tiles = footprints.far_pixels + tile_height * footprints.far_widths;
  const double shiny_tiles = footprints.shiny_pixels + tile_height * footprints.shiny_widths;
  const double wrps_of_a_sample =
      static_cast<double>(plan.wrps.size()) / static_cast<double>(plan.layers.size());
  work.pairs = samples_of_a_cell * (gatherings * (far_tiles + highlight * lights * shiny_tiles +
                                                  profile_of_a_pixel * footprints.near_sides) +
                                    (frames - gatherings) * further_frame * far_tiles +
                                    frames * near_pixel * footprints.near_pixels) +
               frames * aim_of_a_sample * work.samples * wrps_of_a_sample;
  if (is_near_hologram(plan)) work.pairs *= pair_at_hologram;
  return work;
}

Work lens_work(const World& world, const Plan& plan, const FrontView& view, glm::dvec2 window_m,
               double rays) {
  Work work;
  if (view.covered == 0) return work;
  const double descent = std::log2(static_cast<double>(world.triangles.size()) + 1),
               boxes = view.boxes / view.covered,
               middle_m = (plan.extent.near_m + plan.extent.far_m) / 2 - view.eye_z_m,
               seen_m2 = view.covered * std::pow(view.step * middle_m, 2);
  const double met = rays * std::min(1.0, seen_m2 / (window_m.x * window_m.y));
  work.lens_rays = levels_of_lens_ray * rays + (lens_level * descent + levels_of_box * boxes) *
                                                   met * (1 + view.segments / view.covered);
  work.lens_rays += levels_of_look * descent * met * view.looks / view.covered;
  if (plan.lighting.shadows)
    work.shadow_rays = met * (1 + lights_of_look * view.looks / view.covered) *
                       view.lights_faced_levels / view.covered;
  return work;
}

PredictedTimes predict_times(const Work& work, const DeviceRates& rates) {
  return {work.rays * rates.ray_s + work.shadow_rays * rates.shadow_ray_s,
          work.nodes * rates.node_s + work.pairs * rates.pair_s + work.pixels * rates.pixel_s,
          work.butterflies * rates.butterfly_s,
          work.lens_rays * rates.ray_s + work.refine_butterflies * rates.butterfly_s +
              work.picture_butterflies * rates.host_butterfly_s,
          work.levels * rates.level_s};
}

double predicted_s(const Scene& scene, const World& world, const Plan& plan,
                   const DeviceRates& rates) {
  constexpr int cells = 128;
  const auto view = front_view(scene, world, plan, cells);
  return predict_times(count_work(scene, world, plan, view, footprints_of(plan, view)), rates)
      .total_s();
}

}  // namespace raywave
