// SPDX-License-Identifier: Apache-2.0
/// The program raywave_mesh_reader. Arguments: FILE for its mesh; FILE "nodes" for that of a glTF
/// file with the nodes of its triangles; FILE "set" for what stands around the meshes of a glTF
/// file, FILE "motion" for how its nodes move.
#include <string>
#include <utility>
#include <variant>

#include "host/scene/reader/mesh_text.hpp"
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader/serve.hpp"
#include "host/scene/reader_reply.hpp"

namespace {

raywave::Mesh mesh_of(const std::filesystem::path& file, bool wants_nodes) {
  const auto type = raywave::lower(file.extension().string());
  if (type == ".obj") return raywave::read_obj(file);
  if (type == ".ply") return raywave::read_ply(file);
  if (type == ".stl") return raywave::read_stl(file);
  if (type == ".off") return raywave::read_off(file);
  if (auto mesh = raywave::read_gltf_mesh(file, wants_nodes)) return std::move(*mesh);
  return raywave::read_mesh(file);
}

}  // namespace

int main(int argc, char** argv) {
  std::variant<raywave::Mesh, raywave::GltfSet, raywave::GltfMotion> found;
  raywave::serve(
      argc, argv,
      [&](const auto& arguments) {
        const std::string what = arguments.size() > 1 ? arguments[1] : "mesh";
        if (what == "set")
          found = raywave::read_gltf_set(arguments[0]);
        else if (what == "motion")
          found = raywave::read_gltf_motion(arguments[0]);
        else
          found = mesh_of(arguments.at(0), what == "nodes");
      },
      [&](raywave::ReaderPipe& pipe) {
        std::visit([&](const auto& one) { raywave::send(pipe, one); }, found);
      });
}
