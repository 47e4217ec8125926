// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <sstream>

#include "host/carriers/planning/facts.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/quality.hpp"
#include "host/evaluate/report.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/precision.hpp"
#include "host/scene/scene.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave {
namespace {

using Rows = std::ostringstream;

double degrees_of(double sine) { return std::asin(sine) * 180 / std::numbers::pi; }

std::string mm(double metres) { return millimetres(metres, 4); }
/// Two digits, and all of those before the point; what is below 1e-12 is rounding noise: 0
std::string number(double value) {
  const double size = std::abs(value);
  return format(size >= 99.5 && size < 1e9 ? "%.0f" : "%.2g", size < 1e-12 ? 0.0 : value);
}

/// Two digits, more of large numbers.
std::string seconds(double value) {
  const double shown = value < 1 ? value * 1e3 : value;
  return format(shown < 99.5 ? "%.2g" : "%.0f", shown) + (value < 1 ? " ms" : " s");
}

/// The materials of a mesh, those of most triangles first.
void add_found_text(const FoundMaterials& found, Rows& out) {
  constexpr std::size_t most = 16;
  std::vector<const FoundMaterials::Found*> sorted;
  for (const auto& one : found.materials) sorted.push_back(&one);
  std::ranges::stable_sort(sorted, std::greater<>(), &FoundMaterials::Found::triangles);
  for (std::size_t i = 0; i < std::min(sorted.size(), most); ++i) {
    out << "          " << in_quotes(sorted[i]->name) << " on " << sorted[i]->triangles
        << " triangles: " << sorted[i]->description << "\n";
    for (const auto& note : sorted[i]->notes) out << "            " << note << "\n";
  }
  if (sorted.size() > most)
    out << "          and " << sorted.size() - most << " more materials (--json lists them)\n";
  for (const auto& note : found.notes) out << "          " << one_line(note) << "\n";
}

/// is_one  of one wavelength, which is named
void add_hologram(const Plan& plan, const SlmLight& light, bool is_one, Rows& out) {
  const glm::dvec2 window = glm::dvec2(plan.hologram.size) * plan.hologram.pitch_m;
  out << "hologram  " << plan.hologram.size.x << " x " << plan.hologram.size.y << " pixels, "
      << mm(window.x) << " x " << mm(window.y);
  if (is_one) out << ", wavelength " << plan.hologram.wavelength_m * 1e9 << " nm";
  out << "\n";
  out << "SLM       " << name_of(plan.slm.encoding) << ", ";
  if (plan.slm.stop)
    out << "its stop passes " << std::round(1000 * light.through_stop) / 10 << " % of the light, ";
  out << "zero order " << mm(light.zero_order_size_m.x) << " x " << mm(light.zero_order_size_m.y)
      << " around (" << mm(light.zero_order_m.x) << ", " << mm(light.zero_order_m.y) << ") at "
      << mm(light.z_m)
      << (light.zero_order_stopped  ? ", stopped\n"
          : light.on_picture == 0.0 ? ", beside the picture\n"
                                    : ", in the picture\n");
}

/// What an SLM and light that are not ideal do to pictures.
void add_faults(const Plan& plan, const SlmLight& light, Rows& out) {
  const auto& slm = plan.slm;
  const auto& falling = slm.illumination;
  if (!falling.profile.is_even()) {
    out << "beam      ";
    if (!falling.profile.picture)
      out << number(100 * light.on_hologram) << " % of its light falls onto the hologram, ";
    out << "the darkest pixel has " << number(100 * light.darkest) << " % of the mean\n";
  }
  if (slm.fill)
    out << "pixels    send " << number(100 * light.in_order)
        << " % of their light into the picture's order, and where the scene gets least "
        << number(100 * light.at_edge) << " % of that\n";
  if (slm.undiffracted > 0)
    out << "zero      " << number(100 * slm.undiffracted)
        << " % of the light stays in the zero order\n";
  if (const auto& source = light.source; falling.source_size_rad > 0 || falling.bandwidth_m > 0) {
    out << "source    at " << mm(light.z_m);
    if (source.disc_m > 0)
      out << " its size spreads points over " << length_text(std::round(source.disc_m * 1e7) / 1e7);
    if (source.smear_m > 0)
      out << (source.disc_m > 0 ? ", its" : " its") << " spectrum moves light by up to "
          << length_text(std::round(source.smear_m * 1e7) / 1e7) << " (half maximum)";
    out << "; speckle has " << number(100 * source.speckle) << " % of a laser's contrast\n";
  }
}

/// Of each object, the share of its surface that turns its back to the viewer, each part as large
/// as it looks from there.
std::vector<double> shares_from_behind(const World& world) {
  std::vector<double> behind(world.object_closed.size(), 0), all = behind;
  for (std::size_t t = 0; t < world.triangles.size(); ++t) {
    const auto [a, b, c] = world.corners_m(t);
    const auto middle = a + b + c;
    // The line of sight goes through the hologram
    const auto ahead = middle.z == 0 ? glm::dvec3(0, 0, 1) : middle / middle.z;
    const double turned = glm::dot(glm::cross(b - a, c - a), ahead);
    const auto object = static_cast<std::size_t>(world.triangle_object[t]);
    behind[object] += std::max(turned, 0.0);
    all[object] += std::abs(turned);
  }
  for (std::size_t i = 0; i < all.size(); ++i) behind[i] = all[i] > 0 ? behind[i] / all[i] : 0;
  return behind;
}

void add_objects(const Scene& scene, const World& world, Rows& out) {
  constexpr double mostly = 0.75;
  const auto behind = shares_from_behind(world);
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const auto& object = scene.objects[i];
    const auto count = std::ranges::count(world.triangle_object, static_cast<std::int32_t>(i));
    out << "object    " << object.mesh.filename().string() << ": " << count << " triangles, "
        << (world.object_closed[i] ? "closed"
            : behind[i] > mostly   ? "open, seen from behind"
                                   : "open");
    const bool wears_own = i < world.found.size() && !world.found[i].materials.empty();
    if (wears_own) {
      out << ", materials of its own\n";
    } else {
      out << ", material "
          << (object.material == 0
                  ? "default"
                  : scene.materials[static_cast<std::size_t>(object.material)].name);
      if (i < world.found.size() && world.found[i].overridden > 0)
        out << " instead of " << world.found[i].overridden << " of its own";
      out << "\n";
    }
    if (i < world.found.size()) add_found_text(world.found[i], out);
  }
}

