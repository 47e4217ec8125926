// SPDX-License-Identifier: Apache-2.0
// Structs that host and device share. All members are 4-byte scalars, so that both sides use the
// same layout; tests/cl/device.cpp checks sizes and offsets on every device. Lengths are in metres,
// positions in the scene frame (world minus the scene's origin, docs/conventions.md). A member
// *_low holds what remains of the value before it after rounding to float.
#ifndef RAYWAVE_SHARED_H
#define RAYWAVE_SHARED_H

// Inner node of a flattened tree: the boxes of both children. A child with BVH_COUNT(count) 0 is
// the node with number `child`. A child with BVH_COUNT(count) > 0 is a leaf with the triangles
// [child, child + BVH_COUNT(count)). The other bits of `count` hold the child's normal cone
// (kernels/scene/normal_cones.h).
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

// A triangle: the numbers of its corners among the vertices, and what shading needs. Triangles are
// in the order of the trees' leaves.
typedef struct {
  int corner_a;
  int corner_b;
  int corner_c;
  int material;
  // Closed mesh: 1 when (b - a) x (c - a) points outwards, -1 when inwards; open mesh: 0
  int side;
  int instance;
} Triangle;

// A rigid part of the scene with a tree of its own. Tree, vertices and normals stay in the
// instance's frame, which was the scene frame when the tree was built. A point q of that frame is
// centre + outward q in the scene; a point p of the scene is inward (p - centre) in that frame.
// Matrices are row by row.
typedef struct {
  float inward[9];
  float inward_low[9];
  float outward[9];  // rotation times scale
  float outward_low[9];
  float centre[3];
  float centre_low[3];
  // Direction from the hologram's centre to the instance's middle, in the instance's frame, with
  // length VIEW_STEPS
  int view[3];
  // Margin of the normal-cone test that makes it valid for every point of the instance
  int view_margin;
  int root;   // number of the root node of its tree
  int moved;  // 0: both frames are the same
  // In the first instance: number of the root of the tree over all instances, in the scene frame,
  // whose leaves are one instance each; -1: there is no other instance
  int top;
} Instance;

// A picture on a surface, of one channel or, in colour, of red, green and blue one after the other.
// (u, v) of the mesh shows the place (across . (u, v, 1), up . (u, v, 1))
// of the picture, whose bottom left is (0, 0); row 0 of the texels is on top.
typedef struct {
  int first;  // number of its first texel; -1: no picture
  int width;
  int height;
  int wrap;  // across + 4 * up: WRAP_REPEAT, WRAP_MIRROR or WRAP_CLAMP
  float across[3];
  float up[3];
} TextureMap;

#define WRAP_REPEAT 0
#define WRAP_MIRROR 1
#define WRAP_CLAMP 2

// Bits of Material::kind
#define MATERIAL_VERTEX_COLOURS 1  // they multiply what the colour map multiplies
#define MATERIAL_METALLIC 2        // diffuse, specular and shininess follow from base to roughness
#define MATERIAL_UNLIT 4           // the colour map multiplies the emission

// Phong material for the hologram's wavelength: the first of three numbers is that of its channel.
// In colour (RAYWAVE_COLOURS) they are red, green and blue.
typedef struct {
  float ambient[3];  // factor of the ambient light
  float diffuse[3];
  float specular[3];
  float shininess;
  float reflectivity;
  float transparency;
  float ior;
  float ior_low;      // what the float leaves over
  float attenuation;  // per metre of glass: exp(-attenuation length) of the light is left
  TextureMap colour;  // times ambient and diffuse
  // Properties that only meshes bring (kernels/scene/look.h)
  int kind;
  float emission[3];  // radiance over the unit of lights
  TextureMap emission_map;
  float base[3];  // of MATERIAL_METALLIC: colour, metalness, roughness
  float metallic;
  float roughness;
  float reflectance;    // without metal
  float ambient_share;  // ambient part of the colour
  int metallic_texels;  // first texel of the metalness; roughness_map has that of the roughness
  TextureMap roughness_map;
  float normal_scale;
  // First texels of the components along v and outwards; normal_map has those along u
  int normal_up_texels;
  int normal_out_texels;
  TextureMap normal_map;
  int alpha_mode;  // as RAYWAVE_ALPHA (kernels/scene/options.h)
  float alpha;
  float alpha_cutoff;
  int alpha_texels;  // first texel of the alpha of the picture `colour`; -1: it has none
  TextureMap opacity_map;
  float blend_rate;  // cells per metre that are there or not, as a whole
  uint blend_seed;
} Material;

