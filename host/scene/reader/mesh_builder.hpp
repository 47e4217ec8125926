// SPDX-License-Identifier: Apache-2.0
/// What the readers of OBJ, PLY, STL and OFF share: a mesh that grows, and its notes.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "host/common/error.hpp"
#include "host/scene/points.hpp"
#include "host/scene/read_data.hpp"

namespace raywave {

/// Notes about a file: equal ones become one, which names the first place.
class Notes {
public:
  void add(const std::string& what, const std::string& where);
  /// No more than a reply may hold.
  std::vector<std::string> take();

private:
  struct Note {
    std::string what, where;
    std::size_t count = 0;
  };
  std::vector<Note> notes_;
  std::map<std::string, std::size_t> number_;
};

class MeshBuilder {
public:
  using Where = std::function<std::string()>;  // names a place in the file

  Mesh mesh;
  Notes notes;
  std::uint32_t counted_from = 0;  // vertices, in the file

  void reserve_vertices(std::size_t count);
  /// Returns the vertex's number. `normal` may have any length.
  ///
  /// throws  InputError for what is no place, or more vertices than a file may have
  std::uint32_t add_vertex(const glm::dvec3& position, const glm::dvec3& normal,
                           const glm::dvec2& uv, const Where& where);
  /// A polygon of any size. One with fewer than three corners becomes a note.
  ///
  /// corners   numbers of vertices
  /// material  of Mesh::materials; -1: none
  /// throws    InputError for vertices that are not there and outlines that cross themselves
  void add_face(std::span<const std::uint32_t> corners, std::int32_t material, const Where& where);
  /// Gives the vertices their colours, sRGB in the file's numbers; triangles without a material get
  /// a white one that shows them.
  ///
  /// colours  those that are missing are white; an alpha of NaN is 1
  /// scale    the number of the brightest colour: brightest_of
  void set_colours(std::vector<glm::vec4> colours, float scale);
  /// The same of triangles, which get vertices of their own.
  void set_triangle_colours(std::vector<glm::vec4> colours, float scale);

  /// The mesh, with the notes.
  /// throws  InputError where it holds no triangle
  Mesh finish();

private:
  std::vector<glm::dvec3> corners_;
  std::vector<glm::uvec3> triangles_;
};

/// Brightest number of colours that are 0 to 1, 0 to 255 and so on: the least of them that none of
/// red, green and blue exceeds.
float brightest_of(std::span<const glm::vec4> colours);

/// Makes materials opaque where all of them say that nothing is seen, as those of tools that mean
/// the opposite: MTL's Tr, Collada's transparency.
///
/// said     what says so: "Tr 1 or d 0"
/// returns  a note for the file; empty: nothing is changed
std::string keep_visible(std::vector<MeshMaterial>& materials, const std::string& said);

/// Number of the material in the mesh, which gets it.
///
/// throws  InputError for more materials than a file may have
std::int32_t add_material(Mesh& mesh, MeshMaterial material);

/// Number of the picture of this name in the mesh, which it gets unless there are too many: -1.
std::int32_t add_picture(Mesh& mesh, const std::string& name);

}  // namespace raywave
