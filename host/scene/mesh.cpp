// SPDX-License-Identifier: Apache-2.0
#include "host/scene/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <glm/geometric.hpp>
#include <map>
#include <numeric>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <string_view>
#include <tuple>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/common/threads.hpp"
#include "host/scene/gltf_motion.hpp"
#include "host/scene/reader_process.hpp"
#include "host/scene/reader_reply.hpp"
#include "host/scene/vectors.hpp"
#include "host/scene/weld.hpp"

namespace raywave {
namespace {

/// Normals at the welded positions: face normals weighted by the angle of the corner, which does
/// not depend on how a polygon was cut.
std::vector<glm::dvec3> smooth_normals(const Mesh& mesh) {
  const std::vector<std::uint32_t> weld = weld_positions(mesh.positions);
  std::vector<glm::dvec3> sum(mesh.positions.size(), glm::dvec3(0));
  for (const glm::uvec3& triangle : mesh.triangles) {
    const auto p = corners_of(mesh.positions, triangle);
    const glm::dvec3 normal = face_normal(p);
    for (int i = 0; i < 3; ++i) {
      const glm::dvec3 a = unit_or_zero(p[(i + 1) % 3] - p[i]),
                       b = unit_or_zero(p[(i + 2) % 3] - p[i]);
      sum[weld[triangle[i]]] += normal * std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
    }
  }
  std::vector<glm::dvec3> normals(mesh.positions.size());
  for (std::size_t i = 0; i < normals.size(); ++i) normals[i] = unit_or_zero(sum[weld[i]]);
  return normals;
}

}  // namespace

Mesh finish_mesh(Mesh raw, Normals mode) {
  std::vector<Mesh> one;
  one.push_back(std::move(raw));
  return finish_meshes(std::move(one), mode).first;
}

std::pair<Mesh, std::vector<MeshShape>> finish_meshes(std::vector<Mesh> all, Normals mode) {
  auto& raw = all.front();
  // Triangles with an area, and their materials
  std::size_t kept = 0;
  for (std::size_t i = 0; i < raw.triangles.size(); ++i) {
    const auto triangle = raw.triangles[i];
    if (std::all_of(all.begin(), all.end(), [&](const Mesh& one) {
          return face_normal(corners_of(one.positions, triangle)) == glm::dvec3(0);
        }))
      continue;
    raw.triangles[kept] = triangle;
    if (!raw.triangle_material.empty()) raw.triangle_material[kept] = raw.triangle_material[i];
    ++kept;
  }
  raw.triangles.resize(kept);
  if (!raw.triangle_material.empty()) raw.triangle_material.resize(kept);

  // Normals of the corners of a triangle, in each mesh
  std::vector<std::vector<glm::dvec3>> normals;
  for (auto& one : all) {
    if (&one != &raw) one.triangles = raw.triangles;
    normals.push_back(mode == Normals::smooth ? smooth_normals(one) : one.normals);
  }
  const auto corner_of = [&](std::size_t which, const glm::uvec3& triangle, int i) {
    const auto& of_file = normals[which][triangle[i]];
    const bool own = mode != Normals::flat && of_file != glm::dvec3(0);
    return std::pair(all[which].positions[triangle[i]],
                     own ? of_file : face_normal(corners_of(all[which].positions, triangle)));
  };

  Mesh mesh;
  std::vector<MeshShape> shapes(all.size() - 1);
  const std::size_t expected =
      mode == Normals::smooth ? raw.positions.size() : 3 * raw.triangles.size();
  const bool has_colours = !raw.colours.empty();
  Welder<8> welder(has_colours ? 0 : expected);
  Welder<12> coloured(has_colours ? expected : 0);
  // Corners that are equal so far may differ in the next mesh
  std::vector<std::unique_ptr<Welder<7>>> more;
  for (std::size_t k = 0; k < shapes.size(); ++k)
    more.push_back(std::make_unique<Welder<7>>(expected));
  for (const glm::uvec3& triangle : raw.triangles) {
    glm::uvec3 joined;
    for (int i = 0; i < 3; ++i) {
      const auto corner = corner_of(0, triangle, i);
      const auto &p = corner.first, &n = corner.second;
      const glm::dvec2 uv = raw.uvs[triangle[i]];
      const glm::vec4 c = has_colours ? raw.colours[triangle[i]] : glm::vec4(1);
      joined[i] = has_colours
                      ? coloured.id({p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y, c.r, c.g, c.b, c.a})
                      : welder.id({p.x, p.y, p.z, n.x, n.y, n.z, uv.x, uv.y});
      for (std::size_t k = 0; k < shapes.size(); ++k) {
        const auto other = corner_of(k + 1, triangle, i);
        const auto &q = other.first, &m = other.second;
        joined[i] = more[k]->id({static_cast<double>(joined[i]), q.x, q.y, q.z, m.x, m.y, m.z});
      }
      if (joined[i] < mesh.positions.size()) continue;
      mesh.positions.push_back(p);
      mesh.normals.push_back(n);
      mesh.uvs.push_back(uv);
      if (has_colours) mesh.colours.push_back(c);
      for (std::size_t k = 0; k < shapes.size(); ++k) {
        const auto other = corner_of(k + 1, triangle, i);
        shapes[k].positions.push_back(other.first);
        shapes[k].normals.push_back(other.second);
      }
    }
    mesh.triangles.push_back(joined);
  }
  mesh.triangle_material = std::move(raw.triangle_material);
  mesh.materials = std::move(raw.materials);
  mesh.pictures = std::move(raw.pictures);
  mesh.notes = std::move(raw.notes);
  return {std::move(mesh), std::move(shapes)};
}

void read_mesh_file(const std::filesystem::path& file, const std::string& what,
                    const std::vector<std::string>& more,
                    const std::function<void(ReaderPipe&)>& receive) {
  constexpr std::uintmax_t most_bytes = std::uintmax_t{2} << 30;
  const auto fail = [&](std::string_view why) {
    throw InputError(what + " " + in_quotes(file.string()) + ": " + one_line(why));
  };
  std::error_code error;
  if (!std::filesystem::is_regular_file(file, error)) fail("there is no such file");
  const std::uintmax_t bytes = std::filesystem::file_size(file, error);
  if (error || bytes > most_bytes) fail("larger than 2 GiB");

  const auto program = find_reader("raywave_mesh_reader");
  std::vector<std::string> arguments{file.string()};
  arguments.insert(arguments.end(), more.begin(), more.end());
  try {
    // Limits are generous: a text file of 100 MiB takes 10 s
    run_reader(program,
               {static_cast<unsigned>(2 + (bytes >> 20)), (std::uint64_t{1} << 30) + 64 * bytes},
               arguments, receive);
  } catch (const std::exception& failure) {
    fail(failure.what());
  }
}

namespace {

/// The mesh of a file as it is there.
///
/// more  of the reader's arguments
Mesh read_raw(const std::filesystem::path& file, const std::string& where,
              const std::vector<std::string>& more) {
  Mesh raw;
  read_mesh_file(file, where + ": mesh", more, [&](ReaderPipe& pipe) { raw = receive_mesh(pipe); });
  return raw;
}

void require_triangles(const Mesh& mesh, const std::filesystem::path& file,
                       const std::string& where) {
  if (mesh.triangles.empty())
    throw InputError(where + ": mesh " + in_quotes(file.string()) +
                     ": holds no triangle that has an area");
}

std::size_t count_of(const std::vector<std::uint32_t>& ids) {
  return ids.empty() ? 0 : std::size_t{1} + *std::max_element(ids.begin(), ids.end());
}

/// True where corners lie together in either mesh that lie apart in the other. A surface that tears
/// comes apart in one only, so that the triangles are in another order. Files without shared
/// vertices have triangles that are equal by their numbers, whatever their order.
bool are_in_another_order(const Mesh& a, const Mesh& b) {
  const auto of_a = weld_positions(a.positions), of_b = weld_positions(b.positions);
  Welder<2> both(of_a.size());
  std::vector<std::uint32_t> of_both;
  for (std::size_t i = 0; i < of_a.size(); ++i)
    of_both.push_back(both.id({double{1} * of_a[i], double{1} * of_b[i]}));
  return count_of(of_both) > std::max(count_of(of_a), count_of(of_b));
}

/// The mesh of an object and those that it can become.
std::pair<Mesh, std::vector<MeshShape>> load_shapes(const Object& object) {
  std::map<std::filesystem::path, std::size_t> place;  // of each file in `raw`, once
  std::vector<Mesh> raw;
  std::vector<std::size_t> of_key;
  const auto add = [&](const std::filesystem::path& file) {
    const auto [known, is_new] = place.try_emplace(file, raw.size());
    if (!is_new) return known->second;
    raw.push_back(read_raw(file, object.where, {}));
    const auto &first = raw.front(), &last = raw.back();
    const auto refuse = [&](const std::string& what) {
      throw InputError(
          object.where + ": mesh " + in_quotes(file.string()) + " of its track: " + what + " " +
          in_quotes(object.mesh.string()) +
          "; all meshes that an object becomes must have the same triangles, in one order");
    };
    if (last.triangles.size() != first.triangles.size())
      refuse("has " + std::to_string(last.triangles.size()) + " triangles, and not the " +
             std::to_string(first.triangles.size()) + " of");
    if (last.triangles != first.triangles || are_in_another_order(first, last))
      refuse("its triangles join other vertices than those of");
    return known->second;
  };
  add(object.mesh);
  for (const auto& file : object.shapes) of_key.push_back(add(file));
  auto [mesh, distinct] = finish_meshes(std::move(raw), object.normals);
  require_triangles(mesh, object.mesh, object.where);
  std::vector<MeshShape> shapes;
  for (const auto number : of_key)
    shapes.push_back(number > 0 ? distinct[number - 1] : MeshShape{mesh.positions, mesh.normals});
  return {std::move(mesh), std::move(shapes)};
}

}  // namespace

Mesh part_of_nodes(const Mesh& raw, const std::vector<std::int32_t>& nodes) {
  if (raw.triangle_node.size() != raw.triangles.size())
    throw std::logic_error("the nodes of the mesh have not been read");
  const std::set<std::int32_t> wanted(nodes.begin(), nodes.end());
  Mesh part;
  part.positions = raw.positions;  // those that no triangle names are dropped when it is finished
  part.normals = raw.normals;
  part.uvs = raw.uvs;
  part.colours = raw.colours;
  part.notes = raw.notes;
  std::vector<std::int32_t> material(raw.materials.size(), -1), picture(raw.pictures.size(), -1);
  const auto keep_picture = [&](MeshMap& map) {
    if (map.picture < 0) return;
    const auto number = static_cast<std::size_t>(map.picture);
    if (picture[number] < 0) {
      picture[number] = static_cast<std::int32_t>(part.pictures.size());
      part.pictures.push_back(raw.pictures[number]);
    }
    map.picture = picture[number];
  };
  const auto kept_material = [&](std::int32_t from) {
    if (from < 0) return from;
    auto& kept = material[static_cast<std::size_t>(from)];
    if (kept >= 0) return kept;
    kept = static_cast<std::int32_t>(part.materials.size());
    part.materials.push_back(raw.materials[static_cast<std::size_t>(from)]);
    auto& look = part.materials.back().look;
    for (auto* map : {&look.base_map, &look.metallic_map, &look.emission_map, &look.normal_map,
                      &look.alpha_map})
      keep_picture(*map);
    return kept;
  };
  for (const auto& one : raw.deforming)
    if (wanted.contains(one.node)) part.deforming.push_back(one);
  for (std::size_t i = 0; i < raw.triangles.size(); ++i) {
    if (!wanted.contains(raw.triangle_node[i])) continue;
    part.triangles.push_back(raw.triangles[i]);
    if (!raw.triangle_material.empty())
      part.triangle_material.push_back(kept_material(raw.triangle_material[i]));
  }
  return part;
}

Mesh load_mesh(const std::filesystem::path& file, Normals normals, const std::string& where) {
  auto mesh = finish_mesh(read_raw(file, where, {}), normals);
  require_triangles(mesh, file, where);
  return mesh;
}

bool is_closed(const Mesh& mesh) {
  const std::vector<std::uint32_t> weld = weld_positions(mesh.positions);
  // The ends of the edges from each vertex, vertex by vertex
  std::vector<std::size_t> end_of(count_of(weld) + 1);
  for (const glm::uvec3& triangle : mesh.triangles)
    for (int i = 0; i < 3; ++i) ++end_of[weld[triangle[i]] + 1];
  std::partial_sum(end_of.begin(), end_of.end(), end_of.begin());
  std::vector<std::uint32_t> ends(3 * mesh.triangles.size());
  for (const glm::uvec3& triangle : mesh.triangles)
    for (int i = 0; i < 3; ++i) ends[end_of[weld[triangle[i]]]++] = weld[triangle[(i + 1) % 3]];
  const auto from = [&](std::size_t vertex) {
    const auto first = vertex > 0 ? end_of[vertex - 1] : 0;
    return std::span(ends).subspan(first, end_of[vertex] - first);
  };
  const auto vertices = end_of.size() - 1;
  for (std::size_t vertex = 0; vertex < vertices; ++vertex) {
    std::sort(from(vertex).begin(), from(vertex).end());
    if (std::adjacent_find(from(vertex).begin(), from(vertex).end()) != from(vertex).end())
      return false;
  }
  for (std::size_t vertex = 0; vertex < vertices; ++vertex)
    for (const auto end : from(vertex))
      if (!std::binary_search(from(end).begin(), from(end).end(),
                              static_cast<std::uint32_t>(vertex)))
        return false;
  return true;
}

namespace {

using MeshKey = std::tuple<std::filesystem::path, Normals, std::vector<std::int32_t>,
                           std::vector<std::filesystem::path>>;

MeshKey key_of(const Object& object) {
  std::error_code error;
  return {std::filesystem::weakly_canonical(object.mesh, error), object.normals, object.nodes,
          object.shapes};
}

/// A file that is a mesh as a whole.
struct WholeFile {
  const Object* first;  // that names it
  Mesh mesh{};
  bool closed = false;
  std::exception_ptr failure{};
};

/// Reads and finishes, side by side, the files of objects that are no part of a file, do not deform
/// and are not in memory. Failures wait for the object's turn.
std::map<MeshKey, WholeFile> load_whole_files(
    const Scene& scene, std::span<const std::shared_ptr<const Mesh>> in_memory) {
  std::map<MeshKey, WholeFile> files;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const auto& object = scene.objects[i];
    const bool is_given = i < in_memory.size() && in_memory[i];
    if (!is_given && !object.mesh.empty() && object.nodes.empty() && object.shapes.empty())
      files.try_emplace(key_of(object), WholeFile{&object});
  }
  std::vector<WholeFile*> all;
  for (auto& [key, file] : files) all.push_back(&file);
  auto& threads = cl::Threads::shared();
  threads.for_each(std::min(threads.count(), all.size()), all.size(), 1,
                   [&](std::size_t, std::size_t i) {
                     auto& file = *all[i];
                     try {
                       const auto& object = *file.first;
                       file.mesh = load_mesh(object.mesh, object.normals, object.where);
                       file.closed = is_closed(file.mesh);
                     } catch (...) {
                       file.failure = std::current_exception();
                     }
                   });
  return files;
}

}  // namespace

