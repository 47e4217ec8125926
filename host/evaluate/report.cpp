// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/report.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/device_json.hpp"
#include "host/evaluate/refinement.hpp"
#include "host/evaluate/slm_json.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/precision.hpp"
#include "host/scene/eyepiece.hpp"
#include "host/trace/device_scene.hpp"
#include "raywave_version.hpp"

namespace raywave {
namespace {

using Json = nlohmann::ordered_json;

double degrees_of(double sine) { return std::asin(sine) * 180 / std::numbers::pi; }

Json json_of(glm::ivec2 v) { return Json::array({v.x, v.y}); }
Json json_of(glm::dvec3 v) { return Json::array({v.x, v.y, v.z}); }

/// What objects' meshes bring, in place of the scene's materials.
void add_found(const std::vector<FoundMaterials>& found, Json& objects) {
  for (std::size_t i = 0; i < std::min(found.size(), objects.size()); ++i) {
    auto& object = objects[i];
    for (const auto& one : found[i].materials)
      object["mesh_materials"].push_back({{"name", one.name},
                                          {"triangles", one.triangles},
                                          {"as", one.description},
                                          {"notes", one.notes}});
    if (found[i].overridden > 0) object["mesh_materials_overridden"] = found[i].overridden;
    if (!found[i].notes.empty()) object["mesh_notes"] = found[i].notes;
  }
}

Json json_of(const AccuracySpec& accuracy, const Plan& plan) {
  Json predicted;
  for (const auto p : {Precision::floats, Precision::doubles}) {
    const auto& e = plan.phase_errors[static_cast<std::size_t>(p)];
    predicted[name_of(p)] = {{"waves", e.waves_turns},
                             {"bounces", e.bounces_turns},
                             {"propagation", e.propagate_turns},
                             {"total", e.total_turns()}};
  }
  const double error = plan.phase_errors[static_cast<std::size_t>(plan.precision)].total_turns();
  return {{"precision", name_of(plan.precision)},
          {"predicted_phase_error_turns", predicted},
          {"wanted_phase_error_turns", accuracy.phase_turns},
          {"kept", error < accuracy.phase_turns}};
}

Json json_of(const Plan& plan) {
  Json j{{"tiles", json_of(plan.tile_grid)},
         {"tile_size", json_of(plan.tile_size)},
         {"why_tiles", plan.why_tiles},
         {"propagation", plan.compact ? "compact" : "spectrum"},
         {"why_propagation", plan.why_propagation},
         {"grid", json_of(plan.grid)},
         {"near_m", plan.near_m},
         {"far_m", plan.far_m},
         {"padded", json_of(plan.padded)},
         {"cone_error", plan.cone_error},
         {"padding_error", plan.padding_error},
         {"rays", plan.rays}};
  if (plan.bounces > 0)
    j["mirrors"] = {{"surfaces", plan.bounces}, {"bounces", name_of(plan.bounces_as)}};
  if (plan.bounces > 0 && plan.has_specular_samples())
    j["mirrors"]["images"] = {{"near_m", plan.images.near_m},
                              {"far_m", plan.images.far_m},
                              {"light_beyond", plan.images.beyond}};
  if (const auto& c = plan.compact)
    j["compact"] = {{"size", json_of(c->size)},
                    {"bell", c->bell},
                    {"margin_px", c->margin_px},
                    {"rough_margin_px", c->rough_margin_px},
                    {"lines", c->lines},
                    {"lines_tolerance", c->lines_tolerance},
                    {"window_error", c->window_error},
                    {"lines_error", c->lines_error},
                    {"highlight_lines", c->highlight_lines},
                    {"highlight_margin_px", c->highlight_margin_px},
                    {"highlights_error", c->highlights_error}};
  for (const auto& s : plan.layers) {
    j["layers"].push_back({{"distance_m", s.distance_m},
                           {"near_m", s.min_m.z},
                           {"far_m", s.max_m.z},
                           {"grid", json_of(s.grid)}});
  }
  for (const auto& w : plan.wrps) {
    j["wrps"].push_back({{"centre_m", json_of(w.centre_m)}, {"layer", w.layer}, {"tile", w.tile}});
    if (!plan.aimed) j["wrps"].back()["rays_per_pixel"] = w.fan.size();
  }
  return j;
}

Json json_of(const Prediction& prediction) {
  const auto& t = prediction.times;
  Json j{{"seconds",
          {{"samples", t.samples_s},
           {"trace", t.trace_s},
           {"propagate", t.propagate_s},
           {"refine", t.refine_s},
           {"encode", t.encode_s},
           {"total", t.total_s()}}},
         {"rates_of", prediction.rates_of},
         {"device_bytes", prediction.device_bytes},
         {"field_error", prediction.field_error},
         {"resolution_m", prediction.resolution_m}};
  if (const auto& p = prediction.pictures; p && p->dark)
    j["pictures"] = {{"dark", true}};
  else if (p)
    j["pictures"] = {{"psnr_db", p->psnr_db},
                     {"mean_psnr_db", p->mean_psnr_db},
                     {"refined", p->refined},
                     {"shares_of_error",
                      {{"speckle", p->speckle},
                       {"cells_and_edges", p->edges},
                       {"light_missing", p->missing},
                       {"dots", p->dots},
                       {"padding", p->padding},
                       {"encoding", p->encoding},
                       {"stop", p->stop}}},
                     {"field", {{"mean_psnr_db", p->field_psnr_db}}}};
  const auto& light = prediction.slm_light;
  j["slm_light"] = {{"through_stop", light.through_stop},
                    {"zero_order",
                     {{"z_m", light.z_m},
                      {"centre_m", {light.zero_order_m.x, light.zero_order_m.y}},
                      {"size_m", {light.zero_order_size_m.x, light.zero_order_size_m.y}},
                      {"stopped", light.zero_order_stopped},
                      {"share_of_picture", light.on_picture}}}};
  const auto& w = prediction.work;
  j["work"] = {{"samples", w.samples},
               {"rays", w.rays},
               {"shadow_rays", w.shadow_rays},
               {"nodes", w.nodes},
               {"pairs", w.pairs},
               {"pixels", w.pixels},
               {"butterflies", w.butterflies},
               {"levels", w.levels}};
  if (w.lens_rays > 0) {
    j["work"]["lens_rays"] = w.lens_rays;
    j["work"]["refine_butterflies"] = w.refine_butterflies;
  }
  return j;
}

/// The materials of a mesh, those that most triangles wear first.
void add_found_text(const FoundMaterials& found, std::ostringstream& out) {
  constexpr std::size_t most = 16;
  std::vector<const FoundMaterials::Found*> sorted;
  for (const auto& one : found.materials) sorted.push_back(&one);
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const auto* a, const auto* b) { return a->triangles > b->triangles; });
  for (std::size_t i = 0; i < std::min(sorted.size(), most); ++i) {
    out << "          " << in_quotes(sorted[i]->name) << " on " << sorted[i]->triangles
        << " triangles: " << sorted[i]->description << "\n";
    for (const auto& note : sorted[i]->notes) out << "            " << note << "\n";
  }
  if (sorted.size() > most)
    out << "          and " << sorted.size() - most << " more materials (--json lists them)\n";
  for (const auto& note : found.notes) out << "          " << one_line(note) << "\n";
}

