// SPDX-License-Identifier: Apache-2.0
// load_scenes reads in this process. What follows a zero byte is an override, as --set gives it.
#include "host/scene/scene.hpp"

#include "tests/fuzz/fuzz.hpp"

using namespace raywave;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view all = fuzz::text(data, size), document = all.substr(0, all.find('\0'));
  std::vector<std::string> overrides;
  if (document.size() < all.size()) overrides.emplace_back(all.substr(document.size() + 1));
  const fuzz::File file(document);
  fuzz::refuses_or_reads([&] {
    const Scene scene = load_scenes(file.path(), overrides).at(0);
    fuzz::require(!scene.objects.empty() && !scene.lights.empty() && !scene.materials.empty());
    fuzz::require(scene.hologram.resolution.x >= 1 && scene.hologram.resolution.y >= 1 &&
                  scene.sampling.frames >= 1);
    fuzz::require(scene.hologram.wavelength_m > 0 && scene.hologram.pitch_m.x > 0 &&
                  scene.hologram.pitch_m.y > 0);
    fuzz::require(std::isfinite(scene.sampling.pitch_m) && std::isfinite(scene.wrp.padding));
    for (const Object& o : scene.objects)
      fuzz::require(o.material >= 0 && o.material < static_cast<int>(scene.materials.size()));
  });
  return 0;
}
