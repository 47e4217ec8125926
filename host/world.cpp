// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <map>
#include <utility>

#include "cl/threads.hpp"
#include "host/error.hpp"
#include "host/mesh.hpp"
#include "host/text.hpp"
#include "host/weld.hpp"

namespace raywave {
namespace {

constexpr double kSmallestObject_m = 1e-10, kLargestObject_m = 1e4;
constexpr std::size_t kMaxTriangles = 500'000'000;
constexpr std::size_t most_facets = 1 << 16;

struct Box {
  glm::dvec3 min{INFINITY}, max{-INFINITY};
  void add(const glm::dvec3& p) {
    min = glm::min(min, p);
    max = glm::max(max, p);
  }
  void add(const Box& other) {
    min = glm::min(min, other.min);
    max = glm::max(max, other.max);
  }
  glm::dvec3 size() const { return max - min; }
  glm::dvec3 centre() const { return min + 0.5 * size(); }
};

glm::dmat3 rotation_xyz(const glm::dvec3& degrees) {
  const auto about = [](double angle_deg, const glm::dvec3& axis) {
    return glm::dmat3(glm::rotate(glm::dmat4(1), glm::radians(std::remainder(angle_deg, 360.0)), axis));
  };
  return about(degrees.z, {0, 0, 1}) * about(degrees.y, {0, 1, 0}) * about(degrees.x, {1, 0, 0});
}

/// Of points after a turn. Side by side, which the compiler makes vectors of: frames of a scene that moves wait for it.
Box turned_box(const glm::dmat3& rotation, const glm::dvec3* points, std::size_t count) {
  constexpr std::size_t lanes = 8;
  double low[3][lanes], high[3][lanes];
  std::fill_n(&low[0][0], 3 * lanes, INFINITY);
  std::fill_n(&high[0][0], 3 * lanes, -INFINITY);
  for (std::size_t first = 0; first < count; first += lanes) {
    double p[3][lanes];
    for (std::size_t i = 0; i < lanes; ++i) {
      const auto& point = points[std::min(first + i, count - 1)];
      for (int axis = 0; axis < 3; ++axis) p[axis][i] = point[axis];
    }
    for (int axis = 0; axis < 3; ++axis) {
      const double x = rotation[0][axis], y = rotation[1][axis], z = rotation[2][axis];
      for (std::size_t i = 0; i < lanes; ++i) {
        const double at = x * p[0][i] + y * p[1][i] + z * p[2][i];
        low[axis][i] = at < low[axis][i] ? at : low[axis][i];
        high[axis][i] = at > high[axis][i] ? at : high[axis][i];
      }
    }
  }
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.min[axis] = *std::min_element(low[axis], low[axis] + lanes);
    box.max[axis] = *std::max_element(high[axis], high[axis] + lanes);
  }
  return box;
}

/// Metres per mesh unit.
double scale_of(const Object& object, const Box& rotated) {
  const glm::dvec3 size = rotated.size();
  const double largest = std::max({size.x, size.y, size.z});
  if (object.width_m && size.x <= 1e-9 * largest)
    throw InputError(object.where + ": width cannot be reached, because the mesh has no extent in x after rotation; turn it or omit width");
  const double scale = object.width_m ? *object.width_m / size.x : 1;
  if (const double largest_m = largest * scale; !(largest_m >= kSmallestObject_m && largest_m <= kLargestObject_m))
    throw InputError(object.where + ": the mesh would be " + length_text(largest_m) + " large, and must be " +
                     length_text(kSmallestObject_m) + " to " + length_text(kLargestObject_m) + "; give a width");
  return scale;
}

/// Triangles that stand for all of a mesh, drawn by area at even steps through the list; all of them where they are few.
std::vector<Facet> facets_of(const Mesh& mesh) {
  const auto count = mesh.triangles.size();
  std::vector<double> area(count, 1);
  double whole = static_cast<double>(count);
  if (count > most_facets) {
    whole = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto t = mesh.triangles[i];
      const auto& a = mesh.positions[t.x];
      area[i] = glm::length(glm::cross(mesh.positions[t.y] - a, mesh.positions[t.z] - a));
      whole += area[i];
    }
  }
  const auto wanted = std::min(count, most_facets);
  const double step = whole / static_cast<double>(wanted);
  std::vector<Facet> facets;
  double reached = 0;
  std::size_t drawn = 0;
  for (std::size_t i = 0; i < count; ++i) {
    reached += area[i];
    const auto last = std::min(static_cast<std::size_t>(reached / step + 0.5), wanted);
    if (last <= drawn) continue;
    facets.push_back({static_cast<std::uint32_t>(i), static_cast<double>(last - drawn) * step / area[i]});
    drawn = last;
  }
  return facets;
}

