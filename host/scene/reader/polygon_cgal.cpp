// SPDX-License-Identifier: Apache-2.0
#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>

#include <map>
#include <optional>
#include <utility>

#include "host/scene/reader/mesh_polygon.hpp"

namespace raywave {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Corner = CGAL::Triangulation_vertex_base_with_info_2<glm::uint, Kernel>;
/// How often the outline runs around a triangle; none: not known yet.
using Turns = CGAL::Triangulation_face_base_with_info_2<std::optional<int>, Kernel>;
using Face = CGAL::Constrained_triangulation_face_base_2<Kernel, Turns>;
using Triangulation = CGAL::Constrained_Delaunay_triangulation_2<
    Kernel, CGAL::Triangulation_data_structure_2<Corner, Face>,
    CGAL::No_constraint_intersection_requiring_constructions_tag>;
using Vertex = Triangulation::Vertex_handle;

/// How often the outline runs along each edge, less how often it runs back.
using Runs = std::map<std::pair<Vertex, Vertex>, int>;

/// The edges of the triangulation between two corners: others may lie on the way.
void run_along(const Triangulation& all, Vertex from, Vertex to, Runs& runs) {
  while (from != to) {
    auto around = all.incident_vertices(from);
    const auto first = around;
    auto next = Vertex();
    do {
      const Vertex other = around;
      if (all.is_infinite(other)) continue;
      if (other == to ||
          (CGAL::orientation(from->point(), other->point(), to->point()) == CGAL::COLLINEAR &&
           CGAL::are_strictly_ordered_along_line(from->point(), other->point(), to->point())))
        next = other;
    } while (++around != first);
    if (next == Vertex()) return;  // the area will not be right
    ++runs[{from, next}];
    --runs[{next, from}];
    from = next;
  }
}

}  // namespace

bool cut_outline(std::span<const glm::dvec2> outline, std::vector<glm::uvec3>& triangles) {
  triangles.clear();
  Triangulation all;
  std::vector<Vertex> corners;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const auto before = all.number_of_vertices();
    corners.push_back(all.insert({outline[i].x, outline[i].y}, corners.empty()
                                                                   ? Triangulation::Face_handle()
                                                                   : corners.back()->face()));
    if (all.number_of_vertices() > before) corners.back()->info() = static_cast<glm::uint>(i);
  }
  const auto next = [&](std::size_t i) { return corners[(i + 1) % corners.size()]; };
  try {
    for (std::size_t i = 0; i < corners.size(); ++i)
      if (corners[i] != next(i)) all.insert_constraint(corners[i], next(i));
  } catch (const Triangulation::Intersection_of_constraints_exception&) {
    return false;
  }
  Runs runs;
  for (std::size_t i = 0; i < corners.size(); ++i) run_along(all, corners[i], next(i), runs);

  if (all.dimension() < 2) return true;
  std::vector<Triangulation::Face_handle> pending{all.infinite_face()};
  pending[0]->info() = 0;
  while (!pending.empty()) {
    const auto face = pending.back();
    pending.pop_back();
    for (int i = 0; i < 3; ++i) {
      const auto beyond = face->neighbor(i);
      if (beyond->info()) continue;
      // The face lies to the left of this edge: what runs along it turns less beyond it
      const auto run = runs.find({face->vertex(all.ccw(i)), face->vertex(all.cw(i))});
      beyond->info() = *face->info() - (run == runs.end() ? 0 : run->second);
      pending.push_back(beyond);
    }
  }
  for (const auto face : all.finite_face_handles())
    if (*face->info() != 0)
      triangles.emplace_back(face->vertex(0)->info(), face->vertex(1)->info(),
                             face->vertex(2)->info());
  return true;
}

}  // namespace raywave