// A surface sample: one source of light, where a ray of the lattice pierces a surface. Samples are
// in the order of their cells.
typedef struct {
  float x, y, z;
  float nx, ny, nz;  // unit length, facing the hologram
  // Distance from the hologram's plane over that at which the lattice's pitch is p, so that every
  // sample stands for the same solid angle
  float weight;
  float radiance;  // part that does not depend on the viewing direction
  float specular;
  float shininess;
  // tilt . (u, v, -1): projected area of the surface in the direction (u, v, -1), over that towards
  // the hologram's centre
  float tilt_x, tilt_y, tilt_z;
  uint key;  // of the random phase: made from cell and layer
  int triangle;
  int hidden;  // 1: its visibility mask is not full (kernels/samples/visibility.h)
  // Number of its first profile. A hidden sample has PLANE_WAVE_PARTS profiles, any other has one.
  int profile;
  // Number of the SamplePath of a sample that is seen in mirrors or through glass. It shines from
  // a virtual point then; normal and triangle are those of its source. -1: it is seen directly
  int path;
} Sample;

// From where a sample of a slot looks for the hologram: before it has moved to the centroid of its
// light, with the normal of its side (kernels/samples/look_around.cl).
typedef struct {
  float x, y, z;
  float nx, ny, nz;
  int asks;  // 1: rays tell which parts of the window see it
} Lookout;

// Terms of the polynomials of a SamplePath (kernels/samples/path_layout.h)
#define PATH_TERMS 18
#define PATH_AMPLITUDE_TERMS 6

// How the light of a sample reaches the hologram over mirrors and through glass. (x, y): place on
// the window that visibility masks divide, in half sides from its centre.
typedef struct {
  float source[3];         // place where it shines, scene frame
  float rest[PATH_TERMS];  // path beyond the distance from the virtual point, metres
  // Amplitude over that of the virtual point
  float amplitude[PATH_AMPLITUDE_TERMS];
} SamplePath;

// The lattice of rays from the eye, mostly the hologram's centre. Ray (i, j) has the tangents
// (first_x + i + 0.5) step and (first_y + j + 0.5) step.
typedef struct {
  int first_x, first_y;
  int nx, ny;
  float step;
  float centre_x, centre_y, centre_z;  // centre of the hologram in the scene frame
  float eye_x, eye_y, eye_z;  // where all rays come from: the same, or a point before the scene
  // Rays start here, just in front of the scene, so that rounding depends on the scene's size only
  float near_z;
  float full_z;                  // distance from the eye at which the lattice's pitch is p
  float steepest_x, steepest_y;  // tangents that masks divide near the hologram; else FLT_MAX
  float layer_gap;               // layers closer to each other than this along z are merged
  float bias;
  float reach;
  // Half sides of the window that visibility masks divide; in gather.cl, of the tile's window
  float half_width, half_height;
} Lattice;

// A sample projected onto one plane. Its light crosses the plane around its chief ray, the line
// from the sample to the hologram's centre (or its tile's). x and y count from the centre of pixel
// (0, 0), y up.
typedef struct {
  float x, x_low, y, y_low;  // the sample
  float depth, depth_low;    // z of the sample minus that of the plane; negative in front of it
  float inverse_depth;       // 1 / depth, kept finite
  // Where the chief ray meets the plane
  float centre_x, centre_x_low, centre_y, centre_y_low;
  float half_x, half_y;  // half width of the footprint on the plane
  // Half windows of the tile per metre of the plane; negative where the hologram lies behind the
  // sample
  float scale_x, scale_y;
  float amplitude;  // without highlights
  float tilt_x;     // Sample::tilt per metre on the plane
  float tilt_y, tilt_z;
  // For plane_waves.h
  float turns;  // path of the chief ray, reduced
  // Sine of the chief ray's direction, in turns per metre
  float chief_x, chief_x_low, chief_y, chief_y_low;
  float tangent_x, tangent_y;            // direction of the chief ray, towards the hologram
  float half_tangent_x, half_tangent_y;  // tangent of half the tile's window, seen from the sample
  int specular;
  int hidden;  // as in Sample
  int profile;
  int path;         // as in Sample
  int plane_waves;  // 1: its light is summed from plane waves (plane_waves.h)
  // Pixels of its footprint with a margin for rounding; no columns or no rows: none
  int left;
  int top;
  int columns;
  int rows;
} ProjectedSample;

