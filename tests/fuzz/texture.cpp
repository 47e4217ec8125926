// SPDX-License-Identifier: Apache-2.0
// load_texture as the program calls it. libpng and OpenImageIO run in a reader process under its
// limits; the fuzzer sees no coverage of them. The target fails on a crash or a hang in this
// process, or on an invalid picture. The first bytes tell the format, whatever the extension.
#include "host/scene/image.hpp"
#include "tests/fuzz/fuzz.hpp"

using namespace raywave;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::File file(fuzz::text(data, size));
  fuzz::refuses_or_reads([&] {
    const Image image = load_texture(file.path(), 1, "here");
    fuzz::require(image.width >= 1 && image.height >= 1 &&
                  image.pixels.size() == std::size_t{1} * image.width * image.height);
    for (const float v : image.pixels) fuzz::require(std::isfinite(v));
  });
  return 0;
}
