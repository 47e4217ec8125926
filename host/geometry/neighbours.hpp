// SPDX-License-Identifier: Apache-2.0
/// Which triangles of a mesh share an edge.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace raywave {

/// The triangles beyond the edges ab, bc and ca of each triangle, three numbers for each; -1 where
/// there is none, more than one, or one of the other winding. Corners at equal positions are the
/// same corner.
std::vector<std::int32_t> neighbours_of(const std::vector<glm::dvec3>& positions_m,
                                        const std::vector<glm::uvec3>& triangles);

}  // namespace raywave
