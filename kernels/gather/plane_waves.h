// SPDX-License-Identifier: Apache-2.0
// Plane-wave samples: samples so near to a plane that diffraction, not geometry, decides where
// their light crosses it on the way into the hologram's window. Their light is the sum of the plane
// waves that reach the window. Along one axis, with the sine s of a wave's direction and the cone's
// apodization weight w(s),
//   g(x) = integral of
//          w(s) / cosine(s) exp(2 pi i / wavelength (s x - depth (1 - cosine(s)))) ds,
// and the sample's wave is i / wavelength exp(2 pi i depth / wavelength) g(x) g(y): far away, by
// stationary phase, exp(ikr) / r. Sines and offsets count from those of the chief ray, which goes
// to the hologram's centre (sine s0, cosine c0, meeting the plane at x0), so that floats hold no
// more turns than the wave has fringes. With s = s0 + d,
//   s x - depth (1 - cosine(s)) = s0 (x - x0) + depth (1 / c0 - 1) + d (x - x0) - depth e,
//   e = (c0 - cosine(s)) - d s0 / c0
//     = d^2 (c0 + s0 (s0 + s) / (c0 + cosine(s))) / (c0 (c0 + cosine(s))).
// The wave is finite at depth 0, and turns by half a period through it. Products of both sines are
// neglected from the third power on. Occlusion is resolved for PLANE_WAVE_PARTS x PLANE_WAVE_PARTS
// parts of the window: g is a sum of as many parts per axis.
#ifndef RAYWAVE_PLANE_WAVES_H
#define RAYWAVE_PLANE_WAVES_H

#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/common/phase.h"
#include "kernels/common/shared.h"
#include "kernels/gather/footprint.h"
#include "kernels/samples/visibility.h"

DEFINE_APODIZATION(apodization_weights, floatv)

// The members of GatherPlane that belong to one axis. Of samples before the hologram the larger
// sines belong to the smaller places on it: parts of the window count from the other side.
typedef struct {
  float cone, apodization_rate, sine_limit, reference, reference_fall, visibility_scale,
      visibility_shift;
} Gathered;
static inline Gathered gathered_x(const GatherPlane* plane, bool is_reversed) {
  const Gathered x = {plane->cone_x,
                      plane->apodization_rate_x,
                      plane->sine_limit_x,
                      plane->reference_x,
                      is_reversed ? -plane->reference_fall_x : plane->reference_fall_x,
                      plane->visibility_scale_x,
                      is_reversed ? -plane->visibility_shift_x : plane->visibility_shift_x};
  return x;
}
static inline Gathered gathered_y(const GatherPlane* plane, bool is_reversed) {
  const Gathered y = {plane->cone_y,
                      plane->apodization_rate_y,
                      plane->sine_limit_y,
                      plane->reference_y,
                      is_reversed ? -plane->reference_fall_y : plane->reference_fall_y,
                      plane->visibility_scale_y,
                      is_reversed ? -plane->visibility_shift_y : plane->visibility_shift_y};
  return y;
}

// 1 / cosine - 1 of a direction, given by its tangent.
static inline DoubleSingle plane_wave_slant(DoubleSingle tangent) {
  const DoubleSingle squared = ds_times(tangent, tangent), one = ds(1.0f, 0.0f);
  return ds_over(squared, ds_plus(one, ds_sqrt(ds_plus(one, squared))));
}

// Sine of the direction with tangent t + step, minus the sine of that with tangent t.
static inline float plane_wave_sine_step(float t, float step) {
  const float n = sqrt(1.0f + t * t), m = sqrt(1.0f + (t + step) * (t + step));
  return step * (n * m + 1.0f - t * (t + step)) / (n * m * (n + m));
}

// The plane waves of one axis at a sample.
typedef struct {
  int count;
  float first;  // sine of the first wave, in turns per metre from the chief ray's
  float step;
  float re[PLANE_WAVES];
  float im[PLANE_WAVES];
  float tangent[PLANE_WAVES];       // direction of each wave
  int begin[PLANE_WAVE_PARTS + 1];  // first wave of each part of the window
} PlaneWaves;

