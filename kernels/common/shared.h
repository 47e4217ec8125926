// SPDX-License-Identifier: Apache-2.0
// Structs that host and device share. Members are 4-byte scalars only, so that both sides lay them
// out alike; tests/cl/device.cpp checks size and offsets on every device. Lengths are metres in the
// scene frame (world minus the scene's origin, docs/conventions.md).
#ifndef RAYWAVE_SHARED_H
#define RAYWAVE_SHARED_H

// Inner node of a flattened tree: the boxes of both children. A child with BVH_COUNT(count) 0 is
// node number `child`; one with more is a leaf of the triangles [child, child + BVH_COUNT(count)).
// The rest of `count` says which way what lies in the box faces (facing.h).
#define BVH_COUNT(count) ((count)&15)
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

// A triangle, in the order of the trees' leaves: its corners' numbers among the vertices, and what
// shading needs.
typedef struct {
  int corner_a;
  int corner_b;
  int corner_c;
  int material;
  // Of a closed mesh: 1 when (b - a) x (c - a) points outwards, -1 when inwards; 0 for open meshes
  int side;
  int instance;
} Triangle;

// What moves as one. Trees, vertices and normals stay in the instance's frame: the scene's as it was
// when they were made. A place q of that frame is centre + outward q in the scene, and a place p of
// the scene is inward (p - centre). Matrices row by row; low: what the floats leave over.
typedef struct {
  float inward[9];
  float inward_low[9];
  float outward[9];  // a rotation times a change of size
  float outward_low[9];
  float centre[3];
  float centre_low[3];
  // Direction from the hologram's centre to the instance's middle, in the instance's frame, VIEW_STEPS long
  int view[3];
  // By which facing.h must exceed it, so that it holds for the directions to all of the instance
  int view_margin;
  int root;   // number of its tree's node
  int moved;  // 0: both frames are the same
  int last;   // 1: no instance follows
} Instance;

// Phong material for the hologram's wavelength.
typedef struct {
  float ambient;  // times the ambient light
  float diffuse;
  float specular;
  float shininess;
  float reflectivity;
  float transparency;
  float ior;
  float ior_low;  // what the float leaves over
  int texture;    // first texel, or -1
  int texture_width;
  int texture_height;
} Material;

// One source of light on a surface: where a ray of the lattice pierces it. Samples of a cell follow
// each other.
typedef struct {
  float x;
  float y;
  float z;
  float nx;  // unit length, facing the hologram
  float ny;
  float nz;
  // Distance over the distance at which the lattice's pitch is p: every sample stands for the same
  // solid angle
  float weight;
  float radiance;  // that does not depend on the direction it is seen from
  float specular;
  float shininess;
  // Tilt . (u, v, -1): projected area of the surface in that direction, over that towards the
  // hologram's centre
  float tilt_x;
  float tilt_y;
  float tilt_z;
  uint key;  // of the random phase: cell and layer
  int triangle;
  int hidden;  // 1: some part of the hologram's window does not see it; view.h says which
  // Its first among the profiles of all samples: PLANE_WAVE_PARTS of a hidden one, one of any other
  int profile;
} Sample;

// The lattice of rays from the hologram's centre: ray (i, j) has the tangents ((first_x + i + 0.5)
// step, (first_y + j + 0.5) step).
typedef struct {
  int first_x;
  int first_y;
  int nx;
  int ny;
  float step;
  float centre_x;  // the hologram's centre in the scene frame
  float centre_y;
  float centre_z;
  // Rays start here, close before the scene: places are then as exact as the scene is small
  float near_z;
  float full_z;     // world depth at which the lattice's pitch is p
  float layer_gap;  // layers closer than this along z are one
  float bias;
  float reach;
  float half_width;  // of the window that samples are looked at from, or whose light is gathered
  float half_height;
} Lattice;

// A sample as the pixels of one plane see it: its light passes through the plane around the line to
// the hologram's centre on its way into the hologram's window. x and y are relative to the centre
// of pixel (0, 0), y up.
typedef struct {
  float x;  // of the sample; low: what the float leaves over
  float x_low;
  float y;
  float y_low;
  float depth;  // behind the plane; negative in front of it
  float depth_low;
  float inverse_depth;  // kept finite
  // Where the line from the sample to the hologram's centre, its chief ray, meets the plane
  float centre_x;
  float centre_x_low;
  float centre_y;
  float centre_y_low;
  float half_x;  // half the footprint on the plane
  float half_y;
  float scale_x;  // half windows of the tile per metre of the plane
  float scale_y;
  float amplitude;  // of the part that does not depend on direction
  float tilt_x;     // Sample::tilt, for offsets on the plane in place of tangents
  float tilt_y;
  float tilt_z;
  float turns;    // of the chief ray, reduced; this and the rates serve near.h
  float chief_x;  // sine of the chief ray in turns per metre
  float chief_x_low;
  float chief_y;
  float chief_y_low;
  float tangent_x;  // of the chief ray, towards the hologram
  float tangent_y;
  float half_tangent_x;  // of half the tile's window
  float half_tangent_y;
  int specular;
  int hidden;  // as in Sample
  int profile;
  int plane_waves;  // 1: near.h has its wave
  int left;         // pixels of its footprint, with room for rounding; none: no columns or no rows
  int top;
  int columns;
  int rows;
} ProjectedSample;

