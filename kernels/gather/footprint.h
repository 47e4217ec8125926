// SPDX-License-Identifier: Apache-2.0
// The footprint of a sample on a plane: the pixels that its light passes through on its way into
// the hologram's window. For kernels/gather/, and for the host, which includes this file as C++
// with FOOTPRINT_REAL double, inside a namespace that has fmin and clamp.
//
// Each axis has a footprint of its own. A cone leads from the sample to the window and meets the
// plane around the sample's chief ray, the line to the window's centre. Its half width `cone` is in
// half windows of the hologram or of its tile. Diffraction spreads the light beyond the cone:
// `spot` is the width of the bright spot into which the whole cone focuses a point. Where the cone
// on the plane is no wider than a few spots, the sample's light is summed from plane waves instead
// (plane_waves.h), and its footprint has a tail on each side.
#ifndef RAYWAVE_FOOTPRINT_H
#define RAYWAVE_FOOTPRINT_H

#ifndef FOOTPRINT_REAL
#define FOOTPRINT_REAL float
#endif

// Half widths in spots below which a sample's light is summed from plane waves (Gatherer's default)
#define PLANE_WAVE_SPOTS 12
// Spots that the footprint of a plane-wave sample reaches beyond its cone
#define PLANE_WAVE_TAIL 4
#define PLANE_WAVES 96  // along an axis, at most; a multiple of RAYWAVE_LANES
// Half extents in spots for which plane_wave_count does not exceed PLANE_WAVES are below 36
#define PLANE_WAVE_WIDEST 34

// One axis of a footprint, metres on the plane.
typedef struct {
  FOOTPRINT_REAL half_width;  // half width of the cone
  FOOTPRINT_REAL spot;        // width of the diffraction spot
  FOOTPRINT_REAL extent;      // half width with the tail of a plane-wave sample
} FootprintAxis;

// Width of the spot of one axis, metres on the plane.
static inline FOOTPRINT_REAL footprint_spot(FOOTPRINT_REAL half_tangent, FOOTPRINT_REAL cone,
                                            FOOTPRINT_REAL turns_per_metre) {
  return 0.5f / (turns_per_metre * cone * half_tangent);
}

// half_window_m    of the hologram or of its tile
// narrowed         distance from the sample to the plane over that to the hologram
// half_tangent     half_window_m over the distance from the sample to the hologram
// turns_per_metre  1 / wavelength
// tail_spots       PLANE_WAVE_TAIL
static inline FootprintAxis footprint_axis(FOOTPRINT_REAL cone, FOOTPRINT_REAL half_window_m,
                                           FOOTPRINT_REAL narrowed, FOOTPRINT_REAL half_tangent,
                                           FOOTPRINT_REAL turns_per_metre,
                                           FOOTPRINT_REAL tail_spots) {
  FootprintAxis axis;
  axis.half_width = cone * half_window_m * narrowed;
  axis.spot = footprint_spot(half_tangent, cone, turns_per_metre);
  axis.extent = axis.half_width + tail_spots * axis.spot;
  return axis;
}

// Plane waves that an axis needs: a sum of evenly spaced waves repeats itself after as many spots,
// and edges ring for about 12. A multiple of 8, so that none lies between two parts of the window.
static inline int plane_wave_count(FOOTPRINT_REAL half_extent, FOOTPRINT_REAL spot) {
  return 8 * (int)(0.25f * fmin(half_extent / spot, (FOOTPRINT_REAL)1e6f)) + 32;
}

// True when the sample's light is summed from plane waves: one axis of its cone is narrower than
// `spots` spots to each side, and both axes need no more than PLANE_WAVES.
static inline bool is_plane_wave_sample(FootprintAxis x, FootprintAxis y, FOOTPRINT_REAL spots) {
  return (x.half_width < spots * x.spot || y.half_width < spots * y.spot) &&
         plane_wave_count(x.extent, x.spot) <= PLANE_WAVES &&
         plane_wave_count(y.extent, y.spot) <= PLANE_WAVES;
}

// Defines name(at, cone, rate): the weight of light that meets the window at `at` >= 0 half windows
// from its centre, for numbers of type T. 1 inside, 0 from `cone` on, and between them a smooth
// step of width 1 / rate; rate 0: a hard edge, which the caller cuts.
#define DEFINE_APODIZATION(name, T)                                      \
  static inline T name(T at, FOOTPRINT_REAL cone, FOOTPRINT_REAL rate) { \
    if (!(rate > 0.0f)) return (T)(1.0f);                                \
    const T e = clamp((cone - at) * rate, (T)(0.0f), (T)(1.0f));         \
    return e * e * (3.0f - 2.0f * e);                                    \
  }

DEFINE_APODIZATION(apodization_weight, FOOTPRINT_REAL)

#endif
