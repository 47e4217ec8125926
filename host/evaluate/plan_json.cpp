// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <nlohmann/json.hpp>

#include "host/carriers/planning/facts.hpp"
#include "host/evaluate/quality.hpp"
#include "host/evaluate/report.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/precision.hpp"
#include "host/scene/scene_json.hpp"
#include "raywave_version.hpp"

namespace raywave {
namespace {

Json json_of(glm::ivec2 v) { return Json::array({v.x, v.y}); }
Json json_of(glm::dvec2 v) { return Json::array({v.x, v.y}); }
Json json_of(glm::dvec3 v) { return Json::array({v.x, v.y, v.z}); }

Json json_of(const Planned& planned, const World& world) {
  const auto& [scene, plan, prediction, reasons, warnings] = planned;
  Json j;
  j["raywave"] = version;
  j["scene"] = json_of(scene);
  add_found(world.found, j["scene"]["objects"]);
  j["triangles"] = world.triangles.size();
  j["vertices"] = world.positions.size();
  j["bounds_m"] = Json::array({json_of(world.min_m), json_of(world.max_m)});
  j["plan"] = plan_json(plan);
  j["accuracy"] = accuracy_json(scene.accuracy, plan);
  for (const auto& [part, value] : kernel_options(plan))
    j["kernels"][std::string(part.name)] = value;
  j["prediction"] = json_of(prediction);
  j["reasons"] = reasons;
  j["warnings"] = warnings;
  return j;
}

}  // namespace

Json json_of(const Prediction& prediction) {
  const auto& t = prediction.times;
  Json j{{"seconds",
          {{"samples", t.samples_s},
           {"trace", t.trace_s},
           {"propagate", t.propagate_s},
           {"refine", t.refine_s},
           {"encode", t.encode_s},
           {"total", t.total_s()}}},
         {"first_picture_seconds",
          {{"meshes_and_trees", prediction.meshes_and_trees_s},
           {"kernels", prediction.kernels_s ? Json(*prediction.kernels_s) : Json()},
           {"files", prediction.files_s}}},
         {"device", prediction.device},
         {"rates_of", prediction.rates_of},
         {"device_bytes", prediction.device_bytes},
         {"host_bytes", prediction.host_bytes},
         {"field_error", prediction.field_error},
         {"resolution_m", prediction.resolution_m}};
  if (const auto& p = prediction.pictures; p && p->dark)
    j["pictures"] = {{"dark", true}};
  else if (p)
    j["pictures"] = {{"psnr_db", p->psnr_db},
                     {"mean_psnr_db", p->mean_psnr_db},
                     {"likely_above_db", p->sure_db()},
                     {"window_m", json_of(p->window)},
                     {"refined", p->refined},
                     {"shares_of_error",
                      {{"speckle", p->speckle},
                       {"cells_and_edges", p->edges},
                       {"light_missing", p->missing},
                       {"dots", p->dots},
                       {"padding", p->padding},
                       {"encoding", p->encoding},
                       {"stop", p->stop},
                       {"fall_off", p->fall_off}}},
                     {"field", {{"mean_psnr_db", p->field_psnr_db}}}};
  const auto& light = prediction.slm_light;
  j["slm_light"] = {{"through_stop", light.through_stop},
                    {"zero_order",
                     {{"z_m", light.z_m},
                      {"centre_m", {light.zero_order_m.x, light.zero_order_m.y}},
                      {"size_m", {light.zero_order_size_m.x, light.zero_order_size_m.y}},
                      {"stopped", light.zero_order_stopped},
                      {"share_of_picture", light.on_picture}}},
                    {"beam_on_hologram", light.on_hologram},
                    {"darkest_pixel", light.darkest},
                    {"in_order", light.in_order},
                    {"least_in_order", light.at_edge},
                    {"source",
                     {{"disc_m", light.source.disc_m},
                      {"smear_m", light.source.smear_m},
                      {"speckle", light.source.speckle}}}};
  if (prediction.eye) {
    const auto& eye = *prediction.eye;
    j["eye"] = {{"pupil_m", eye.pupil.diameter_m},
                {"eyebox_m", json_of(eye.eyebox_m)},
                {"lit_m", json_of(eye.lit_m)},
                {"acuity", eye.acuity},
                {"sharp_dioptres",
                 {{"by_acuity", eye.sharp_by_acuity}, {"by_quarter_wave", eye.sharp_by_wave}}}};
    for (const auto& place : eye.places)
      j["eye"]["places"].push_back({{"position_m", json_of(place.centre_m)},
                                    {"light", place.light},
                                    {"not_seen", place.cut}});
  }
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
    j["work"]["refine_butterflies"] = w.refine_butterflies + w.picture_butterflies;
  }
  return j;
}

