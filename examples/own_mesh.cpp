// SPDX-License-Identifier: Apache-2.0
// Renders a mesh that no file holds, a rippled sheet, and looks at what the hologram shows of it.
//
// usage: own_mesh
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <raywave/raywave.hpp>
#include <vector>

int main() try {
  auto scene = raywave::parse_scene(R"(
    [hologram]
    resolution = [256, 192]
    pitch      = "8 um"
    [sampling]
    pitch      = "60 um"
    [[light]]
    direction  = [0.3, -0.4, 0.9]
    [[object]]                       # without `mesh`: it comes from memory
    width      = "3 mm"
    position   = ["0 mm", "0 mm", "100 mm"]
  )");

  constexpr std::uint32_t side = 41;
  std::vector<raywave::Vec3> vertices;
  std::vector<std::array<std::uint32_t, 3>> faces;
  for (std::uint32_t j = 0; j < side; ++j)
    for (std::uint32_t i = 0; i < side; ++i)
      vertices.push_back({0.1 * i, 0.1 * j, 0.2 * std::sin(0.5 * i) * std::cos(0.4 * j)});
  for (std::uint32_t j = 0; j + 1 < side; ++j) {
    for (std::uint32_t i = 0; i + 1 < side; ++i) {
      const std::uint32_t corner = j * side + i;  // seen from the hologram, counter-clockwise
      faces.push_back({corner, corner + side, corner + 1});
      faces.push_back({corner + 1, corner + side, corner + side + 1});
    }
  }
  scene.set_mesh(0, {vertices, faces});

  const auto hologram = raywave::render(scene);
  raywave::ViewOptions at_the_sheet;
  at_the_sheet.z_m = 0.1;
  const auto seen = raywave::reconstruct(hologram.field(), hologram.pixels(), at_the_sheet);
  const auto lens = raywave::lens(scene, at_the_sheet, 4);
  const auto alike = raywave::compare(lens, seen, {.blur_px = 8});
  std::printf("%d x %d levels; the picture at 100 mm is within %.1f dB of what a lens sees\n",
              hologram.nx(), hologram.ny(), alike.psnr_db);
} catch (const std::exception& error) {
  std::fprintf(stderr, "own_mesh: %s\n", error.what());
  return 1;
}
