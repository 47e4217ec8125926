// SPDX-License-Identifier: Apache-2.0
/// Scenes made in code, without mesh files, and their sample tables, for tests and the self-test.
#pragma once

#include <cstdint>
#include <vector>

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/reference/surfaces.hpp"
#include "host/scene/scene.hpp"
#include "host/trace/samples.hpp"

namespace raywave::reference {

/// Scene and world that grow together.
struct Stage {
  Scene scene;
  World world;

  /// 96 x 80 pixels of 8 um, 638 nm, samples 25 um apart without antialiasing: closed forms speak
  /// of the rays through the cells' centres. Light travels over WRPs.
  Stage();

  /// One more object of that material.
  Stage& add(const Surface& s, const Material& material = {});
};

/// A shiny ball before a tilted wall that lies 0.5 mm behind its centre, lit by a sun and a lamp:
/// 61 x 47 pixels of 8 um x 10 um, samples 50 um apart, with shadows.
Stage ball_before_wall(double z_m);

/// Corners of the triangles of a tree on a device, in leaf order.
std::vector<Corners> corners_of(const DeviceTree& tree);

/// The stage on a device, its sample table read back, and the triangles as the device has them.
struct Rig {
  Scene scene;
  Plan plan;
  std::vector<PlacedLight> lights;
  DeviceScene arrays;
  SampleTable table;
  std::vector<device::Sample> samples;
  std::vector<std::int32_t> first_of_cell;
  std::vector<std::uint32_t> visibility_masks, lit;
  std::vector<device::Triangle> triangles;
  std::vector<Corners> corners;  // corners of the triangles

  /// keep_unseen  as SampleTable has it
  Rig(const cl::Device& device, const Stage& stage, Method method = Method::wrp,
      bool keep_unseen = true);
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  /// True when part (i, j) of the hologram's window sees a sample.
  bool sees(std::size_t sample, int i, int j) const {
    const auto bit = static_cast<std::size_t>(j * table.visibility_parts + i);
    return visibility_masks[sample * table.visibility_words() + bit / 32] >> (bit % 32) & 1u;
  }

  int object_of(const device::Sample& s) const {
    return triangles[static_cast<std::size_t>(s.triangle)].material;
  }
};

/// Scene frame.
inline glm::dvec3 place(const device::Sample& s) { return {s.x, s.y, s.z}; }
inline glm::dvec3 normal(const device::Sample& s) { return {s.nx, s.ny, s.nz}; }

}  // namespace raywave::reference
