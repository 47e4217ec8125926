// SPDX-License-Identifier: Apache-2.0
// Replies of reader processes, as this process checks them: a mesh (first byte even) or a picture
// (odd); the other bytes are the reply. Targets mesh and texture start the readers themselves.
#include <fcntl.h>

#include "host/scene/reader_reply.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace raywave;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const fuzz::File sent(fuzz::text(data, size).substr(1));
  const int descriptor = open(sent.path().c_str(), O_RDONLY | O_CLOEXEC);
  fuzz::require(descriptor >= 0);
  ReaderPipe pipe(descriptor);
  try {
    if (data[0] % 2 == 0) {
      const Mesh mesh =
          finish_mesh(receive_mesh(pipe), data[0] % 4 == 0 ? Normals::file : Normals::smooth);
      fuzz::require_sound(mesh);
    } else {
      const Image image = receive_image(pipe);
      fuzz::require(image.width >= 1 && image.height >= 1 &&
                    image.pixels.size() == std::size_t{1} * image.width * image.height);
    }
  } catch (const std::runtime_error&) {
    // refused
  }
  close(descriptor);
  return 0;
}