// The plane of pixels that a gather fills.
typedef struct {
  int nx;
  int ny;
  float left;  // x of the centres of the first column, scene frame; low: what the float leaves over
  float left_low;
  float top;  // y of the centres of the first row
  float top_low;
  float z;
  float z_low;
  float begin_z;  // depths of the samples that it gathers: begin_z <= z < end_z
  float end_z;
  float pitch_x;
  float pitch_x_low;
  float pitch_y;
  float pitch_y_low;
  // Centre of the hologram, or of its tile that the plane's light goes to, scene frame
  float hologram_x;
  float hologram_x_low;
  float hologram_y;
  float hologram_y_low;
  float hologram_z;
  float hologram_z_low;
  float turns_hi;  // 1 / wavelength as the sum of two floats
  float turns_lo;
  float cone_x;  // half width of the fan in half windows of the tile
  float cone_y;
  float apodization_rate_x;  // 1 / width of its soft edge; 0: hard
  float apodization_rate_y;
  float sine_limit_x;  // largest sine that the SLM's pixels can show
  float sine_limit_y;
  // Lattice tangent of the first column's centre, and of one pixel further; window: how far from
  // its own tangent a pixel gathers
  float tangent_x;
  float tangent_y;
  float tangent_step_x;
  float tangent_step_y;
  float window_x;
  float window_y;
  // Samples whose footprint's half is narrower than so many diffraction spots are near; 0: none
  float plane_wave_spots;
  float plane_wave_tail;  // of their light beyond the footprint, in diffraction spots
  int room_x;             // of a profile, in pixels; gather.cl
  int room_y;
  // Half sides of the tile's window over those of the window that views speak of
  float visibility_scale_x;
  float visibility_scale_y;
  float visibility_shift_x;  // from that one's centre to the tile's, in half sides of it
  float visibility_shift_y;
} GatherPlane;

// Directional light (is_point 0): xyz is the unit vector towards it. Point light (is_point 1): xyz
// is its position. Low: what the floats leave over. Ambient light is a constant.
typedef struct {
  float x;
  float x_low;
  float y;
  float y_low;
  float z;
  float z_low;
  float intensity;
  int is_point;
} Light;

// The plane of pixels that a trace fills, and what a frame's waves share. Pixel (0, 0) is the top
// left one; y falls with the row.
typedef struct {
  int nx;
  int ny;
  float left;  // x of the centres of the first column; low: what the float leaves over
  float left_low;
  float top;  // y of the centres of the first row
  float top_low;
  float z;
  float z_low;
  float pitch_x;
  float pitch_x_low;
  float pitch_y;
  float pitch_y_low;
  float turns_hi;  // 1 / wavelength as the sum of two floats
  float turns_lo;
  // Added to a ray's tangents per metre of its pixel's x and y from the axis: 1 / distance to the
  // hologram for a fan of perspective views, 0 for parallel views
  float convergence;
  float convergence_low;
  float axis_x;  // the optical axis in the scene frame
  float axis_x_low;
  float axis_y;
  float axis_y_low;
  float sine_limit_x;  // largest sine that the SLM's pixels can show
  float sine_limit_y;
  float step_x;  // tangents between neighbouring rays
  float step_y;
  float sampling_rate;  // 1 / sampling pitch p: cells of the random phase per metre
  float bias;           // distance that a secondary ray starts off its surface
  float reach;          // longer than any way through the scene
  uint seed;
} TracePlane;

// What a lens looks at: the pixels of a picture in the plane in focus, and the points of the lens
// that rays to each of them start from. Scene frame; pixel (0, 0) and point (0, 0) are the top left
// ones.
typedef struct {
  int nx;
  int ny;
  float left;  // x of the centres of the first column
  float top;   // y of the centres of the first row
  float pitch_x;
  float pitch_y;
  float inverse_focus;  // 1 / distance from the lens to the plane in focus
  int points;           // of the lens, per axis
  float lens_left;
  float lens_top;
  float lens_pitch_x;
  float lens_pitch_y;
  float start;    // distance from the lens before which nothing stands: rays start there
  float start_z;  // the same place in the scene frame
  float bias;     // distance that a secondary ray starts off its surface
  float reach;    // longer than any way through the scene
} LensPlane;

#endif
