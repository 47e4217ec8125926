// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/warnings.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <numbers>

#include "host/carriers/planning/facts.hpp"
#include "host/common/text.hpp"
#include "host/forecast/candidates.hpp"
#include "host/forecast/eye.hpp"
#include "host/forecast/panel_rate.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/message_text.hpp"
#include "host/plan/precision.hpp"
#include "host/planning/cautions.hpp"
#include "host/planning/light_shown.hpp"

namespace raywave {
namespace {

/// Below this share of the scene's light a loss is not worth a line.
constexpr double least_loss = 0.005;

/// Up to 6 evenly spread levels put less into the wanted wave.
constexpr double least_wanted_share = 0.92;

/// A mesh as large, beyond what the pixels show, may be in millimetres.
constexpr double least_large_m = 1;

/// The planner itself leaves two hundredths of the images' light beyond the depths of its planes.
constexpr double least_image_loss = 0.05;

std::string degrees(double sine) {
  return number_text(std::round(std::asin(sine) * 1800 / std::numbers::pi) / 10);
}

/// Sums of the light of the front surfaces: all, what the SLM's pixels can show of it, and what
/// passes the WRPs besides.
struct Light {
  double all = 0, within_pixels = 0, within_planes = 0;
  double farther_m = 0;     // by which every pixel could show all of it
  bool has_beyond = false;  // the scene reaches beyond what was looked at: more is lost
};

/// The distance from which on all of the hologram shows a place so far off the axis.
double shown_from_m(const Plan& plan, int axis, double off_axis_m, double shortest) {
  const double sine = std::min(shortest * plan.hologram.largest_sine[axis], 0.999);
  return (off_axis_m + plan.window_m()[axis] / 2) * std::sqrt(1 - sine * sine) / sine;
}

/// shortest  wavelength of all lasers, over that of the plan
Light light_of(const World& world, const Plan& plan, const FrontView& view, double shortest) {
  Light light;
  view.for_surfaces([&](int x, int y, std::size_t cell, double z) {
    const double here = view.radiance[cell];
    const auto place = view.place_m(x, y, z);
    double within_pixels = here, within_planes = here;
    for (int axis = 0; axis < 2; ++axis) {
      within_pixels *= share_within_pixels(plan, axis, place[axis], z);
      light.farther_m = std::max(
          light.farther_m, shown_from_m(plan, axis, std::abs(place[axis]), shortest) - std::abs(z));
      within_planes *= share_seen(plan, axis, place[axis], z);
    }
    light.all += here;
    light.within_pixels += within_pixels;
    light.within_planes += within_planes;
  });
  const auto seen_m =
      glm::max(glm::abs(view.low), glm::abs(view.low + glm::dvec2(view.size) * view.step)) *
      (plan.extent.farthest_m() + std::abs(view.eye_z_m));
  for (int axis = 0; axis < 2; ++axis) {
    const double edge_m = std::max(world.max_m[axis], -world.min_m[axis]);
    if (edge_m <= 1.01 * seen_m[axis]) continue;
    light.has_beyond = true;
    light.farther_m = std::max(light.farther_m,
                               shown_from_m(plan, axis, edge_m, shortest) - plan.extent.closest_m);
  }
  return light;
}

/// Where the whole scene lies beyond what the pixels show; empty where it does not.
std::string beyond_pixels(const World& world, const Plan& plan) {
  if (!plan.slm.illumination.is_plane()) return "";
  for (int axis = 0; axis < 2; ++axis) {
    const double sine = plan.hologram.largest_sine[axis],
                 shown_m = plan.window_m()[axis] / 2 +
                           plan.extent.farthest_m() * sine / std::sqrt(1 - sine * sine),
                 nearest_m = std::max(world.min_m[axis], -world.max_m[axis]);
    if (nearest_m > shown_m)
      return "the scene begins " + length_text(std::round(nearest_m * 1e4) / 1e4) +
             (axis == 0 ? " beside" : " above or below") +
             " the axis, and the pixels show light from no farther than " +
             length_text(std::floor(shown_m * 1e4) / 1e4) +
             ": the hologram is dark; move the scene closer to the axis, or farther away";
  }
  return "";
}

/// "[\"4.1 mm\", 0]"
std::string shift_text(glm::dvec2 shift_m) {
  const auto text = [](double metres) {
    if (metres == 0) return std::string("0");
    return in_quotes(length_text(std::round(metres * 1e5) / 1e5));
  };
  return "[" + text(shift_m.x) + ", " + text(shift_m.y) + "]";
}

/// What a shift of the picture makes too steep: "; 450 nm loses 12 % of its light"; empty: nothing.
std::string lost_text(const std::vector<double>& lost, const std::vector<double>& wavelengths_m) {
  std::string text;
  for (std::size_t i = 0; i < lost.size(); ++i)
    if (lost[i] > least_loss)
      text += (text.empty() ? "; " : ", ") + length_text(wavelengths_m[i]) + " loses " +
              percent_text(lost[i]);
  return text.empty() ? text : text + " of its light, which gets too steep for the pixels";
}

/// What the stop cuts off, and undiffracted light in the picture.
template <class Warn>
void warn_of_slm(const SlmLight& light, const std::vector<double>& wavelengths_m,
                 bool has_no_zero_order, const Warn& warn) {
  const bool is_one = wavelengths_m.size() == 1;
  const auto up = [](double share) { return number_text(std::ceil(share * 100) / 100); };
  if (const double lost = 1 - light.through_stop; lost > least_loss)
    warn(percent_text(lost) +
         " of the light that the pixels can show is cut off by slm.stop: slm.stop [" +
         up(light.open_stop.x) + ", " + up(light.open_stop.y) +
         "] passes all of it; a scene closer to the axis or farther away needs less");
  if (light.beyond_band > least_loss)
    warn(percent_text(light.beyond_band) +
         " of the light is moved beyond the pixels' band by slm.shift or slm.carrier: it is dim "
         "there, and lies on the picture's other side again; a smaller shift keeps it");
  if (light.on_picture == 0 || light.zero_order_stopped || has_no_zero_order) return;
  const auto& size_m = light.zero_order_size_m;
  const std::string place = light.zero_order_m == glm::dvec2(0)
                                ? "the axis"
                                : length_text(std::round(light.zero_order_m.x * 1e5) / 1e5) + ", " +
                                      length_text(std::round(light.zero_order_m.y * 1e5) / 1e5);
  const std::string pictures = is_one ? "the picture" : "the pictures of all lasers";
  const std::string falls = "light that the SLM leaves undiffracted falls onto " +
                            percent_text(light.on_picture) +
                            " of the picture: " + length_text(size_m.x) + " x " +
                            length_text(size_m.y) + " around " + place;
  const std::string advice =
      light.beside_m == glm::dvec2(0)
          ? "the pixels cannot move " + pictures +
                " beside it: move the scene off the axis or farther away, or block that light "
                "where it is focused"
          : "slm.shift = " + shift_text(light.beside_m) + " with slm.shift_distance = " +
                in_quotes(length_text(std::round(std::abs(light.z_m) * 1e5) / 1e5)) + " moves " +
                pictures + " beside it, slm.stop then blocks it" +
                lost_text(light.beside_lost, wavelengths_m);
  if (is_one) return warn(falls + "; " + advice);
  warn(falls);
  warn("undiffracted light: " + advice);
}

/// The warnings, group by group.
struct Warnings {
  const Scene& scene;
  const World& world;
  const Plan& plan;
  const FrontView& view;
  double shortest = 1;         // wavelength of all lasers, over that of the plan
  std::optional<EyeView> eye;  // behind an eyepiece
  Light light;
  std::vector<std::string> all;