void add_scene(const Scene& scene, const World& world, const Plan& plan, Rows& out) {
  const glm::dvec3 extent = world.max_m - world.min_m;
  if (std::ranges::any_of(scene.lights, has_size))
    out << "lights    looked for in "
        << directions_of(scene.lights, [](const Light&) { return true; })
        << " directions from every place of a surface, highlights in "
        << directions_of(scene.lights, [](const Light& l) { return l.highlights; }) << "\n";
  out << "scene     " << world.triangles.size() << " triangles, " << mm(extent.x) << " x "
      << mm(extent.y) << " x " << mm(extent.z) << ", " << mm(plan.extent.near_m) << " to "
      << mm(plan.extent.far_m) << " from the hologram\n";
  if (scene.viewer.eyepiece_m && plan.extent.near_m + scene.viewer.eyepiece_distance_m > 0)
    out << "eyepiece  shows it at " << number(dioptres_of_depth(scene.viewer, plan.extent.near_m))
        << " D to " << number(dioptres_of_depth(scene.viewer, plan.extent.far_m)) << " D\n";
}

void add_eye(const Scene& scene, const EyeView& eye, Rows& out) {
  const auto acuity = number(eye.acuity * 180 * 60 / std::numbers::pi);
  out << "eye       a pupil of " << mm(eye.pupil.diameter_m) << " sees " << acuity << " arc minute"
      << (acuity == "1" ? "" : "s") << ", sharp within +-" << number(eye.sharp())
      << " D (of acuity " << number(eye.sharp_by_acuity) << ", of a quarter wave "
      << number(eye.sharp_by_wave) << ")";
  if (scene.viewer.eyepiece_m)
    out << "; eyebox " << mm(eye.eyebox_m.x) << " x " << mm(eye.eyebox_m.y) << ", of it lit "
        << mm(eye.lit_m.x) << " x " << mm(eye.lit_m.y) << ", undiffracted light around ("
        << mm(eye.zero_order_m.x) << ", " << mm(eye.zero_order_m.y) << "), the hologram itself at "
        << number(dioptres_of_depth(scene.viewer, 0)) << " D";
  else
    out << "; the SLM's orders lie " << mm(eye.eyebox_m.x) << " x " << mm(eye.eyebox_m.y)
        << " apart there";
  out << "\n";
  for (const auto& place : eye.places)
    out << "          at (" << mm(place.centre_m.x) << ", " << mm(place.centre_m.y)
        << ") the scene's light fills " << percent_text(place.light) << " of it, and "
        << percent_text(place.cut) << " of the scene is not seen\n";
}

