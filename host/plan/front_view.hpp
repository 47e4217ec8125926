// SPDX-License-Identifier: Apache-2.0
/// A coarse view of the scene from the middle of the hologram. Planning counts samples and pairs
/// from it, and predicts pictures.
#pragma once

#include <cstddef>
#include <glm/vec2.hpp>
#include <vector>

#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// A raster of tangents (x/z, y/z) over the plan's lattice, row by row from the lowest y. Cells
/// stand for equal solid angles, as samples do.
struct FrontView {
  glm::ivec2 size{0, 0};
  glm::dvec2 low{0, 0};  // tangents of the raster's corner
  double step = 1;       // tangent between cells
  // Of the nearest surface, or of the brightest image that it shows; 0 where there is none
  std::vector<float> depth_m;
  // Of it: Phong without shadows; what mirrors and glass show counts as bright as the mean of all
  // other surfaces
  std::vector<float> radiance;
  std::vector<bool> shiny;  // it has highlights
  // Surfaces met by a ray to each cell, summed over the cells: outsides of closed meshes, all of
  // open ones
  double pierced = 0;
  double boxes = 0;          // cells in the boxes of all triangles
  double covered = 0;        // cells with a surface
  double ends = 0;           // cells beside which a surface ends, or another lies far behind it
  double steep = 0;          // cells whose surface is a break as a whole (kernels/samples/breaks.h)
  double behind_breaks = 0;  // cells from which a ray to the hologram may meet a break
  // Cells whose surface is hidden from some part of the hologram by one that ends before it
  std::vector<bool> partly_hidden;
  double hidden = 0;  // as many
  // Samples that a ray through each cell's middle finds, for each lattice cell there: 1 where it
  // meets a surface with light of its own, and what mirrors and glass show beside it
  std::vector<float> sources;
  double specular = 0;  // cells that show mirrors or glass first
  // Of these: sources that they show, their surfaces in all, and segments of all their paths
  double images = 0, image_surfaces = 0, segments = 0;
  double lost = 0;  // segments that meet nothing
  // Lights that each cell's surface faces, and these times the depth of the tree of its object,
  // summed over the cells
  double lights_faced = 0, lights_faced_levels = 0;
  double looks = 0;  // rays to other surfaces, summed over the cells

  double eye_z_m = 0;  // where tangents are taken, on the axis: LatticePlan::eye_m

  /// Its place in the arrays.
  std::size_t cell(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(size.x) +
           static_cast<std::size_t>(x);
  }
  /// Calls `use` with x, y, place in the arrays and depth of each cell with a surface, or of one in
  /// `every` along both axes.
  void for_surfaces(const auto& use, int every = 1) const {
    for (int y = every / 2; y < size.y; y += every)
      for (int x = every / 2; x < size.x; x += every)
        if (const double z_m = depth_m[cell(x, y)]; z_m != 0) use(x, y, cell(x, y), z_m);
  }
  glm::dvec2 tangent(int x, int y) const { return low + (glm::dvec2(x, y) + 0.5) * step; }
  /// Where the ray through a cell's middle meets the plane z_m.
  glm::dvec2 place_m(int x, int y, double z_m) const { return tangent(x, y) * (z_m - eye_z_m); }
};

/// longest  cells of the raster's longer side; a surface smaller than a cell may be missed
FrontView front_view(const Scene& scene, const World& world, const Plan& plan, int longest = 512);

}  // namespace raywave
