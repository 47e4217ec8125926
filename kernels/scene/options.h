// SPDX-License-Identifier: Apache-2.0
// Compile-time options of the kernels that trace rays and shade (kernels/common/options.h). They
// leave out what no object of the scene has; host/trace/device_scene.cpp sets all of them.
#ifndef RAYWAVE_SCENE_OPTIONS_H
#define RAYWAVE_SCENE_OPTIONS_H

// Nodes from the root of a tree to its deepest leaf, rounded up to a multiple of 16
#ifndef RAYWAVE_BVH_DEPTH
#define RAYWAVE_BVH_DEPTH 64
#endif

// Number of directional and point lights, 0 or more
#ifndef RAYWAVE_LIGHTS
#define RAYWAVE_LIGHTS 1
#endif

// 1: some material has a specular part
#ifndef RAYWAVE_SPECULAR
#define RAYWAVE_SPECULAR 1
#endif

// 1: the exponent of a highlight is so large that directions need more than floats
#ifndef RAYWAVE_SHARP
#define RAYWAVE_SHARP 0
#endif

// Reflections and refractions that a ray is followed through, 0 or more
#ifndef RAYWAVE_BOUNCES
#define RAYWAVE_BOUNCES 0
#endif

// 1: some material has a texture
#ifndef RAYWAVE_TEXTURES
#define RAYWAVE_TEXTURES 1
#endif

// 1: lights are tested for occluders
#ifndef RAYWAVE_SHADOWS
#define RAYWAVE_SHADOWS 0
#endif

#define RAYWAVE_SCENE_OPTIONS(OPTION)  \
  OPTION(bvh_depth, RAYWAVE_BVH_DEPTH) \
  OPTION(lights, RAYWAVE_LIGHTS)       \
  OPTION(specular, RAYWAVE_SPECULAR)   \
  OPTION(sharp, RAYWAVE_SHARP)         \
  OPTION(bounces, RAYWAVE_BOUNCES)     \
  OPTION(textures, RAYWAVE_TEXTURES)   \
  OPTION(shadows, RAYWAVE_SHADOWS)

#endif
