// SPDX-License-Identifier: Apache-2.0
/// What the fuzz targets share. Each defines LLVMFuzzerTestOneInput and lets a reader's InputError
/// pass: that is how readers refuse.
#pragma once

#include <sys/mman.h>
#include <unistd.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <glm/geometric.hpp>
#include <stdexcept>
#include <string>
#include <string_view>

#include "host/common/error.hpp"
#include "host/scene/mesh.hpp"

namespace raywave::fuzz {

inline void require(bool claim) {
  if (!claim) std::abort();
}

/// These bytes as a file that lives in memory.
class File {
public:
  explicit File(std::string_view bytes) : descriptor_(memfd_create("fuzz", MFD_CLOEXEC)) {
    require(descriptor_ >= 0);
    while (!bytes.empty()) {
      const ssize_t done = write(descriptor_, bytes.data(), bytes.size());
      require(done > 0);
      bytes.remove_prefix(static_cast<std::size_t>(done));
    }
  }
  ~File() { close(descriptor_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  /// Of any process: readers open it, too.
  std::filesystem::path path() const {
    return "/proc/" + std::to_string(getpid()) + "/fd/" + std::to_string(descriptor_);
  }

private:
  int descriptor_;
};

/// Calls `read`; an InputError must be one line.
template <class Read>
void refuses_or_reads(Read read) {
  try {
    read();
  } catch (const InputError& error) {
    const std::string_view message(error.what());
    require(!message.empty() && message.find('\n') == std::string_view::npos);
  }
}

/// Indices of vertices that are there, finite positions, unit normals.
inline void require_sound(const Mesh& mesh) {
  const std::size_t count = mesh.positions.size();
  require(mesh.normals.size() == count && mesh.uvs.size() == count);
  for (const glm::uvec3& t : mesh.triangles) require(t.x < count && t.y < count && t.z < count);
  for (const glm::dvec3& p : mesh.positions)
    require(std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z));
  for (const glm::dvec3& n : mesh.normals) require(std::abs(glm::length(n) - 1) < 1e-6);
  require(mesh.colours.empty() || mesh.colours.size() == count);
  require(mesh.triangle_material.empty() || mesh.triangle_material.size() == mesh.triangles.size());
  for (const auto m : mesh.triangle_material)
    require(m >= -1 && m < static_cast<std::int64_t>(mesh.materials.size()));
  for (const auto& material : mesh.materials) {
    const auto& look = material.look;
    for (const auto* map : {&look.base_map, &look.metallic_map, &look.emission_map,
                            &look.normal_map, &look.alpha_map})
      require(map->picture < static_cast<std::int64_t>(mesh.pictures.size()));
  }
}

#ifdef RAYWAVE_READERS
inline const bool readers_known = setenv("RAYWAVE_READER_DIR", RAYWAVE_READERS, 0) == 0;
#endif

inline std::string_view text(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

}  // namespace raywave::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);
