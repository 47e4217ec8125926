// SPDX-License-Identifier: Apache-2.0
// Normal cones: the directions in which the triangles of a box face, as an axis and a spread,
// packed with the number of triangles into `count` of a BvhNode. Integers only, so that host
// (host/geometry/normal_cones.cpp) and devices agree. Bits: 4 for the number of triangles of a
// leaf, 7 for each component of the axis, 7 for the spread.
#ifndef RAYWAVE_NORMAL_CONE_H
#define RAYWAVE_NORMAL_CONE_H

#define NORMAL_CONE_STEPS 63  // length of a unit vector in units of an axis component
#define VIEW_STEPS (1 << 14)  // length of Instance::view

// Every outward unit normal, times NORMAL_CONE_STEPS, lies within half this distance of the axis.
// 0: unknown.
static inline int normal_cone_spread(int cone) { return cone >> 25 & 127; }

static inline int normal_cone_axis(int cone, int component) {
  return (cone >> (4 + 7 * component) & 127) - NORMAL_CONE_STEPS;
}

#endif
