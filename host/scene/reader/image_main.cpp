// SPDX-License-Identifier: Apache-2.0
/// The program raywave_image_reader. It reads PNGs, and becomes raywave_oiio_reader, which takes
/// long to load, for all other pictures.
#include <unistd.h>

#include <filesystem>
#include <vector>

#include "host/scene/reader/picture.hpp"
#include "host/scene/reader/serve.hpp"
#include "host/scene/reader_reply.hpp"

int main(int argc, char** argv) {
  constexpr int file = 4, not_started = 127;
  if (argc > file && !raywave::is_png(argv[file])) {
    const auto program = std::filesystem::path(argv[0]).parent_path() / "raywave_oiio_reader";
    execv(program.c_str(), argv);
    _exit(not_started);
  }
  std::vector<raywave::Image> channels;
  raywave::serve(
      argc, argv,
      [&](const auto& arguments) { channels = raywave::read_image(raywave::open_png, arguments); },
      [&](raywave::ReaderPipe& pipe) { send(pipe, channels); });
}
