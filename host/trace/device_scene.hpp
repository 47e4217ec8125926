// SPDX-License-Identifier: Apache-2.0
/// The scene in device memory.
#pragma once

#include <utility>
#include <vector>

#include "cl/program.hpp"
#include "host/geometry/shared_types.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/trace/instances.hpp"

namespace raywave {

/// Which lights, highlights, textures, shadows and bounces kernels are built with: what some object
/// of the scene has, nothing else.
cl::Options kernel_options(const Plan& plan);

/// The scene as the kernels see it: trees, triangles, materials for the hologram's wavelength,
/// lights and textures in device memory. Scene frame: the world minus Plan::origin_m, subtracted in
/// double.
///
/// Vertices and trees stay as they were made, in the first plan's scene frame
/// (host/trace/instances.hpp).
class DeviceScene {
public:
  DeviceScene(const cl::Device& device, const World& world, const Plan& plan);

  /// The same meshes and materials at other places (World::motions), or under other lights (as many
  /// as before). `options` may change where objects part that were one instance.
  void place(const World& world, const Plan& plan);

  DeviceTree tree;
  cl::Buffer<float> normals, uvs;  // of the vertices: kernels/scene/shade.h
  cl::Buffer<device::Material> materials;
  cl::Buffer<device::Light> lights;
  cl::Buffer<float> texels;
  // Sum of the ambient lights; 1 when there is none, so that a material's ambient part counts as
  // given
  float ambient_light = 1;
  // Radiances on the device are in it, and fields in its root: a power of four that keeps them
  // within float
  double radiance_unit = 1;
  float diameter_m = 0;  // of the scene's bounding box
  // Distance that secondary rays start off a surface: far above rounding, far below anything
  // visible
  float bias_m = 0;
  cl::Options options;      // leave out of the kernels what this scene does not use
  double tree_seconds = 0;  // for trees and instances, of the last time

  /// 32-bit words that hold a bit for each light.
  std::size_t light_words() const { return lights.size() > 32 ? (lights.size() + 31) / 32 : 1; }

private:
  void upload_lights(const World& world, const Plan& plan);

  cl::Device device_;
  Instances instances_;
  double material_unit_ = 1;
};

/// Pixels that one work-item handles side by side: the SIMD width on CPUs, one on GPUs.
int lanes_for(const cl::DeviceInfo& device);

}  // namespace raywave
