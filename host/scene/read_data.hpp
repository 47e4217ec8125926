// SPDX-License-Identifier: Apache-2.0
/// What readers of files return: a mesh, a picture.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

namespace raywave {

/// Triangles that index vertices; `normals` and `uvs` are empty or as long as `positions`.
struct Mesh {
  std::vector<glm::dvec3> positions;
  std::vector<glm::dvec3> normals;
  std::vector<glm::dvec2> uvs;  // (0, 0) is the bottom left of the texture
  std::vector<glm::uvec3> triangles;
};

/// One channel of a picture, linear light, row-major.
struct Image {
  int width = 0, height = 0;
  std::vector<float> pixels;
};

}  // namespace raywave
