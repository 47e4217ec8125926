// SPDX-License-Identifier: Apache-2.0
// Renders the first object of a scene as it turns, into pose_00.pgm, pose_01.pgm ...
//
// usage: turntable SCENE [POSES]
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <raywave/raywave.hpp>

int main(int argc, char** argv) try {
  const auto scene = raywave::load_scene(argc > 1 ? argv[1] : "scene.toml");
  const int poses = argc > 2 ? std::atoi(argv[2]) : 12;
  raywave::Renderer renderer(scene);
  for (int pose = 0; pose < poses; ++pose) {
    renderer.set_pose(0, scene.position_m(0), {0, 360.0 * pose / poses, 0});
    const auto hologram = renderer.render();

    char name[32];
    std::snprintf(name, sizeof name, "pose_%02d.pgm", pose);
    std::FILE* file = std::fopen(name, "wb");
    if (!file) return std::perror(name), 1;
    std::fprintf(file, "P5 %d %d 255\n", hologram.nx(), hologram.ny());
    const auto picture = hologram.for_slm();
    std::fwrite(picture.values.data(), 1, picture.values.size(), file);
    std::fclose(file);
    std::printf("%s\n", name);
  }
} catch (const std::exception& error) {  // InputError, DeviceError: one line for the user
  std::fprintf(stderr, "turntable: %s\n", error.what());
  return 1;
}