std::uint64_t host_peak_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace

std::string scene_json(const Scene& scene) { return json_of(scene).dump(); }

std::string render_report_json(const Scene& scene, const RenderResult& result,
                               const cl::DeviceInfo& device, cl::FftBackend fft) {
  Json j;
  j["raywave"] = version;
  j["scene"] = json_of(scene);
  j["scene"]["slm"] = json_of(result.plan.slm);  // what the pictures are for
  add_found(result.found, j["scene"]["objects"]);
  j["plan"] = json_of(result.plan);
  j["accuracy"] = json_of(scene.accuracy, result.plan);
  j["device"] = json_of(device);
  j["device"]["fft"] = cl::name_of(fft);
  j["samples"] = {{"count", result.samples}, {"with_visibility_rays", result.hidden_samples}};
  j["seed"] = scene.sampling.seed;
  if (result.refined) {
    j["refine"] = Json::parse(refinement_json({}, result.refined->figures));
    j["refine"]["blur_m"] = result.plan.refine->blur_m.value();
    j["refine"]["brightness"] = result.plan.refine->brightness;
  }
  j["notes"] = scene.notes;
  for (const auto& note : result.notes) j["notes"].push_back(note);
  j["seconds"] = result.seconds;
  j["processor_seconds"] = result.processor_seconds;
  j["peak_memory"] = {{"host_bytes", host_peak_bytes()},
                      {"device_bytes", result.device_peak_bytes}};
  return j.dump(2) + "\n";
}