// The plane of pixels that `gather` fills.
typedef struct {
  int nx, ny;
  float left, left_low;  // x of the centres of the first column, scene frame
  float top, top_low;    // y of the centres of the first row
  float z, z_low;
  float begin_z;  // it gathers the samples with begin_z <= z < end_z
  float end_z;
  float pitch_x, pitch_x_low, pitch_y, pitch_y_low;
  // Centre of the hologram, or of the tile that the plane's light goes to, scene frame
  float hologram_x, hologram_x_low, hologram_y, hologram_y_low, hologram_z, hologram_z_low;
  float turns_hi, turns_lo;  // 1 / wavelength
  float cone_x, cone_y;      // half width of the cone in half windows of the tile
  float apodization_rate_x;  // 1 / width of the cone's apodization; 0: hard edge
  float apodization_rate_y;
  float sine_limit_x, sine_limit_y;  // largest sine that the SLM's pixels can show
  // Sine of the light on the SLM at the window's centre, from which the limit counts, and by how
  // much it falls to the window's edge
  float reference_x, reference_y;
  float reference_fall_x, reference_fall_y;
  // Half sides of the tile's window
  float half_window_x, half_window_y;
  // Lattice tangent of the first column's centre, its step per pixel, and the largest difference
  // between a pixel's tangent and those of the samples that it gathers
  float tangent_x, tangent_y;
  float tangent_step_x, tangent_step_y;
  float window_x, window_y;
  // Half width of the cone, in diffraction spots, below which a sample is a plane-wave sample; 0:
  // none is
  float plane_wave_spots;
  float plane_wave_tail;  // width of the footprint beyond the cone, in diffraction spots
  int room_x;             // columns (rows) that a profile has room for; gather.cl
  int room_y;
  // Half sides of the tile's window over those of the window that visibility masks divide
  float visibility_scale_x, visibility_scale_y;
  // From the centre of that window to the centre of the tile's, in half sides of that window
  float visibility_shift_x, visibility_shift_y;
} GatherPlane;

// The virtual plane of compact gathering (kernels/gather/compact.cl), one transform away from a
// tile of the hologram.
typedef struct {
  int nx;  // a multiple of 16
  int ny;
  int tile_nx, tile_ny;          // pixels of the tile
  int row_stride;                // pixels in memory from a row of the plane to the next
  float origin_x, origin_x_low;  // centre of the tile's pixel (columns / 2, rows / 2), scene frame
  float origin_y, origin_y_low;
  float hologram_z, hologram_z_low;
  float z0, z0_low;  // distance from the tile
  // 1; -1: it stands for the mirror image, through the hologram's plane, of samples before the
  // hologram
  float side;
  float begin_z;  // it gathers the samples with begin_z <= z < end_z
  float end_z;
  float turns_hi, turns_lo;  // 1 / wavelength
  float pitch_x, pitch_y;    // pixels of the tile
  float half_x, half_y;      // half sides of the tile
  float period_x, period_y;  // nx pitch_x: what the transform repeats after
  float frequency_x, frequency_x_low, frequency_y, frequency_y_low;  // 1 / period_x
  float pixels_per_sine_x, pixels_per_sine_y;                        // period_x / wavelength
  // Pixels that a footprint reaches beyond the sample's rays; rough_margin: where something hides
  // the sample, or its light becomes too steep for the pixels
  float margin;
  float rough_margin;
  float highlight_margin;  // the same where highlights change over the tile
  int lines;               // for samples that nothing hides, at most
  int highlight_lines;     // for samples with highlights, at least
  float lines_tolerance;   // relative error up to which a sample has fewer
  float sine_limit_x;      // largest sine that the SLM's pixels can show
  float sine_limit_y;
  // Sine of the light on the SLM at the tile's origin, from which the limit counts, and by how much
  // it falls per metre; y downwards, of mirror images with the opposite sign
  float reference_x, reference_y;
  float reference_fall_x, reference_fall_y;
  float per_cut_x, per_cut_y;  // 1 / width, on the tile, of the step there
  int knots;                   // 8, 16 or 32 (kernels/gather/compact_layout.h)
  // Half sides of the window that visibility masks divide for each metre, and from the centre of
  // that window to the tile's origin, in half sides; y up
  float window_scale_x, window_scale_y;
  float window_shift_x, window_shift_y;
} CompactPlane;

