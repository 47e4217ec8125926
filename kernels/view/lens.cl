// SPDX-License-Identifier: Apache-2.0
// The view of an ideal lens: rays start at points spread evenly over the lens and go through a
// pixel of the plane in focus to the nearest hit. A pixel is the mean radiance of the rays of all
// points; a miss is black. Mirrors and glass are followed to RAYWAVE_BOUNCES further hits.
//
// Arrays: the scene's (kernels/scene/arrays.h); picture: lens.ny rows of lens.nx radiances, row 0
// on top. A work-item fills a packet: RAYWAVE_LANES neighbouring pixels of one row. Packets are
// numbered row by row, ceil(nx / lanes) to a row; a launch fills [first_packet, first_packet +
// packet_count). Global size: packet_count. OpenCL C 1.2.
#include "kernels/common/lanes.h"
#include "kernels/common/shared.h"
#include "kernels/scene/bounce.h"
#include "kernels/scene/bvh.h"
#include "kernels/scene/shade.h"

// Point i of `points` along an axis of the part of a lens within `reach` of a pixel. The lens
// begins at `edge` and goes on by `pitch` for each of its points.
static inline floatv open_place(floatv pixel, float edge, float pitch, float reach, int points,
                                int i) {
  const float other = edge + pitch * (float)points;
  const float low = fmin(edge, other), high = fmax(edge, other);
  const floatv from = clamp(pixel - reach, low, high), to = clamp(pixel + reach, low, high);
  return from + (to - from) * (((float)i + 0.5f) / (float)points);
}

__kernel void see(SCENE_PARAMETERS, LensPlane lens, int first_packet, int packet_count,
                  __global float* picture) {
  const int index = (int)get_global_id(0);
  if (index >= packet_count) return;
  const int packet = first_packet + index;
  const int packets_per_row = (lens.nx + RAYWAVE_LANES - 1) / RAYWAVE_LANES;
  const int row = packet / packets_per_row;
  const int first = (packet - row * packets_per_row) * RAYWAVE_LANES;
  if (row >= lens.ny) return;
  const SceneArrays scene = SCENE_OF_PARAMETERS;
  const intv column = first + LANES_INDEX;
  const floatv x = lens.left + lens.pitch_x * LANES_TO_FLOAT(column);
  const float y = lens.top - lens.pitch_y * (float)row;

  // Places in the pixel, where rays are spread over it: a grid of points x points cells whose
  // column is chosen by the lens's row, and the place within the cell by its column; likewise its
  // row. So every part of the lens sees all of the pixel.
  const float part = 1.0f / (float)lens.points;
  floatv sum = 0.0f;
  for (int j = 0; j < lens.points; ++j) {
    float from_y = lens.lens_top - lens.lens_pitch_y * (float)j;
    if (lens.reach_y > 0.0f)
      from_y = LANES_FIRST(open_place((floatv)(y), lens.lens_top + 0.5f * lens.lens_pitch_y,
                                      -lens.lens_pitch_y, lens.reach_y, lens.points, j));
    from_y += lens.follow * y;
    const float tangent_y = (y - from_y) * lens.inverse_focus;
    if (from_y < lens.window_bottom || from_y > lens.window_top ||
        fabs(tangent_y) > lens.steepest_y)
      continue;
    const float cell_x = (float)(j * lens.scatter % lens.points), fine_y = ((float)j + 0.5f) * part;
    // Two short sums round less than one long sum
    floatv sum_of_row = 0.0f;
    for (int i = 0; i < lens.points; ++i) {
      floatv from_x = lens.lens_left + lens.lens_pitch_x * (float)i;
      if (lens.reach_x > 0.0f)
        from_x = open_place(x, lens.lens_left - 0.5f * lens.lens_pitch_x, lens.lens_pitch_x,
                            lens.reach_x, lens.points, i);
      from_x += lens.follow * x;
      const int off_x = 2 * i + 1 - lens.points, off_y = 2 * j + 1 - lens.points;
      if (lens.is_round && off_x * off_x + off_y * off_y > lens.points * lens.points) continue;
      const float cell_y = (float)(i * lens.scatter % lens.points);
      const float place_x = (cell_x + ((float)i + 0.5f) * part) * part - 0.5f,
                  place_y = (cell_y + fine_y) * part - 0.5f;
      const floatv dx = (x + lens.spread_x * place_x - from_x) * lens.inverse_focus;  // tangents
      const floatv dy = (y + lens.spread_y * place_y - from_y) * lens.inverse_focus;
      Rays rays = {from_x + lens.start * dx,
                   (floatv)(from_y) + lens.start * dy,
                   (floatv)(lens.start_z),
                   dx,
                   dy,
                   (floatv)(1.0f),
                   (floatv)(0.0f),
                   (floatv)(lens.reach),
                   (column < lens.nx) & (from_x >= lens.window_left) &
                       (from_x <= lens.window_right) & (fabs(dx) <= lens.steepest_x)};
#if REFINED_SURFACES
      Line line = {ds3(rays.ox, rays.oy, rays.oz), ds3(rays.dx, rays.dy, rays.dz)};
#endif
      // Paths still to be followed: the ray's own, and those that mirrors and glass add
      int pending = 1;
#if RAYWAVE_BOUNCES > 0
      Path paths[BOUNCE_PATHS];
      paths[0] = path_from(&line, rays.active);
#endif
      while (pending > 0) {
        --pending;
#if RAYWAVE_BOUNCES > 0
        Path path = paths[pending];
        line = path.line;
        rays = rays_of(&path, lens.reach);
#endif
        const Hits hits = bvh_nearest(&scene.tree, &rays);
        const intv hit = hits.triangle >= 0;
        if (!LANES_ANY(hit)) continue;
        Surface surface = surface_at(&scene, &rays, &hits);
        LOOK_FOR_LIGHTS(&surface, light_place_of(i + column, (intv)(j + row)));
#if RAYWAVE_BOUNCES > 0
        reach_surface(&path, refine_surface(&scene, &line, &hits, &surface));
#elif REFINED_SURFACES
        refine_surface(&scene, &line, &hits, &surface);
#endif
        floatv radiance = phong(&scene, &surface, lens.bias, lens.reach, false, hit);
#if RAYWAVE_BOUNCES > 0
        path.active = hit;
        radiance *= own_share(&path, &surface);
        pending = bounce(&path, &surface, lens.bias, paths, pending);
#endif
        sum_of_row += LANES_SELECT((floatv)(0.0f), radiance, hit);
      }
    }
    sum += sum_of_row;
  }

  float pixels[RAYWAVE_LANES];
  LANES_STORE(sum / lens.rays, pixels);
  __global float* out = picture + (size_t)row * (size_t)lens.nx;
  for (int i = 0; i < RAYWAVE_LANES && first + i < lens.nx; ++i) out[first + i] = pixels[i];
}
