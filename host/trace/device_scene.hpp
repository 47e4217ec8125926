// SPDX-License-Identifier: Apache-2.0
/// The scene in device memory.
#pragma once

#include <algorithm>
#include <optional>
#include <tuple>
#include <vector>

#include "cl/program.hpp"
#include "host/geometry/shared_types.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/placed_lights.hpp"
#include "host/plan/plan.hpp"
#include "host/trace/instances.hpp"

namespace raywave {

/// Build options of the kernels: lights, highlights, textures, shadows and bounces. A feature is
/// compiled in only when the scene uses it.
cl::Options kernel_options(const Plan& plan);

/// The same with those that depend on the device.
cl::Options kernel_options(const Plan& plan, const cl::DeviceInfo& device);

/// The scene as the kernels see it: trees, triangles, materials for the hologram's wavelength,
/// lights and textures in device memory. Scene frame: the world minus
/// SceneExtent::origin_m, subtracted in double.
///
/// Vertices and trees stay in the scene frame of the first plan (host/trace/instances.hpp).
class DeviceScene {
public:
  /// for_samples  false: for lens pictures alone, which need less
  DeviceScene(const cl::Device& device, const World& world, const Plan& plan,
              bool for_samples = true);

  /// Updates the places of the objects (World::motions) and the lights (as many as before); meshes
  /// and materials stay. `options` may change when an object leaves the shared instance.
  void place(const World& world, const Plan& plan);

  /// Shows the same world to another laser.
  ///
  /// plan  of a scene that differs in the laser alone
  void show(const Plan& plan);

  DeviceTree tree;
  cl::Buffer<float> normals, uvs, colours;  // of the vertices: kernels/scene/arrays.h
  cl::Buffer<device::Material> materials;
  cl::Buffer<device::Light> lights;
  cl::Buffer<float> texels;
  device::SceneLight light{};
  // Unit of radiances on the device; fields are in units of its square root. It is a power of four
  // that keeps both in the range of floats.
  double radiance_unit = 1;
  float diameter_m = 0;  // of the scene's bounding box
  // Offset of secondary rays from their surface: far above rounding errors, far below visible
  // sizes
  float bias_m = 0;
  /// SCENE_PARAMETERS of kernels/scene/arrays.h, for cl::Kernel::run.
  auto arguments() const {
    return std::tuple_cat(tree.arguments(),
                          std::tie(normals, uvs, colours, materials, lights, texels, light));
  }

  cl::Options options;      // of the kernels: features that this scene does not use are left out
  double tree_seconds = 0;  // of the last call of place(): trees and instances

  /// 32-bit words that hold a bit for each light.
  std::size_t light_words() const {
    return std::max<std::size_t>(1, ((placed_ ? placed_->size() : 0) + 31) / 32);
  }

private:
  void show_spectra(const Plan& plan);
  void upload_lights(const World& world, const Plan& plan);
  void upload_radiances(const Plan& plan);

  cl::Device device_;
  Instances instances_;
  double material_unit_ = 1;
  std::vector<device::Material> materials_;  // as `materials`, but for the unit of their emission
  double brightest_emission_ = 0;
  std::vector<Light> lights_;  // that placed_ was made of
  std::optional<std::vector<PlacedLight>> placed_;
};

/// Pixels that one work-item handles side by side: the SIMD width on CPUs, one on GPUs.
int lanes_for(const cl::DeviceInfo& device);

/// Work-items side by side where each has a sample or a cell.
inline cl::Range group_of_samples(const cl::DeviceInfo& device) {
  return {lanes_for(device) == 1 ? std::size_t{64} : std::size_t{1}};
}

}  // namespace raywave