void add_illumination(const Scene& scene, const Plan& plan, Rows& out) {
  if (const auto& falling = scene.slm.illumination; !falling.is_plane()) {
    out << "light     on the SLM ";
    if (!falling.focus_m)
      out << "parallel";
    else if (*falling.focus_m > 0)
      out << "converging " << mm(*falling.focus_m) << " before it";
    else
      out << "diverging from " << mm(-*falling.focus_m) << " beyond it";
    out << ", its middle ray " << number(degrees_of(falling.sine.x)) << " x "
        << number(degrees_of(falling.sine.y)) << " degrees off the axis; pixels turn it by "
        << number(degrees_of(plan.hologram.largest_sine.x)) << " x "
        << number(degrees_of(plan.hologram.largest_sine.y)) << " degrees at most\n";
  }
}

/// Tiles, and WRPs or virtual planes.
void add_planes(const Plan& plan, Rows& out) {
  if (plan.tiling.tiles.size() > 1)
    out << "tiles     " << plan.tiling.grid.x << " x " << plan.tiling.grid.y << " of "
        << plan.tiling.tile_size.x << " x " << plan.tiling.tile_size.y
        << " pixels, one after another\n";
  for (const auto& layer : plan.layers) {
    const auto lit =
        std::ranges::count_if(plan.wrps, [&](const Wrp& w) { return &plan.layer_of(w) == &layer; });
    if (is_near_hologram(plan)) {
      out << "gathered  at the hologram itself, each sample where its light is no steeper than the "
             "pixels show\n";
      break;
    }
    const auto name = plane_name(plan), head = name.substr(name.rfind(' ') + 1) + "s";
    out << head << std::string(10 - head.size(), ' ') << layer.grid.x << " x " << layer.grid.y;
    if (const auto dark = std::ptrdiff_t{layer.grid.x} * layer.grid.y - lit; dark > 0)
      out << " less " << dark << " that no light falls into";
    out << " at " << mm(layer.distance_m);
    const double behind_m = layer.distance_m - plan.extent.near_m;
    if (plan.layers.size() == 1)
      out << (mm(behind_m) == "0 mm" ? ", at"
              : behind_m > 0         ? ", " + mm(behind_m) + " behind"
                                     : ", " + mm(-behind_m) + " in front of")
          << " the nearest surface\n";
    else
      out << ", for surfaces from " << mm(layer.min_m.z) << " to " << mm(layer.max_m.z) << "\n";
    constexpr int most_listed = 16;
    int listed = 0;
    for (const auto& w : plan.wrps) {
      if (&plan.layer_of(w) != &layer || ++listed > most_listed) continue;
      out << "          centre (" << mm(w.centre_m.x) << ", " << mm(w.centre_m.y) << ")";
      if (!plan.samples.aimed) out << ": " << w.fan.size() << " rays per pixel";
      out << "\n";
    }
    if (listed > most_listed) out << "          and " << listed - most_listed << " more\n";
  }
}

void add_samples(const Scene& scene, const Plan& plan, Rows& out) {
  if (plan.specular.bounces > 0) {
    out << "mirrors   up to " << plan.specular.bounces
        << " mirrors and surfaces of glass on a path, ";
    if (plan.has_specular_samples()) {
      out << (has_fitted_paths(plan) ? "samples with a path fitted to the window"
                                     : "samples of virtual points");
      if (scene.trace.bounces == Bounces::automatic) out << " (auto)";
      if (!plan.specular.images.all.empty())
        out << "; seen from " << mm(plan.specular.images.near_m) << " to "
            << mm(plan.specular.images.far_m) << ", " << number(100 * plan.specular.images.beyond)
            << " % of the light elsewhere";
      out << "\n";
    } else {
      out << "fans of rays\n";
    }
  }
  if (const auto& light = plan.lighting; light.diffuse_rays + light.gloss_rays > 0)
    out << "scattered light of other surfaces, by " << light.diffuse_rays << " rays all around and "
        << light.gloss_rays << " in highlights, from each ray's end\n";
  if (plan.samples.aimed)
    out << "samples   a lattice of " << plan.lattice.size.x << " x " << plan.lattice.size.y
        << " rays, " << mm(scene.sampling.pitch_m) << " apart at "
        << mm(plan.lattice.full_z_m + plan.lattice.eye_m.z) << "\n";
  out << "rays      " << (plan.samples.aimed ? "about " : "") << primary_rays(plan)
      << " per frame, " << scene.sampling.frames
      << (scene.sampling.frames == 1 ? " frame\n" : " frames\n");
}

