// SPDX-License-Identifier: Apache-2.0
// load_mesh as the program calls it, Assimp in a child under its limits: Assimp may crash or spin
// there (on damaged files Debian's does), and the fuzzer sees no coverage of it. What it looks for
// is a way out: a crash or a hang here, or a mesh that is none. The first byte chooses the format.
#include <array>
#include <fstream>

#include "tests/fuzz/fuzz.hpp"

using namespace raywave;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  // Assimp goes by the extension, which a file in memory has not.
  constexpr std::array extensions{"ply", "obj", "stl", "gltf"};
  const auto name =
      std::filesystem::temp_directory_path() /
      ("raywave-fuzz-" + std::to_string(getpid()) + "." + extensions[data[0] % extensions.size()]);
  std::ofstream(name, std::ios::binary) << fuzz::text(data, size).substr(1);
  fuzz::refuses_or_reads([&] { fuzz::require_sound(load_mesh(name, Normals::smooth, "here")); });
  std::filesystem::remove(name);
  return 0;
}
