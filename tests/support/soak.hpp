// SPDX-License-Identifier: Apache-2.0
/// Memory of a program that renders a moving scene for long.
#pragma once

#include <malloc.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "host/render.hpp"

namespace raywave::test {

/// Memory of the program after so many frames.
struct SoakReading {
  int frames = 0;
  double wall_s = 0;
  std::uint64_t resident_bytes = 0;  // by the system
  std::uint64_t heap_bytes = 0;      // allocated and not freed
  std::uint64_t device_bytes = 0;    // in buffers
};

inline SoakReading read_memory(const cl::Device& device, int frames, double wall_s) {
  std::uint64_t pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  const auto heap = mallinfo2();
  return {frames, wall_s, resident * static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE)),
          heap.uordblks + heap.hblkhd, device.allocated_bytes()};
}

/// Frames after which poses and lights of a soak come back. Seeds never do.
inline constexpr int soak_period = 50;

/// Renders a scene whose objects swing and turn, whose directional lights turn about z, and whose
/// seed changes with every frame; reads the memory after so many frames each, in rising order.
inline std::vector<SoakReading> soak(
    const cl::Device& device, const Scene& scene, const std::vector<int>& frames,
    const std::function<void(const SoakReading&)>& report = [](const auto&) {}) {
  RenderOptions options{.keep_field = false};
  Renderer renderer(device, scene, options);
  // No wider than what stays in sight
  const double swing_m = 0.05 * scene.hologram.resolution.x * scene.hologram.pitch_m.x;
  const auto start = std::chrono::steady_clock::now();
  std::vector<SoakReading> readings;
  int done = 0;
  for (const int wanted : frames) {
    for (; done < wanted; ++done) {
      const double turn = 2 * std::numbers::pi * (done % soak_period) / soak_period;
      for (std::size_t i = 0; i < scene.objects.size(); ++i) {
        const auto& object = scene.objects[i];
        const double phase = turn + static_cast<double>(i);
        renderer.set_pose(
            i, object.position_m + swing_m * glm::dvec3(std::cos(phase), std::sin(phase), 0.5),
            object.rotation_deg + glm::dvec3(2 * std::sin(phase), 2 * std::cos(phase), 0));
      }
      for (std::size_t i = 0; i < scene.lights.size(); ++i) {
        auto light = scene.lights[i];
        const auto d = light.direction;
        light.direction = {d.x * std::cos(turn) - d.y * std::sin(turn),
                           d.x * std::sin(turn) + d.y * std::cos(turn), d.z};
        renderer.set_light(i, light);
      }
      renderer.set_seed(static_cast<std::uint32_t>(done));
      renderer.render();
    }
    const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
    readings.push_back(read_memory(device, done, wall.count()));
    report(readings.back());
  }
  return readings;
}

}  // namespace raywave::test
