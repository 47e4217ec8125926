// SPDX-License-Identifier: Apache-2.0
#include "host/planning/memory.hpp"

#include <algorithm>

#include "host/gatherer.hpp"

namespace raywave {

int frames_together(const Scene& scene, const Plan& plan, std::uint64_t largest_buffer_bytes) {
  if (!plan.aimed || plan.bounces > 0) return 1;
  const double plane = 8.0 * static_cast<double>(plan.gathered_pixels()), half_a_gigabyte = 512.0 * 1024 * 1024;
  const double fitting =
      std::min(half_a_gigabyte / (plane * static_cast<double>(plan.wrps.size())), static_cast<double>(largest_buffer_bytes) / plane);
  return static_cast<int>(std::clamp(fitting, 1.0, static_cast<double>(std::min(scene.sampling.frames, Gatherer::most_frames))));
}

std::vector<cl::MemoryNeed> memory_needs(const Scene& scene, const World& world, const Plan& plan, Method method,
                                         std::uint64_t largest_buffer_bytes) {
  const int together = frames_together(scene, plan, largest_buffer_bytes);
  const std::string planes = "a smaller hologram.resolution or wrp.padding needs less", mesh = "fewer triangles need less";
  const auto size = [](auto n) { return static_cast<std::uint64_t>(n); };
  const auto pixels = size(plan.size.x) * size(plan.size.y), padded = size(plan.padded.x) * size(plan.padded.y);
  std::vector<cl::MemoryNeed> needs;
  if (method == Method::wrp) needs = {{"padded plane", 8 * padded, planes}, {"sum of spectra", 8 * padded, planes}};
  for (std::size_t i = 0; i < (together > 1 ? plan.wrps.size() : 1); ++i)
    needs.push_back({"fields of a WRP", 8 * size(together) * size(plan.gathered_pixels()), planes});
  if (std::any_of(plan.slabs.begin(), plan.slabs.end(), [](const Slab& slab) { return slab.refines(); }))
    needs.push_back({"field of a WRP", 8 * pixels, planes});
  needs.push_back({"field at the hologram", 8 * pixels, planes});
  needs.push_back({"hologram levels", pixels, planes});
  if (plan.aimed || scene.sampling.source == FanSource::surface)
    needs.push_back(
        {"sample lattice", 4 * (size(plan.lattice.size.x) * size(plan.lattice.size.y) + 1), "a larger sampling.pitch needs less"});
  needs.push_back({"triangles", sizeof(device::Triangle) * world.triangles.size(), mesh});
  needs.push_back({"vertices", 8 * sizeof(float) * world.positions.size(), mesh});
  return needs;
}

}  // namespace raywave
