// SPDX-License-Identifier: Apache-2.0
#include "host/trace/sample_light.hpp"

#include <algorithm>

#include "host/plan/memory.hpp"
#include "host/trace/gather_options.hpp"

namespace raywave {

SampleLight sample_light(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
                         const SampleTable& table, const PartPlane& window) {
  SampleLight result;
  result.parts = table.visibility_parts > 0 ? table.visibility_parts : 8;
  const auto& lattice = table.lattice;
  result.half_m = {lattice.half_width, lattice.half_height};
  result.dots = plan.lattice.step;
  result.dots_from_m = plan.lattice.eye_m.z;
  if (window.pupil) {
    result.pupil = window.pupil;
    result.half_m = window.open_m() / 2.0;
    result.middle_m = ((window.low + window.high) / 2.0 - 0.5) * window.size_m;
  }
  // Of the plane that parts are of; b 0: the hologram
  const Pupil through = window.pupil.value_or(Pupil{0, {0, 0}, 0, 0});
  if (table.count == 0) return result;
  const auto count = static_cast<std::size_t>(table.count),
             each = static_cast<std::size_t>(result.parts) * static_cast<std::size_t>(result.parts);
  std::vector<device::Sample> samples(count);
  table.samples.read(samples);
  for (const auto& s : samples)
    result.at_m.emplace_back(s.x - lattice.centre_x, s.y - lattice.centre_y,
                             s.z - lattice.centre_z);

  cl::Program program(device, "kernels/gather/sample_light.cl",
                      gather_options(device, plan, scene, table, 1, 1));
  auto kernel = program.kernel("light_of_parts");
  const cl::Buffer<float> light(device, std::min(count, most_lit_together) * each,
                                "light of samples by parts of the window");
  const auto reference = plan.slm.illumination.sine_at({0, 0}),
             fall = plan.slm.illumination.curvature_per_m();
  const auto most = plan.hologram.largest_sine;
  result.irradiance.resize(count * each);
  for (std::size_t first = 0; first < count; first += most_lit_together) {
    const auto some = std::min(most_lit_together, count - first);
    kernel.run({some}, group_of_samples(device.info()), scene.lights, table.samples, table.lit,
               table.visibility_masks, static_cast<std::int32_t>(first),
               static_cast<std::int32_t>(some), lattice.centre_x, lattice.centre_y,
               lattice.centre_z, lattice.half_width, lattice.half_height,
               static_cast<float>(through.a), static_cast<float>(through.b_m),
               static_cast<float>(result.middle_m.x), static_cast<float>(result.middle_m.y),
               static_cast<float>(result.half_m.x), static_cast<float>(result.half_m.y),
               lattice.steepest_x, lattice.steepest_y, static_cast<float>(most.x),
               static_cast<float>(most.y), static_cast<float>(reference.x),
               static_cast<float>(reference.y), static_cast<float>(fall.x),
               static_cast<float>(fall.y), light);
    light.read(std::span(result.irradiance).subspan(first * each, some * each));
  }
  return result;
}

}  // namespace raywave
