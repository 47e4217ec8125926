// SPDX-License-Identifier: Apache-2.0
/// Light that the surface samples send through each part of the hologram's window, whatever their
/// phases (kernels/gather/sample_light.cl).
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <vector>

#include "host/plan/key_places.hpp"
#include "host/trace/samples.hpp"

namespace raywave {

struct SampleLight {
  int parts = 1;                // of the window, per axis
  glm::dvec2 half_m{1, 1};      // half sides of the window, which is centred on the hologram
  double dots = 0;              // distance of the samples over their distance from dots_from_m
  double dots_from_m = 0;       // z of the lattice's eye
  std::vector<glm::vec3> at_m;  // places, from the hologram's centre
  // Irradiance at the hologram, in the unit of the field's squares on the device: parts x parts
  // numbers of each sample, row by row from the bottom left
  std::vector<float> irradiance;
  // The window is one in the plane of this pupil, around middle_m, and the irradiance is of the
  // light that goes there
  std::optional<Pupil> pupil{};
  glm::dvec2 middle_m{0, 0};
};

/// Samples in mirrors and behind glass shine from their virtual points.
///
/// window  whose parts the light is told for: that of masks, or behind an eyepiece of the pupil's
///         plane, part_plane
SampleLight sample_light(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
                         const SampleTable& table, const PartPlane& window = {});

}  // namespace raywave
