// SPDX-License-Identifier: Apache-2.0
/// The picture that a lens would see of the scene, which every hologram of it should approach
/// (kernels/view/lens.cl).
#pragma once

#include <functional>
#include <glm/vec2.hpp>
#include <optional>

#include "host/plan/plan.hpp"
#include "host/scene/image.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave {

/// Fields as in ReconstructSpec, so that both pictures can be compared pixel by pixel.
struct LensSpec {
  double z_m = 0.1;                    // distance of the plane in focus, > 0 on the object's side
  std::optional<glm::dvec2> window_m;  // size of the picture around the axis; empty: the hologram's
  // Centre of the lens, in half holograms: (-1, -1) bottom left to (1, 1) top right
  glm::dvec2 view{0, 0};
  // Size of the lens in holograms; parts beyond the hologram's edge are cut off
  glm::dvec2 aperture{1, 1};
  // Points of the lens from which rays start, per axis, 1 to 4096: points^2 rays per pixel
  int points = 24;
  // Size of a pixel; empty: the hologram's pitch
  std::optional<glm::dvec2> pixel_m{};
  // The rays to a pixel go through places spread over it, not all through its centre: larger pixels
  // then show the mean of what they cover
  bool area = false;
  // The lens is the pupil of an eye behind the hologram: rays to it through that part of the
  // hologram count; empty: that part is the lens
  std::optional<Pupil> pupil{};
  glm::dvec2 pupil_part_m{0, 0};  // > 0: a rectangle of this size around its centre, no disc
};

/// Makes the kernel of lens_picture ready, from source or from a cache. Meanwhile another thread
/// can make the DeviceScene.
void load_lens(const cl::Device& device, const Plan& plan);

/// Radiance in the plane z, averaged over the lens: an ideal rectangular lens in the hologram's
/// plane, incoherent light, no diffraction. Every pixel is the mean over a grid of cell centres on
/// the lens of the Phong radiance where the ray through the pixel's centre first meets the scene, 0
/// where it meets nothing; mirrors and glass are followed to trace.depth. Pixels lie where
/// reconstruct puts them, on the hologram's pitch. A surface sharp in one picture is as sharp as
/// its pixels in the other.
///
/// Where surfaces lie near the hologram or in its plane (is_near_hologram), the lens is open only
/// within reach of each pixel's steepest light, that the SLM can show.
///
/// plan      and `scene` with the same origin; a DeviceScene serves any number of pictures
/// progress  called with 0..1 when given
/// throws    InputError when z, window, view, aperture or points are not possible
/// accuracy  docs/quality.md#what-a-lens-sees; bit-identical for the same device
Image lens_picture(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
                   const LensSpec& what, const std::function<void(double)>& progress = {});

}  // namespace raywave
