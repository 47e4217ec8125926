// SPDX-License-Identifier: Apache-2.0
/// Meshes as their files hold them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "host/scene/mesh_materials.hpp"
#include "host/scene/read_data.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

class ReaderPipe;
struct DeformingMesh;

/// Reads a mesh file. Merges all parts, applies node transforms, triangulates polygons, drops
/// points, lines and triangles without area, and joins equal vertices.
/// Axes and numbers stay as in the file (in float, as Assimp keeps them).
///
/// throws  InputError, starting with `where`, when the file cannot be read, holds no triangle, or a
///         vertex is NaN or infinite
Mesh load_mesh(const std::filesystem::path& file, Normals normals, const std::string& where);

/// Starts the reader of mesh files.
///
/// what     the start of messages, which goes on with the file's name: "scene.toml:4: object 0:
///          mesh"
/// more     arguments of the reader behind the file
/// receive  called with the pipe once the reader has a result
/// throws   InputError when there is no such file, it is larger than 2 GiB, or the reader fails
void read_mesh_file(const std::filesystem::path& file, const std::string& what,
                    const std::vector<std::string>& more,
                    const std::function<void(ReaderPipe&)>& receive);

/// The last step of load_mesh: drops triangles without area, gives every corner its normal, and
/// joins equal corners. Materials and pictures stay as they are. `raw` holds the mesh as in the
/// file, with a normal of zero where the file has none.
Mesh finish_mesh(Mesh raw, Normals normals);

/// The triangles of some nodes of a glTF file, with the materials and pictures that they wear.
///
/// raw    with Mesh::triangle_node
/// nodes  their numbers in the file
Mesh part_of_nodes(const Mesh& raw, const std::vector<std::int32_t>& nodes);

/// Returns true when every edge, after welding equal positions, is shared by exactly two triangles
/// in opposite directions.
bool is_closed(const Mesh& mesh);

/// finish_mesh, of a mesh and others that it can become: corners are joined where they are equal in
/// all of them, and triangles dropped that have an area in none.
///
/// raw  the mesh, then the others; all with the same triangles
std::pair<Mesh, std::vector<MeshShape>> finish_meshes(std::vector<Mesh> raw, Normals mode);

/// The meshes of a scene's objects, as read. Objects that name the same file and normals share one.
struct Meshes {
  std::vector<Mesh> meshes;
  std::vector<bool> closed;
  std::vector<std::size_t> of_object;  // index into `meshes`
  // Of each mesh's materials, for the wavelength of the scene that they were read for; empty where
  // a mesh has none, or no object wears them
  std::vector<std::vector<MaterialMaps>> maps{};
  std::vector<std::vector<MeshShape>> shapes{};  // of each mesh: Object::shapes
  // Of each mesh: how it follows a glTF file's nodes; null: it does not
  std::vector<std::shared_ptr<const DeformingMesh>> deforming{};
};

/// True when an object wears what its mesh brings: the scene names no material for it.
inline bool wears_own_materials(const Object& object) { return object.material == 0; }

/// Reads the meshes of all objects, and the pictures of the materials that objects wear.
///
/// in_memory  by object, meshes that stand for files, null where there is none: raw, as finish_mesh
///            takes them
/// throws     InputError when a mesh or a picture of it is unusable, or when the scene has no
///            object, or meshes of an object differ in their triangles
Meshes load_meshes(const Scene& scene, std::span<const std::shared_ptr<const Mesh>> in_memory = {});

}  // namespace raywave
