// SPDX-License-Identifier: Apache-2.0
#include "host/planning/assess.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <limits>

#include "host/carriers/virtual_planes/planning/errors.hpp"
#include "host/carriers/virtual_planes/planning/planes.hpp"
#include "host/carriers/wrps/planning/fans.hpp"
#include "host/carriers/wrps/planning/wrp_placement.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/message_text.hpp"
#include "host/plan/precision.hpp"
#include "host/planning/images.hpp"
#include "host/planning/light_shown.hpp"
#include "host/planning/placement.hpp"
#include "host/planning/tiles.hpp"

namespace raywave {
namespace {

/// Sine of the steepest light that pixels can show, per axis.
glm::dvec2 largest_sine_of(double wavelength_m, const Plan& plan) {
  return glm::min(glm::dvec2(1), wavelength_m / (2.0 * plan.hologram.pitch_m));
}

/// The planes of Method::points and Method::rays, at the hologram itself: one per tile.
Placement place_at_hologram(const World& world, glm::dvec2 steepest, int rays_per_axis,
                            bool is_near, Plan& plan) {
  Placement placement{{}, all_tangents};
  plan.layers = {{.distance_m = 0, .min_m = world.min_m, .max_m = world.max_m}};
  for (std::size_t i = 0; i < plan.tiling.tiles.size(); ++i) {
    if (!is_near)
      placement.extents.add(
          extents_of(world, seen_through(0, steepest, plan, plan.tiling.tiles[i])));
    plan.wrps.push_back(plane_at_hologram(plan, i, steepest, rays_per_axis));
  }
  return placement;
}

/// Scenes meet the hologram with surfaces nearer to it than this share of its longer side.
constexpr double near_hologram = 0.25;

/// Double phase brings haze into pictures that fill the band: the light of its checkerboard comes
/// back there (docs/slm.md). From here on the levels of phases alone show more: of `wire` (0.45)
/// both show the same, of `apart` and `study` double phase 2 dB more, of `teapot` (0.55) 1 and of
/// `room` 7 dB less.
constexpr double most_filled_by_double_phase = 0.48;

/// Phases alone light the hologram evenly. Where light of the scene reaches less of it than this,
/// mean over vertices, double phase shows more: 3 dB of a cup whose light reaches 0.75 and 10 dB at
/// 0.3; `teapot` and `room` reach 0.97.
constexpr double least_lit_by_phases = 0.85;

/// Share of the hologram that light from the scene's vertices reaches, their mean.
double share_lit_by_scene(const World& world, const Plan& plan) {
  double sum = 0, count = 0;
  for (const auto& at_m : positions_now(world)) {
    sum +=
        share_within_pixels(plan, 0, at_m.x, at_m.z) * share_within_pixels(plan, 1, at_m.y, at_m.z);
    ++count;
  }
  return count > 0 ? sum / count : 1;
}

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

/// The object with the place nearest to the hologram's plane.
std::size_t nearest_object(const World& world) {
  std::size_t nearest = 0;
  double least_m = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < world.triangles.size(); ++i) {
    const auto corners = world.corners_m(i);
    const auto [low, high] = std::minmax({corners[0].z, corners[1].z, corners[2].z});
    const double away_m = low <= 0 && high >= 0 ? 0 : std::min(std::abs(low), std::abs(high));
    if (away_m >= least_m) continue;
    least_m = away_m;
    nearest = static_cast<std::size_t>(world.triangle_object[i]);
  }
  return nearest;
}

/// Says what does not know surfaces before the hologram.
///
/// throws  InputError naming it
void require_known_sides(const Scene& scene, const World& world, const Plan& plan, Method method) {
  if (plan.extent.near_m > 0) return;
  const bool is_near = crosses_hologram(world) && meets_hologram(scene, world);
  const auto refuse = [&](const std::string& what) {
    throw InputError(one_line(scene.file.string()) + ": the scene reaches to z = " +
                     millimetres(plan.extent.near_m) + ", before the hologram: " + what);
  };
  if (!plan.samples.aimed && method == Method::wrp && plan.extent.far_m >= 0)
    refuse(
        "fans of WRPs before all of it show what is far from these too dark; give sampling.mode "
        "\"aimed\", or --method rays");
  const auto refuse_near = [&](const std::string& what) {
    const auto object = nearest_object(world);
    throw InputError((object < scene.objects.size() ? scene.objects[object].where
                                                    : one_line(scene.file.string())) +
                     ": it comes too near to the hologram: " + what +
                     "; move it so that all of it is " + millimetres(near_distance_m(plan)) +
                     " away or more");
  };
  if (plan.has_specular_samples() && is_near)
    refuse_near("mirrors and glass are not followed there");
  if (scene.refine && !scene.viewer.eyepiece_m && is_near)
    refuse_near("[refine] shows no pictures there, but behind an eyepiece");
  if (!scene.wrp.distances_m.empty() && method == Method::wrp &&
      (scene.wrp.distances_m.front() > 0 ||
       (plan.extent.far_m > 0 && scene.wrp.distances_m.back() < 0)))
    refuse(
        "wrp.distance needs distances on each side of it that has surfaces, and those at z < 0 "
        "are negative");
}

/// Sets the encoding that the scene leaves open, and what refinement asks of it.
///
/// throws  InputError where refinement cannot serve an SLM that shows amplitudes
void choose_encoding(const Scene& scene, const World& world, bool is_near, const Plan* moved_from,
                     Plan& plan) {
  if (plan.slm.encoding == Encoding::automatic && moved_from && !is_near) {
    plan.slm.encoding = moved_from->slm.encoding;
  } else if (plan.slm.encoding == Encoding::automatic) {
    // Lasers of one scene have one encoding: that of the narrowest band
    auto narrowest = plan;
    if (scene.colour)
      narrowest.hologram.largest_sine = largest_sine_of(scene.colour->shortest_m(), plan);
    const bool is_dim = darkest_of(plan.slm.illumination.profile, plan.hologram.size,
                                   plan.hologram.pitch_m) < least_darkest;
    const bool is_even =
        share_of_band(world, narrowest.hologram.largest_sine) > most_filled_by_double_phase &&
        share_lit_by_scene(world, narrowest) > least_lit_by_phases;
    plan.slm.encoding = !is_near && (is_even || is_dim) ? Encoding::phase : Encoding::double_phase;
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
    plan.refine->viewer = scene.viewer;
    if (plan.refine->targets == RefineTargets::samples && scene.sampling.mode == SamplingMode::fan)
      throw InputError(one_line(scene.file.string()) +
                       ": refine.targets \"samples\": rays of fans make no samples; give \"lens\"");
    if (plan.refine->targets == RefineTargets::samples && plan.refine->views.value_or(0) > 0)
      throw InputError(
          one_line(scene.file.string()) +
          ": refine.views is for pictures of a lens; parts as large as viewer.pupil "
          "serve every view of samples. Leave it out, or give refine.targets \"lens\"");
  }
}

/// Light that is gathered for an eye behind an eyepiece: what reaches its pupil, and no more of the
/// band than the encoding keeps apart from its own haze. What would light the rest of the eyebox is
/// left out.
glm::dvec2 sine_for_eye(const ViewerSpec& viewer, const Plan& plan) {
  glm::dvec2 reach(0);
  for (const auto& pupil : pupils_of(viewer))
    reach = glm::max(reach, (glm::abs(pupil.centre_m) + pupil.diameter_m / 2 +
                             std::abs(pupil.a) * plan.window_m() / 2.0) /
                                std::abs(pupil.b_m));
  const bool is_apart = plan.slm.encoding == Encoding::double_phase || plan.refine;
  const double kept = is_apart ? most_filled_by_double_phase : 1;
  return glm::min(reach, kept * plan.hologram.largest_sine);
}

/// Share of the band that is gathered near the hologram for double phase behind a stop: of faster
/// fields it shows no brightness, and what it throws aside, from the band's corners inwards, must
/// not pass. All of it where a stop leaves too little of that apart.
glm::dvec2 share_behind_stop(const StopSpec& stop) {
  constexpr double least = 0.2;
  const auto share = glm::min(glm::min(stop.size, 1.0 - stop.size), most_filled_by_double_phase);
  return stop.centre == glm::dvec2(0) && share.x > least && share.y > least ? share : glm::dvec2(1);
}

/// Divides the hologram into the tiles that the scene asks for, or had before its objects moved.
///
/// throws  InputError where it can only be computed in one piece
void divide_as_asked(const Scene& scene, Method method, const Plan* moved_from, Plan& plan) {
  const auto tiles =
      moved_from ? moved_from->tiling.grid : scene.hologram.tiles.value_or(glm::ivec2(1));
  if (const auto why = why_in_one_piece(plan, method); tiles != glm::ivec2(1) && !why.empty()) {
    throw InputError(one_line(scene.file.string()) + ": hologram.tiles " + extent_text(tiles) +
                     ": " + why + "; give hologram.tiles [1, 1]");
  }
  if (method != Method::wrp) plan.carrier = AtHologram{};
  divide(plan, tiles, scene.wrp.padding);
}

/// Mirrors or glass that light goes on from.
bool has_bounces(const Scene& scene, const World& world) {
  return scene.trace.depth != 0 &&
         lighting_of(scene, world).any_material([](const Material& m) { return m.is_specular(); });
}

/// Decides how mirrors and glass are followed.
///
/// images  of the scene in them; made where they are not known
void follow_bounces(const Scene& scene, const World& world, Method method, const Plan* moved_from,
                    std::optional<Images>& images, Plan& plan) {
  plan.specular.bounces =
      plan.lighting.any_material([](const Material& m) { return m.is_specular(); })
          ? scene.trace.depth.value_or(TraceSpec::usual_depth)
          : 0;
  require_known_sides(scene, world, plan, method);
  if (!images) images = images_of(world, plan);
  plan.specular.images = *images;
  if (scene.trace.bounces != Bounces::automatic)
    plan.specular.as = scene.trace.bounces;
  else if (moved_from)
    plan.specular.as = moved_from->specular.as;
  else if (images->points_error > most_points_error)
    plan.specular.as = Bounces::paths;
}

/// Chooses virtual planes where they are asked for, and refuses what the carrier cannot do.
void choose_carrier(const Scene& scene, Method method, bool is_compact, Plan& plan) {
  if (is_compact) {
    if (const auto why = why_not_virtual_planes(scene); !why.empty())
      throw InputError(one_line(scene.file.string()) + ": wrp.propagation \"compact\": " + why +
                       "; give \"spectrum\"");
    plan.carrier = virtual_planes_of(plan, scene.wrp);
  } else if (method == Method::wrp && !scene.slm.illumination.is_plane()) {
    throw InputError(one_line(scene.file.string()) +
                     ": [illumination]: WRPs hold light about the axis alone; give "
                     "wrp.propagation \"compact\", or --method points");
  }
}

}  // namespace