/// Precision, and the errors of what carries light to the hologram.
void add_errors(const Scene& scene, const Plan& plan, Rows& out) {
  const double error = phase_error_turns(plan);
  out << "precision " << name_of(plan.precision) << (scene.accuracy.precision ? "" : " (auto)")
      << ", predicted phase error " << number(error) << " turn"
      << (error < scene.accuracy.phase_turns ? ", below " : ", NOT below ")
      << number(scene.accuracy.phase_turns) << "\n";
  if (plan.samples.aimed && !plan.holds_all_light() && !is_near_hologram(plan))
    out << "cone      " << plan.cone.half_width << " half holograms to each side, apodization "
        << plan.cone.apodization << ", error predicted " << number(100 * cone_error_of(plan))
        << " %\n";
  for (const auto& [name, text] : report_rows(plan))
    out << name << std::string(10 - name.size(), ' ') << text << '\n';
}

void add_kernels(const Plan& plan, Rows& out) {
  const auto kernels = kernel_options(plan);
  out << "kernels   with";
  for (const auto& [part, name] : {std::pair{option::highlights, "highlights"},
                                   {option::textures, "textures"},
                                   {option::shadows, "shadows"},
                                   {option::bounces, "bounces"}})
    out << (part == option::highlights ? " " : ", ") << (kernels.at(part) == "0" ? "no " : "")
        << name;
  out << "\n";
}

void add_time(const Prediction& prediction, Rows& out) {
  const auto& t = prediction.times;
  out << "time      " << seconds(t.total_s()) << " predicted: samples " << seconds(t.samples_s)
      << ", trace " << seconds(t.trace_s) << ", propagate " << seconds(t.propagate_s)
      << (t.refine_s > 0 ? ", refine " + seconds(t.refine_s) : "") << ", encode "
      << seconds(t.encode_s)
      << (prediction.device.empty() ? "" : " on " + one_line(prediction.device)) << " (rates of "
      << prediction.rates_of
      << (prediction.are_rates_measured ? "" : "; raywave tune measures this device")
      << ")\nfirst     the first picture takes "
      << (prediction.kernels_s.value_or(0) > 0 ? "up to about " : "")
      << seconds(prediction.meshes_and_trees_s + prediction.kernels_s.value_or(0))
      << " more for meshes, trees and kernels"
      << (!prediction.kernels_s ? "; those that the device has not compiled yet take seconds, "
                                  "once"
          : *prediction.kernels_s > 0 ? ", which this device has not compiled yet"
                                      : ", which this device has compiled before")
      << (prediction.files_s > 1 ? "; its files take " + seconds(prediction.files_s) : "") << "\n";
}

void add_pictures(const Plan& plan, const Prediction& prediction, Rows& out) {
  const auto& pictures = prediction.pictures;
  if (!pictures) return;
  if (pictures->dark)
    out << "pictures  dark: a coarse look from the hologram's middle meets no light\n";
  else
    out << format(
        "pictures  PSNR %.1f dB predicted, likely above %.1f, in %s at %s%s (of the field %.1f): "
        "encoding %.0f %%, speckle %.0f %%, cells and edges %.0f %%, light missing %.0f %%, "
        "dots %.0f %%, padding %.0f %% of the error\n",
        pictures->mean_psnr_db, pictures->sure_db(), pictures->window.text().c_str(),
        mm(prediction.resolution_m).c_str(), pictures->refined ? ", refined" : "",
        pictures->field_psnr_db, 100 * pictures->encoding, 100 * pictures->speckle,
        100 * pictures->edges, 100 * pictures->missing, 100 * pictures->dots,
        100 * pictures->padding);
  if (pictures->stop > 0)
    out << "          " << number(100 * pictures->stop)
        << " % of the error is what the stop cuts off\n";
  if (plan.slm.fill)
    out << "          " << number(100 * pictures->fall_off)
        << " % of the error is the fall-off of slm.fill\n";
  if (shows_amplitude(plan.slm.encoding))
    out << "          (haze as of double phase; that of " << name_of(plan.slm.encoding)
        << " is not predicted)\n";
}