// The pixels of the virtual plane that a sample lights, before they are taken modulo its size, and
// the number of its scan lines.
typedef struct {
  int left;
  int columns;  // even, as rows
  int top;
  int rows;
  int lines;  // 0: it lights none
  // 1: its path over mirrors and through glass is followed; 0: it shines from its virtual point
  int follows;
} CompactFootprint;

// Directional light (is_point 0): (x, y, z) is the unit vector towards it. Point light (is_point
// 1): (x, y, z) is its position. Ambient light is not among the lights. There are
// RAYWAVE_LIGHT_PLACES of each light, which differ in (x, y, z) only.
typedef struct {
  float x, x_low, y, y_low, z, z_low;
  float intensity;
  int is_point;
  int falls_off;  // 1: the intensity is that at 1 m, and falls with the square of the distance
  // A spot shines with clamp(edge_rate c + edge_offset)^2, c the cosine to its axis
  float axis_x, axis_y, axis_z;
  float edge_rate;
  float edge_offset;
  // In colour: of red, green and blue, over the intensity; and of the hologram's laser
  float colour[3];
  float of_laser;
} Light;

// Light that all surfaces have, and what a hologram in colour shows of it.
typedef struct {
  // Sum of the ambient lights; 1 when there is none, so that the ambient share of a material is
  // used unchanged
  float ambient;
  float laser[3];  // weights of red, green and blue in the light of the hologram's laser
} SceneLight;

// The plane of pixels that a fan trace fills, and what all its rays share. Pixel (0, 0) is the top
// left one; y decreases with the row.
typedef struct {
  int nx, ny;
  float left, left_low;  // x of the centres of the first column
  float top, top_low;    // y of the centres of the first row
  float z, z_low;
  float pitch_x, pitch_x_low, pitch_y, pitch_y_low;
  float turns_hi, turns_lo;          // 1 / wavelength
  float sine_limit_x, sine_limit_y;  // largest sine that the SLM's pixels can show
  float sampling_rate;               // 1 / sampling pitch p: cells of the random phase per metre
  float bias;                        // distance from the surface at which a secondary ray starts
  float reach;                       // longer than any path through the scene
  float ahead;                       // rays start so far beyond it in z: 0, or before a scene that
                                     // reaches to the eye's side of it (negative)
  uint seed;
} TracePlane;

// The view of a lens: the pixels of a picture in the plane in focus, and the points of the lens at
// which the rays to each pixel start. Scene frame; pixel (0, 0) and point (0, 0) are the top left
// ones.
typedef struct {
  int nx, ny;
  float left;  // x of the centres of the first column
  float top;   // y of the centres of the first row
  float pitch_x, pitch_y;
  float inverse_focus;  // 1 / distance from the lens to the plane in focus
  int points;           // points of the lens per axis
  float lens_left;
  float lens_top;
  float lens_pitch_x, lens_pitch_y;
  // Half sides of the part of the lens around a pixel that is open, where it is smaller; 0: all is
  float reach_x, reach_y;
  float start;    // distance from the lens at which rays start; nothing is nearer
  float start_z;  // z of these starts in the scene frame
  float bias;     // distance from the surface at which a secondary ray starts
  float reach;    // longer than any path through the scene
  // Size of the part of a pixel that rays go through; 0: all go through its centre
  float spread_x, spread_y;
  // Point i stands at i * scatter modulo points in the order of places in the pixel
  int scatter;
  // The lens stands behind the hologram, as an eye's pupil does: rays to a pixel at x pass the
  // hologram at lens_left + follow * x
  float follow;
  int is_round;  // points beyond a disc are left out
  float rays;    // to a pixel: points of the lens in all
  float window_left, window_right, window_bottom, window_top;  // of the hologram; dark beyond
  float steepest_x, steepest_y;                                // tangents; steeper rays are dark
} LensPlane;

#endif
