// SPDX-License-Identifier: Apache-2.0
// Which way the triangles in a box face, in 28 bits of the counts of BvhNode: an axis, and how far
// their normals stray from it. Whole numbers, so that host (host/geometry/normal_cones.cpp) and
// devices read the same. Bits: 4 for the triangles of a leaf, 7 for each component of the axis, and
// 7 for the spread.
#ifndef RAYWAVE_NORMAL_CONE_H
#define RAYWAVE_NORMAL_CONE_H

#define NORMAL_CONE_STEPS 63  // of unit length in components of an axis
#define VIEW_STEPS (1 << 14)  // of unit length in Instance::view

// NORMAL_CONE_STEPS times the normals' unit vector, on the outer side, is nowhere farther from the axis
// than half this. 0: nothing is known.
static inline int normal_cone_spread(int cone) { return cone >> 25 & 127; }

static inline int normal_cone_axis(int cone, int component) {
  return (cone >> (4 + 7 * component) & 127) - NORMAL_CONE_STEPS;
}

#endif