Json plan_json(const Plan& plan) {
  Json j{{"tiles", json_of(plan.tiling.grid)},
         {"tile_size", json_of(plan.tiling.tile_size)},
         {"why_tiles", plan.tiling.why},
         {"propagation", name_of(propagation_of(plan))},
         {"why_propagation", plan.why_carrier},
         {"grid", json_of(plan.grid)},
         {"near_m", plan.extent.near_m},
         {"far_m", plan.extent.far_m},
         {"padded", json_of(transformed_size(plan))},
         {"cone_error", cone_error_of(plan)},
         {"propagation_error", propagation_error_of(plan)},
         {"band_filled", plan.hologram.band_filled},
         {"rays", primary_rays(plan)}};
  if (plan.specular.bounces > 0)
    j["mirrors"] = {{"surfaces", plan.specular.bounces}, {"bounces", name_of(plan.specular.as)}};
  if (plan.specular.bounces > 0 && plan.has_specular_samples())
    j["mirrors"]["images"] = {{"near_m", plan.specular.images.near_m},
                              {"far_m", plan.specular.images.far_m},
                              {"light_beyond", plan.specular.images.beyond}};
  add_report(plan, j);
  for (const auto& s : plan.layers) {
    j["layers"].push_back({{"distance_m", s.distance_m},
                           {"near_m", s.min_m.z},
                           {"far_m", s.max_m.z},
                           {"low_m", json_of(glm::dvec2(s.min_m))},
                           {"high_m", json_of(glm::dvec2(s.max_m))},
                           {"grid", json_of(s.grid)}});
  }
  for (const auto& w : plan.wrps) {
    j["wrps"].push_back({{"centre_m", json_of(w.centre_m)}, {"layer", w.layer}, {"tile", w.tile}});
    if (!plan.samples.aimed) j["wrps"].back()["rays_per_pixel"] = w.fan.size();
  }
  return j;
}

Json accuracy_json(const AccuracySpec& accuracy, const Plan& plan) {
  Json predicted;
  const auto errors = phase_errors_of(plan);
  for (const auto p : {Precision::floats, Precision::doubles}) {
    const auto& e = errors[static_cast<std::size_t>(p)];
    predicted[name_of(p)] = {{"waves", e.waves_turns},
                             {"bounces", e.bounces_turns},
                             {"propagation", e.propagate_turns},
                             {"total", e.total_turns()}};
  }
  const double error = phase_error_turns(plan);
  return {{"precision", name_of(plan.precision)},
          {"predicted_phase_error_turns", predicted},
          {"wanted_phase_error_turns", accuracy.phase_turns},
          {"kept", error < accuracy.phase_turns}};
}

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

Json plan_report_json(const std::vector<Planned>& planned, const World& world) {
  const auto& first = planned.at(0).scene;
  if (planned.size() == 1) return json_of(planned[0], world);
  Json j{{"colour", colour_json(first.colour.value(), first.colour->lasers.white_powers)}};
  for (std::size_t i = 0; i < planned.size(); ++i) {
    auto& laser = j["colour"]["lasers"][i];
    const auto field = field_m(first.hologram, planned[i].plan.hologram.wavelength_m,
                               (world.min_m.z + world.max_m.z) / 2);
    laser["field_m"] = {2 * field.x, 2 * field.y};
    laser["plan"] = json_of(planned[i], world);
  }
  return j;
}

}  // namespace raywave