std::string plan_report_json(const Planned& planned, const World& world) {
  const auto& [scene, plan, prediction, reasons, warnings] = planned;
  Json j;
  j["raywave"] = version;
  j["scene"] = json_of(scene);
  add_found(world.found, j["scene"]["objects"]);
  j["triangles"] = world.triangles.size();
  j["vertices"] = world.positions.size();
  j["bounds_m"] = Json::array({json_of(world.min_m), json_of(world.max_m)});
  j["plan"] = json_of(plan);
  j["accuracy"] = json_of(scene.accuracy, plan);
  for (const auto& [part, value] : kernel_options(plan))
    j["kernels"][std::string(part.name)] = value;
  j["prediction"] = json_of(prediction);
  j["reasons"] = reasons;
  j["warnings"] = warnings;
  return j.dump(2) + "\n";
}

std::string plan_report_text(const Planned& planned, const World& world) {
  const auto& [scene, plan, prediction, reasons, warnings] = planned;
  std::ostringstream out;
  const auto mm = [](double metres) {
    std::array<char, 32> text;
    std::snprintf(text.data(), text.size(), "%.4g mm", metres * 1e3);
    return std::string(text.data());
  };
  const auto number = [](double value) {
    std::array<char, 32> text;
    std::snprintf(text.data(), text.size(), "%.2g", value);
    return std::string(text.data());
  };
  const glm::dvec2 window = glm::dvec2(plan.size) * plan.pitch_m;
  const glm::dvec3 extent = world.max_m - world.min_m;
  // Hologram, objects and scene
  out << "hologram  " << plan.size.x << " x " << plan.size.y << " pixels, " << mm(window.x) << " x "
      << mm(window.y) << ", wavelength " << plan.wavelength_m * 1e9 << " nm\n";
  const auto& light = prediction.slm_light;
  out << "SLM       " << name_of(plan.slm.encoding) << ", ";
  if (plan.slm.stop)
    out << "its stop passes " << std::round(1000 * light.through_stop) / 10 << " % of the light, ";
  out << "zero order " << mm(light.zero_order_size_m.x) << " x " << mm(light.zero_order_size_m.y)
      << " around (" << mm(light.zero_order_m.x) << ", " << mm(light.zero_order_m.y) << ") at "
      << mm(light.z_m)
      << (light.zero_order_stopped  ? ", stopped\n"
          : light.on_picture == 0.0 ? ", beside the picture\n"
                                    : ", in the picture\n");
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const auto& object = scene.objects[i];
    const auto count = std::count(world.triangle_object.begin(), world.triangle_object.end(),
                                  static_cast<std::int32_t>(i));
    out << "object    " << object.mesh.filename().string() << ": " << count << " triangles, "
        << (world.object_closed[i] ? "closed" : "open");
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
  if (std::any_of(scene.lights.begin(), scene.lights.end(), has_size))
    out << "lights    looked for in "
        << directions_of(scene.lights, [](const Light&) { return true; })
        << " directions from every place of a surface, highlights in "
        << directions_of(scene.lights, [](const Light& l) { return l.highlights; }) << "\n";
  out << "scene     " << world.triangles.size() << " triangles, " << mm(extent.x) << " x "
      << mm(extent.y) << " x " << mm(extent.z) << ", " << mm(plan.near_m) << " to "
      << mm(plan.far_m) << " from the hologram\n";
  if (scene.viewer.eyepiece_m && plan.near_m + scene.viewer.eyepiece_distance_m > 0)
    out << "eyepiece  shows it at " << number(dioptres_of_depth(scene.viewer, plan.near_m))
        << " D to " << number(dioptres_of_depth(scene.viewer, plan.far_m)) << " D\n";
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
        << number(degrees_of(plan.largest_sine.x)) << " x "
        << number(degrees_of(plan.largest_sine.y)) << " degrees at most\n";
  }
  // Tiles and WRPs
  if (plan.tiles.size() > 1)
    out << "tiles     " << plan.tile_grid.x << " x " << plan.tile_grid.y << " of "
        << plan.tile_size.x << " x " << plan.tile_size.y << " pixels, one after another\n";
  for (const auto& layer : plan.layers) {
    const auto lit =
        std::count_if(plan.wrps.begin(), plan.wrps.end(),
                      [&plan = plan, &layer](const Wrp& w) { return &plan.layer_of(w) == &layer; });
    if (is_near_hologram(plan)) {
      out << "gathered  at the hologram itself, each sample where its light is no steeper than the "
             "pixels show\n";
      break;
    }
    out << (plan.compact ? "planes    " : "WRPs      ") << layer.grid.x << " x " << layer.grid.y;
    if (const auto dark = std::ptrdiff_t{layer.grid.x} * layer.grid.y - lit; dark > 0)
      out << " less " << dark << " that no light falls into";
    out << " at " << mm(layer.distance_m);
    if (plan.layers.size() == 1)
      out << ", " << mm(std::abs(plan.near_m - layer.distance_m))
          << (layer.distance_m > plan.near_m ? " behind" : " in front of")
          << " the nearest surface\n";
    else
      out << ", for surfaces from " << mm(layer.min_m.z) << " to " << mm(layer.max_m.z) << "\n";
    for (const auto& w : plan.wrps) {
      if (&plan.layer_of(w) != &layer) continue;
      out << "          centre (" << mm(w.centre_m.x) << ", " << mm(w.centre_m.y) << ")";
      if (!plan.aimed) out << ": " << w.fan.size() << " rays per pixel";
      out << "\n";
    }
  }
  // Sampling and its predicted errors
  if (plan.bounces > 0) {
    out << "mirrors   up to " << plan.bounces << " mirrors and surfaces of glass on a path, ";
    if (plan.has_specular_samples()) {
      out << (has_fitted_paths(plan) ? "samples with a path fitted to the window"
                                     : "samples of virtual points");
      if (scene.trace.bounces == Bounces::automatic) out << " (auto)";
      if (!plan.images.all.empty())
        out << "; seen from " << mm(plan.images.near_m) << " to " << mm(plan.images.far_m) << ", "
            << number(100 * plan.images.beyond) << " % of the light elsewhere";
      out << "\n";
    } else {
      out << "fans of rays\n";
    }
  }
  if (plan.aimed)
    out << "samples   a lattice of " << plan.lattice.size.x << " x " << plan.lattice.size.y
        << " rays, " << mm(scene.sampling.pitch_m) << " apart at "
        << mm(plan.lattice.full_z_m + plan.lattice.eye_m.z) << "\n";
  out << "rays      " << (plan.aimed ? "about " : "") << plan.rays << " per frame, "
      << scene.sampling.frames << (scene.sampling.frames == 1 ? " frame\n" : " frames\n");
  const double error = plan.phase_errors[static_cast<std::size_t>(plan.precision)].total_turns();
  out << "precision " << name_of(plan.precision) << (scene.accuracy.precision ? "" : " (auto)")
      << ", predicted phase error " << number(error) << " turn"
      << (error < scene.accuracy.phase_turns ? ", below " : ", NOT below ")
      << number(scene.accuracy.phase_turns) << "\n";
  const int most_lines = plan.compact ? plan.compact->most_lines() : 0;
  if (plan.compact)
    out << "virtual   planes of " << plan.compact->size.x << " x " << plan.compact->size.y << ", "
        << (plan.compact->lines_tolerance > 0 && most_lines > 1 ? "up to " : "") << most_lines
        << (most_lines == 1 ? " scan line" : " scan lines") << " of a sample; error predicted "
        << number(100 * plan.compact->error()) << " %\n";
  if (plan.aimed && !plan.compact && !is_near_hologram(plan))
    out << "cone      " << plan.cone_half_width << " half holograms to each side, apodization "
        << plan.apodization << ", error predicted " << number(100 * plan.cone_error) << " %\n";
  if (!plan.compact && !plan.is_at_hologram())
    out << "transform " << plan.padded.x << " x " << plan.padded.y << " (padding "
        << scene.wrp.padding << "), propagation error predicted "
        << number(100 * plan.padding_error) << " %\n";
  // Kernels, memory and predictions
  const auto kernels = kernel_options(plan);
  out << "kernels   with";
  for (const auto& [part, name] : {std::pair{option::highlights, "highlights"},
                                   {option::textures, "textures"},
                                   {option::shadows, "shadows"},
                                   {option::bounces, "bounces"}})
    out << (part == option::highlights ? " " : ", ") << (kernels.at(part) == "0" ? "no " : "")
        << name;
  out << "\n";
  out << "memory    " << cl::format_bytes(prediction.device_bytes) << " on the device\n";
  const auto& t = prediction.times;
  const auto seconds = [&](double value) {
    std::array<char, 32> text;  // two digits, more of large numbers
    const double shown = value < 1 ? value * 1e3 : value;
    std::snprintf(text.data(), text.size(), shown < 99.5 ? "%.2g %s" : "%.0f %s", shown,
                  value < 1 ? "ms" : "s");
    return std::string(text.data());
  };
  out << "time      " << seconds(t.total_s()) << " predicted: samples " << seconds(t.samples_s)
      << ", trace " << seconds(t.trace_s) << ", propagate " << seconds(t.propagate_s)
      << (t.refine_s > 0 ? ", refine " + seconds(t.refine_s) : "") << ", encode "
      << seconds(t.encode_s) << " (rates of "
      << (prediction.rates_of == "default"
              ? "two processor cores; raywave tune measures this device"
              : prediction.rates_of)
      << ")\n";
  if (const auto& pictures = prediction.pictures) {
    std::array<char, 240> text;
    if (pictures->dark)
      std::snprintf(text.data(), text.size(),
                    "pictures  dark: a coarse look from the hologram's middle meets no light\n");
    else if (pictures->refined)
      std::snprintf(text.data(), text.size(),
                    "pictures  PSNR %.1f dB predicted at %s, refined (of the field %.1f)\n",
                    pictures->mean_psnr_db, mm(prediction.resolution_m).c_str(),
                    pictures->field_psnr_db);
    else
      std::snprintf(
          text.data(), text.size(),
          "pictures  PSNR %.1f dB predicted at %s (of the field %.1f): encoding %.0f %%, "
          "speckle %.0f %%, cells and edges %.0f %%, light missing %.0f %%, dots %.0f %%, "
          "padding %.0f %% of the error\n",
          pictures->mean_psnr_db, mm(prediction.resolution_m).c_str(), pictures->field_psnr_db,
          100 * pictures->encoding, 100 * pictures->speckle, 100 * pictures->edges,
          100 * pictures->missing, 100 * pictures->dots, 100 * pictures->padding);
    out << text.data();
    if (pictures->stop > 0)
      out << "          " << number(100 * pictures->stop)
          << " % of the error is what the stop cuts off\n";
    if (shows_amplitude(plan.slm.encoding))
      out << "          (haze as of double phase; that of " << name_of(plan.slm.encoding)
          << " is not predicted)\n";
  }
  out << "field     error " << number(100 * prediction.field_error) << " % predicted\n";
  for (const auto& reason : reasons) out << "because   " << reason << "\n";
  for (const auto& warning : warnings) out << "warning   " << warning << "\n";
  return out.str();
}

