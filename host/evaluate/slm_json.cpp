// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/slm_json.hpp"

#include <fstream>
#include <nlohmann/json.hpp>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/scene/read_slm.hpp"

namespace raywave {

using Json = nlohmann::ordered_json;

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
                   ": is of several lasers; give the file of one: " + names);
}

SlmSpec slm_of_report(const std::filesystem::path& report, const std::filesystem::path& file) {
  const auto name = one_line(report.string());
  std::ifstream in(report);
  if (!in)
    throw InputError(name + ": not found; it tells how the SLM shows phases (or give --slm)");
  SlmSpec slm;
  try {
    const auto scene = scene_of_report(Json::parse(in), report, file);
    slm = slm_of_json(scene.at("slm"), report);
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
