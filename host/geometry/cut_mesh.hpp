// SPDX-License-Identifier: Apache-2.0
/// Cutting away what of a mesh lies before a plane: rooms that a camera stands in.
#pragma once

#include <vector>

#include "host/scene/read_data.hpp"

namespace raywave {

/// The part of a mesh on which a height is at least `least`. Triangles across the limit are cut;
/// positions, normals, texture coordinates and colours of new corners lie between those of the old
/// ones. Materials and pictures are left behind.
///
/// heights  of the mesh's positions, linear in them
Mesh part_above(const Mesh& mesh, const std::vector<double>& heights, double least);

}  // namespace raywave
