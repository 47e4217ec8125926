// SPDX-License-Identifier: Apache-2.0
#include "host/samples.hpp"

#include <algorithm>
#include <cstdint>
#include <vector>

#include "host/error.hpp"

namespace raywave {

SampleTable::SampleTable(const cl::Device& device, const Plan& plan, const DeviceScene& scene) {
  const auto& wanted = plan.lattice;
  const glm::dvec3 centre = -plan.origin_m;
  lattice.first_x = wanted.first.x;
  lattice.first_y = wanted.first.y;
  lattice.nx = wanted.size.x;
  lattice.ny = wanted.size.y;
  lattice.step = static_cast<float>(wanted.step);
  lattice.centre_x = static_cast<float>(centre.x);
  lattice.centre_y = static_cast<float>(centre.y);
  lattice.centre_z = static_cast<float>(centre.z);
  lattice.near_z = static_cast<float>(plan.near_m - plan.origin_m.z) - 0.01f * scene.diameter_m;
  lattice.full_z = static_cast<float>(wanted.full_z_m);
  lattice.layer_gap = static_cast<float>(1e-3 * wanted.step * wanted.full_z_m);
  lattice.bias = scene.bias_m;
  lattice.reach = static_cast<float>(plan.far_m * 2);
  lattice.half_width = static_cast<float>(plan.size.x * plan.pitch_m.x / 2 * std::max(1.0, plan.fan));
  lattice.half_height = static_cast<float>(plan.size.y * plan.pitch_m.y / 2 * std::max(1.0, plan.fan));

  const cl::Program program(device, "samples.cl", cl::with(scene.options, {{"RAYWAVE_ANTIALIAS", plan.antialias ? "1" : "0"}}));
  const int lanes = lanes_for(device.info());
  const cl::Range packets{static_cast<std::size_t>((lattice.nx + lanes - 1) / lanes), static_cast<std::size_t>(lattice.ny)};
  const cl::Range local = lanes == 1 ? cl::Range{8, 8} : cl::Range{1, 1};

  const auto cells = static_cast<std::size_t>(lattice.nx) * static_cast<std::size_t>(lattice.ny);
  first_of_cell = {device, cells + 1, "sample lattice"};
  program.kernel("count_layers").run(packets, local, scene.nodes, scene.triangles, scene.shading, lattice, first_of_cell);
  std::int64_t total = 0;
  first_of_cell.on_host([&](std::span<std::int32_t> counts) {
    for (std::size_t i = 0; i <= cells; ++i) {
      const std::int64_t layers = i < cells ? counts[i] : 0;
      counts[i] = static_cast<std::int32_t>(std::min<std::int64_t>(total, INT32_MAX));
      total += layers;
    }
  });
  if (total > (1 << 28))
    throw InputError("sampling.pitch: " + std::to_string(total) + " surface samples, at most 268435456 are allowed; give a larger pitch");
  count = static_cast<int>(total);

  const auto words = scene.light_words();
  samples = {device, static_cast<std::size_t>(std::max(count, 1)), "samples"};
  lit = {device, static_cast<std::size_t>(std::max(count, 1)) * words, "lights on samples"};
  if (count == 0) return;
  samples.fill_zero();  // should the second pass find fewer layers than the first, what is missing shines with nothing
  program.kernel("write_samples")
      .run(packets, local, scene.nodes, scene.triangles, scene.shading, scene.materials, scene.lights, scene.texels, scene.ambient_light,
           lattice, first_of_cell, samples, lit);
  const float slack = scene.bias_m / 4;
  const cl::Range group{lanes == 1 ? std::size_t{64} : std::size_t{1}};
  program.kernel("find_hidden").run({static_cast<std::size_t>(count)}, group, scene.nodes, scene.triangles, lattice, slack, count, samples);
  samples.on_host(
      [&](std::span<device::Sample> all) {
        hidden = static_cast<int>(std::count_if(all.begin(), all.end(), [](const auto& s) { return s.hidden != 0; }));
      },
      CL_MAP_READ);
}

}  // namespace raywave