// centre_tangent: of the direction to the hologram's centre. in_parts: fill `begin` too.
static inline void plane_waves_of(PlaneWaves* waves, bool in_parts, float centre_tangent,
                                  float half_tangent, float half_extent, float depth, Gathered axis,
                                  float turns_per_metre) {
  waves->count =
      min(plane_wave_count(half_extent, footprint_spot(half_tangent, axis.cone, turns_per_metre)),
          PLANE_WAVES);
  const float low = plane_wave_sine_step(centre_tangent, -axis.cone * half_tangent);
  const float step =
      (plane_wave_sine_step(centre_tangent, axis.cone * half_tangent) - low) / (float)waves->count;
  const float c0 = 1.0f / sqrt(1.0f + centre_tangent * centre_tangent), s0 = centre_tangent * c0;
  waves->first = (low + 0.5f * step) * turns_per_metre;
  waves->step = step * turns_per_metre;
  for (int i = 0; i <= PLANE_WAVE_PARTS; ++i) waves->begin[i] = i == 0 ? 0 : waves->count;
  for (int n = 0; n < waves->count; n += RAYWAVE_LANES) {
    const floatv d = low + (LANES_TO_FLOAT(n + LANES_INDEX) + 0.5f) * step, sine = s0 + d;
    const floatv cosine = sqrt(1.0f - sine * sine);
    const floatv bend = c0 + s0 * (s0 + sine) / (c0 + cosine);
    const floatv at = d * bend / (c0 * cosine * half_tangent);  // on the hologram, in half windows
    floatv weight = step / cosine * apodization_weights(fabs(at), axis.cone, axis.apodization_rate);
    const floatv from_reference = sine - (axis.reference - at * axis.reference_fall);
    weight = LANES_SELECT((floatv)(0.0f), weight, fabs(from_reference) <= axis.sine_limit);
    floatv c, s;
    cos_sin_turns(-depth * turns_per_metre * d * d * bend / (c0 * (c0 + cosine)), &c, &s);
    LANES_STORE(weight * c, waves->re + n);
    LANES_STORE(weight * s, waves->im + n);
    LANES_STORE(sine / cosine, waves->tangent + n);
    if (!in_parts) continue;
    float ats[RAYWAVE_LANES];
    LANES_STORE(at, ats);
    for (int i = 0; i < RAYWAVE_LANES && n + i < waves->count; ++i) {
      for (int part = 1; part < PLANE_WAVE_PARTS; ++part) {
        if (ats[i] * axis.visibility_scale + axis.visibility_shift >=
            (float)part * (2.0f / PLANE_WAVE_PARTS) - 1.0f)
          waves->begin[part] = min(waves->begin[part], n + i);
      }
    }
  }
}

// Sum of waves `from` to before `to` at offset_m from the chief ray; `turns`: phase of the chief
// ray there. Two recurrences, for every other wave each: a single one would wait for its own
// products.
static inline void plane_wave_sum(const PlaneWaves* waves, int from, int to, floatv offset_m,
                                  floatv turns, floatv* re, floatv* im) {
  floatv even_re, even_im, step_re, step_im;
  cos_sin_turns((waves->first + (float)from * waves->step) * offset_m + turns, &even_re, &even_im);
  cos_sin_turns(waves->step * offset_m, &step_re, &step_im);
  floatv odd_re = even_re * step_re - even_im * step_im,
         odd_im = even_re * step_im + even_im * step_re;
  const floatv turn_re = step_re * step_re - step_im * step_im, turn_im = 2.0f * step_re * step_im;
  floatv sum_even_re = 0.0f, sum_even_im = 0.0f, sum_odd_re = 0.0f, sum_odd_im = 0.0f;
  int n = from;
  for (; n + 1 < to; n += 2) {
    sum_even_re += even_re * waves->re[n] - even_im * waves->im[n];
    sum_even_im += even_re * waves->im[n] + even_im * waves->re[n];
    sum_odd_re += odd_re * waves->re[n + 1] - odd_im * waves->im[n + 1];
    sum_odd_im += odd_re * waves->im[n + 1] + odd_im * waves->re[n + 1];
    const floatv turned_even = even_re * turn_re - even_im * turn_im,
                 turned_odd = odd_re * turn_re - odd_im * turn_im;
    even_im = even_re * turn_im + even_im * turn_re;
    odd_im = odd_re * turn_im + odd_im * turn_re;
    even_re = turned_even;
    odd_re = turned_odd;
  }
  if (n < to) {
    sum_even_re += even_re * waves->re[n] - even_im * waves->im[n];
    sum_even_im += even_re * waves->im[n] + even_im * waves->re[n];
  }
  *re = sum_even_re + sum_odd_re;
  *im = sum_even_im + sum_odd_im;
}

#endif
