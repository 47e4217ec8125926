// SPDX-License-Identifier: Apache-2.0
/// A scene file with every kind of key, and what is said of it where one is wrong.
#pragma once

#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"
#include "tests/support/scenes.hpp"

namespace raywave::test {

// The test cases rely on line numbers: line 1 is [hologram].
inline const std::string kScene = R"([hologram]
resolution = [1280, 720]
pitch = ["8 um", 4e-6]
wavelength = "532 nm"
[wrp]
grid = [3, 2]
distance = "95 mm"
padding = 1.5
[sampling]
mode = "fan"
pitch = "0.05 mm"
seed = 4294967295
frames = 4
[trace]
depth = 3
shadows = true
[[light]]
type = "directional"
direction = [0.5, -0.6, 0.62]
intensity = 2
[[light]]
type = "point"
position = ["1 cm", 0.02, "30mm"]
[[light]]
type = "ambient"
[materials.china]
ambient = 0.08
diffuse = [0.7, 0.6, 0.5]
specular = 0.6
shininess = 30
texture = "checker.png"
reflectivity = 0.25
transparency = 0.75
ior = 1.33
[materials.gold]
[[object]]
mesh = "teapot.ply"
width = "12.5 mm"
position = ["1 mm", "-2 mm", "100 mm"]
rotation = [10, 30, -20.5]
material = "china"
normals = "smooth"
[[object]]
mesh = "teapot.ply"
)";

struct Workshop {
  Folder folder;
  Workshop() {
    folder.write("teapot.ply", "");
    folder.write("checker.png", "");
  }
  Scene load(const std::string& text, const std::vector<std::string>& overrides = {}) const {
    return load_scene(folder.write("scene.toml", text), overrides);
  }
  /// The message of the InputError, without the folder's name.
  std::string refusal(const std::string& text,
                      const std::vector<std::string>& overrides = {}) const {
    std::string message = input_error_of([&] { load(text, overrides); });
    for (const std::string prefix = (folder / "").string();
         message.find(prefix) != std::string::npos;)
      message.erase(message.find(prefix), prefix.size());
    return message;
  }
};

}  // namespace raywave::test
