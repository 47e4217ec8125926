// SPDX-License-Identifier: Apache-2.0
/// Meshes as read, and the one world mesh that all of a scene's objects become.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <vector>

#include "host/scene.hpp"

namespace raywave {

/// Triangles that index vertices; `normals` and `uvs` are empty or as long as `positions`.
struct Mesh {
  std::vector<glm::dvec3> positions;
  std::vector<glm::dvec3> normals;
  std::vector<glm::dvec2> uvs;  // (0, 0) is the bottom left of the texture
  std::vector<glm::uvec3> triangles;
};

/// Reads any format Assimp reads; all parts of the file merged, polygons triangulated, points, lines and triangles of no area dropped, node
/// transforms applied, vertices that agree in everything joined. Axes and numbers stay as in the file (in float, as Assimp keeps them).
///
/// throws  InputError, starting with `where`, when the file cannot be read, holds no triangle, or a vertex is NaN or infinite
Mesh load_mesh(const std::filesystem::path& file, Normals normals, const std::string& where);

/// The last step of load_mesh, on a mesh as a file has it, with zero for a normal that is missing: triangles of no area dropped, every
/// corner given its normal, and corners that agree in everything joined.
Mesh finish_mesh(Mesh raw, Normals normals);

/// A triangle that stands for a part of an object's surface: so many times its own area.
struct Facet {
  std::uint32_t triangle = 0;
  double share = 1;
};

/// Every object placed in the world (metres), one after the other. All vectors of a vertex are as long as `positions`.
struct World {
  std::vector<glm::dvec3> positions;
  std::vector<glm::vec3> normals;  // unit length, as oriented by the mesh; of the face where a vertex has none
  std::vector<glm::vec2> uvs;      // (0, 0) where a mesh has none
  std::vector<glm::uvec3> triangles;
  std::vector<std::int32_t> triangle_object;  // index into Scene::objects
  std::vector<bool>
      object_closed;  // per object: every edge shared by exactly two triangles in opposite directions (after welding equal positions)
  std::vector<Facet> facets;      // stand for all surfaces in sums over them; none: every triangle stands for itself
  glm::dvec3 min_m{0}, max_m{0};  // bounding box
};

/// Whether every edge is shared by exactly two triangles in opposite directions, after welding equal positions.
bool is_closed(const Mesh& mesh);

/// The meshes of a scene's objects, as read. Objects that name the same file and normals share one.
struct Meshes {
  std::vector<Mesh> meshes;
  std::vector<bool> closed;
  std::vector<std::size_t> of_object;  // index into `meshes`
};

/// throws  InputError when a mesh is unusable, or when the scene has no object
Meshes load_meshes(const Scene& scene);

/// Rotates, scales and places all objects.
///
/// throws  InputError when a width is asked of a mesh without x extent, or an object touches or lies behind the hologram plane (z <= 0)
World place_objects(const Scene& scene, const Meshes& meshes);

/// Moves all objects of a world that place_objects has made of these meshes to where the scene has them now.
///
/// throws  as place_objects; the world is then worth nothing until it has been moved again
void move_objects(const Scene& scene, const Meshes& meshes, World& world);

/// Reads the meshes and places all objects.
World build_world(const Scene& scene);

}  // namespace raywave
