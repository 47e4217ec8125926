// SPDX-License-Identifier: Apache-2.0
/// Light that the surface samples send through each part of the hologram's window, whatever their
/// phases (kernels/gather/sample_light.cl).
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "host/trace/samples.hpp"

namespace raywave {

struct SampleLight {
  int parts = 1;                // of the window, per axis
  glm::dvec2 half_m{1, 1};      // half sides of the window, which is centred on the hologram
  double dots = 0;              // distance of the samples over their distance from the hologram
  std::vector<glm::vec3> at_m;  // places, from the hologram's centre
  // Irradiance at the hologram, in the unit of the field's squares on the device: parts x parts
  // numbers of each sample, row by row from the bottom left
  std::vector<float> irradiance;
};

/// Samples in mirrors and behind glass shine from their virtual points.
SampleLight sample_light(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
                         const SampleTable& table);

}  // namespace raywave