  glm::dvec2 size_m() const { return world.max_m - world.min_m; }
  /// Within which replicas stay apart.
  double period_m(int axis) const {
    return shortest * plan.hologram.wavelength_m * plan.extent.farthest_m() /
               plan.hologram.pitch_m[axis] +
           (is_near_hologram(plan) ? plan.window_m()[axis] : 0);
  }
  void warn(const std::string& text) { all.push_back(text); }

  void of_hologram();
  void of_units();
  void of_place();
  void of_light();
  void of_panel(const SlmLight& slm_light);
  void of_viewer();
  void of_detail(bool is_default_pitch);
  void of_materials();
};

void Warnings::of_hologram() {
  const auto& hologram = scene.hologram;
  if (hologram.wavelength_m < 380e-9 || hologram.wavelength_m > 780e-9)
    warn("hologram.wavelength " + length_text(hologram.wavelength_m) +
         " is no visible light, 380 nm to 780 nm");
  for (int axis = 0; axis < 2; ++axis) {
    if (const double pitch = hologram.pitch_m[axis]; pitch < 0.2e-6 || pitch > 100e-6) {
      warn("hologram.pitch " + length_text(pitch) + " is unlike any SLM's, 0.2 um to 100 um");
      break;
    }
  }
}

void Warnings::of_units() {
  for (std::size_t i = 0; i < world.placed.size(); ++i) {
    const auto& object = scene.objects[i];
    const auto object_m = world.placed[i].max_m - world.placed[i].min_m;
    const bool is_of_gltf = object.cut_m > 0;  // whose lengths are metres
    if (object.width_m || object.unit_m != 1 || is_of_gltf ||
        std::max(object_m.x, object_m.y) < least_large_m ||
        (object_m.x < period_m(0) && object_m.y < period_m(1)))
      continue;
    warn(object.where + ": " + length_text(object_m.x) + " x " + length_text(object_m.y) +
         ", for it has no width, and a unit of its mesh is 1 m: give a width, or unit = \"1 mm\" "
         "for millimetres");
  }
}

void Warnings::of_place() {
  if (eye) {
    for (const auto& warning : eye_warnings(scene, plan, *eye)) warn(warning);
  } else if (light.all > 0) {
    if (const double lost = 1 - light.within_pixels / light.all; lost > least_loss)
      warn(
          (light.has_beyond ? "more than " : "") + percent_text(lost) +
          " of the scene's light is steeper than the pixels can show, " +
          degrees(plan.hologram.largest_sine.x) + " x " + degrees(plan.hologram.largest_sine.y) +
          " degrees off the axis: bring the scene closer to the axis, give a smaller "
          "hologram.pitch, or move it " +
          length_text(std::ceil(light.farther_m * 1e3) / 1e3) +
          " farther away, where all of the hologram shows it" +
          (plan.extent.near_m - light.farther_m < -scene.viewer.distance_m && plan.extent.near_m < 0
               ? ", and viewer.distance beyond it"
               : ""));
  }
  if (auto text = beyond_pixels(world, plan); !text.empty() && !eye && plan.specular.bounces == 0)
    warn(text);
  if (auto text = eye_distance_warning(scene.viewer, plan.extent.near_m); !text.empty()) warn(text);
}

void Warnings::of_light() {
  if (!eye && light.all > 0) {
    if (const double lost = (light.within_pixels - light.within_planes) / light.all;
        lost > least_loss)
      warn(percent_text(lost) +
           " of the scene's light passes beside the WRPs: a larger wrp.grid, or \"auto\", catches "
           "it");
  }
  if (const double beyond = plan.specular.images.beyond; beyond > least_image_loss)
    warn(percent_text(beyond) +
         " of the scene's light is seen in mirrors and glass behind the hologram or far away, and "
         "is shown out of focus: flatter mirrors and thinner glass keep it near the scene");
  const auto glows = [](const Material& m) { return m.emission != glm::dvec3(0); };
  const auto shines = [](const raywave::Light& one) { return one.type != LightType::ambient; };
  // Rims face lights from behind, too; pictures on surfaces need no more than ambient light
  if (view.lights_faced < least_loss * view.covered && view.specular == 0 &&
      plan.lighting.diffuse_rays == 0 && !plan.lighting.any_material(glows) &&
      (plan.lighting.textures == 0 || std::ranges::any_of(scene.lights, shines)))
    warn(
        "hardly anything that the hologram sees faces a light, and ambient light alone shows flat "
        "shapes: change light.direction, light.position or light.intensity");
  for (const auto& warning : image_warnings(plan)) warn(warning);
  for (const auto& warning : cut_warnings(scene, world, plan)) warn(warning);
  for (const auto& warning : carrier_warnings(plan)) warn(warning);
}

void Warnings::of_panel(const SlmLight& slm_light) {
  if (const double share = wanted_share_of_levels(plan.slm); share < least_wanted_share) {
    const auto& slm = plan.slm;
    const std::string cause = slm.levels < grey_levels_of(slm) ? "slm.levels"
                              : !slm.lut.values.empty()        ? "slm.lut"
                                                               : "slm.levels_per_turn";
    warn(cause + ": the phases that the SLM shows put " + percent_text(share) +
         " of the light into the picture; the rest makes a twin picture and haze, which the "
         "predicted PSNR leaves out");
  }
  std::string left_out;
  const auto leave_out = [&](bool is_given, const char* key) {
    if (is_given) left_out += (left_out.empty() ? "" : ", ") + std::string(key);
  };
  const auto& illumination = plan.slm.illumination;
  leave_out(!illumination.profile.is_even(), "illumination.profile");
  leave_out(illumination.source_size_rad > 0, "illumination.source_size");
  leave_out(illumination.bandwidth_m > 0, "illumination.bandwidth");
  leave_out(plan.slm.undiffracted > 0, "slm.undiffracted");
  leave_out(plan.slm.crosstalk.any(), "slm.crosstalk");
  if (!left_out.empty()) warn("the predicted PSNR leaves out " + left_out);
  if (const Image* beam = illumination.profile.picture.get()) {
    constexpr double alike = 0.02;
    const double stretched = static_cast<double>(plan.hologram.size.x) * beam->height /
                             (static_cast<double>(plan.hologram.size.y) * beam->width);
    if (std::abs(std::log(stretched)) > alike)
      warn("illumination.profile: its picture of " + extent_text({beam->width, beam->height}) +
           " pixels is stretched to the shape of the SLM, " + extent_text(plan.hologram.size) +
           ": cut it to the part that falls onto the SLM");
  }
  // Amplitudes are those that the darkest pixel shows, too
  constexpr double dim = 0.25;
  if (slm_light.darkest < dim && plan.slm.encoding != Encoding::phase)
    warn("slm.encoding \"" + std::string(name_of(plan.slm.encoding)) + "\" " +
         (slm_light.darkest < least_darkest ? "loses the picture in haze" : "dims the picture") +
         ": it knows no amplitudes above what the darkest pixel of illumination.profile shows, " +
         percent_text(slm_light.darkest) +
         " of the mean; a wider beam loses less, and so does slm.encoding \"phase\", or [refine]");
  if (is_near_hologram(plan) && plan.slm.encoding == Encoding::double_phase && !plan.slm.stop &&
      !scene.viewer.eyepiece_m)
    warn(
        "so near to the SLM, light that double phase throws aside lies over the picture: optics "
        "whose aperture passes half the band, slm.stop = 0.5, keep it out");
}

void Warnings::of_viewer() {
  // Within a part of the hologram, what hides what stays as it is
  constexpr int most_parts = 16;
  const int parts = plan.samples.visibility_parts;
  const auto window_m = plan.window_m();
  const double part_m = std::max(window_m.x, window_m.y) / std::max(parts, 1);
  if (!scene.viewer.eyepiece_m && parts > 0 && parts < most_parts && part_m > Pupil{}.diameter_m)
    warn("what hides what is known of parts of the hologram " +
         length_text(std::round(part_m * 1e5) / 1e5) +
         " wide, larger than the pupil of an eye: edges brighten and fade slowly as it passes; "
         "sampling.visibility = 16 makes them sharper");
  for (int axis = 0; axis < 2; ++axis) {
    const double period = period_m(axis), extent = size_m()[axis];
    if (extent > period && !eye) {
      warn(std::string("the picture's replicas overlap it: its ") +
           (axis == 0 ? "width" : "height") + " of " + length_text(extent) +
           " is more than wavelength z / pitch, " + length_text(std::round(period * 1e7) / 1e7) +
           "; a smaller scene, a larger distance or a smaller hologram.pitch keeps them apart");
      break;
    }
  }
}

void Warnings::of_detail(bool is_default_pitch) {
  const double p = scene.sampling.pitch_m;
  const auto limits = limit_m(plan, middle_m(plan));
  const double limit = shortest * std::max(limits.x, limits.y);
  const double resolution_m = std::max(
      limit,
      scene.viewer.resolution_m.value_or(eye ? eye->detail_m : detail_for_eye_m(scene, plan)));
  // Spots are as wide as the hologram resolves: dots twice as far apart do not touch
  constexpr double apart = 2;
  const auto detail = [](double length_m) { return length_text(std::round(length_m * 1e7) / 1e7); };
  if (const auto seen_m = size_m(); std::max(seen_m.x, seen_m.y) < resolution_m)
    warn("the scene is " + length_text(seen_m.x) + " x " + length_text(seen_m.y) +
         ", smaller than the " + detail(resolution_m) +
         " that the viewer makes out, and looks like a dot: check the units of object.width and "
         "position");
  else if (p > 1.05 * resolution_m)
    warn("sampling.pitch " + length_text(p) + " shows single dots: the viewer makes out " +
         detail(resolution_m) + "; a smaller one closes the surfaces, or " +
         (is_default_pitch ? "" : "sampling.pitch = \"auto\" and ") + "--preset balanced");
  else if (is_default_pitch && p > apart * limit)
    warn("sampling.pitch " + length_text(p) + " (default) is for a bare eye: the hologram shows " +
         detail(limit) +
         ", so a camera, and reconstruct, show single dots; give a smaller one, or "
         "viewer.resolution = " +
         in_quotes(detail(apart * limit)) + " and --preset balanced, where that matters");
  else if (p < 0.8 * limit)
    warn("sampling.pitch " + length_text(p) + " is finer than what the hologram resolves, " +
         length_text(std::round(limit * 1e8) / 1e8) + ": it costs time and shows no more");
  if (!plan.samples.aimed && !plan.is_at_hologram()) {
    const double spread = (plan.extent.far_m - plan.layers[0].distance_m) * plan.window_m().x /
                          std::abs(plan.layers[0].distance_m);
    if (spread > 2 * p)
      warn("rays of the fan alias: they spread over " +
           length_text(std::round(spread * 1e7) / 1e7) +
           " at the scene's far side, more than twice sampling.pitch; sampling.mode \"aimed\" does "
           "not");
  }
}

void Warnings::of_materials() {
  const auto& materials = plan.lighting.materials;
  const auto bounces = std::ranges::find_if(plan.lighting.used, [&](std::int32_t number) {
    return materials[static_cast<std::size_t>(number)].is_specular();
  });
  if (bounces != plan.lighting.used.end() && scene.trace.depth == 0)
    warn("material " + in_quotes(materials[static_cast<std::size_t>(*bounces)].name) +
         " is a mirror or glass, but trace.depth is 0: its reflections stay dark");
  if (phase_error_turns(plan) >= scene.accuracy.phase_turns)
    warn(
        "the predicted error of phase is not below accuracy.phase; accuracy.precision \"double\" "
        "has the least, on devices that can");
}

/// Those of what a viewer sees at all.
Warnings warnings_of_place(const Scene& scene, const World& world, const Plan& plan,
                           const FrontView& view) {
  const auto wavelengths_m = wavelengths_m_of(scene);
  Warnings warnings{scene, world, plan, view, 1, {}, {}, {}};
  warnings.shortest = *std::ranges::min_element(wavelengths_m) / scene.hologram.wavelength_m;
  if (scene.viewer.eyepiece_m) warnings.eye = eye_view(scene, plan, view);
  warnings.light = light_of(world, plan, view, warnings.shortest);
  warnings.of_hologram();
  warnings.of_units();
  warnings.of_place();
  return warnings;
}

}  // namespace

std::string eye_distance_warning(const ViewerSpec& viewer, double near_m) {
  const double nearest_m = viewer.distance_m + near_m;
  if (viewer.eyepiece_m || nearest_m >= nearest_focus_m) return "";
  if (nearest_m < 0)
    return "the picture reaches to " + length_text(near_m) +
           ", behind the viewer's eye: give a viewer.distance of more than " + length_text(-near_m);
  return "the picture reaches to " + length_text(std::round(nearest_m * 1e4) / 1e4) +
         " before the viewer's eye, nearer than eyes focus: a viewer.distance of " +
         length_text(std::ceil((nearest_focus_m - near_m) * 1e2) / 1e2) + " is seen sharp";
}

std::vector<std::string> preview_warnings(const Scene& scene, const World& world,
                                          const Plan& plan) {
  constexpr int coarse = 64;  // takes milliseconds
  return warnings_of_place(scene, world, plan, front_view(scene, world, plan, coarse)).all;
}

bool is_default_pitch(const Scene& scene) {
  return !scene.given.contains("sampling.pitch") &&
         scene.sampling.pitch_m == SamplingSpec{}.pitch_m;
}

std::vector<std::string> warnings_of(const Scene& scene, const World& world, const Plan& plan,
                                     const FrontView& view, const SlmLight& slm_light,
                                     bool is_default_pitch) {
  const auto wavelengths_m = wavelengths_m_of(scene);
  auto warnings = warnings_of_place(scene, world, plan, view);
  warnings.of_light();
  // A user who gives 0 says that nothing is left undiffracted
  warn_of_slm(slm_light, wavelengths_m,
              plan.slm.undiffracted == 0 && scene.given.contains("slm.undiffracted"),
              [&](const std::string& text) { warnings.warn(text); });
  warnings.of_panel(slm_light);
  warnings.of_viewer();
  for (const auto& warning : thin_object_warnings(scene, world, plan)) warnings.warn(warning);
  warnings.of_detail(is_default_pitch);
  warnings.of_materials();
  return std::move(warnings.all);
}

std::vector<std::string> warnings_of(const Scene& scene, const World& world, const Plan& plan) {
  const auto view = front_view(scene, world, plan);
  auto warnings =
      warnings_of(scene, world, plan, view, slm_light(plan, view, wavelengths_m_of(scene)),
                  is_default_pitch(scene));
  if (auto warning = panel_warning(scene, pictures_per_s(scene)); !warning.empty())
    warnings.push_back(std::move(warning));
  return warnings;
}

}  // namespace raywave
