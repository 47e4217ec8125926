// SPDX-License-Identifier: Apache-2.0
#include "host/plan/make_plan.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/plan/compact.hpp"
#include "host/plan/compact_errors.hpp"
#include "host/plan/fans.hpp"
#include "host/plan/images.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/message_text.hpp"
#include "host/plan/precision.hpp"
#include "host/plan/slm_stop.hpp"
#include "host/plan/tiles.hpp"
#include "host/plan/wrp_placement.hpp"
#include "kernels/gather/compact_layout.h"

namespace raywave {
namespace {

/// Sine of the steepest light that pixels can show, per axis.
glm::dvec2 largest_sine_of(double wavelength_m, const Plan& plan) {
  return glm::min(glm::dvec2(1), wavelength_m / (2.0 * plan.pitch_m));
}

/// Tangent of the steepest ray to the optical axis that pixels can show, per axis.
glm::dvec2 steepest_tangent(glm::dvec2 largest_sine) {
  glm::dvec2 tangent;
  for (int axis = 0; axis < 2; ++axis) {
    const double sine = std::min(largest_sine[axis], 0.999);
    tangent[axis] = sine / std::sqrt(1 - sine * sine);
  }
  return tangent;
}

/// The planes of Method::points and Method::rays, at the hologram itself: one per tile.
Placement place_at_hologram(const World& world, glm::dvec2 steepest, int rays_per_axis,
                            bool is_near, Plan& plan) {
  Placement placement{{}, all_tangents};
  plan.layers = {{.distance_m = 0, .min_m = world.min_m, .max_m = world.max_m}};
  for (std::size_t i = 0; i < plan.tiles.size(); ++i) {
    if (!is_near)
      placement.extents.add(extents_of(world, seen_through(0, steepest, plan, plan.tiles[i])));
    plan.wrps.push_back(plane_at_hologram(plan, i, steepest, rays_per_axis));
  }
  return placement;
}

/// Scenes on both sides of the hologram with surfaces nearer to it than this share of its longer
/// side are sampled from before them, and gathered at the hologram.
constexpr double near_hologram = 0.25;

/// True for them: on one side alone, the lattice from the hologram's centre serves.
bool meets_hologram(const World& world, const Plan& plan) {
  if (plan.near_m > 0 || plan.far_m < 0) return false;
  const auto window = plan.window_m();
  return closest_m(world) < near_hologram * std::max(window.x, window.y);
}

/// Double phase brings haze into pictures that fill the band: the light of its checkerboard comes
/// back there (docs/slm.md).
constexpr double most_filled_by_double_phase = 0.6;

/// Share of the SLM's band, mean of the axes, that light from all vertices to the hologram's middle
/// needs.
double share_of_band(const World& world, glm::dvec2 largest_sine) {
  glm::dvec2 low(1), high(-1);
  for (const auto& position_m : positions_now(world)) {
    if (position_m.z == 0) continue;
    const auto tangent = glm::dvec2(position_m) / position_m.z;
    const auto sine = tangent / glm::sqrt(1.0 + tangent * tangent);
    low = glm::min(low, sine);
    high = glm::max(high, sine);
  }
  const auto filled = glm::clamp((high - low) / (2.0 * largest_sine), 0.0, 1.0);
  return std::sqrt(filled.x * filled.y);
}

/// Of the scan lines, too: footprints that are cut off are no reason for fewer.
constexpr double largest_window_error = 0.03;

/// As few scan lines as add little to what the window leaves wrong, where they do at all.
void choose_lines(Plan& plan) {
  auto& compact = plan.compact.value();
  const double enough = 0.5 * std::min(compact.window_error, largest_window_error);
  compact.lines_tolerance = enough;
  const auto error = [&](int lines) { return predicted_lines_error(plan, lines); };
  compact.lines_error = error(compact.lines);
  while (compact.lines_error > enough && compact.lines < COMPACT_MOST_LINES)
    compact.lines_error = error(++compact.lines);
  // A scan line less has four times the error, and more: no need to look closer at every frame
  while (compact.lines > 1 && compact.lines_error <= enough / 4) {
    const double fewer = error(compact.lines - 1);
    if (fewer > enough) break;
    --compact.lines;
    compact.lines_error = fewer;
  }
}

/// Light that is the scene's sharpest highlights alone may be off by this between scan lines.
constexpr double most_highlights_error = 0.01;

/// Highlights that change as much over half a tile need room for their diffraction.
constexpr double sharp_highlight = 0.25;

/// Scan lines and margin of samples with highlights.
void choose_for_highlights(Plan& plan, bool lines_are_given) {
  auto& compact = plan.compact.value();
  const double sharpness = sharpest_highlight(plan);
  compact.highlight_margin_px =
      sharpness > sharp_highlight ? compact.rough_margin_px : compact.margin_px;
  compact.highlight_lines = lines_are_given ? compact.lines : 1;
  const auto error = [&] {
    return sharpness > 0 ? predicted_highlights_error(plan, compact.highlight_lines) : 0;
  };
  compact.highlights_error = error();
  while (!lines_are_given && compact.highlights_error > most_highlights_error &&
         compact.highlight_lines < COMPACT_MOST_LINES) {
    ++compact.highlight_lines;
    compact.highlights_error = error();
  }
}

/// Says what does not know surfaces before the hologram.
///
/// throws  InputError naming it
void require_known_sides(const Scene& scene, const Plan& plan, Method method) {
  if (plan.near_m > 0) return;
  const auto refuse = [&](const std::string& what) {
    throw InputError(one_line(scene.file.string()) + ": the scene reaches to z = " +
                     millimetres(plan.near_m) + ", before the hologram: " + what);
  };
  if (!plan.aimed)
    refuse(method == Method::rays
               ? "--method rays sends rays from the hologram to z > 0; give \"points\""
               : "rays of a fan go to z > 0; give sampling.mode \"aimed\"");
  if (plan.bounces > 0)
    refuse("mirrors and glass are followed at z > 0 only; give trace.depth 0, or move the scene");
  if (scene.refine) refuse("[refine] knows pictures at z > 0 only; leave it out");
  if (!scene.wrp.distances_m.empty() && method == Method::wrp &&
      (scene.wrp.distances_m.front() > 0 || (plan.far_m > 0 && scene.wrp.distances_m.back() < 0)))
    refuse(
        "wrp.distance needs distances on each side of it that has surfaces, and those at z < 0 "
        "are negative");
}

/// The plan with the propagation that the scene asks for, which is not "auto" of Method::wrp.
///
/// samples  the lattice, where another plan's is shared
/// images   none: they are found, and kept there
Plan plan_as_asked(const Scene& scene, const World& world, Method method, int rays_per_axis,
                   bool has_doubles, const Plan* moved_from,
                   const std::optional<LatticePlan>& samples, std::optional<Images>& images) {
  // The hologram, the depths of the scene, and the steepest light that pixels can show
  Plan plan;
  plan.size = scene.hologram.resolution;
  plan.pitch_m = scene.hologram.pitch_m;
  plan.wavelength_m = scene.hologram.wavelength_m;
  plan.colour = scene.colour;
  plan.slm = scene.slm;
  plan.near_m = world.min_m.z;
  plan.far_m = world.max_m.z;
  // Predictions divide by it
  const auto window = plan.window_m();
  plan.closest_m = std::max(closest_m(world), 1e-3 * std::max(window.x, window.y));
  plan.origin_m = {(world.min_m.x + world.max_m.x) / 2, (world.min_m.y + world.max_m.y) / 2,
                   (plan.near_m + plan.far_m) / 2};
  plan.largest_sine = largest_sine_of(plan.wavelength_m, plan);
  // Pixels turn the light that falls onto them by so much
  const auto& illumination = scene.slm.illumination;
  const auto steepest =
      steepest_tangent(plan.largest_sine + glm::abs(illumination.sine) +
                       glm::abs(illumination.curvature_per_m()) * plan.window_m() / 2.0);

  const bool is_near = method == Method::points && meets_hologram(world, plan);

  // The encoding. Near the hologram, the field's amplitude is the picture
  plan.band_filled = moved_from ? moved_from->band_filled : share_of_band(world, plan.largest_sine);
  if (plan.slm.encoding == Encoding::automatic) {
    // Lasers of one scene have one encoding: that of the narrowest band, wherever objects move
    const double fullest =
        scene.colour ? share_of_band(world, largest_sine_of(scene.colour->shortest_m(), plan))
                     : plan.band_filled;
    plan.slm.encoding = fullest > most_filled_by_double_phase && !is_near ? Encoding::phase
                                                                          : Encoding::double_phase;
    if (moved_from && scene.colour && !is_near) plan.slm.encoding = moved_from->slm.encoding;
  }
  if (scene.refine) {
    if (shows_amplitude(plan.slm.encoding))
      throw InputError(one_line(scene.file.string()) + ": slm.encoding \"" +
                       name_of(plan.slm.encoding) +
                       "\": refinement changes phases; give an SLM that shows them, "
                       "slm.encoding \"phase\"");
    plan.slm.encoding = Encoding::phase;
    plan.refine = scene.refine;
    if (!plan.refine->blur_m) plan.refine->blur_m = blur_of_resolution * scene.sampling.pitch_m;
  }

  // What later stages need to know of the scene
  plan.scene_name = scene.file.string();
  plan.lighting = lighting_of(scene, world);
  plan.frames = scene.sampling.frames;
  plan.seed = scene.sampling.seed;
  plan.sampling_pitch_m = scene.sampling.pitch_m;
  plan.padding = scene.wrp.padding;
  plan.most_layers = scene.wrp.layers;

  // What the SLM cannot do
  carrier_of(plan.slm, plan.pitch_m, plan.wavelength_m);
  require_fit(plan.slm.flatness, plan.size);

  // How light is gathered
  plan.aimed = method == Method::points ||
               (method == Method::wrp && scene.sampling.mode == SamplingMode::aimed);
  const bool has_bounces =
      plan.lighting.any_material([](const Material& m) { return m.is_specular(); });
  plan.bounces = has_bounces ? scene.trace.depth.value_or(TraceSpec::usual_depth) : 0;
  if (scene.trace.bounces != Bounces::automatic) plan.bounces_as = scene.trace.bounces;
  require_known_sides(scene, plan, method);
  if (!images) images = images_of(world, plan);
  plan.images = *images;
  require_light_through_stop(plan, world);
  plan.antialias = scene.sampling.antialias;
  plan.visibility_parts = scene.sampling.visibility;
  // Virtual planes hold all light of the hologram, and need no cone
  const bool is_compact = method == Method::wrp && scene.wrp.propagation == WrpPropagation::compact;
  plan.cone_half_width = is_compact ? 1 : scene.sampling.cone;
  plan.apodization = is_compact ? 0 : scene.sampling.apodization;

  // Tiles: windows of the hologram that are computed one after another
  const auto tiles =
      moved_from ? moved_from->tile_grid : scene.hologram.tiles.value_or(glm::ivec2(1));
  if (const auto why = why_in_one_piece(plan, method); tiles != glm::ivec2(1) && !why.empty()) {
    throw InputError(one_line(scene.file.string()) + ": hologram.tiles " + std::to_string(tiles.x) +
                     " x " + std::to_string(tiles.y) + ": " + why + "; give hologram.tiles [1, 1]");
  }
  divide(plan, tiles, scene.wrp.padding);

  if (method == Method::wrp && is_compact) {
    if (const auto why = why_not_compact(scene); !why.empty())
      throw InputError(one_line(scene.file.string()) + ": wrp.propagation \"compact\": " + why +
                       "; give \"spectrum\"");
    plan.compact = compact_plane(plan, scene.wrp);
  } else if (method == Method::wrp && !illumination.is_plane()) {
    throw InputError(one_line(scene.file.string()) +
                     ": [illumination]: WRPs hold light about the axis alone; give "
                     "wrp.propagation \"compact\", or --method points");
  }

  // Layers and the planes in them
  const auto placement = method == Method::wrp
                             ? place_wrps(scene, world, steepest, plan)
                             : place_at_hologram(world, steepest, rays_per_axis, is_near, plan);
  if (plan.compact) place_compact(plan);

  // The lattice of rays that finds the surface samples
  plan.lattice = is_near ? lattice_from_eye(scene, world, plan, steepest)
                         : lattice_over(scene, placement.extents, plan, steepest, placement.lit);
  if (samples) plan.lattice = *samples;
  plan.beyond_diffraction = placement.extents.beyond_m[0] > 0 ||
                            placement.extents.beyond_m[1] > 0 || !illumination.is_plane() ||
                            is_near;

  // Scan lines, and the errors of virtual planes
  if (plan.compact && moved_from) {
    plan.compact = moved_from->compact;
    plan.compact->window_error = std::max(plan.compact->window_error, predicted_cut_error(plan));
  }
  if (plan.compact && !moved_from) plan.compact->window_error = predicted_window_error(plan);
  if (plan.compact && scene.wrp.lines)
    plan.compact->lines_error = predicted_lines_error(plan, plan.compact->lines);
  else if (plan.compact)
    choose_lines(plan);
  if (plan.compact) choose_for_highlights(plan, scene.wrp.lines.has_value());

  // The precision that keeps the phase error
  plan.precision = choose_precision(scene.accuracy, phase_errors_of(plan), has_doubles);
  if (method == Method::wrp && moved_from) plan.why_tiles = moved_from->why_tiles;
  return plan;
}

/// Layers and tiles that "auto" tries, where the scene leaves them open.
constexpr int most_layers_tried = 8, most_tiles_tried = 4;

/// The next division where virtual planes do not serve, without those whose tiles are still wider
/// than the light of their pixels; the same where there is none.
glm::ivec2 tiles_to_try(const Plan& plan) {
  auto tiles = plan.tile_grid, finer = with_more_tiles(plan.size, tiles);
  while (finer != tiles && std::max(finer.x, finer.y) <= most_tiles_tried) {
    tiles = std::exchange(finer, with_more_tiles(plan.size, finer));
    if (!is_wider_than_light(plan, tile_size_of(plan.size, tiles))) return tiles;
  }
  return plan.tile_grid;
}

/// Why a plan has virtual planes, and what it took.
std::string why_compact(const Plan& plan) {
  return "its error of " + percent_text(plan.compact.value().error()) + " is within " +
         percent_text(most_compact_error);
}

/// Why it has none.
std::string why_no_compact(const Plan& plan) {
  const auto& plane = plan.compact.value();
  return plane.error() > most_compact_error
             ? "virtual planes would bring an error of " + percent_text(plane.error())
             : "the hologram is wider than the light of its pixels at the scene's distance";
}

/// The lattice that the lasers of a scene in colour share: that of the longest wavelength, whose
/// light spreads farthest. Empty: this scene's is its own.
std::optional<LatticePlan> shared_lattice(const Scene& scene, const World& world, Method method,
                                          int rays_per_axis, bool has_doubles,
                                          const Plan* moved_from) {
  if (!scene.colour || scene.hologram.wavelength_m == scene.colour->longest_m()) return {};
  auto widest = scene;
  widest.hologram.wavelength_m = scene.colour->longest_m();
  return make_plan(widest, world, method, rays_per_axis, has_doubles, moved_from).lattice;
}

}  // namespace

Plan make_plan(const Scene& scene, const World& world, Method method, int rays_per_axis,
               bool has_doubles, const Plan* moved_from) {
  auto tried = scene;
  std::optional<Images> images;  // the same for all that is tried
  const auto samples = shared_lattice(scene, world, method, rays_per_axis, has_doubles, moved_from);
  const auto planned = [&](WrpPropagation propagation, const Plan* from) {
    tried.wrp.propagation = propagation;
    return plan_as_asked(tried, world, method, rays_per_axis, has_doubles, from, samples, images);
  };
  if (method == Method::wrp && scene.sampling.mode == SamplingMode::aimed && world.min_m.z <= 0 &&
      world.max_m.z >= 0) {
    auto near = plan_as_asked(tried, world, Method::points, rays_per_axis, has_doubles, moved_from,
                              samples, images);
    if (is_near_hologram(near)) {
      if (scene.wrp.propagation != WrpPropagation::automatic || !scene.wrp.distances_m.empty())
        throw InputError(one_line(scene.file.string()) +
                         ": surfaces in the hologram's plane, or near it, are gathered at the "
                         "hologram; leave out wrp.propagation and wrp.distance");
      near.why_propagation = "surfaces in or near the hologram's plane are gathered there";
      return near;
    }
  }
  if (method != Method::wrp || scene.wrp.propagation != WrpPropagation::automatic)
    return planned(scene.wrp.propagation, moved_from);

  // What served before the objects moved, if it still does
  const bool leaves_layers = scene.wrp.distances_m.empty() && !scene.given.contains("wrp.layers");
  if (moved_from && is_near_hologram(*moved_from)) {
    tried.hologram.tiles = moved_from->tile_grid;
  } else if (moved_from) {
    if (leaves_layers) tried.wrp.layers = moved_from->most_layers;
    auto plan = planned(moved_from->compact ? WrpPropagation::compact : WrpPropagation::spectrum,
                        moved_from);
    plan.why_propagation = moved_from->why_propagation;
    if (!plan.compact || shortfall_of(plan) == CompactShortfall::none) return plan;
    tried.hologram.tiles = moved_from->tile_grid;  // and with its layers, or more
  }

  // Virtual planes, of as few layers and tiles as serve
  auto why = why_not_compact(scene);
  if (const auto key = key_of_wrps(scene); why.empty() && !key.empty()) why = key + " is for WRPs";
  while (why.empty()) {
    auto plan = planned(WrpPropagation::compact, nullptr);
    const auto shortfall = shortfall_of(plan);
    if (shortfall == CompactShortfall::none) {
      plan.why_propagation = why_compact(plan);
      if (tried.hologram.tiles != scene.hologram.tiles && !moved_from)
        plan.why_tiles = "virtual planes of one piece would not serve";
      return plan;
    }
    const auto more_tiles = tiles_to_try(plan);
    if (shortfall == CompactShortfall::depth && leaves_layers &&
        tried.wrp.layers < most_layers_tried)
      ++tried.wrp.layers;
    else if (!scene.hologram.tiles && !moved_from && more_tiles != plan.tile_grid)
      tried.hologram.tiles = more_tiles;
    else
      why = why_no_compact(plan);
  }

  // WRPs and the shifted angular spectrum
  tried = scene;
  if (moved_from) tried.hologram.tiles = moved_from->tile_grid;
  auto plan = planned(WrpPropagation::spectrum, nullptr);
  plan.why_propagation = why;
  return plan;
}

}  // namespace raywave