void add_plan(const Planned& planned, const World& world, bool is_one, Rows& out) {
  const auto& [scene, plan, prediction, reasons, warnings] = planned;
  add_hologram(plan, prediction.slm_light, is_one, out);
  add_objects(scene, world, out);
  add_scene(scene, world, plan, out);
  if (prediction.eye) add_eye(scene, *prediction.eye, out);
  add_illumination(scene, plan, out);
  add_faults(plan, prediction.slm_light, out);
  add_planes(plan, out);
  add_samples(scene, plan, out);
  add_errors(scene, plan, out);
  add_kernels(plan, out);
  out << "memory    " << cl::format_bytes(prediction.device_bytes)
      << " on the device; render holds " << cl::format_bytes(prediction.host_bytes)
      << " of the host's memory at most" << (prediction.device_on_host ? ", with these" : "")
      << "\n";
  add_time(prediction, out);
  add_pictures(plan, prediction, out);
  out << "field     error " << number(100 * prediction.field_error) << " % predicted\n";
  for (const auto& reason : reasons) out << "because   " << reason << "\n";
  for (const auto& warning : warnings) out << "warning   " << warning << "\n";
}

/// The rows of a plan, each with the lines that belong to it.
std::vector<std::string> rows_of(const Planned& planned, const World& world) {
  Rows out = text_stream();
  add_plan(planned, world, false, out);
  std::vector<std::string> rows;
  std::istringstream in(out.str());
  for (std::string line; std::getline(in, line);) {
    if (rows.empty() || !line.starts_with(' ')) rows.emplace_back();
    rows.back() += line + "\n";
  }
  return rows;
}

/// The head of the plans of several lasers: what each shows, and what all need.
void add_lasers(const std::vector<Planned>& planned, const World& world, Rows& out) {
  const auto share_text = [](double share) { return format("%.3f", share); };
  const auto& lasers = planned.at(0).scene.colour.value().lasers;
  const double middle_m = (world.min_m.z + world.max_m.z) / 2;
  out << "colour    " << planned.size() << " lasers in turn; linear sRGB, white D65";
  if (const double error = white_error(lasers.white()); error > 0.1) {
    const auto white = chromaticity_of(xyz_from_srgb() * lasers.white());
    out << ", which is shown as (" << share_text(white.x) << ", " << share_text(white.y)
        << "), a CIEDE2000 of " << format("%.1f", error) << " away";
  }
  out << "\n";
  if (const auto text = drive_text(planned[0].scene.colour.value(), lasers.white_powers, "white");
      !text.empty())
    out << "lasers    " << text << "; render says what its picture needs\n";
  std::vector<Scene> scenes;
  double seconds = 0;
  for (std::size_t i = 0; i < planned.size(); ++i) {
    const auto& scene = planned[i].scene;
    scenes.push_back(scene);
    seconds += planned[i].prediction.times.total_s();
    const auto row = lasers.from_rgb[i];
    out << "laser     " << length_text(scene.hologram.wavelength_m) << ": "
        << share_text(lasers.white_powers[i]) << " of white's power; light " << share_text(row.x)
        << " R + " << share_text(row.y) << " G + " << share_text(row.z) << " B; shows "
        << sides_text(field_m(scene.hologram, scene.hologram.wavelength_m, middle_m)) << " at "
        << length_text(middle_m) << "\n";
  }
  const auto shortest = *std::ranges::min_element(lasers.wavelengths_m);
  out << "field     " << sides_text(field_m(scenes[0].hologram, shortest, middle_m))
      << " that the whole hologram shows with all lasers\n";
  out << "time      " << number_text(std::round(100 * seconds) / 100)
      << " s predicted for all lasers\n";
  if (const auto warning = colour_warning(scenes, world); !warning.empty())
    out << "warning   " << warning << "\n";
}

}  // namespace

std::string plan_report_text(const std::vector<Planned>& planned, const World& world) {
  Rows out = text_stream();
  if (planned.size() == 1) {
    add_plan(planned[0], world, true, out);
    return out.str();
  }
  add_lasers(planned, world, out);
  std::vector<std::vector<std::string>> rows;
  for (const auto& plan : planned) rows.push_back(rows_of(plan, world));
  const auto is_common = [&](const std::string& row) {
    return std::ranges::all_of(
        rows, [&](const auto& one) { return std::ranges::find(one, row) != one.end(); });
  };
  out << "\n--- all lasers\n";
  for (const auto& row : rows[0])
    if (is_common(row)) out << row;
  for (std::size_t i = 0; i < planned.size(); ++i) {
    out << "\n--- " << length_text(planned[i].plan.hologram.wavelength_m) << "\n";
    for (const auto& row : rows[i])
      if (!is_common(row)) out << row;
  }
  return out.str();
}

}  // namespace raywave