bool crosses_hologram(const World& world) { return world.min_m.z <= 0 && world.max_m.z >= 0; }

double near_distance_m(const Plan& plan) {
  const auto window_m = plan.window_m();
  return near_hologram * std::max(window_m.x, window_m.y);
}

bool meets_hologram(const Scene& scene, const World& world) {
  const auto window_m = glm::dvec2(scene.hologram.resolution) * scene.hologram.pitch_m;
  // Light to the pupil behind an eyepiece spreads little: scenes a hologram's side away are near
  const double share = scene.viewer.eyepiece_m ? 1 : near_hologram;
  if (closest_m(world) >= share * std::max(window_m.x, window_m.y)) return false;
  return crosses_hologram(world) ||
         (!has_bounces(scene, world) && (!scene.refine || scene.viewer.eyepiece_m));
}

bool shows_lens_alone(const Scene& scene, const World& world) {
  return crosses_hologram(world) && meets_hologram(scene, world) && has_bounces(scene, world);
}

bool serves_at_hologram(const Scene& scene, const Plan& plan) {
  constexpr double most_lit = 0.35;  // of the hologram, by one place: it takes as long as that
  const auto spread_m = 2 * plan.extent.closest_m * tangents_of_sines(plan.hologram.largest_sine);
  const auto lit = glm::min(spread_m / plan.window_m(), glm::dvec2(1));
  return scene.sampling.mode == SamplingMode::aimed && plan.specular.bounces == 0 &&
         (!scene.refine || scene.viewer.eyepiece_m) && !scene.wrp.grid &&
         scene.wrp.distances_m.empty() && key_of_wrps(scene).empty() && lit.x * lit.y < most_lit;
}

