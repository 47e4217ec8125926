// SPDX-License-Identifier: Apache-2.0
/// A scene as a viewer left it, written down.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/scene/scene.hpp"

namespace raywave {

/// The overrides of load_scenes that make one scene of another with the same lights and objects:
/// settings, lights and the places of objects.
std::vector<std::string> overrides_between(const Scene& from, const Scene& to);

/// Writes a scene file, whole or not at all: a text with overrides in place. Names of files hold
/// from its own folder.
///
/// throws  InputError where the overrides name what the text has not, or nothing can be written
void save_scene(const std::filesystem::path& file, const SceneText& text,
                const std::vector<std::string>& overrides);

}  // namespace raywave
