// SPDX-License-Identifier: Apache-2.0
/// Fields on the WRPs by backward ray tracing on the device (kernels/trace.cl).
#pragma once

#include <cstdint>

#include "cl/program.hpp"
#include "host/bvh.hpp"
#include "host/mesh.hpp"
#include "host/plan.hpp"
#include "host/scene.hpp"
#include "host/shared_types.hpp"

namespace raywave {

/// The scene as the kernels see it: tree, triangles, materials for the hologram's wavelength, lights and textures in device memory, in the
/// scene frame (world minus Plan::origin_m, subtracted in double).
struct DeviceScene {
  DeviceScene(const cl::Device& device, const Scene& scene, const World& world, glm::dvec3 origin_m);

  cl::Buffer<device::BvhNode> nodes;
  cl::Buffer<device::Triangle> triangles;
  cl::Buffer<device::TriangleShading> shading;
  cl::Buffer<device::Material> materials;
  cl::Buffer<device::Light> lights;
  cl::Buffer<float> texels;
  float ambient_light = 1;  // sum of the ambient lights; 1 when there is none, so that a material's ambient part counts as given
  float diameter_m = 0;     // of the scene's bounding box
  cl::Options options;      // leave out of the kernels what this scene does not use
  double tree_seconds = 0;
};

class Tracer {
public:
  Tracer(const cl::Device& device, const Scene& scene, const World& world, const Plan& plan);

  /// Fills `field` (ny x nx) with the field of one WRP.
  ///
  /// seed      of the random phases; equal for all WRPs of a frame
  /// accuracy  docs/accuracy.md, "Tracing"
  void trace(const Wrp& wrp, std::uint32_t seed, cl::ComplexBuffer& field);

  double tree_seconds() const { return scene_.tree_seconds; }

private:
  cl::Device device_;
  Plan plan_;
  double sampling_pitch_m_;
  DeviceScene scene_;
  int lanes_;
  cl::Program program_;
  cl::Kernel trace_fan_;
};

/// Pixels that one work-item handles side by side: the SIMD width on CPUs, one on GPUs.
int lanes_for(const cl::DeviceInfo& device);

}  // namespace raywave
