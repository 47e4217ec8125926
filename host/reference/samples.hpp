// SPDX-License-Identifier: Apache-2.0
/// The samples of a cell with antialiasing, in double precision, ray by ray and triangle by
/// triangle: the oracle of the places and radiances that kernels/samples/samples.cl finds.
#pragma once

#include <cstddef>
#include <glm/vec3.hpp>
#include <vector>

#include "host/reference/surfaces.hpp"

namespace raywave::reference {

struct CellSample {
  glm::dvec3 place{0};  // centroid of its light, scene frame
  double radiance = 0;  // without highlights; times the part of the cell that it covers
};

struct CellSamples {
  std::vector<CellSample> samples;  // in the order of the table, those that nothing sees included
  // A ray passes an edge, or the limit between two layers, closer than floats tell.
  bool unsure = false;
};

/// The samples of cell number `cell` of the rig's lattice, for SamplesPlan::antialias > 0 and
/// materials without mirrors and glass.
CellSamples samples_of_cell(const Stage& stage, const Rig& rig, std::size_t cell);

}  // namespace raywave::reference
