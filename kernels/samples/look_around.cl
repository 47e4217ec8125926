// SPDX-License-Identifier: Apache-2.0
// Visibility of samples on devices with one cell per work-item: a ray per work-item, since the few
// cells with much to ask would let all others wait. Where there are lanes, find_samples asks itself
// (visibility.h). place = cell * slots + slot, in a band of cells.
//
// ask_parts       whether places that ask see a part k of the window: sees[place * parts + k]. In
//                 the first round 16 parts are asked, which stand for all when they agree; in the
//                 second, where these do not agree, all. One work-item per part of a place
// settle_samples  visibility masks of the samples that ask; those that no part sees go, the
//                 following take their slots. counts as after find_samples. One work-item per cell
//
// OpenCL C 1.2.
#include "kernels/common/shared.h"
#include "kernels/samples/options.h"
#include "kernels/samples/shade_samples.h"
#include "kernels/samples/visibility.h"

#if RAYWAVE_LANES == 1
// How many of `parts` parts a place sees.
static inline int count_seen(__global const uchar* sees, int parts) {
  int seen = 0;
  for (int part = 0; part < parts; ++part) seen += sees[part];
  return seen;
}

// How many of the sixteen parts a place sees where they stand for all, else SEEN_UNKNOWN.
static inline int sixteen_say(__global const uchar* sixteen) {
  if (!SIXTEEN_TELL) return SEEN_UNKNOWN;
  const int seen = count_seen(sixteen, 16);
  return seen == 0 ? 0 : seen == 16 ? VISIBILITY_ALL : SEEN_UNKNOWN;
}

__kernel void ask_parts(SCENE_PARAMETERS, Lattice lattice, int cells, int slots, int first_round,
                        __global const int2* counts, __global const Lookout* lookouts,
                        __global const uchar* sixteen, __global uchar* sees) {
  const size_t parts = first_round ? 16 : VISIBILITY_ALL, place = get_global_id(0) / parts;
  const int part = (int)(get_global_id(0) % parts);
  const size_t cell = place / (size_t)slots;
  if (cell >= (size_t)cells || (int)(place % (size_t)slots) >= counts[cell].x) return;
  const Lookout at = lookouts[place];
  if (!at.asks) return;
  if (first_round ? !SIXTEEN_TELL : sixteen_say(sixteen + 16 * place) != SEEN_UNKNOWN) return;
  const SceneArrays scene = SCENE_OF_PARAMETERS;
#if RAYWAVE_VISIBILITY_PARTS > 0
  int i = part % RAYWAVE_VISIBILITY_PARTS, j = part / RAYWAVE_VISIBILITY_PARTS;
  if (first_round) {
    const int a = part / 4, b = (part + a) % 4;
    i = part_of_16(a, b);
    j = part_of_16(b, a);
  }
  const Rays ray = rays_to_parts(&lattice, at.x, at.y, at.z, at.nx, at.ny, at.nz, i, j);
  sees[get_global_id(0)] = bvh_occluded(&scene.tree, &ray) ? 0 : 1;
#else
  (void)scene, (void)part, (void)sees;
#endif
}

__kernel void settle_samples(int cells, int slots, int keeps_unseen,
                             __global const Lookout* lookouts, __global const uchar* sixteen,
                             __global const uchar* sees, __global int2* counts,
                             __global Sample* samples, __global uint* visibility_masks,
                             __global uint* lit, __global float* sample_colours) {
#if RAYWAVE_COLOURS == 1
  (void)sample_colours;
#endif
  const int cell = (int)get_global_id(0);
  if (cell >= cells) return;
  const size_t first = (size_t)cell * (size_t)slots;
  const int found = counts[cell].x;
  int kept = 0, hidden = 0;
  for (int slot = 0; slot < min(found, slots); ++slot) {
    const size_t from = first + (size_t)slot, to = first + (size_t)kept;
    Sample sample = samples[from];
    uint mask[VISIBILITY_WORDS];
    for (int w = 0; w < VISIBILITY_WORDS; ++w)
      mask[w] = visibility_masks[from * VISIBILITY_WORDS + w];
    if (lookouts[from].asks) {
      int seen = sixteen_say(sixteen + 16 * from);
      if (seen != VISIBILITY_ALL) {
        __global const uchar* of_sample = sees + from * VISIBILITY_ALL;
        for (int w = 0; w < VISIBILITY_WORDS; ++w) mask[w] = 0;
        if (seen == SEEN_UNKNOWN) {
          for (int part = 0; part < VISIBILITY_ALL; ++part)
            mask[part / 32] |= (uint)of_sample[part] << (part % 32);
          seen = count_seen(of_sample, VISIBILITY_ALL);
        }
      }
      if (seen == 0 && !keeps_unseen) continue;
      sample.hidden = seen < VISIBILITY_ALL;
    }
    hidden += sample.hidden;
    samples[to] = sample;
    for (int w = 0; w < VISIBILITY_WORDS; ++w)
      visibility_masks[to * VISIBILITY_WORDS + w] = mask[w];
    for (int w = 0; w < LIT_WORDS; ++w) lit[to * LIT_WORDS + w] = lit[from * LIT_WORDS + w];
#if RAYWAVE_COLOURS > 1
    for (size_t k = 0; k < SAMPLE_COLOURS; ++k)
      sample_colours[to * SAMPLE_COLOURS + k] = sample_colours[from * SAMPLE_COLOURS + k];
#endif
    ++kept;
  }
  // Where there are more samples than slots, the band is repeated.
  counts[cell] = (int2)(found > slots ? found : kept, hidden);
}
#endif
