// SPDX-License-Identifier: Apache-2.0
/// The program raywave_mesh_reader.
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader/serve.hpp"
#include "host/scene/reader_reply.hpp"

int main(int argc, char** argv) {
  raywave::Mesh mesh;
  raywave::serve(
      argc, argv, [&](const auto& arguments) { mesh = raywave::read_mesh(arguments.at(0)); },
      [&](raywave::ReaderPipe& pipe) { send(pipe, mesh); });
}
