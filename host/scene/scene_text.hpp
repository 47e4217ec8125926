// SPDX-License-Identifier: Apache-2.0
/// The text of a scene file, from wherever it comes.
#pragma once

#include <filesystem>
#include <string>

namespace raywave {

struct SceneText {
  std::string toml;
  std::filesystem::path file;    // its name, for messages
  std::filesystem::path folder;  // of the files that it names
  bool needs_meshes = true;      // false: an object may lack `mesh`; its path is then empty
};

/// throws  InputError when the file cannot be read, or is larger than 1 MiB
SceneText read_scene_text(const std::filesystem::path& file);

}  // namespace raywave
