// SPDX-License-Identifier: Apache-2.0
/// The one world mesh that all of a scene's objects become.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host/geometry/deform.hpp"
#include "host/geometry/motion.hpp"
#include "host/geometry/ray_tree.hpp"
#include "host/geometry/vertex_tree.hpp"
#include "host/scene/files.hpp"
#include "host/scene/mesh.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// A triangle that stands for a part of its object's surface, as the object was placed.
struct AreaSample {
  std::size_t triangle = 0;
  double share = 1;            // of the surface: so many times the triangle's area
  glm::dvec3 normal_m2{0};     // as long as twice the triangle's area
  glm::dvec3 corner_sum_m{0};  // the sum of the corners, three times the centre
};

/// An object's vertices, which follow each other, and how place_objects has placed them. Of one
/// that deforms, box and tree are those of its vertices as they are now.
struct PlacedObject {
  std::size_t first_vertex = 0, vertices = 0, first_triangle = 0, triangles = 0;
  glm::dvec3 position_m{0}, rotation_deg{0};
  std::optional<double> width_m;
  double unit_m = 1;  // length of a mesh unit
  glm::dvec3 min_m{0}, max_m{0};
  bool is_cut = false;  // a part of it lay nearer than Object::cut_m, and is not there
  VertexTree tree;
  std::shared_ptr<const Deforming> deforming;  // null: it never has deformed
  std::optional<double> shape;                 // Object::shape of its vertices
  std::uint64_t version = 0;                   // of its vertices: another one whenever they change
  bool seams_hold = true;  // vertices that lay at one place when it was placed still do

  /// Those of its vertices, of a vector of the world.
  template <class Vectors>
  auto own(Vectors& all) const {
    return std::span(all).subspan(first_vertex, vertices);
  }
};

/// The materials that an object's mesh brings.
struct FoundMaterials {
  struct Found {
    std::string name, description;
    std::size_t triangles = 0;
    std::vector<std::string> notes;
  };
  std::vector<Found> materials;    // that the object has
  std::size_t overridden = 0;      // the mesh has so many, and the scene names another
  std::vector<std::string> notes;  // about the mesh as a whole
};

/// Every object placed in the world (metres), one after the other. All vectors of a vertex are as
/// long as `positions`. Vertices and normals stay where they were placed, but for those of objects
/// that deform; `motions` says where they are now.
struct World {
  std::vector<glm::dvec3> positions;
  // Unit length, as oriented by the mesh; of the face where a vertex has none
  std::vector<glm::vec3> normals;
  std::vector<glm::vec2> uvs;  // (0, 0) where a mesh has none
  // Colour and alpha; in scenes of one wavelength, red, green and blue are its channel. Empty: no
  // mesh that wears its own has any
  std::vector<glm::vec4> colours;
  std::vector<glm::uvec3> triangles;
  std::vector<std::int32_t> triangle_object;  // index into Scene::objects
  // Index into `materials`; -1: the material that the scene gives the object. Empty: all are -1
  std::vector<std::int32_t> triangle_material;
  // Per object: every edge is shared by exactly two triangles in opposite directions (after welding
  // equal positions)
  std::vector<bool> object_closed;
  // Per object, for sums over its surface; none: every triangle stands for itself
  std::vector<std::vector<AreaSample>> area_samples;
  std::vector<PlacedObject> placed;  // per object; none in worlds that place_objects has not made
  std::vector<Motion> motions;       // per object; none: nothing has moved
  Textures textures;                 // of the scene's materials
  std::vector<Material> materials;   // that objects' meshes bring
  std::vector<MaterialMaps> maps;    // of `materials`
  // What was found of them, per object: lines for `raywave plan`, and what is approximated or
  // ignored
  std::vector<FoundMaterials> found;
  // For rays on the host; in scenes with mirrors or glass only
  std::shared_ptr<const RayTree> ray_tree;
  glm::dvec3 min_m{0}, max_m{0};  // bounding box, as everything is now

  Motion motion_of(std::int32_t object) const {
    return motions.empty() ? Motion{} : motions[static_cast<std::size_t>(object)];
  }
  /// Index of a triangle's material into `materials`; -1: that of its object.
  std::int32_t material_of(std::size_t triangle) const {
    return triangle_material.empty() ? -1 : triangle_material[triangle];
  }
  /// A triangle's corners after its object's motion.
  std::array<glm::dvec3, 3> corners_m(std::size_t triangle) const;
};

/// True for objects before the hologram, z < 0; of one that crosses its plane, either.
bool lies_before(const World& world, std::size_t object);

/// Smallest distance of a surface from the hologram's plane, 0 where one crosses it; of objects on
/// both sides, that of their vertices.
double closest_m(const World& world);

/// Middle of everything as it is now: origin of the frame in which a scene that is built here is
/// traced.
glm::dvec3 middle_of(const World& world);

/// A triangle as an area sample.
AreaSample area_sample(const World& world, std::size_t triangle, double share);

/// All notes about the materials of meshes, a line each: "object 0: material "gold": ...".
std::vector<std::string> material_notes(const Scene& scene, const World& world);

/// A tree for rays on the host: RayTree::nearest takes the world's motions.
RayTree ray_tree_of(const World& world);

/// Turns about x, then y, then z (Object::rotation_deg).
glm::dmat3 rotation_xyz(const glm::dvec3& degrees);

/// Positions of all vertices after their objects' motions.
std::vector<glm::dvec3> positions_now(const World& world);

/// Normals of all vertices after their objects' motions.
std::vector<glm::vec3> normals_now(const World& world);

/// Rotates, scales and places all objects.
///
/// throws  InputError when a width is asked of a mesh without x extent
World place_objects(const Scene& scene, const Meshes& meshes, Textures textures = {});

/// Gives an object other vertices; all that follows from them is made anew: boxes and trees by
/// refitting, area samples, and whether it is closed, which it is no more where vertices of one
/// place have parted. The pose stays.
///
/// positions_m  as many as the object has, in their order, where place_objects would put them
/// normals      unit length
/// throws       InputError when a number is not finite, the numbers do not match, or a part of the
///              object is cut away: the world stays as it is
void set_vertices(World& world, std::size_t object, std::span<const glm::dvec3> positions_m,
                  std::span<const glm::vec3> normals);

/// Moves all objects of a world that place_objects has made to their positions in the scene, and
/// gives them their shapes: sets the world's motions and its bounding box.
///
/// throws    as place_objects, and when an object of which a part is cut away moves, or one moves
///           nearer than its cut; the world must not be used until another move has succeeded
/// accuracy  equal to a world placed there to a few roundings of the objects' sizes and distances
void move_objects(const Scene& scene, World& world);

/// Refuses a pose that move_objects would refuse; the world stays as it is.
///
/// object  how the object with this index would be
/// throws  as move_objects
void require_pose(const World& world, std::size_t index, const Object& object);

/// Reads meshes and textures, and places all objects.
World build_world(const Scene& scene);

}  // namespace raywave
