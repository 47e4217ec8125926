// SPDX-License-Identifier: Apache-2.0
/// Meshes made in code, for measurements that need no file.
#pragma once

#include "host/geometry/world.hpp"

namespace raywave {

/// A closed sphere of diameter 1 about the origin with its true normals: 2 `rings` sectors,
/// 4 rings (rings - 1) triangles.
Mesh unit_sphere(int rings);

/// A rectangle in the plane z = 0 about the origin, 1 wide and `height` high. Its normal is -z.
Mesh flat_rectangle(double height);

}  // namespace raywave