ViewerSpec viewer_of_report(const std::filesystem::path& report,
                            const std::filesystem::path& file) {
  ViewerSpec viewer;
  std::ifstream in(report);
  if (!in) return viewer;
  try {
    const auto scene = scene_of_report(Json::parse(in), report, file);
    if (!scene.contains("viewer") || !scene.at("viewer").contains("eyepiece_m")) return viewer;
    viewer.eyepiece_m = scene.at("viewer").at("eyepiece_m").get<double>();
    viewer.eyepiece_distance_m = scene.at("viewer").at("eyepiece_distance_m").get<double>();
  } catch (const nlohmann::json::exception& error) {
    throw InputError(one_line(report.string()) +
                     ": not a report of raywave: " + json_reason(error));
  }
  return viewer;
}

HologramSpec hologram_of_report(const std::filesystem::path& report,
                                const std::filesystem::path& file) {
  std::ifstream in(report);
  if (!in)
    throw InputError(one_line(report.string()) +
                     ": not found; it tells the hologram's pitch and wavelength (or give --pitch "
                     "and --wavelength)");
  try {
    const auto j = scene_of_report(Json::parse(in), report, file).at("hologram");
    HologramSpec spec;
    spec.resolution = {j.at("resolution").at(0).get<int>(), j.at("resolution").at(1).get<int>()};
    spec.pitch_m = {j.at("pitch_m").at(0).get<double>(), j.at("pitch_m").at(1).get<double>()};
    spec.wavelength_m = j.at("wavelength_m").get<double>();
    if (!(spec.pitch_m.x > 0 && spec.pitch_m.y > 0 && spec.wavelength_m > 0))
      throw InputError(one_line(report.string()) + ": pitch and wavelength must be > 0");
    return spec;
  } catch (const nlohmann::json::exception& error) {
    throw InputError(one_line(report.string()) +
                     ": not a report of raywave: " + json_reason(error));
  }
}

}  // namespace raywave
