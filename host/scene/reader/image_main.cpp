// SPDX-License-Identifier: Apache-2.0
/// The program raywave_image_reader.
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader/serve.hpp"
#include "host/scene/reader_reply.hpp"

int main(int argc, char** argv) {
  raywave::Image image;
  raywave::serve(
      argc, argv, [&](const auto& arguments) { image = raywave::read_image(arguments); },
      [&](raywave::ReaderPipe& pipe) { send(pipe, image); });
}
