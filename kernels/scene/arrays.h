// SPDX-License-Identifier: Apache-2.0
// The scene's arrays as one bundle: how kernels declare them (SCENE_PARAMETERS, TREE_PARAMETERS),
// and what their functions receive. OpenCL C 1.2 allows no pointers in a struct that the host
// passes, so that each array is an argument of its own; DeviceScene::arguments() and
// DeviceTree::arguments() (host/trace/) pass them in the same order.
#ifndef RAYWAVE_ARRAYS_H
#define RAYWAVE_ARRAYS_H

#include "kernels/common/shared.h"
#include "kernels/scene/options.h"

// The trees of all instances, and the triangles of their leaves.
typedef struct {
  __global const BvhNode* nodes;
  __global const Triangle* triangles;
  __global const float* positions;  // 3 per vertex, frame of its instance
  __global const Instance* instances;
#if RAYWAVE_ALPHA
  // Arrays that alpha needs, as in SceneArrays
  __global const float* uvs;
  __global const float* colours;
  __global const Material* materials;
  __global const float* texels;
#endif
} Tree;

typedef struct {
  Tree tree;
  // 3 per vertex, unit length, outwards as the mesh says, frame of its instance
  __global const float* normals;
  __global const float* uvs;  // 2 per vertex; (0, 0) is the bottom left of the texture
  // COLOUR_FLOATS per vertex: colours and alpha; only where materials want them
  __global const float* colours;
  __global const Material* materials;
  __global const Light* lights;
  __global const float* texels;
  SceneLight light;
} SceneArrays;

#define TREE_PARAMETERS                                              \
  __global const BvhNode *nodes, __global const Triangle *triangles, \
      __global const float *positions, __global const Instance *instances
#define SCENE_PARAMETERS                                                     \
  TREE_PARAMETERS, __global const float *normals, __global const float *uvs, \
      __global const float *colours, __global const Material *materials,     \
      __global const Light *lights, __global const float *texels, SceneLight scene_light

// Initialisers of a Tree and of SceneArrays, in a kernel with these parameters.
#define TREE_OF_PARAMETERS \
  { nodes, triangles, positions, instances }
#if RAYWAVE_ALPHA
#define TREE_OF_SCENE_PARAMETERS \
  { nodes, triangles, positions, instances, uvs, colours, materials, texels }
#else
#define TREE_OF_SCENE_PARAMETERS TREE_OF_PARAMETERS
#endif
#define SCENE_OF_PARAMETERS \
  { TREE_OF_SCENE_PARAMETERS, normals, uvs, colours, materials, lights, texels, scene_light }

#endif
