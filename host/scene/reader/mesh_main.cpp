// SPDX-License-Identifier: Apache-2.0
/// The program raywave_mesh_reader. Arguments: FILE for its mesh; FILE "nodes" for that of a glTF
/// file with the nodes of its triangles; FILE "set" for what stands around the meshes of a glTF
/// file, FILE "motion" for how its nodes move.
#include <string>
#include <variant>

#include "host/scene/reader/readers.hpp"
#include "host/scene/reader/serve.hpp"
#include "host/scene/reader_reply.hpp"

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
          found = raywave::read_mesh(arguments.at(0), what == "nodes");
      },
      [&](raywave::ReaderPipe& pipe) {
        std::visit([&](const auto& one) { raywave::send(pipe, one); }, found);
      });
}
