// SPDX-License-Identifier: Apache-2.0
// Replies of reader processes, as this process checks them: by the first byte modulo 4 a mesh with
// its materials, the channels of a picture, cameras and lights, or nodes and how they move; the
// other bytes are the reply.
// Targets mesh and texture start the readers themselves.
#include <fcntl.h>

#include "host/scene/gltf_motion.hpp"
#include "host/scene/mesh_materials.hpp"
#include "host/scene/reader_reply.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace raywave;

namespace {

/// A mesh that deforms, at the pose of two nodes that stay.
void deform(const Mesh& raw) {
  GltfMoves moves;
  moves.nodes.resize(2);
  moves.nodes[1].number = 1;
  const auto [mesh, deforming] = finish_deforming(raw);
  const auto shape = deformed_at(deforming, moves, 0);
  fuzz::require(mesh.normals.size() == mesh.positions.size() &&
                mesh.uvs.size() == mesh.positions.size() &&
                shape.positions.size() == mesh.positions.size() &&
                shape.normals.size() == mesh.positions.size());
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) fuzz::require(t[i] < mesh.positions.size());
}

}  // namespace

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const fuzz::File sent(fuzz::text(data, size).substr(1));
  const int descriptor = open(sent.path().c_str(), O_RDONLY | O_CLOEXEC);
  fuzz::require(descriptor >= 0);
  ReaderPipe pipe(descriptor);
  try {
    if (data[0] % 4 == 0) {
      const Mesh raw = receive_mesh(pipe);
      if (!raw.deforming.empty()) deform(raw);
      const Mesh mesh = finish_mesh(raw, data[0] % 8 == 0 ? Normals::file : Normals::smooth);
      fuzz::require_sound(mesh);
      for (const auto& from : mesh.materials) {
        const auto material = phong_of(from, {}, true, 1, "here");
        for (int c = 0; c < 3; ++c)
          fuzz::require(material.diffuse[c] >= 0 && material.specular[c] >= 0);
        fuzz::require(!description_of(from, material, {}, 0).empty());
      }
    } else if (data[0] % 4 == 1) {
      for (const Image& image : receive_channels(pipe))
        fuzz::require(image.width >= 1 && image.height >= 1 &&
                      image.pixels.size() == std::size_t{1} * image.width * image.height);
    } else if (data[0] % 4 == 3) {
      const auto motion = receive_gltf_motion(pipe);
      for (const auto& animation : motion.animations) {
        for (const auto& wearer : motion.wearers)
          fuzz::require(weights_at(animation.channels, wearer.node, wearer.weights, 0.5).size() ==
                        wearer.weights.size());
        for (const double time_s : {0.0, 0.5, 1e9})
          fuzz::require(poses_at(motion.nodes, animation.channels, time_s).size() ==
                        motion.nodes.size());
      }
    } else {
      const auto set = receive_gltf_set(pipe);
      for (const auto& light : set.lights) fuzz::require(light.intensity >= 0);
    }
  } catch (const std::runtime_error&) {
    // refused
  }
  close(descriptor);
  return 0;
}
