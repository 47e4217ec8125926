// SPDX-License-Identifier: Apache-2.0
/// The program raywave_oiio_reader, which raywave_image_reader starts.
#include <vector>

#include "host/scene/reader/picture.hpp"
#include "host/scene/reader/serve.hpp"
#include "host/scene/reader_reply.hpp"

int main(int argc, char** argv) {
  std::vector<raywave::Image> channels;
  raywave::serve(
      argc, argv,
      [&](const auto& arguments) { channels = raywave::read_image(raywave::open_oiio, arguments); },
      [&](raywave::ReaderPipe& pipe) { send(pipe, channels); });
}