Plan assess(const Scene& scene, const World& world, Method method, bool is_near, int rays_per_axis,
            bool has_doubles, const Plan* moved_from, const std::optional<LatticePlan>& samples,
            std::optional<Images>& images) {
  // The hologram, the depths of the scene, and the steepest light that pixels can show
  Plan plan;
  plan.hologram.size = scene.hologram.resolution;
  plan.hologram.pitch_m = scene.hologram.pitch_m;
  plan.hologram.wavelength_m = scene.hologram.wavelength_m;
  plan.hologram.colour = scene.colour;
  plan.slm = scene.slm;
  plan.extent.near_m = world.min_m.z;
  plan.extent.far_m = world.max_m.z;
  // Predictions divide by it
  const auto window = plan.window_m();
  plan.extent.closest_m = std::max(closest_m(world), 1e-3 * std::max(window.x, window.y));
  plan.extent.origin_m = middle_of(world);
  plan.hologram.largest_sine = largest_sine_of(plan.hologram.wavelength_m, plan);
  // Pixels turn the light that falls onto them by so much
  const auto& illumination = scene.slm.illumination;
  const auto steepest =
      tangents_of_sines(plan.hologram.largest_sine + glm::abs(illumination.sine) +
                        glm::abs(illumination.curvature_per_m()) * plan.window_m() / 2.0);

  // The encoding. Near the hologram, the field's amplitude is the picture
  plan.hologram.band_filled = moved_from ? moved_from->hologram.band_filled
                                         : share_of_band(world, plan.hologram.largest_sine);
  choose_encoding(scene, world, is_near, moved_from, plan);
  if (is_near && scene.viewer.eyepiece_m)
    plan.hologram.largest_sine = sine_for_eye(scene.viewer, plan);
  else if (is_near && plan.slm.stop && plan.slm.encoding == Encoding::double_phase)
    plan.hologram.largest_sine *= share_behind_stop(*plan.slm.stop);

  // What later stages need to know of the scene
  plan.scene_name = scene.file.string();
  plan.lighting = lighting_of(scene, world);
  plan.hologram.frames = scene.sampling.frames;
  plan.hologram.seed = scene.sampling.seed;
  plan.samples.pitch_m = scene.sampling.pitch_m;
  plan.most_layers = scene.wrp.layers;

  // What the SLM cannot do
  carrier_of(plan.slm, plan.hologram.pitch_m, plan.hologram.wavelength_m);
  require_fit(plan.slm.flatness, plan.hologram.size);
  kernel_of(plan.slm.crosstalk, plan.hologram.pitch_m);  // or refuses it

  // How light is gathered
  plan.samples.aimed = method == Method::points ||
                       (method == Method::wrp && scene.sampling.mode == SamplingMode::aimed);
  follow_bounces(scene, world, method, moved_from, images, plan);
  require_light_through_stop(plan, world);
  plan.samples.antialias = scene.sampling.antialias;
  plan.samples.visibility_parts = scene.sampling.visibility;
  // Virtual planes hold all light of the hologram, and need no cone
  const bool is_compact = method == Method::wrp && scene.wrp.propagation == WrpPropagation::compact;
  plan.cone.half_width = is_compact ? 1 : scene.sampling.cone;
  plan.cone.apodization = is_compact ? 0 : scene.sampling.apodization;

  divide_as_asked(scene, method, moved_from, plan);

  choose_carrier(scene, method, is_compact, plan);

  // Layers and the planes in them
  const auto placement = method == Method::wrp
                             ? place_layers(scene, world, steepest, plan)
                             : place_at_hologram(world, steepest, rays_per_axis, is_near, plan);
  if (is_compact)
    place_virtual_planes(plan);
  else if (method == Method::wrp)
    place_wrps(scene, world, placement, plan);

  // The lattice of rays that finds the surface samples
  plan.lattice = is_near ? lattice_from_eye(scene, world, plan, steepest)
                         : lattice_over(scene, placement.extents, plan, steepest, placement.lit);
  if (samples) plan.lattice = *samples;
  plan.beyond_diffraction = placement.extents.beyond_m[0] > 0 ||
                            placement.extents.beyond_m[1] > 0 || !illumination.is_plane() ||
                            is_near;

  if (is_compact) choose_lines(plan, scene.wrp.lines.has_value(), moved_from);

  // The precision that keeps the phase error
  plan.precision = choose_precision(scene.accuracy, phase_errors_of(plan), has_doubles);
  if (method == Method::wrp && moved_from) plan.tiling.why = moved_from->tiling.why;
  return plan;
}

}  // namespace raywave
