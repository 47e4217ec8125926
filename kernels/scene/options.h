// SPDX-License-Identifier: Apache-2.0
// Compile-time options of the kernels that trace rays and shade (kernels/common/options.h). They
// leave out what no object of the scene has; host/trace/device_scene.cpp sets all of them.
#ifndef RAYWAVE_SCENE_OPTIONS_H
#define RAYWAVE_SCENE_OPTIONS_H

// Colours that are computed together: 1, the channel that the hologram's wavelength sees; or 3,
// red, green and blue, from which the light of a laser follows (docs/colour.md)
#ifndef RAYWAVE_COLOURS
#define RAYWAVE_COLOURS 1
#endif

// Nodes from the root of a tree to its deepest leaf, at most. Scenes take the default, and share
// their kernels; tests of trees set it
#ifndef RAYWAVE_BVH_DEPTH
#define RAYWAVE_BVH_DEPTH 64
#endif

// Number of lights besides ambient ones, 0 or more
#ifndef RAYWAVE_LIGHTS
#define RAYWAVE_LIGHTS 1
#endif

// Number of lights, the first ones, whose highlights show; 0 where no material has a specular part
#ifndef RAYWAVE_HIGHLIGHTS
#define RAYWAVE_HIGHLIGHTS RAYWAVE_LIGHTS
#endif

// Places of each light among which neighbouring rays choose: 1, or 16 where a light has a size
// (host/plan/placed_lights.hpp)
#ifndef RAYWAVE_LIGHT_PLACES
#define RAYWAVE_LIGHT_PLACES 1
#endif

// 1: some light is a spot, or falls off with distance
#ifndef RAYWAVE_SPOTS
#define RAYWAVE_SPOTS 0
#endif

// 1: the exponent of a highlight is so large that directions need more than floats
#ifndef RAYWAVE_SHARP
#define RAYWAVE_SHARP 0
#endif

// Reflections and refractions that a ray is followed through, 0 or more
#ifndef RAYWAVE_BOUNCES
#define RAYWAVE_BOUNCES 0
#endif

// Most that materials change from place to place
#define TEXTURES_NONE 0
#define TEXTURES_PLAIN 1  // pictures multiply ambient and diffuse, and repeat
#define TEXTURES_LOOKS 2  // all that meshes bring (kernels/scene/look.h), and emission
#ifndef RAYWAVE_TEXTURES
#define RAYWAVE_TEXTURES TEXTURES_PLAIN
#endif

// 1: some material has a normal map
#ifndef RAYWAVE_NORMAL_MAPS
#define RAYWAVE_NORMAL_MAPS 0
#endif

// Whether surfaces are there everywhere; otherwise a ray meets them only where alpha passes. The
// largest Material::alpha_mode in the scene
#define ALPHA_OPAQUE 0
#define ALPHA_MASK 1   // some are there where alpha is at least the cutoff
#define ALPHA_BLEND 2  // some are there with the probability alpha, in cells of blend_rate
#ifndef RAYWAVE_ALPHA
#define RAYWAVE_ALPHA ALPHA_OPAQUE
#endif

// 0: nothing is in a light's way. Otherwise the number of rays of a cell that ask for each
// direction of a light that has a size, where its rays disagree; SHADOWS_ALL: every ray asks for
// all lights
#define SHADOWS_ALL 16
#ifndef RAYWAVE_SHADOWS
#define RAYWAVE_SHADOWS 0
#endif

// Rays that look from a surface for light of others that it scatters: all around, and around the
// mirrored direction, where highlights are; 0: none
#ifndef RAYWAVE_DIFFUSE_RAYS
#define RAYWAVE_DIFFUSE_RAYS 0
#endif
#ifndef RAYWAVE_GLOSS_RAYS
#define RAYWAVE_GLOSS_RAYS 0
#endif

#define RAYWAVE_SCENE_OPTIONS(OPTION)        \
  OPTION(colours, RAYWAVE_COLOURS)           \
  OPTION(bvh_depth, RAYWAVE_BVH_DEPTH)       \
  OPTION(lights, RAYWAVE_LIGHTS)             \
  OPTION(highlights, RAYWAVE_HIGHLIGHTS)     \
  OPTION(light_places, RAYWAVE_LIGHT_PLACES) \
  OPTION(spots, RAYWAVE_SPOTS)               \
  OPTION(sharp, RAYWAVE_SHARP)               \
  OPTION(bounces, RAYWAVE_BOUNCES)           \
  OPTION(textures, RAYWAVE_TEXTURES)         \
  OPTION(normal_maps, RAYWAVE_NORMAL_MAPS)   \
  OPTION(alpha, RAYWAVE_ALPHA)               \
  OPTION(shadows, RAYWAVE_SHADOWS)           \
  OPTION(diffuse_rays, RAYWAVE_DIFFUSE_RAYS) \
  OPTION(gloss_rays, RAYWAVE_GLOSS_RAYS)

#endif
