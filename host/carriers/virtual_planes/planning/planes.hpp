// SPDX-License-Identifier: Apache-2.0
/// Compact propagation: one virtual plane per layer of depth, one Fourier transform away from the
/// tile of the hologram, on which each surface sample lights a few hundred pixels
/// (docs/pipeline.md). After Kozacki & Falaggis, Opt. Lett. 40, 3420 (2015), for the reference wave
/// that is taken off; the window is that of non-uniform FFTs (Barnett et al., SIAM J. Sci. Comput.
/// 41, C479 (2019)).
#pragma once

#include <glm/vec2.hpp>
#include <string>

#include "host/plan/plan.hpp"

namespace raywave {

/// The window that is applied in front of the transform and divided out after it: exp(strength
/// (sqrt(1 - (at / reach)^2) - 1)), zero from `reach` on. Half tiles from the tile's middle.
struct WindowFunction {
  double strength = 9, reach = 1;
  double operator()(double at) const;
};

/// The window along one axis: it reaches as far as it may wrap around into the guard band.
WindowFunction window_function(const Plan& plan, int axis);

/// Where places on a tile and pixels of its virtual plane count from: the centre of the tile's
/// pixel (size / 2). World.
glm::dvec2 origin_of_tile(const Plan& plan, const Tile& tile);

/// The virtual planes of a plan whose tiles are set, with what the scene asks for.
VirtualPlanes virtual_planes_of(const Plan& plan, const WrpSpec& wanted);

/// Why the light of a scene cannot travel by virtual planes, in a line; empty: it can.
std::string why_not_virtual_planes(const Scene& scene);

/// The key of the scene that asks for WRPs, since it means nothing to virtual planes, and its value
/// is not the default; empty: none does.
std::string key_of_wrps(const Scene& scene);

/// The largest predicted error of the field, relative, at which "auto" takes virtual planes.
inline constexpr double most_virtual_plane_error = 0.05;

/// True when tiles of so many pixels are wider than what one of their pixels lights at the distance
/// of a layer, wavelength z / pitch.
bool is_wider_than_light(const Plan& plan, glm::ivec2 tile_size);

/// Where virtual planes fall short of what "auto" asks for.
enum class Shortfall { none, depth, width };

/// depth  footprints are too long for the plane: more layers help
/// width  the hologram is too wide for few scan lines, or for the light of its pixels: tiles help
Shortfall shortfall_of(const Plan& plan);

/// Places one virtual plane for each tile and layer of depth, in place of WRPs.
void place_virtual_planes(Plan& plan);

}  // namespace raywave
