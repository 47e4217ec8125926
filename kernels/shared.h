// SPDX-License-Identifier: Apache-2.0
// Structs that host and device share. Members are 4-byte scalars only, so that both sides lay them out alike; tests/device.cpp checks
// size and offsets on every device. Lengths are metres in the scene frame (world minus the scene's origin, docs/conventions.md).
#ifndef RAYWAVE_SHARED_H
#define RAYWAVE_SHARED_H

// Inner node of the flattened tree: the boxes of both children. A child with count 0 is node number `child`; one with count > 0 is a leaf
// of the triangles [child, child + count).
typedef struct {
  float left_min[3];
  int left_child;
  float left_max[3];
  int left_count;
  float right_min[3];
  int right_child;
  float right_max[3];
  int right_count;
} BvhNode;

// Corners of a triangle, in the order of the tree's leaves.
typedef struct {
  float a[3];
  float b[3];
  float c[3];
} Triangle;

// What shading needs of the same triangle.
typedef struct {
  float normal_a[3];  // unit length, outwards as the mesh says
  float normal_b[3];
  float normal_c[3];
  float uv_a[2];  // (0, 0) is the bottom left of the texture
  float uv_b[2];
  float uv_c[2];
  int material;
} TriangleShading;

// Phong material for the hologram's wavelength.
typedef struct {
  float ambient;  // times the ambient light
  float diffuse;
  float specular;
  float shininess;
  float reflectivity;
  float transparency;
  float ior;
  int texture;  // first texel, or -1
  int texture_width;
  int texture_height;
} Material;

// Directional light (is_point 0): xyz is the unit vector towards it. Point light (is_point 1): xyz is its position. Ambient light is a
// constant.
typedef struct {
  float x;
  float y;
  float z;
  float intensity;
  int is_point;
} Light;

// One direction of a fan of parallel rays: (x, y, 1) points from a WRP pixel away from the hologram.
typedef struct {
  float x;
  float y;
  float length;    // of (x, y, 1)
  float turns_hi;  // length / wavelength, the turns of phase per metre of depth, as the sum of two floats
  float turns_lo;
} FanRay;

// The plane of pixels that a trace fills, and what a frame's waves share. Pixel (0, 0) is the top left one; y falls with the row.
typedef struct {
  int nx;
  int ny;
  float left;  // x of the centres of the first column
  float top;   // y of the centres of the first row
  float z;
  float pitch_x;
  float pitch_y;
  float turns_hi;  // 1 / wavelength as the sum of two floats
  float turns_lo;
  float sampling_rate;  // 1 / sampling pitch p: cells of the random phase per metre
  float bias;           // distance that a secondary ray starts off its surface
  float reach;          // longer than any way through the scene
  uint seed;
} TracePlane;

#endif
