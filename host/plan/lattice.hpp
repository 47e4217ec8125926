// SPDX-License-Identifier: Apache-2.0
/// The sample lattice: the rays from the hologram's centre whose hits are the surface samples.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec2.hpp>

#include "host/geometry/extents.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// Tangents of chief rays (to the hologram's centre), low and high per axis.
using ChiefTangents = std::array<Interval, 2>;

/// Bounds nothing: for planes whose light may come from anywhere.
inline constexpr ChiefTangents all_tangents{Interval{-1e9, 1e9}, Interval{-1e9, 1e9}};

/// WRPs side by side.
struct WrpGrid {
  glm::ivec2 size{1, 1};  // columns, rows
  glm::dvec2 middle_m{0, 0};
};

/// Extends `lit` by the chief rays of the light that falls onto a tile's WRPs, diffraction at their
/// edges included.
void add_chief_tangents(const Plan& plan, const DepthLayer& layer, const Tile& tile,
                        const WrpGrid& wrps, ChiefTangents& lit);

/// The lattice over everything in the scene whose light the hologram can show.
///
/// lit     chief rays of whatever light can fall onto a WRP
/// throws  InputError when sampling.pitch needs more cells than are allowed, or cells too far off
///         the axis
LatticePlan lattice_over(const Scene& scene, const Extents& extents, const Plan& plan,
                         glm::dvec2 largest_tangent, const ChiefTangents& lit);

/// The lattice over scenes with surfaces near the hologram, or in its plane: its rays come from a
/// point before all surfaces, so that samples are about as far apart on all of them.
///
/// throws  as lattice_over
LatticePlan lattice_from_eye(const Scene& scene, const World& world, const Plan& plan,
                             glm::dvec2 largest_tangent);

/// True for plans of such scenes. Their samples are gathered at the hologram, each where its light
/// is no steeper than the pixels can show.
inline bool is_near_hologram(const Plan& plan) { return plan.lattice.eye_m.z != 0; }

/// Tangents to the optical axis of rays with these sines, a little less than 1 at most.
glm::dvec2 tangents_of_sines(glm::dvec2 sines);

/// The same of the steepest light that the plan's pixels show, up to 88 degrees.
glm::dvec2 steepest_slope(const Plan& plan);

/// Tangents that the visibility masks of such plans divide: of the steepest light that pixels show.
glm::dvec2 steepest_of_masks(const Plan& plan);

/// The smallest detail that the hologram shows at a depth, by axis: wavelength z / width, and near
/// the hologram no less than a pixel.
glm::dvec2 limit_m(const Plan& plan, double z_m);

/// The depth that the lattice's pitch is given for.
inline double middle_m(const Plan& plan) { return plan.lattice.full_z_m + plan.lattice.eye_m.z; }

/// Primary rays of a frame. Those that are aimed at samples are counted as if one surface filled
/// the lattice, the layers' middle depths in equal parts.
std::uint64_t primary_rays(const Plan& plan);

/// Distance from surfaces at which rays start: beyond the rounding errors of coordinates, which
/// grow with the distance from the scene's origin.
double ray_bias_m(const World& world, const Plan& plan);

/// Breaks are looked for where that is less than so many cells of the lattice: their margin covers
/// what it moves rays aside.
inline constexpr double most_bias_of_breaks = 0.02;

/// True when looking for breaks (kernels/samples/breaks.h) takes less time than the rays that it
/// saves: at most 16 triangles for each cell of the lattice (docs/pipeline.md).
bool breaks_pay(const LatticePlan& lattice, std::size_t triangles);

/// True when the rays through the parts of a cell are shaded one by one: they differ in texture, in
/// shadow or, where more than 3 triangles lie in a cell, in their normals. Of a teapot with 4 to 11
/// triangles in a cell, this brings 3 to 5 dB for 0 to 17 % of the frame's time; with 2 in a cell,
/// 0.4 dB for 28 %.
bool shades_parts(const Plan& plan, std::size_t triangles);

}  // namespace raywave
