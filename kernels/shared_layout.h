// SPDX-License-Identifier: Apache-2.0
// Every member of every struct of shared.h: RAYWAVE_LAYOUT(MEMBER) expands to MEMBER(struct, member) for each. Host and device compare
// where they put them (tests/device.cpp, which also fails when a member is missing here).
#ifndef RAYWAVE_SHARED_LAYOUT_H
#define RAYWAVE_SHARED_LAYOUT_H

#define RAYWAVE_LAYOUT(MEMBER)      \
  MEMBER(BvhNode, left_min)         \
  MEMBER(BvhNode, left_child)       \
  MEMBER(BvhNode, left_max)         \
  MEMBER(BvhNode, left_count)       \
  MEMBER(BvhNode, right_min)        \
  MEMBER(BvhNode, right_child)      \
  MEMBER(BvhNode, right_max)        \
  MEMBER(BvhNode, right_count)      \
  MEMBER(Triangle, a)               \
  MEMBER(Triangle, b)               \
  MEMBER(Triangle, c)               \
  MEMBER(TriangleShading, normal_a) \
  MEMBER(TriangleShading, normal_b) \
  MEMBER(TriangleShading, normal_c) \
  MEMBER(TriangleShading, uv_a)     \
  MEMBER(TriangleShading, uv_b)     \
  MEMBER(TriangleShading, uv_c)     \
  MEMBER(TriangleShading, material) \
  MEMBER(Material, ambient)         \
  MEMBER(Material, diffuse)         \
  MEMBER(Material, specular)        \
  MEMBER(Material, shininess)       \
  MEMBER(Material, reflectivity)    \
  MEMBER(Material, transparency)    \
  MEMBER(Material, ior)             \
  MEMBER(Material, texture)         \
  MEMBER(Material, texture_width)   \
  MEMBER(Material, texture_height)  \
  MEMBER(Light, x)                  \
  MEMBER(Light, y)                  \
  MEMBER(Light, z)                  \
  MEMBER(Light, intensity)          \
  MEMBER(Light, is_point)           \
  MEMBER(FanRay, x)                 \
  MEMBER(FanRay, y)                 \
  MEMBER(FanRay, length)            \
  MEMBER(FanRay, turns_hi)          \
  MEMBER(FanRay, turns_lo)          \
  MEMBER(TracePlane, nx)            \
  MEMBER(TracePlane, ny)            \
  MEMBER(TracePlane, left)          \
  MEMBER(TracePlane, top)           \
  MEMBER(TracePlane, z)             \
  MEMBER(TracePlane, pitch_x)       \
  MEMBER(TracePlane, pitch_y)       \
  MEMBER(TracePlane, turns_hi)      \
  MEMBER(TracePlane, turns_lo)      \
  MEMBER(TracePlane, sampling_rate) \
  MEMBER(TracePlane, bias)          \
  MEMBER(TracePlane, reach)         \
  MEMBER(TracePlane, seed)

#endif
