// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader_reply.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>

namespace raywave {
namespace {

void require(bool sound) {
  if (!sound) throw std::runtime_error("its reader returned nonsense");
}

template <class Vector>
bool all_finite(const std::vector<Vector>& vectors) {
  return std::all_of(vectors.begin(), vectors.end(), [](const Vector& v) {
    for (int i = 0; i < Vector::length(); ++i)
      if (!std::isfinite(v[i])) return false;
    return true;
  });
}

/// Readers send floats. Within that range, squares of areas fit into doubles.
bool are_positions(const std::vector<glm::dvec3>& vectors) {
  return std::all_of(vectors.begin(), vectors.end(), [](const glm::dvec3& p) {
    constexpr double largest = std::numeric_limits<float>::max();
    return std::abs(p.x) <= largest && std::abs(p.y) <= largest && std::abs(p.z) <= largest;
  });
}

bool are_normals(const std::vector<glm::dvec3>& vectors) {
  return std::all_of(vectors.begin(), vectors.end(), [](const glm::dvec3& n) {
    return n == glm::dvec3(0) || std::abs(glm::length(n) - 1) < 1e-6;
  });
}

}  // namespace

void send(ReaderPipe& pipe, const Mesh& mesh) {
  pipe.write_vector(mesh.positions);
  pipe.write_vector(mesh.normals);
  pipe.write_vector(mesh.uvs);
  pipe.write_vector(mesh.triangles);
}

void send(ReaderPipe& pipe, const Image& image) {
  pipe.write_vector(std::vector<int>{image.width, image.height});
  pipe.write_vector(image.pixels);
}

Mesh receive_mesh(ReaderPipe& pipe) {
  Mesh mesh;
  pipe.read_vector(mesh.positions, most_vertices_of_file);
  const std::size_t count = mesh.positions.size();
  pipe.read_vector(mesh.normals, count);
  pipe.read_vector(mesh.uvs, count);
  pipe.read_vector(mesh.triangles, most_triangles_of_file);
  require(mesh.normals.size() == count && mesh.uvs.size() == count);
  require(are_positions(mesh.positions) && are_normals(mesh.normals) && all_finite(mesh.uvs));
  require(std::all_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const glm::uvec3& t) {
    return t.x < count && t.y < count && t.z < count;
  }));
  return mesh;
}

Image receive_image(ReaderPipe& pipe) {
  std::vector<int> size;
  pipe.read_vector(size, 2);
  require(size.size() == 2 && std::min(size[0], size[1]) >= 1 &&
          std::max(size[0], size[1]) <= largest_picture_side);
  Image image{size[0], size[1], {}};
  const std::uint64_t count = std::uint64_t{1} * size[0] * size[1];
  pipe.read_vector(image.pixels, count);
  require(image.pixels.size() == count);
  require(std::all_of(image.pixels.begin(), image.pixels.end(),
                      [](float v) { return std::isfinite(v); }));
  return image;
}

}  // namespace raywave
