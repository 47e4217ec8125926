// SPDX-License-Identifier: Apache-2.0
/// The program raywave_mesh_reader. Arguments: FILE for its mesh, FILE "set" for what stands around
/// the meshes of a glTF file.
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader/serve.hpp"
#include "host/scene/reader_reply.hpp"

int main(int argc, char** argv) {
  raywave::Mesh mesh;
  raywave::GltfSet set;
  bool is_set = false;
  raywave::serve(
      argc, argv,
      [&](const auto& arguments) {
        is_set = arguments.size() > 1 && arguments[1] == "set";
        if (is_set)
          set = raywave::read_gltf_set(arguments[0]);
        else
          mesh = raywave::read_mesh(arguments.at(0));
      },
      [&](raywave::ReaderPipe& pipe) {
        if (is_set)
          send(pipe, set);
        else
          send(pipe, mesh);
      });
}