/// Adds an object's vertices and triangles, its vertices nowhere yet.
void add(std::int32_t index, const Object& object, const Mesh& mesh, World& world) {
  if (world.triangles.size() + mesh.triangles.size() > kMaxTriangles)
    throw InputError(object.where + ": with it the scene has more than " + std::to_string(kMaxTriangles) + " triangles");
  const auto first = static_cast<glm::uint>(world.positions.size());
  world.positions.resize(first + mesh.positions.size());
  world.normals.resize(world.positions.size());
  for (const auto& facet : facets_of(mesh))
    world.facets.push_back({static_cast<std::uint32_t>(world.triangles.size()) + facet.triangle, facet.share});
  world.uvs.insert(world.uvs.end(), mesh.uvs.begin(), mesh.uvs.end());
  for (const glm::uvec3& triangle : mesh.triangles) world.triangles.push_back(triangle + first);
  world.triangle_object.resize(world.triangles.size(), index);
}

/// Puts an object's vertices, those of the world from `first` on, where they belong; returns their box.
Box move(const Object& object, const Mesh& mesh, std::size_t first, World& world) {
  auto& threads = cl::Threads::shared();
  const glm::dmat3 rotation = rotation_xyz(object.rotation_deg);
  std::vector<Box> boxes(threads.count());
  threads.for_ranges(mesh.positions.size(), [&](std::size_t thread, std::size_t from, std::size_t to) {
    boxes[thread].add(turned_box(rotation, mesh.positions.data() + from, to - from));
  });
  Box rotated;
  for (const auto& box : boxes) rotated.add(box);

  const double scale = scale_of(object, rotated);
  const glm::dvec3 centre = rotated.centre();
  // Differences first: a mesh far from its own origin keeps its shape.
  const auto placed = [&](const glm::dvec3& p) { return object.position_m + (p - centre) * scale; };
  const Box box{placed(rotated.min), placed(rotated.max)};
  if (!(box.min.z > 0))
    throw InputError(object.where + ": lies behind or touches the hologram plane: its z runs from " + length_text(box.min.z) + " to " +
                     length_text(box.max.z) + ", and must be > 0");
  threads.for_ranges(mesh.positions.size(), [&](std::size_t, std::size_t from, std::size_t to) {
    for (std::size_t i = from; i < to; ++i) {
      world.positions[first + i] = placed(rotation * mesh.positions[i]);
      world.normals[first + i] = rotation * mesh.normals[i];
    }
  });
  return box;
}

}  // namespace

bool is_closed(const Mesh& mesh) {
  const std::vector<std::uint32_t> weld = weld_positions(mesh.positions);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> edges, reversed;
  edges.reserve(3 * mesh.triangles.size());
  for (const glm::uvec3& triangle : mesh.triangles)
    for (int i = 0; i < 3; ++i) edges.emplace_back(weld[triangle[i]], weld[triangle[(i + 1) % 3]]);
  for (const auto& [from, to] : edges) reversed.emplace_back(to, from);
  std::sort(edges.begin(), edges.end());
  std::sort(reversed.begin(), reversed.end());
  return edges == reversed && std::adjacent_find(edges.begin(), edges.end()) == edges.end();
}

Meshes load_meshes(const Scene& scene) {
  if (scene.objects.empty()) throw InputError(one_line(scene.file.string()) + ": there is no object: add [[object]] with mesh = \"FILE\"");
  Meshes loaded;
  std::map<std::pair<std::filesystem::path, Normals>, std::size_t> known;
  for (const Object& object : scene.objects) {
    std::error_code error;
    const auto [found, is_new] =
        known.try_emplace({std::filesystem::weakly_canonical(object.mesh, error), object.normals}, loaded.meshes.size());
    if (is_new) {
      loaded.meshes.push_back(load_mesh(object.mesh, object.normals, object.where));
      loaded.closed.push_back(is_closed(loaded.meshes.back()));
    }
    loaded.of_object.push_back(found->second);
  }
  return loaded;
}

World place_objects(const Scene& scene, const Meshes& meshes) {
  World world;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const auto mesh = meshes.of_object[i];
    add(static_cast<std::int32_t>(i), scene.objects[i], meshes.meshes[mesh], world);
    world.object_closed.push_back(meshes.closed[mesh]);
  }
  move_objects(scene, meshes, world);
  return world;
}

void move_objects(const Scene& scene, const Meshes& meshes, World& world) {
  Box all;
  std::size_t first = 0;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const Mesh& mesh = meshes.meshes[meshes.of_object[i]];
    all.add(move(scene.objects[i], mesh, first, world));
    first += mesh.positions.size();
  }
  world.min_m = all.min;
  world.max_m = all.max;
}

World build_world(const Scene& scene) { return place_objects(scene, load_meshes(scene)); }

}  // namespace raywave
