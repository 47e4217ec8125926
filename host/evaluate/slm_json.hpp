// SPDX-License-Identifier: Apache-2.0
/// The SLM in report.json: what the pictures beside it were made for.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "host/scene/scene_json.hpp"

namespace raywave {

/// The SLM of a report.
///
/// file    a picture or field beside a report of several lasers, which tells the laser
/// throws  InputError when the report is missing or damaged, or the flatness picture is gone
SlmSpec slm_of_report(const std::filesystem::path& report, const std::filesystem::path& file = {});

/// "scene" of a report; of several lasers, that of the one whose picture or field the file is.
///
/// throws  InputError when it is none's; nlohmann::json::exception when the report is damaged
nlohmann::ordered_json scene_of_report(const nlohmann::ordered_json& report,
                                       const std::filesystem::path& name,
                                       const std::filesystem::path& file);

}  // namespace raywave
