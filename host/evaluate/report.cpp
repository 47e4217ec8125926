// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/report.hpp"

#include <sys/resource.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/device_json.hpp"
#include "host/evaluate/refinement.hpp"
#include "host/evaluate/slm_json.hpp"
#include "raywave_version.hpp"

namespace raywave {
namespace {

using Json = nlohmann::ordered_json;

std::uint64_t host_peak_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

}  // namespace

Json render_report_json(const Scene& scene, const RenderResult& result,
                        const cl::DeviceInfo& device, cl::FftBackend fft) {
  Json j;
  j["raywave"] = version;
  j["scene"] = json_of(scene);
  j["scene"]["slm"] = json_of(result.plan.slm);  // what the pictures are for
  add_found(result.found, j["scene"]["objects"]);
  j["plan"] = plan_json(result.plan);
  j["accuracy"] = accuracy_json(scene.accuracy, result.plan);
  j["device"] = json_of(device);
  j["device"]["fft"] = cl::name_of(fft);
  j["samples"] = {{"count", result.samples}, {"with_visibility_rays", result.hidden_samples}};
  j["seed"] = scene.sampling.seed;
  if (result.refined) {
    j["refine"] = refinement_json({}, result.refined->figures);
    j["refine"]["blur_m"] = result.plan.refine->blur_m.value();
    j["refine"]["brightness"] = result.plan.refine->brightness;
  }
  j["notes"] = scene.notes;
  for (const auto& note : result.notes) j["notes"].push_back(note);
  j["seconds"] = result.seconds;
  j["processor_seconds"] = result.processor_seconds;
  j["peak_memory"] = {{"host_bytes", host_peak_bytes()},
                      {"device_bytes", result.device_peak_bytes}};
  return j;
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
