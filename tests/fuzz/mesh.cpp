// SPDX-License-Identifier: Apache-2.0
// load_mesh as the program calls it. Assimp runs in a reader process under its limits and may crash
// or spin there (Debian's does, on damaged files); the fuzzer sees no coverage of it. The target
// fails on a crash or a hang in this process, or on an invalid mesh. The first byte selects the
// format.
#include <fstream>

#include "tests/fuzz/fuzz.hpp"

using namespace raywave;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  // Assimp goes by the extension, which a file in memory has not.
  constexpr std::array extensions{"ply", "obj", "stl", "gltf", "glb"};
  const auto name =
      std::filesystem::temp_directory_path() /
      ("raywave-fuzz-" + std::to_string(getpid()) + "." + extensions[data[0] % extensions.size()]);
  std::ofstream(name, std::ios::binary) << fuzz::text(data, size).substr(1);
  fuzz::refuses_or_reads([&] { fuzz::require_sound(load_mesh(name, Normals::smooth, "here")); });
  std::filesystem::remove(name);
  return 0;
}
