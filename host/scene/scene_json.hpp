// SPDX-License-Identifier: Apache-2.0
/// A scene and its SLM as report.json tells them, with all defaults filled in; lengths are in
/// metres.
#pragma once

#include <filesystem>

#include "host/common/json.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

Json json_of(const Scene& scene);
Json json_of(const SlmSpec& slm);
Json json_of(const ViewerSpec& viewer);

/// The SLM that `json_of` told. The flatness picture is not read.
///
/// throws  InputError, starting with the report's name, for what no scene may say;
///         nlohmann::json::exception where something is missing
SlmSpec slm_of_json(const Json& json, const std::filesystem::path& report);

/// The scene with the settings that `json_of` told, those of its SLM, lights, materials and objects
/// aside.
///
/// throws  as slm_of_json
Scene settings_of_json(const Json& json, Scene scene, const std::filesystem::path& report);

}  // namespace raywave
