// SPDX-License-Identifier: Apache-2.0
// OFF (Geomview): [ST][C][N]OFF as text.
#include <algorithm>
#include <cmath>
#include <string>

#include "host/scene/reader/mesh_builder.hpp"
#include "host/scene/reader/mesh_text.hpp"
#include "host/scene/reader/readers.hpp"

namespace raywave {
namespace {

/// The numbers that are left in the line.
std::vector<double> numbers_of(LineScanner& lines) {
  std::vector<double> numbers;
  while (!lines.peek().empty()) numbers.push_back(lines.number());
  return numbers;
}

/// The next line that has numbers.
std::vector<double> next_numbers(LineScanner& lines) {
  std::vector<double> numbers;
  while (numbers.empty()) {
    if (!lines.next_line()) lines.fail("the file ends too soon");
    numbers = numbers_of(lines);
  }
  return numbers;
}

/// Three or four numbers from a place on.
glm::vec4 colour_at(const std::vector<double>& numbers, std::size_t first, std::size_t last) {
  return {numbers[first], numbers[first + 1], numbers[first + 2],
          first + 3 < last ? numbers[first + 3] : NAN};
}

}  // namespace

Mesh read_off(const std::filesystem::path& file) {
  const MappedFile bytes(file);
  LineScanner lines(bytes.bytes(), "");
  MeshBuilder builder;
  std::string kind;
  std::vector<double> counts;
  while (counts.empty()) {
    if (!lines.next_line()) throw InputError("is no OFF: it has no numbers of vertices and faces");
    if (lines.peek().ends_with("OFF") && kind.empty()) {
      kind = lines.word();
      if (lines.peek() == "BINARY") throw InputError("is a binary OFF; save it as text");
    }
    counts = numbers_of(lines);
  }
  std::string_view left = kind;
  const auto takes = [&](std::string_view prefix) {
    const bool is_there = left.starts_with(prefix);
    if (is_there) left.remove_prefix(prefix.size());
    return is_there;
  };
  const bool has_uv = takes("ST"), has_colour = takes("C"), has_normal = takes("N");
  if (!left.empty() && left != "OFF")
    throw InputError("is a " + kind + " file; of OFF, vertices of three numbers are read");
  const auto is_count = [](double n) { return n >= 0 && n <= 4e9 && n == std::floor(n); };
  if (counts.size() < 2 || !is_count(counts[0]) || !is_count(counts[1]))
    lines.fail("the numbers of vertices and faces are needed");

  std::vector<glm::vec4> of_vertices, of_faces;
  bool has_face_colours = false;
  const auto where = [&] { return lines.where(); };
  for (double i = 0; i < counts[0]; ++i) {
    const auto n = next_numbers(lines);
    const std::size_t normal = 3, colour = normal + (has_normal ? 3 : 0),
                      uv = n.size() - std::min<std::size_t>(n.size(), has_uv ? 2 : 0);
    if (n.size() < colour + (has_uv ? 2 : 0) || (has_colour && uv < colour + 3))
      lines.fail("a vertex of " + kind + " needs more numbers");
    builder.add_vertex({n[0], n[1], n[2]},
                       has_normal ? glm::dvec3(n[3], n[4], n[5]) : glm::dvec3(0),
                       has_uv ? glm::dvec2(n[uv], n[uv + 1]) : glm::dvec2(0), where);
    if (has_colour) of_vertices.push_back(colour_at(n, colour, uv));
    if (uv > colour && !has_colour)
      builder.notes.add("numbers behind x y z are ignored: COFF would say that they are colours",
                        lines.where());
  }
  std::vector<std::uint32_t> corners;
  for (double i = 0; i < counts[1]; ++i) {
    const auto n = next_numbers(lines);
    if (!is_count(n[0]) || n[0] + 1 > static_cast<double>(n.size()))
      lines.fail("a face needs its corners in one line");
    const auto last = static_cast<std::size_t>(n[0]) + 1;
    corners.clear();
    for (std::size_t k = 1; k < last; ++k)
      corners.push_back(is_count(n[k]) ? static_cast<std::uint32_t>(n[k]) : UINT32_MAX);
    of_faces.resize(builder.mesh.triangles.size(), glm::vec4(NAN));  // white
    builder.add_face(corners, -1, where);
    if (n.size() == last + 1 || n.size() == last + 2)
      builder.notes.add("numbers of a colour map are ignored", lines.where());
    if (n.size() < last + 3) continue;
    has_face_colours = true;
    of_faces.resize(builder.mesh.triangles.size(), colour_at(n, last, n.size()));
  }
  if (has_colour && has_face_colours)
    builder.notes.add("colours of faces are ignored: vertices have colours", "");
  const float scale = brightest_of(has_colour ? of_vertices : of_faces);
  if (has_colour)
    builder.set_colours(std::move(of_vertices), scale);
  else if (has_face_colours)
    builder.set_triangle_colours(std::move(of_faces), scale);
  return builder.finish();
}

}  // namespace raywave