Meshes load_meshes(const Scene& scene, std::span<const std::shared_ptr<const Mesh>> in_memory) {
  if (scene.objects.empty())
    throw InputError(one_line(scene.file.string()) +
                     ": there is no object: add [[object]] with mesh = \"FILE\"");
  Meshes loaded;
  auto whole_files = load_whole_files(scene, in_memory);
  std::map<MeshKey, std::size_t> known_files;
  std::map<std::filesystem::path, Mesh> known_raw;  // of which objects are parts
  std::map<std::pair<const Mesh*, Normals>, std::size_t> known_in_memory;
  const auto add = [&](Mesh mesh, std::vector<MeshShape> shapes = {},
                       std::optional<bool> closed = {}) {
    loaded.meshes.push_back(std::move(mesh));
    loaded.shapes.push_back(std::move(shapes));
    loaded.closed.push_back(closed ? *closed : is_closed(loaded.meshes.back()));
    loaded.maps.emplace_back();
    loaded.deforming.emplace_back();
  };
  const auto wear = [&](const Object& object, std::size_t index) {
    loaded.of_object.push_back(index);
    const auto& mesh = loaded.meshes[index];
    auto& maps = loaded.maps[index];
    if (wears_own_materials(object) && maps.empty() && !mesh.materials.empty())
      maps = load_maps(mesh, object.mesh, scene.channels(),
                       object.where + ": mesh " + in_quotes(object.mesh.string()));
  };
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Object& object = scene.objects[i];
    const auto next = loaded.meshes.size();
    if (const Mesh* given = i < in_memory.size() ? in_memory[i].get() : nullptr) {
      const auto [found, is_new] = known_in_memory.try_emplace({given, object.normals}, next);
      if (is_new) add(finish_mesh(*given, object.normals));
      wear(object, found->second);
      continue;
    }
    if (object.mesh.empty()) throw InputError(object.where + ": mesh is missing");
    const auto key = key_of(object);
    const auto [found, is_new] = known_files.try_emplace(key, next);
    if (is_new && !object.shapes.empty()) {
      if (!object.nodes.empty())
        throw InputError(object.where + ": it moves as its glTF file says, and has no meshes");
      auto [mesh, shapes] = load_shapes(object);
      add(std::move(mesh), std::move(shapes));
    } else if (is_new && object.nodes.empty()) {
      auto& file = whole_files.at(key);
      if (file.failure) std::rethrow_exception(file.failure);
      add(std::move(file.mesh), {}, file.closed);
    } else if (is_new) {
      auto& raw = known_raw[object.mesh];
      if (raw.triangles.empty()) raw = read_raw(object.mesh, object.where, {"nodes"});
      auto part = part_of_nodes(raw, object.nodes);
      if (object.deforms) {
        auto [mesh, deforming] = finish_deforming(std::move(part));
        add(std::move(mesh));
        loaded.deforming.back() = std::make_shared<const DeformingMesh>(std::move(deforming));
      } else {
        add(finish_mesh(std::move(part), object.normals));
      }
      require_triangles(loaded.meshes.back(), object.mesh, object.where);
    }
    wear(object, found->second);
  }
  return loaded;
}

}  // namespace raywave
