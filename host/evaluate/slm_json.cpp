// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/slm_json.hpp"

#include <fstream>
#include <nlohmann/json.hpp>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/scene/read_slm.hpp"

namespace raywave {
namespace {

using Json = nlohmann::ordered_json;

Json json_of(glm::dvec2 v) { return Json::array({v.x, v.y}); }

glm::dvec2 pair_of(const Json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>()};
}

}  // namespace

Json json_of(const SlmSpec& slm) {
  Json json{{"encoding", name_of(slm.encoding)},
            {"clip", slm.clip},
            {"band", json_of(slm.band)},
            {"bits", slm.bits},
            {"levels", slm.levels},
            {"levels_per_turn", slm.levels_per_turn},
            {"invert", slm.invert},
            {"offset_turns", slm.offset_turns},
            {"carrier", json_of(slm.carrier)},
            {"shift_m", json_of(slm.shift_m)},
            {"shift_distance_m", slm.shift_distance_m},
            {"lut", slm.lut},
            {"zernike", Json::array()},
            {"flip", std::string(slm.flip_x ? "x" : "") + (slm.flip_y ? "y" : "")},
            {"rotate_deg", slm.rotate_deg}};
  if (slm.lens_m) json["lens_m"] = *slm.lens_m;
  if (const auto& light = slm.illumination; !light.is_plane()) {
    json["illumination"] = {{"sine", json_of(light.sine)}};
    if (light.focus_m) json["illumination"]["focus_m"] = *light.focus_m;
  }
  if (slm.stop)
    json["stop"] = {{"size", json_of(slm.stop->size)}, {"centre", json_of(slm.stop->centre)}};
  for (const auto& term : slm.zernike) json["zernike"].push_back({term.noll, term.turns});
  if (!slm.flatness.picture.pixels.empty())
    json["flatness"] = {{"file", std::filesystem::absolute(slm.flatness.file).string()},
                        {"unit", slm.flatness.in_nm ? "nm" : "levels"},
                        {"fit", slm.flatness.centre ? "centre" : "exact"}};
  return json;
}

Json scene_of_report(const Json& report, const std::filesystem::path& name,
                     const std::filesystem::path& file) {
  if (!report.contains("colour")) return report.at("scene");
  std::string names;
  for (const auto& laser : report.at("colour").at("lasers")) {
    if (laser.contains("files")) {  // of an animation
      const std::string number = "%05d", pattern = laser.at("files").get<std::string>(),
                        name_here = file.filename().string();
      const auto at = pattern.find(number);
      if (at != std::string::npos && name_here.starts_with(pattern.substr(0, at)) &&
          name_here.ends_with(pattern.substr(at + number.size())))
        return laser.at("report").at("scene");
      names += (names.empty() ? "" : ", ") + one_line(pattern);
      continue;
    }
    auto files = laser.at("pictures").get<std::vector<std::string>>();
    for (const auto* kept : {"field", "refined"})
      if (laser.contains(kept)) files.push_back(laser.at(kept));
    for (const auto& one : files) {
      if (file.filename() == one) return laser.at("report").at("scene");
      names += (names.empty() ? "" : ", ") + one_line(one);
    }
  }
  throw InputError(one_line(name.string()) +
                   ": is of three lasers; give the file of one: " + names);
}

SlmSpec slm_of_report(const std::filesystem::path& report, const std::filesystem::path& file) {
  const auto name = one_line(report.string());
  std::ifstream in(report);
  if (!in)
    throw InputError(name + ": not found; it tells how the SLM shows phases (or give --slm)");
  SlmSpec slm;
  try {
    const auto scene = scene_of_report(Json::parse(in), report, file);
    if (!scene.contains("slm")) {
      slm.encoding = Encoding::phase;
      return slm;
    }
    const auto& json = scene.at("slm");
    const auto encoding = json.at("encoding").get<std::string>();
    try {
      slm.encoding = encoding_of(encoding);
    } catch (const InputError& error) {
      throw InputError(name + ": slm: encoding must be " + error.what() + ", got " +
                       in_quotes(encoding));
    }
    slm.clip = json.at("clip");
    slm.band = pair_of(json.at("band"));
    slm.bits = json.value("bits", 8);  // reports of earlier versions have none
    slm.levels = json.at("levels");
    slm.levels_per_turn = json.at("levels_per_turn");
    slm.invert = json.at("invert");
    slm.offset_turns = json.at("offset_turns");
    slm.carrier = pair_of(json.at("carrier"));
    slm.shift_m = pair_of(json.at("shift_m"));
    slm.shift_distance_m = json.at("shift_distance_m");
    if (json.contains("lens_m")) slm.lens_m = json.at("lens_m").get<double>();
    if (json.contains("illumination")) {
      const auto& light = json.at("illumination");
      slm.illumination.sine = pair_of(light.at("sine"));
      if (light.contains("focus_m")) slm.illumination.focus_m = light.at("focus_m").get<double>();
    }
    slm.lut = json.at("lut").get<std::vector<double>>();
    for (const auto& term : json.at("zernike"))
      slm.zernike.push_back({term.at(0).get<int>(), term.at(1).get<double>()});
    const auto flip = json.at("flip").get<std::string>();
    slm.flip_x = flip.find('x') != std::string::npos;
    slm.flip_y = flip.find('y') != std::string::npos;
    slm.rotate_deg = json.at("rotate_deg");
    if (json.contains("stop"))
      slm.stop = {pair_of(json.at("stop").at("size")), pair_of(json.at("stop").at("centre"))};
    if (json.contains("flatness")) {
      const auto& flatness = json.at("flatness");
      slm.flatness.in_nm = flatness.at("unit") == "nm";
      slm.flatness.centre = flatness.at("fit") == "centre";
      slm.flatness.file = flatness.at("file").get<std::string>();
    }
    const bool bits_fit = slm.bits == 8 || slm.bits == 10;
    const int most = bits_fit ? grey_levels_of(slm) : 0;
    const bool lut_fits = slm.lut.empty() || slm.lut.size() == static_cast<std::size_t>(most);
    if (!bits_fit || slm.levels < 2 || slm.levels > most || slm.levels_per_turn < 2 ||
        slm.levels_per_turn > 4 * most || !lut_fits || slm.rotate_deg % 90 != 0)
      throw InputError(name + ": its SLM is damaged (or give --slm)");
  } catch (const nlohmann::json::exception& error) {
    throw InputError(name + ": not a report of raywave: " + json_reason(error));
  }
  if (!slm.flatness.file.empty()) {
    slm.flatness.where = name + ": flatness";
    load_flatness(slm.flatness);
  }
  return slm;
}

}  // namespace raywave
