// SPDX-License-Identifier: Apache-2.0
#include "host/scene/scene_json.hpp"

#include <nlohmann/json.hpp>

#include "host/common/error.hpp"
#include "host/scene/settings.hpp"

namespace raywave {
namespace {

glm::dvec2 pair_of(const Json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>()};
}

/// Reads what json_of_keys has told of a struct's keys.
template <class Spec, class... More>
Spec keys_of_json(Spec spec, const Json& json, const std::filesystem::path& report,
                  const std::string& section, const More&... more) {
  Document document;
  document.file = report;
  const Keys key = [&](const Setting& setting) {
    if (setting.told_as.empty() || setting.told_as == "stop") return;
    const auto now = setting.json();
    if (now.is_null() && !json.contains(setting.told_as)) return;
    const auto& told = json.at(setting.told_as);
    if (told == now) return;
    toml::table parsed;
    try {
      // Numbers, texts and lists are as in JSON; a copy knows no line
      const auto original = toml::parse("value = " + told.dump());
      parsed = original;
    } catch (const toml::parse_error&) {
      throw InputError(
          one_line(report.string()) + ": its " +
          (section == "slm" ? "SLM is damaged (or give --slm)" : section + " is damaged"));
    }
    setting.read({&document, parsed.get("value"), setting.key, section + ": " + setting.told_as});
  };
  keys_of(spec, key, more...);
  return spec;
}

}  // namespace

Json json_of(const SlmSpec& slm) {
  auto json = json_of_keys(slm, 0.0, 10);
  if (const auto& light = slm.illumination; !(light == Illumination{})) {
    auto& told_light = json["illumination"] = {{"sine", told(light.sine)}};
    if (light.focus_m) told_light["focus_m"] = *light.focus_m;
    if (light.profile.picture)
      told_light["profile"] = std::filesystem::absolute(light.profile.file).string();
    else if (!light.profile.is_even())
      told_light["profile_m"] = told(light.profile.diameter_m);
    if (light.source_size_rad > 0) told_light["source_size_mrad"] = 1e3 * light.source_size_rad;
    if (light.bandwidth_m > 0) told_light["bandwidth_m"] = light.bandwidth_m;
  }
  if (!slm.flatness.picture.pixels.empty())
    json["flatness"] = {{"file", std::filesystem::absolute(slm.flatness.file).string()},
                        {"unit", slm.flatness.in_nm ? "nm" : "levels"},
                        {"fit", slm.flatness.centre ? "centre" : "exact"}};
  return json;
}

Json json_of(const ViewerSpec& viewer) { return json_of_keys(viewer); }

Json json_of(const Scene& scene) {
  const double wavelength_m = scene.hologram.wavelength_m;
  Json json{{"file", scene.file.string()},
            {"digest", scene.digest},
            {"hologram", json_of_keys(scene.hologram)},
            {"slm", json_of(scene.slm)},
            {"wrp", json_of_keys(scene.wrp)},
            {"sampling", json_of_keys(scene.sampling)},
            {"trace", json_of_keys(scene.trace)},
            {"viewer", json_of(scene.viewer)},
            {"accuracy", json_of_keys(scene.accuracy)}};
  if (scene.refine) json["refine"] = json_of_keys(*scene.refine);
  for (const auto& light : scene.lights) json["lights"].push_back(json_of_keys(light));
  for (const auto& material : scene.materials) {
    json["materials"].push_back({{"name", material.name}});
    json["materials"].back().update(json_of_keys(material, wavelength_m));
  }
  for (const auto& object : scene.objects) {
    auto one = json_of_keys(object, scene.hologram, scene.viewer, scene.materials, false);
    if (!object.width_m) one["width_m"] = "as in the file";
    json["objects"].push_back(one);
  }
  return json;
}

SlmSpec slm_of_json(const Json& json, const std::filesystem::path& report) {
  auto slm = keys_of_json(SlmSpec{}, json, report, "slm", 0.0, 10);
  if (json.contains("illumination")) {
    const auto& light = json.at("illumination");
    slm.illumination.sine = pair_of(light.at("sine"));
    if (light.contains("focus_m")) slm.illumination.focus_m = light.at("focus_m").get<double>();
    auto& profile = slm.illumination.profile;
    if (light.contains("profile")) profile.file = light.at("profile").get<std::string>();
    if (light.contains("profile_m")) profile.diameter_m = pair_of(light.at("profile_m"));
    slm.illumination.source_size_rad = 1e-3 * light.value("source_size_mrad", 0.0);
    slm.illumination.bandwidth_m = light.value("bandwidth_m", 0.0);
  }
  if (json.contains("stop"))
    slm.stop = {pair_of(json.at("stop").at("size")), pair_of(json.at("stop").at("centre"))};
  if (json.contains("flatness")) {
    const auto& flatness = json.at("flatness");
    slm.flatness.in_nm = flatness.at("unit") == "nm";
    slm.flatness.centre = flatness.at("fit") == "centre";
    slm.flatness.file = flatness.at("file").get<std::string>();
  }
  return slm;
}

Scene settings_of_json(const Json& json, Scene scene, const std::filesystem::path& report) {
  const auto read = [&]<class Spec>(const char* section, Spec& spec) {
    spec = keys_of_json(Spec{}, json.at(section), report, section);
  };
  const double wavelength_m = scene.hologram.wavelength_m;
  read("hologram", scene.hologram);
  scene.hologram.wavelength_m = wavelength_m;
  read("wrp", scene.wrp);
  read("sampling", scene.sampling);
  read("trace", scene.trace);
  read("viewer", scene.viewer);
  read("accuracy", scene.accuracy);
  scene.refine.reset();
  if (json.contains("refine")) read("refine", scene.refine.emplace());
  return scene;
}

}  // namespace raywave
