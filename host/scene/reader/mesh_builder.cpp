// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader/mesh_builder.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/scene/reader/mesh_polygon.hpp"
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader_reply.hpp"
#include "host/scene/vectors.hpp"

namespace raywave {

void Notes::add(const std::string& what, const std::string& where) {
  const auto [known, is_new] = number_.try_emplace(what, notes_.size());
  if (is_new && notes_.size() >= most_notes_of_file) {
    number_.erase(known);
    return;
  }
  if (is_new) notes_.push_back({what, where, 0});
  ++notes_[known->second].count;
}

std::vector<std::string> Notes::take() {
  std::vector<std::string> texts;
  for (const auto& note : notes_) {
    auto text = (note.where.empty() ? "" : note.where + ": ") + note.what;
    if (note.count > 1) text += " (" + std::to_string(note.count) + " times)";
    text.resize(std::min(text.size(), longest_text));
    texts.push_back(std::move(text));
  }
  return texts;
}

void MeshBuilder::reserve_vertices(std::size_t count) {
  mesh.positions.reserve(count);
  mesh.normals.reserve(count);
  mesh.uvs.reserve(count);
}

std::uint32_t MeshBuilder::add_vertex(const glm::dvec3& position, const glm::dvec3& normal,
                                      const glm::dvec2& uv, const Where& where) {
  if (!is_position(position)) throw InputError(where() + ": a vertex is NaN or infinite");
  require_at_most(mesh.positions.size() + 1, most_vertices_of_file, "vertices");
  mesh.positions.push_back(position);
  mesh.normals.push_back(unit_or_zero(normal));
  mesh.uvs.push_back(std::isfinite(uv.x + uv.y) ? uv : glm::dvec2(0));
  return static_cast<std::uint32_t>(mesh.positions.size() - 1);
}

void MeshBuilder::add_face(std::span<const std::uint32_t> corners, std::int32_t material,
                           const Where& where) {
  if (corners.size() < 3) {
    notes.add("a face of fewer than three corners is left out", where());
    return;
  }
  for (const auto corner : corners)
    if (corner >= mesh.positions.size())
      throw InputError(where() + ": a face names a vertex that is not there: number " +
                       std::to_string(corner + std::size_t{counted_from}) + ", counted from " +
                       std::to_string(counted_from) + ", of " +
                       std::to_string(mesh.positions.size()));
  if (mesh.triangles.size() + corners.size() > most_triangles_of_file + 2)
    throw InputError("more than " + std::to_string(most_triangles_of_file) + " triangles");
  const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.triangles.emplace_back(a, b, c);
    mesh.triangle_material.push_back(material);
  };
  if (corners.size() == 3) return add(corners[0], corners[1], corners[2]);
  corners_.clear();
  for (const auto corner : corners) corners_.push_back(mesh.positions[corner]);
  const auto cut = cut_polygon(corners_, triangles_);
  if (cut == Cut::crossing)
    throw InputError(where() + ": the outline of a face of " + std::to_string(corners.size()) +
                     " corners crosses itself; triangulate it in the program that made it");
  if (cut == Cut::twisted)
    notes.add("a twisted face of four corners is cut along its shorter diagonal", where());
  for (const auto& t : triangles_) add(corners[t.x], corners[t.y], corners[t.z]);
}

void MeshBuilder::set_colours(std::vector<glm::vec4> colours, float scale) {
  for (auto& c : colours) {
    c /= scale;
    if (std::isnan(c.w)) c.w = 1;
    if (!std::isfinite(c.x + c.y + c.z + c.w)) c = glm::vec4(1);
    c = linear_colour_from_srgb(c);
  }
  colours.resize(mesh.positions.size(), glm::vec4(1));
  mesh.colours = std::move(colours);
  for (auto& material : mesh.materials) material.look.vertex_colours = 1;
  auto& worn = mesh.triangle_material;
  if (std::find(worn.begin(), worn.end(), -1) == worn.end()) return;
  std::replace(worn.begin(), worn.end(), -1, static_cast<std::int32_t>(mesh.materials.size()));
  mesh.materials.push_back(coloured_material("colours of vertices"));
}

void MeshBuilder::set_triangle_colours(std::vector<glm::vec4> colours, float scale) {
  colours.resize(mesh.triangles.size(), glm::vec4(scale));
  const auto positions = std::move(mesh.positions), normals = std::move(mesh.normals);
  const auto uvs = std::move(mesh.uvs);
  mesh.positions.clear();
  mesh.normals.clear();
  mesh.uvs.clear();
  std::vector<glm::vec4> of_vertices;
  for (std::size_t i = 0; i < colours.size(); ++i)
    for (int k = 0; k < 3; ++k) {
      auto& corner = mesh.triangles[i][k];
      mesh.positions.push_back(positions[corner]);
      mesh.normals.push_back(normals[corner]);
      mesh.uvs.push_back(uvs[corner]);
      of_vertices.push_back(colours[i]);
      corner = static_cast<std::uint32_t>(of_vertices.size() - 1);
    }
  set_colours(std::move(of_vertices), scale);
}

Mesh MeshBuilder::finish() {
  if (mesh.triangles.empty()) throw InputError("holds no triangle");
  if (mesh.materials.empty()) mesh.triangle_material.clear();
  mesh.notes = notes.take();
  return std::move(mesh);
}

float brightest_of(std::span<const glm::vec4> colours) {
  float largest = 0;
  for (const auto& c : colours) largest = std::max({largest, c.x, c.y, c.z});
  for (const float scale : {1.0f, 255.0f, 65535.0f})
    if (largest <= scale) return scale;
  return 4294967295.0f;
}

std::string keep_visible(std::vector<MeshMaterial>& materials, const std::string& said) {
  const auto hides = [](const MeshMaterial& one) { return one.look.alpha == 0; };
  if (materials.empty()) return {};
  const bool hides_all = std::all_of(materials.begin(), materials.end(), hides);
  for (auto& one : materials) {
    if (!hides(one)) continue;
    if (!hides_all && one.notes.size() < most_notes_of_file)
      one.notes.push_back(said + " shows nothing of it");
    if (!hides_all) continue;
    one.look.alpha = 1;
    if (one.look.alpha_map.picture < 0) one.look.alpha_mode = AlphaMode::opaque;
  }
  if (!hides_all) return {};
  return "every material has " + said +
         ", which shows nothing: they are taken as opaque (some tools write the opposite)";
}

std::int32_t add_material(Mesh& mesh, MeshMaterial material) {
  require_at_most(mesh.materials.size() + 1, most_materials_of_file, "materials");
  mesh.materials.push_back(std::move(material));
  return static_cast<std::int32_t>(mesh.materials.size() - 1);
}

std::int32_t add_picture(Mesh& mesh, const std::string& name) {
  const auto cut = name.substr(0, longest_text);
  for (std::size_t i = 0; i < mesh.pictures.size(); ++i)
    if (mesh.pictures[i].name == cut) return static_cast<std::int32_t>(i);
  if (mesh.pictures.size() >= most_pictures_of_file) return -1;
  mesh.pictures.push_back({cut, {}});
  return static_cast<std::int32_t>(mesh.pictures.size() - 1);
}

}  // namespace raywave
