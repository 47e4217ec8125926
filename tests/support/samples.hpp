// SPDX-License-Identifier: Apache-2.0
/// The sample table of a rig, cell by cell.
#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <span>

#include "tests/support/worlds.hpp"

namespace raywave::test {

inline glm::dvec3 hologram_centre(const reference::Rig& rig) { return -rig.plan.extent.origin_m; }

/// Tangents of the lattice ray through cell number `cell`, in double precision.
inline glm::dvec2 tangents(const reference::Rig& rig, std::size_t cell) {
  const auto& l = rig.plan.lattice;
  const auto nx = static_cast<std::size_t>(l.size.x);
  return (glm::dvec2(l.first) + glm::dvec2(cell % nx, cell / nx) + 0.5) * l.step;
}

inline std::size_t cells(const reference::Rig& rig) { return rig.first_of_cell.size() - 1; }

inline std::span<const device::Sample> samples_of(const reference::Rig& rig, std::size_t cell) {
  return std::span(rig.samples)
      .subspan(static_cast<std::size_t>(rig.first_of_cell[cell]),
               static_cast<std::size_t>(rig.first_of_cell[cell + 1] - rig.first_of_cell[cell]));
}

}  // namespace raywave::test
