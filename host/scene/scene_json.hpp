// SPDX-License-Identifier: Apache-2.0
/// A scene and its SLM as report.json tells them, with all defaults filled in; lengths are in
/// metres.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

#include "host/scene/scene.hpp"

namespace raywave {

nlohmann::ordered_json json_of(const Scene& scene);
nlohmann::ordered_json json_of(const SlmSpec& slm);

/// The SLM that `json_of` told. The flatness picture is not read.
///
/// throws  InputError, starting with the report's name, for what no scene may say;
///         nlohmann::json::exception where something is missing
SlmSpec slm_of_json(const nlohmann::ordered_json& json, const std::filesystem::path& report);

/// The scene with the settings that `json_of` told, those of its SLM, lights, materials and objects
/// aside.
///
/// throws  as slm_of_json
Scene settings_of_json(const nlohmann::ordered_json& json, Scene scene,
                       const std::filesystem::path& report);

}  // namespace raywave
