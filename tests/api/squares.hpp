// SPDX-License-Identifier: Apache-2.0
/// A square before the shared library, in memory and in files, through its installed headers alone.
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <raywave/raywave.hpp>
#include <string>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"

namespace raywave::test {

inline const std::string scene_text =
    "[hologram]\nresolution = [48, 32]\npitch = \"4 um\"\n[sampling]\npitch = \"20 um\"\n"
    "[[light]]\ndirection = [0, 0, 1]\n"
    "[[object]]\nwidth = \"0.2 mm\"\nposition = [0, 0, \"10 mm\"]\n";
// The square of the file below, corner by corner as readers hand it on
inline const std::vector<Vec3> square{
    {-0.5, -0.5, 0}, {-0.5, 0.5, 0}, {0.5, 0.5, 0}, {0.5, -0.5, 0}};
inline const std::vector<std::array<std::uint32_t, 3>> square_faces{{0, 1, 2}, {0, 2, 3}};

inline Scene square_scene(const std::vector<std::string>& overrides = {}) {
  auto scene = parse_scene(scene_text, ".", overrides);
  scene.set_mesh(0, {square, square_faces});
  return scene;
}

/// The same with its mesh in a file.
class Desk {
public:
  Desk() {
    folder_.write("square.obj",
                  "v -0.5 -0.5 0\nv -0.5 0.5 0\nv 0.5 0.5 0\nv 0.5 -0.5 0\nf 1 2 3\nf 1 3 4\n");
    folder_.write("scene.toml", scene_text + "mesh = \"square.obj\"\n");
  }
  std::string file(const std::string& name) const { return (folder_ / name).string(); }

private:
  Folder folder_;
};

inline std::vector<std::complex<float>> samples_of(const FieldView& field) {
  return {field.values, field.values + field.size()};
}

inline std::vector<std::uint8_t> levels_of(const Hologram& hologram) {
  return {hologram.levels().begin(), hologram.levels().end()};
}

/// The samples of a .npy file: what follows its header.
inline std::vector<std::complex<float>> samples_in(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::vector<char> bytes{std::istreambuf_iterator<char>(in), {}};
  REQUIRE(bytes.size() > 10);
  const auto header =
      10 + static_cast<unsigned char>(bytes[8]) + 256u * static_cast<unsigned char>(bytes[9]);
  std::vector<std::complex<float>> samples((bytes.size() - header) / sizeof(std::complex<float>));
  std::memcpy(samples.data(), bytes.data() + header, samples.size() * sizeof(samples[0]));
  return samples;
}

inline RenderOptions on(const Device& device) {
  RenderOptions options;
  options.on.device = device.index;
  return options;
}

}  // namespace raywave::test
