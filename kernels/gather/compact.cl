// SPDX-License-Identifier: Apache-2.0
// Compact gathering (docs/pipeline.md): the field of surface samples on the virtual plane, one
// Fourier transform away from the hologram's tile. With the reference wave exp(i k c) taken off, a
// sample's light on the tile has few frequencies, and so a small footprint W on this plane:
//   W(x, y) = 1 / pitch^2 integral of bell(u, v) A / r exp(i k (r - c)) exp(2 pi i (x u + y v) /
//             (wavelength z0)) du dv,
//   r: distance from the sample to (u, v) on the tile, c = sqrt(z0^2 + u^2 + v^2).
// W is a sum of `lines` products X_k(x) Y_k(y), one for each of as many rows v_k of the tile
// ("scan lines"): X_k is the transform of the light on that row, less its phase at u = 0, Y_k that
// of the light on the column u = 0 times Lagrange's polynomial of v_k. For a partly hidden sample
// the rows are the middles of the visibility mask's parts, and cubic B-splines stand for the
// polynomials and smooth the mask. The bell is divided out at the hologram, and makes footprints
// end quickly.
//
// (u, v) and pixels (x, y) of the plane count from the tile's pixel (size / 2), v and y downwards.
// The plane is periodic: pixel (x, y) lies in column x modulo nx and row y modulo ny.
//
// aim             footprints[i]: the pixels that sample i lights; none for other layers' samples.
//                 seen: COMPACT_SEEN numbers of each sample for `profile`
// profile         X_k and Y_k of the samples first_sample, ..., at offsets[i] of `profiles`: for
//                 each k the real parts of X, the imaginary parts, the real parts of Y, the
//                 imaginary parts, in COMPACT_ROOM each, with the footprint's middle in the middle
// gather_compact  field: RAYWAVE_FRAMES planes of plane.ny rows of plane.nx samples. Bins of
//                 COMPACT_BIN x COMPACT_BIN pixels list the samples that light them: those of bin b
//                 are bin_samples[first_of_bin[b]] up to that of b + 1. Only the band of
//                 get_global_size(1) RAYWAVE_TILE_ROWS / COMPACT_BIN rows of bins from first_row on
//                 is filled; is_fresh: whether nothing was written there before
//
// A work-item of `gather_compact` fills RAYWAVE_LANES x RAYWAVE_TILE_ROWS pixels. OpenCL C 1.2.
#include "kernels/common/complex_lanes.h"
#include "kernels/common/double_single.h"
#include "kernels/common/lanes.h"
#include "kernels/common/phase.h"
#include "kernels/common/shared.h"
#include "kernels/gather/compact.h"
#include "kernels/gather/options.h"
#include "kernels/gather/phases.h"
#include "kernels/gather/radiance_towards.h"
#include "kernels/samples/visibility.h"
#include "kernels/scene/shade.h"

// Lines of a partly hidden sample: one for each row of parts, and two beyond on each side
#define COMPACT_SPLINES (RAYWAVE_VISIBILITY_PARTS + 4)
// Lines of any sample, at most
#define COMPACT_SPLINES_OR_LINES \
  (COMPACT_SPLINES > COMPACT_MOST_LINES ? COMPACT_SPLINES : COMPACT_MOST_LINES)

// Numbers for path differences: only a few turns are left of them, so that floats do.
#if RAYWAVE_PRECISION == PRECISION_DOUBLE
typedef double real;
typedef DoubleSingle realv;
#define REAL_OF_DS(w) (w)
#define REAL_OF(v) DS_CONVERT(v)
#define REAL_TURNS(turns) ds_turns(turns)
#define REAL_TO_FLOAT(w) ds_high(w)
#define REAL_OF_TWO(high, low) ((double)(high) + (double)(low))
#else
typedef float real;
typedef floatv realv;
#define REAL_OF_DS(w) ds_high(w)
#define REAL_OF(v) (v)
#define REAL_TURNS(turns) (turns)
#define REAL_TO_FLOAT(w) (w)
#define REAL_OF_TWO(high, low) (high)
#endif

// 1: light is computed at every node; 0: at the knots. Polynomials in floats would lose what doubles
// are for.
#define LIGHT_AT_NODES (RAYWAVE_PRECISION == PRECISION_DOUBLE)

// A sample as the tile sees it. Metres, y downwards from the tile's origin pixel.
typedef struct {
  real x;
  real y;
  real z;
  real length;   // of (x, y, z)
  real squares;  // z0^2 - length^2
  real sine_x;   // x / length
  real sine_y;
  // Turns per metre by which the sample's direction differs from that of its footprint's middle
  real slope_x;
  real slope_y;
  real turns;  // at the origin pixel
  real kind;   // a sum of SEEN_CUT, SEEN_ROUGH and SEEN_SHINES
  real z0;     // of the virtual plane
  real rate;   // turns per metre
} Seen;

#define SEEN_CUT 1     // some of its light is too steep
#define SEEN_ROUGH 2   // its amplitude is no smooth function of the place on the tile
#define SEEN_SHINES 4  // it has highlights

static inline Seen load_seen(__global const real* seen, const CompactPlane* plane) {
  const Seen s = {seen[0],
                  seen[1],
                  seen[2],
                  seen[3],
                  seen[4],
                  seen[5],
                  seen[6],
                  seen[7],
                  seen[8],
                  seen[9],
                  seen[10],
                  REAL_OF_TWO(plane->z0, plane->z0_low),
                  REAL_OF_TWO(plane->turns_hi, plane->turns_lo)};
  return s;
}

static inline void store_seen(realv value, int member, int count, __global real* seen) {
#if RAYWAVE_LANES == 1
  (void)count;
  seen[member] = value;
#else
  real values[RAYWAVE_LANES];
  LANES_STORE(value, values);
  for (int lane = 0; lane < count; ++lane) seen[COMPACT_SEEN * lane + member] = values[lane];
#endif
}

// Samples, one per lane.
typedef struct {
  Surface surface;  // what highlights need
  floatv radiance;
  floatv tilt_x, tilt_y, tilt_z;
  intv hidden;
} SampleLanes;

// The first `count` samples; the last one once more in the other lanes.
static inline SampleLanes load_samples(__global const Sample* samples, int count) {
  float x[RAYWAVE_LANES], y[RAYWAVE_LANES], z[RAYWAVE_LANES], nx[RAYWAVE_LANES], ny[RAYWAVE_LANES],
      nz[RAYWAVE_LANES], radiance[RAYWAVE_LANES], specular[RAYWAVE_LANES], shininess[RAYWAVE_LANES],
      tilt_x[RAYWAVE_LANES], tilt_y[RAYWAVE_LANES], tilt_z[RAYWAVE_LANES];
  int hidden[RAYWAVE_LANES];
  for (int lane = 0; lane < RAYWAVE_LANES; ++lane) {
    __global const Sample* s = samples + min(lane, count - 1);
    x[lane] = s->x;
    y[lane] = s->y;
    z[lane] = s->z;
    nx[lane] = s->nx;
    ny[lane] = s->ny;
    nz[lane] = s->nz;
    radiance[lane] = s->radiance;
    specular[lane] = s->specular;
    shininess[lane] = s->shininess;
    tilt_x[lane] = s->tilt_x;
    tilt_y[lane] = s->tilt_y;
    tilt_z[lane] = s->tilt_z;
    hidden[lane] = s->hidden != 0;
  }
  SampleLanes s;
  s.surface.x = LANES_LOAD(x);
  s.surface.y = LANES_LOAD(y);
  s.surface.z = LANES_LOAD(z);
  s.surface.nx = LANES_LOAD(nx);
  s.surface.ny = LANES_LOAD(ny);
  s.surface.nz = LANES_LOAD(nz);
  s.surface.specular = LANES_LOAD(specular);
  s.surface.shininess = LANES_LOAD(shininess);
  s.radiance = LANES_LOAD(radiance);
  s.tilt_x = LANES_LOAD(tilt_x);
  s.tilt_y = LANES_LOAD(tilt_y);
  s.tilt_z = LANES_LOAD(tilt_z);
  s.hidden = LANES_LOAD(hidden) != 0;
  return s;
}

// Rays to so many places along one axis of the tile, on three lines, bound a footprint along it.
#define RAYS_ALONG 9

// First pixel, and number, of those that rays from samples to the tile come from, along one axis: s,
// half_m of it and other_s, other_half_m of the other.
static inline void footprint_along(floatv s, floatv other_s, floatv z, float z0, float half_m,
                                   float other_half_m, float pixels_per_sine, int most,
                                   floatv margin, intv* first, intv* count) {
  floatv low = 1e30f, high = -1e30f;
  for (int ray = 0; ray < 3 * RAYS_ALONG; ++ray) {
    const float u = ((float)(ray % RAYS_ALONG) * (2.0f / (RAYS_ALONG - 1)) - 1.0f) * half_m,
                v = ((float)(ray / RAYS_ALONG) - 1.0f) * other_half_m;
    const float reference = u / sqrt(u * u + v * v + z0 * z0);
    const floatv du = s - u, dv = other_s - v;
    const floatv x = pixels_per_sine * (du / sqrt(du * du + dv * dv + z * z) + reference);
    low = fmin(low, x);
    high = fmax(high, x);
  }
  const floatv limit = 1e9f;
  *first = LANES_TO_INT(ceil(clamp(low - margin, -limit, limit)));
  *count = LANES_TO_INT(floor(clamp(high + margin, -limit, limit))) + 1 - *first;
  *count += *count & 1;
  const intv beyond = max(*count - most, (intv)(0));
  *first += beyond / 2;
  *count -= beyond;
}

// Share of the smooth step that lies before the limit. It keeps the energy of a hard one: the
// integral of the step's square is 13 / 35.
#define CUT_BEFORE (1.0f - 13.0f / 35.0f)

// Mask of the samples some of whose light towards places within half_x and half_y of the tile's
// middle fades out because it is too steep.
static inline intv is_cut(floatv x, floatv y, floatv z, float half_x, float half_y,
                          const CompactPlane* plane) {
#if RAYWAVE_SINE_LIMIT
  const floatv across = fabs(x) + half_x, up = fabs(y) + half_y;
  const floatv x_length = sqrt(across * across + z * z), y_length = sqrt(up * up + z * z);
  return ((plane->sine_limit_x * x_length - across) * plane->per_cut_x < 1.0f - CUT_BEFORE) |
         ((plane->sine_limit_y * y_length - up) * plane->per_cut_y < 1.0f - CUT_BEFORE);
#else
  (void)x, (void)y, (void)z, (void)half_x, (void)half_y, (void)plane;
  return LANES_INDEX < 0;
#endif
}

// Mask of the samples whose amplitude is a smooth function of the direction to the tile, which lies
// within half_x and half_y of (tangent_x, tangent_y): their projected area is far from zero and from
// its limit, and highlights are wide against the tile.
//
// shines  samples with highlights
static inline intv is_smooth(const SampleLanes* s, intv shines, floatv tangent_x, floatv half_x,
                             floatv tangent_y, floatv half_y) {
  const floatv middle = s->tilt_x * tangent_x + s->tilt_y * tangent_y - s->tilt_z,
               change = fabs(s->tilt_x) * half_x + fabs(s->tilt_y) * half_y;
  const floatv shininess = s->surface.shininess;
  const intv wide = (shininess * (half_x * half_x + half_y * half_y) < 1.0f) & (shininess >= 8.0f);
  return (middle > 3.0f * change) & (middle + change < 4.0f) & (wide | !shines);
}

__kernel void aim(__global const Light* lights, __global const Sample* samples,
                  __global const uint* lit, int sample_count, CompactPlane plane,
                  __global CompactFootprint* footprints, __global float* seen) {
  const int index = (int)get_global_id(0) * RAYWAVE_LANES;
  if (index >= sample_count) return;
  const int count = min(RAYWAVE_LANES, sample_count - index);
  SampleLanes s = load_samples(samples + index, count);

  // The pixels that samples of this layer light
  const floatv x = s.surface.x - plane.origin_x, y = plane.origin_y - s.surface.y,
               z = s.surface.z - plane.hologram_z;
  const intv is_here = (plane.begin_z <= s.surface.z) & (s.surface.z < plane.end_z);
  const floatv margin =
      LANES_SELECT((floatv)(plane.margin), (floatv)(plane.rough_margin),
                   s.hidden | is_cut(x, y, z, plane.half_x, plane.half_y, &plane));
  intv left, columns, top, rows;
  footprint_along(x, y, z, plane.z0, plane.half_x, plane.half_y, plane.pixels_per_sine_x,
                  min(plane.nx, COMPACT_WIDEST), margin, &left, &columns);
  footprint_along(y, x, z, plane.z0, plane.half_y, plane.half_x, plane.pixels_per_sine_y,
                  min(plane.ny, COMPACT_WIDEST), margin, &top, &rows);
  int lefts[RAYWAVE_LANES], columnss[RAYWAVE_LANES], tops[RAYWAVE_LANES], rowss[RAYWAVE_LANES],
      liness[RAYWAVE_LANES];
  LANES_STORE(left, lefts);
  LANES_STORE(columns, columnss);
  LANES_STORE(top, tops);
  LANES_STORE(rows, rowss);
  LANES_STORE(
      LANES_SELECT((intv)(0), LANES_SELECT((intv)(plane.lines), (intv)(COMPACT_SPLINES), s.hidden),
                   is_here),
      liness);
  for (int lane = 0; lane < count; ++lane) {
    const bool lights_some = liness[lane] > 0;
    CompactFootprint footprint;
    footprint.left = lights_some ? lefts[lane] : 0;
    footprint.columns = lights_some ? columnss[lane] : 0;
    footprint.top = lights_some ? tops[lane] : 0;
    footprint.rows = lights_some ? rowss[lane] : 0;
    footprint.lines = liness[lane];
    footprints[index + lane] = footprint;
  }

  // The samples as the tile sees them
  __global real* out = (__global real*)seen + COMPACT_SEEN * (size_t)index;
  const floatv zero = 0.0f;
  const DoubleSingle far_x =
                         ds_minus(ds(s.surface.x, zero), ds(plane.origin_x, plane.origin_x_low)),
                     far_y =
                         ds_minus(ds(plane.origin_y, plane.origin_y_low), ds(s.surface.y, zero)),
                     far_z = ds_minus(ds(s.surface.z, zero),
                                      ds(plane.hologram_z, plane.hologram_z_low)),
                     z0 = ds(plane.z0, plane.z0_low), rate = ds(plane.turns_hi, plane.turns_lo);
  const DoubleSingle3 path = {far_x, far_y, far_z};
  const DoubleSingle length = ds_sqrt(ds3_dot(path, path)), nearer = ds_minus(z0, length);
  const DoubleSingle sine_x = ds_over(far_x, length), sine_y = ds_over(far_y, length);
  store_seen(REAL_OF_DS(far_x), 0, count, out);
  store_seen(REAL_OF_DS(far_y), 1, count, out);
  store_seen(REAL_OF_DS(far_z), 2, count, out);
  store_seen(REAL_OF_DS(length), 3, count, out);
  store_seen(REAL_OF_DS(ds_times(nearer, ds_plus(z0, length))), 4, count, out);
  store_seen(REAL_OF_DS(sine_x), 5, count, out);
  store_seen(REAL_OF_DS(sine_y), 6, count, out);
  // The footprint's middle lies half a pixel from the one that counts as its middle.
  const intv twice_x = 2 * left + columns - 1, twice_y = 2 * top + rows - 1;
  store_seen(REAL_OF_DS(ds_minus(ds_times(sine_x, rate), ds_steps(twice_x, 0.5f * plane.frequency_x,
                                                                  0.5f * plane.frequency_x_low))),
             7, count, out);
  store_seen(REAL_OF_DS(ds_minus(ds_times(sine_y, rate), ds_steps(twice_y, 0.5f * plane.frequency_y,
                                                                  0.5f * plane.frequency_y_low))),
             8, count, out);
  store_seen(REAL_OF(-ds_turns(ds_times(nearer, rate))), 9, count, out);

  // How their amplitudes depend on the direction
  const floatv tangent_x = -x / z, half_x = 0.5f * plane.period_x / z, tangent_y = y / z,
               half_y = 0.5f * plane.period_y / z;
  // The bell reaches beyond the tile.
  const intv cut =
      is_cut(x, y, z, plane.period_x - plane.half_x, plane.period_y - plane.half_y, &plane);
  const intv shines = shine_within(lights, lit, index, count, s.radiance, &s.surface, tangent_x,
                                   half_x, tangent_y, half_y);
  const intv rough = !is_smooth(&s, shines, tangent_x, half_x, tangent_y, half_y);
  const floatv kind = LANES_SELECT((floatv)(0.0f), (floatv)(SEEN_CUT), cut) +
                      LANES_SELECT((floatv)(0.0f), (floatv)(SEEN_ROUGH), rough) +
                      LANES_SELECT((floatv)(0.0f), (floatv)(SEEN_SHINES), shines);
  store_seen(REAL_OF(kind), 10, count, out);
}

// A smooth step where light becomes too steep for the pixels, as wide as 1 / per_cut.
static inline floatv shown_share(floatv offset, floatv length, float sine_limit, float per_cut) {
#if RAYWAVE_SINE_LIMIT
  const floatv e = clamp((sine_limit * length - fabs(offset)) * per_cut + CUT_BEFORE,
                         (floatv)(0.0f), (floatv)(1.0f));
  return e * e * (3.0f - 2.0f * e);
#else
  (void)offset, (void)length, (void)sine_limit, (void)per_cut;
  return 1.0f;
#endif
}

// Light at nodes on both sides of the middle one: sums and differences of each pair, which share the
// rotors, and the light of the middle node.
typedef struct {
  float even_re[COMPACT_NODES];
  float even_im[COMPACT_NODES];
  float odd_re[COMPACT_NODES];
  float odd_im[COMPACT_NODES];
  float middle_re;
  float middle_im;
} Nodes;

static inline void set_nodes(int node, floatv right_re, floatv right_im, floatv left_re,
                             floatv left_im, Nodes* nodes) {
  LANES_STORE(right_re + left_re, nodes->even_re + node);
  LANES_STORE(right_im + left_im, nodes->even_im + node);
  LANES_STORE(right_re - left_re, nodes->odd_re + node);
  LANES_STORE(right_im - left_im, nodes->odd_im + node);
}

// Stores pixels `pixel` and on, right of the middle, and those left of it. A profile has room for
// whole packets of eight.
static inline void store_pixels(floatv right, floatv left, int pixel, int count,
                                __global float* middle) {
  const floatv mirrored = LANES_REVERSED(left);
#if RAYWAVE_LANES == 16
  if (count - pixel <= 8) {
    vstore8(right.lo, 0, middle + pixel);
    vstore8(mirrored.hi, 0, middle - pixel - 8);
    return;
  }
#endif
  (void)count;
  LANES_STORE(right, middle + pixel);
  LANES_STORE(mirrored, middle - pixel - RAYWAVE_LANES);
}

// Writes the transform of the light at 2 half_nodes + 1 nodes: `count` pixels on each side of the
// middle, in whole packets, times the signs that pixels of odd places change. They bring the tile
// into the transform's middle. Pixels on both sides share the rotors, too.
//
// out_re, out_im  the first pixel right of the middle
static inline void transform(const Nodes* nodes, int n, int half_nodes,
                             __global const float* rotors, int count, __global float* out_re,
                             __global float* out_im) {
  for (int pixel = 0; pixel < count; pixel += RAYWAVE_LANES) {
    const floatv sign = 1.0f - 2.0f * LANES_TO_FLOAT((pixel + LANES_INDEX) & 1);
    __global const float* turns = rotors + pixel;
    floatv even_cos = sign * nodes->middle_re, im_cos = sign * nodes->middle_im, im_sin = 0.0f,
           re_sin = 0.0f;
    for (int node = 0; node < half_nodes; ++node, turns += n) {
      const floatv c = LANES_LOAD(turns), s = LANES_LOAD(turns + n / 2);
      even_cos += nodes->even_re[node] * c;
      im_sin += nodes->odd_im[node] * s;
      im_cos += nodes->even_im[node] * c;
      re_sin += nodes->odd_re[node] * s;
    }
    store_pixels(even_cos - im_sin, -(even_cos + im_sin), pixel, count, out_re);
    store_pixels(im_cos + re_sin, re_sin - im_cos, pixel, count, out_im);
  }
}

// Light of amplitude 1 at places (u, v) of the tile, less its phase at (0, v) and with its
// footprint's middle turned to zero: turns, and the weight 1 / distance.
static inline void light_on_row(const Seen* s, realv u, realv v, realv* turns, floatv* weight) {
  const real one = 1, two = 2;
  const realv down = v * (v - two * s->y);  // of squared lengths, from the origin to (0, v)
  const realv column_length = sqrt(s->length * s->length + down),
              column_reference = sqrt(s->z0 * s->z0 + v * v);
  const realv across = u * (u - two * s->x);
  const realv r = sqrt(column_length * column_length + across),
              c = sqrt(column_reference * column_reference + u * u);
  const realv squares = s->squares + two * v * s->y;
  const realv column_nearer = squares / (column_reference + column_length),
              column_beyond = down / (column_length + s->length);
  // c - r and the same at u = 0, over the sums that stand below u^2; r and the column's length,
  // beyond the sample's own. Quotients share their divisions.
  const realv sum = r + column_length, references = c + column_reference, own = r + s->length;
  const realv first = one / ((c + r) * own), second = one / (sum * references * r);
  const realv nearer = (squares + two * u * s->x) * own * first,
              beyond = (across + down) * (c + r) * first + column_beyond;
  *turns = s->rate *
               (u * r * second * (u * (nearer + column_nearer) + s->sine_x * beyond * references)) -
           u * s->slope_x;
  *weight = REAL_TO_FLOAT(sum * references * second);
}

// Turns of light on the column u = 0, likewise.
static inline realv turns_on_column(const Seen* s, realv v) {
  const real two = 2;
  const realv down = v * (v - two * s->y);
  const realv r = sqrt(s->length * s->length + down), c = sqrt(s->z0 * s->z0 + v * v);
  const realv nearer = (s->squares + two * v * s->y) / (c + r);
  const real own_nearer = s->squares / (s->z0 + s->length);
  const realv sum = r + s->length;
  const realv bend = v * v * (nearer + own_nearer) / (sum * (c + s->z0));
  return s->rate * (bend + v * s->sine_y * (down / (sum * sum))) - v * s->slope_y;
}

// Values at the knots of a line: the first half right of the middle, then those left of it in the
// same order. The polynomial through them at nodes on both sides of the middle one.
//
// basis  rows of weights from the knots' first on
static inline void between_knots(const float* values, int knots, __global const float* basis, int n,
                                 int node, floatv* right, floatv* left) {
  floatv even = 0.0f, odd = 0.0f;
  for (int knot = 0; knot < knots / 2; ++knot) {
    __global const float* row = basis + knot * COMPACT_NODE_ROOM(n) + node;
    even += (values[knot] + values[knot + knots / 2]) * LANES_LOAD(row);
    odd += (values[knot] - values[knot + knots / 2]) * LANES_LOAD(row + n);
  }
  *right = even + odd;
  *left = even - odd;
}

// The same at the middle node.
static inline float between_middle_knots(const float* values, int knots,
                                         __global const float* basis, int n) {
  float even = 0.0f;
  for (int knot = 0; knot < knots / 2; ++knot)
    even += (values[knot] + values[knot + knots / 2]) * basis[knot * COMPACT_NODE_ROOM(n) + 2 * n];
  return even;
}

// What `profile` knows of a sample and its tile.
typedef struct {
  __global const Light* lights;
  __global const Sample* sample;
  __global const uint* lit;
  const CompactPlane* plane;
  Seen seen;
  float plain;  // amplitude without highlights
} Profiled;

// Share of light, and amplitude, towards places (u, v) of the tile of a sample that is not smooth.
static inline floatv rough_amplitude(const Profiled* p, bool cut, bool rough, bool shines, floatv u,
                                     float v) {
  const float x = (float)p->seen.x, y = (float)p->seen.y, z = (float)p->seen.z;
  const floatv offset = u - x;
  const float down = v - y;
  floatv amplitude = 1.0f;
  if (rough)
    amplitude = amplitude_towards(p->lights, p->lit, p->sample, p->plain, shines, offset / z,
                                  (floatv)(-down / z));
  if (cut)
    amplitude *= shown_share(offset, sqrt(offset * offset + down * down + z * z),
                             p->plane->sine_limit_x, p->plane->per_cut_x);
  return amplitude;
}

// The share of the light along a row that hidden samples show at nodes.
//
// seen_parts  bits of the row's parts
// weights     of the first spline at these nodes
static inline floatv seen_share(uint seen_parts, __global const float* weights, int n) {
  floatv share = 0.0f;
#if RAYWAVE_VISIBILITY_PARTS > 0
  for (int part = 0; part < COMPACT_SPLINES; ++part) {
    if (seen_parts >> clamp(part - 2, 0, RAYWAVE_VISIBILITY_PARTS - 1) & 1u)
      share += LANES_LOAD(weights + part * COMPACT_NODE_ROOM(n));
  }
#else
  (void)seen_parts, (void)weights, (void)n;
#endif
  return share;
}

__kernel void profile(__global const Light* lights, __global const Sample* samples,
                      __global const uint* lit, __global const uint* visibility_masks,
                      __global const CompactFootprint* footprints, __global const float* all_seen,
                      __global const int* offsets, __global const float* rotors,
                      __global const float* weights, int first_sample, int count,
                      CompactPlane plane, __global float* profiles) {
  const int number = (int)get_global_id(0);
  if (number >= count) return;
  const size_t index = (size_t)(first_sample + number);
  const CompactFootprint footprint = footprints[index];
  if (footprint.lines == 0) return;
  __global const Sample* sample = samples + index;
  const bool hidden = sample->hidden;
  const Profiled p = {lights,
                      sample,
                      lit + index * (size_t)((RAYWAVE_LIGHTS + 31) / 32),
                      &plane,
                      load_seen((__global const real*)all_seen + COMPACT_SEEN * index, &plane),
                      sqrt(sample->radiance) * sample->weight};
  const Seen* seen = &p.seen;
  const int kind = (int)seen->kind;
  const bool cut = (kind & SEEN_CUT) != 0, shines = (kind & SEEN_SHINES) != 0,
             rough = LIGHT_AT_NODES || (kind & SEEN_ROUGH) != 0;

  // Nodes and pixels of both axes
  const int nx = COMPACT_NODES_FOR(footprint.columns), ny = COMPACT_NODES_FOR(footprint.rows);
  const int half_x = COMPACT_HALF_NODES(nx, plane.nx, plane.tile_nx),
            half_y = COMPACT_HALF_NODES(ny, plane.ny, plane.tile_ny);
  const float step_x = plane.period_x / (float)nx, step_y = plane.period_y / (float)ny;
  const int room_x = COMPACT_ROOM(footprint.columns), room_y = COMPACT_ROOM(footprint.rows);
  const int splines = RAYWAVE_VISIBILITY_PARTS > 0 ? COMPACT_SPLINES : 0, knots = plane.knots,
            rows_of_weights = COMPACT_WEIGHTS(plane.lines, splines, knots);
  __global const float *weights_x = weights + COMPACT_WEIGHTS_BEFORE(nx, rows_of_weights),
                       *weights_y = weights + COMPACT_WEIGHTS_BEFORE(ny, rows_of_weights);
  const int first_line = hidden ? plane.lines : 0, knot_rows = 1 + 2 * splines + plane.lines;
#if LIGHT_AT_NODES
  (void)knot_rows;
#endif

  // The column's light, which all lines share
  float right_re[COMPACT_NODES], right_im[COMPACT_NODES], left_re[COMPACT_NODES],
      left_im[COMPACT_NODES];
#if !LIGHT_AT_NODES
  float turns[COMPACT_SPLINES_OR_LINES * COMPACT_MOST_KNOTS + 16];
  float light[COMPACT_SPLINES_OR_LINES * COMPACT_MOST_KNOTS + 16];
  __global const float* knots_y = weights_y + (knot_rows + knots / 2) * COMPACT_NODE_ROOM(ny);
  for (int knot = 0; knot < knots; knot += RAYWAVE_LANES)
    LANES_STORE(
        turns_on_column(seen, LANES_LOAD(weights + COMPACT_KNOT_ROOM + knot) * plane.half_y),
        turns + knot);
#endif
  const float y = (float)seen->y;
  for (int node = 0; node < half_y; node += RAYWAVE_LANES) {
    const floatv v = LANES_TO_FLOAT(node + 1 + LANES_INDEX) * step_y;
    floatv right, left;
#if LIGHT_AT_NODES
    right = REAL_TURNS(turns_on_column(seen, REAL_OF(v)));
    left = REAL_TURNS(turns_on_column(seen, REAL_OF(-v)));
#else
    between_knots(turns, knots, knots_y, ny, node, &right, &left);
#endif
    floatv share_right = 1.0f, share_left = 1.0f;
    if (cut) {
      const float far = (float)(seen->x * seen->x + seen->z * seen->z);
      share_right =
          shown_share(v - y, sqrt((v - y) * (v - y) + far), plane.sine_limit_y, plane.per_cut_y);
      share_left =
          shown_share(v + y, sqrt((v + y) * (v + y) + far), plane.sine_limit_y, plane.per_cut_y);
    }
    floatv re, im;
    cos_sin_turns(right + (float)seen->turns, &re, &im);
    LANES_STORE(share_right * re, right_re + node);
    LANES_STORE(share_right * im, right_im + node);
    cos_sin_turns(left + (float)seen->turns, &re, &im);
    LANES_STORE(share_left * re, left_re + node);
    LANES_STORE(share_left * im, left_im + node);
  }
  floatv middle_re, middle_im;
  cos_sin_turns((floatv)((float)seen->turns), &middle_re, &middle_im);
  const float middle_share =
      !cut ? 1.0f
           : LANES_FIRST(shown_share((floatv)(y), (floatv)((float)seen->length), plane.sine_limit_y,
                                     plane.per_cut_y));

#if !LIGHT_AT_NODES
  // Light at the knots of all lines
  __global const float* knots_x = weights_x + knot_rows * COMPACT_NODE_ROOM(nx);
  for (int at = 0; at < footprint.lines * knots; at += RAYWAVE_LANES) {
    const floatv u = LANES_LOAD(weights + (at & (knots - 1))) * plane.half_x,
                 v = LANES_LOAD(weights + COMPACT_PLACES_OF_LINES + first_line * knots + at) *
                     plane.half_y;
    floatv turned, weight;
    light_on_row(seen, u, v, &turned, &weight);
    if (!rough) {
      const float z = (float)seen->z;
      weight *= amplitude_towards(lights, p.lit, sample, p.plain, shines, (u - (float)seen->x) / z,
                                  (y - v) / z);
    }
    LANES_STORE(turned, turns + at);
    LANES_STORE(weight, light + at);
  }
#endif

  // Pixels of odd places change their sign.
  const int odd = (footprint.left + footprint.columns / 2 + footprint.top + footprint.rows / 2) & 1;
  const float sign = odd ? -1.0f : 1.0f;
  __global float* out = profiles + offsets[index];
  Nodes nodes;
  for (int line = 0; line < footprint.lines; ++line) {
    const float v = weights[COMPACT_PLACES_OF_LINES + (first_line + line) * knots] * plane.half_y;
    uint seen_parts = 0;
#if RAYWAVE_VISIBILITY_PARTS > 0
    // Rows of a mask count upwards; parts beyond the window see what the outermost see.
    const int row = clamp(RAYWAVE_VISIBILITY_PARTS + 1 - line, 0, RAYWAVE_VISIBILITY_PARTS - 1);
    if (hidden) seen_parts = visibility_row(visibility_masks + index * VISIBILITY_WORDS, row);
#endif
    for (int node = 0; node < half_x; node += RAYWAVE_LANES) {
      const floatv u = LANES_TO_FLOAT(node + 1 + LANES_INDEX) * step_x;
      floatv turns_right, turns_left, weight_right, weight_left;
#if LIGHT_AT_NODES
      realv turned;
      light_on_row(seen, REAL_OF(u), REAL_OF((floatv)(v)), &turned, &weight_right);
      turns_right = REAL_TURNS(turned);
      light_on_row(seen, REAL_OF(-u), REAL_OF((floatv)(v)), &turned, &weight_left);
      turns_left = REAL_TURNS(turned);
#else
      between_knots(turns + line * knots, knots, knots_x, nx, node, &turns_right, &turns_left);
      between_knots(light + line * knots, knots, knots_x, nx, node, &weight_right, &weight_left);
#endif
      const floatv bell = sign * LANES_LOAD(weights_x + node);
      weight_right *= bell;
      weight_left *= bell;
      if (cut || rough) {
        weight_right *= rough_amplitude(&p, cut, rough, shines, u, v);
        weight_left *= rough_amplitude(&p, cut, rough, shines, -u, v);
      }
      if (hidden) {
        __global const float* spline = weights_x + COMPACT_NODE_ROOM(nx) + node;
        weight_right *= seen_share(seen_parts, spline, nx);
        weight_left *= seen_share(seen_parts, spline + nx, nx);
      }
      floatv c, s, left_c, left_s;
      cos_sin_turns(turns_right, &c, &s);
      cos_sin_turns(turns_left, &left_c, &left_s);
      set_nodes(node, weight_right * c, weight_right * s, weight_left * left_c,
                weight_left * left_s, &nodes);
    }
    float middle;
#if LIGHT_AT_NODES
    realv unused;
    floatv middle_weight;
    light_on_row(seen, REAL_OF((floatv)(0.0f)), REAL_OF((floatv)(v)), &unused, &middle_weight);
    middle = LANES_FIRST(middle_weight);
#else
    middle = between_middle_knots(light + line * knots, knots, knots_x, nx);
#endif
    middle *= sign * weights_x[2 * nx];
    if (cut || rough)
      middle *= LANES_FIRST(rough_amplitude(&p, cut, rough, shines, (floatv)(0.0f), v));
    if (hidden)
      middle *= LANES_FIRST(seen_share(seen_parts, weights_x + COMPACT_NODE_ROOM(nx) + 2 * nx, nx));
    nodes.middle_re = middle;
    nodes.middle_im = 0.0f;
    transform(&nodes, nx, half_x, rotors + COMPACT_ROTORS_BEFORE(nx), footprint.columns / 2,
              out + room_x / 2, out + room_x + room_x / 2);
    out += 2 * room_x;

    __global const float* basis =
        weights_y + (1 + splines + first_line + line) * COMPACT_NODE_ROOM(ny);
    for (int node = 0; node < half_y; node += RAYWAVE_LANES) {
      const floatv right = LANES_LOAD(basis + node), left = LANES_LOAD(basis + ny + node);
      set_nodes(node, right * LANES_LOAD(right_re + node), right * LANES_LOAD(right_im + node),
                left * LANES_LOAD(left_re + node), left * LANES_LOAD(left_im + node), &nodes);
    }
    middle = basis[2 * ny] * middle_share;
    nodes.middle_re = middle * LANES_FIRST(middle_re);
    nodes.middle_im = middle * LANES_FIRST(middle_im);
    transform(&nodes, ny, half_y, rotors + COMPACT_ROTORS_BEFORE(ny), footprint.rows / 2,
              out + room_y / 2, out + room_y + room_y / 2);
    out += 2 * room_y;
  }
}

// The pixels of a work-item and their sums.
typedef struct {
  int top;  // row of the plane
  floatv re[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
  floatv im[RAYWAVE_FRAMES][RAYWAVE_TILE_ROWS];
} Tile;

// A sample in a work-item: its profiles from some line on. X counts from the work-item's first
// column, where it is `inside` the footprint, Y from its first row.
typedef struct {
  __global const float* across;
  __global const float* up;
  intv inside;
  int lines;  // that are left
  int room_x;
  int room_y;
  int stride;    // floats of a line
  int from, to;  // rows of the work-item
  __global const float2* phasors;
  int sample_count;
} Part;

// X of a line, with the sample's phase where there is one only; zeros where no line is left.
static inline void load_line(const Part* p, int line, floatv* re, floatv* im) {
  const intv inside = p->inside & (line < p->lines ? -1 : 0);
  __global const float* across = p->across + (line < p->lines ? line * p->stride : 0);
  *re = LANES_SELECT((floatv)(0.0f), LANES_LOAD(across), inside);
  *im = LANES_SELECT((floatv)(0.0f), LANES_LOAD(across + p->room_x), inside);
#if RAYWAVE_FRAMES == 1
  const float2 phasor = p->phasors[0];
  const floatv turned = *re * phasor.x - *im * phasor.y;
  *im = *re * phasor.y + *im * phasor.x;
  *re = turned;
#endif
}

static inline void add_to_tile(const Part* p, int row, floatv re, floatv im, Tile* tile) {
#if RAYWAVE_FRAMES == 1
  (void)p;
  tile->re[0][row] += re;
  tile->im[0][row] += im;
#else
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    const float2 phasor = p->phasors[(size_t)frame * (size_t)p->sample_count];
    tile->re[frame][row] += re * phasor.x - im * phasor.y;
    tile->im[frame][row] += re * phasor.y + im * phasor.x;
  }
#endif
}

// Adds two lines, or the only one that is left, to the work-item.
static inline void add_two_lines(const Part* p, Tile* tile) {
  floatv re0, im0, re1, im1;
  load_line(p, 0, &re0, &im0);
  load_line(p, 1, &re1, &im1);
  const int room = p->room_y;
  for (int row = p->from; row < p->to; ++row) {
    __global const float *up0 = p->up + row, *up1 = up0 + (p->lines > 1 ? p->stride : 0);
    floatv re = re0 * up0[0], im = re0 * up0[room];
    re -= im0 * up0[room];
    im += im0 * up0[0];
    re += re1 * up1[0];
    im += re1 * up1[room];
    re -= im1 * up1[room];
    im += im1 * up1[0];
    add_to_tile(p, row, re, im, tile);
  }
}

// The same of four lines, or three.
static inline void add_four_lines(const Part* p, Tile* tile) {
  floatv re0, im0, re1, im1, re2, im2, re3, im3;
  load_line(p, 0, &re0, &im0);
  load_line(p, 1, &re1, &im1);
  load_line(p, 2, &re2, &im2);
  load_line(p, 3, &re3, &im3);
  const int room = p->room_y;
  for (int row = p->from; row < p->to; ++row) {
    __global const float *up0 = p->up + row, *up1 = up0 + p->stride, *up2 = up1 + p->stride,
                         *up3 = up2 + (p->lines > 3 ? p->stride : 0);
    floatv re = re0 * up0[0], im = re0 * up0[room];
    re -= im0 * up0[room];
    im += im0 * up0[0];
    re += re1 * up1[0];
    im += re1 * up1[room];
    re -= im1 * up1[room];
    im += im1 * up1[0];
    re += re2 * up2[0];
    im += re2 * up2[room];
    re -= im2 * up2[room];
    im += im2 * up2[0];
    re += re3 * up3[0];
    im += re3 * up3[room];
    re -= im3 * up3[room];
    im += im3 * up3[0];
    add_to_tile(p, row, re, im, tile);
  }
}

__kernel void gather_compact(__global const CompactFootprint* footprints,
                             __global const int* offsets, __global const float* profiles,
                             __global const float2* phasors, int sample_count,
                             __global const int* first_of_bin, __global const int* bin_samples,
                             __global const int* is_fresh, int first_fresh, int first_bin,
                             int first_row, CompactPlane plane, __global float2* field) {
  const int first = (int)get_global_id(0) * RAYWAVE_LANES;
  const int strip = (int)get_global_id(1) * RAYWAVE_TILE_ROWS, bin_row = strip / COMPACT_BIN;
  if (first >= plane.nx || bin_row >= plane.ny / COMPACT_BIN) return;
  Tile tile;
  tile.top = (first_row * COMPACT_BIN + strip) % plane.ny;
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    for (int row = 0; row < RAYWAVE_TILE_ROWS; ++row)
      tile.re[frame][row] = tile.im[frame][row] = 0.0f;
  }
  const int bin = first_bin + bin_row * (plane.nx / COMPACT_BIN) + first / COMPACT_BIN;
  for (int entry = first_of_bin[bin]; entry < first_of_bin[bin + 1]; ++entry) {
    const int index = bin_samples[entry];
    const CompactFootprint footprint = footprints[index];
    const int room_x = COMPACT_ROOM(footprint.columns), room_y = COMPACT_ROOM(footprint.rows);
    const int stride = 2 * (room_x + room_y);
    const int across_middle = room_x / 2 - footprint.columns / 2,
              up_middle = room_y / 2 - footprint.rows / 2;
    __global const float* middle_across = profiles + offsets[index] + room_x / 2;
    __global const float* middle_up = profiles + offsets[index] + 2 * room_x + room_y / 2;
    // The footprint may begin right of the work-item's columns or below its rows, or reach them
    // from the period before.
    int column = (first - footprint.left) % plane.nx, top = (tile.top - footprint.top) % plane.ny;
    column += column < 0 ? plane.nx : 0;
    top += top < 0 ? plane.ny : 0;
    for (int left = column; left > -RAYWAVE_LANES; left -= plane.nx) {
      if (left >= footprint.columns) continue;
      Part part;
      part.inside = (left + LANES_INDEX >= 0) & (left + LANES_INDEX < footprint.columns);
      part.room_x = room_x;
      part.room_y = room_y;
      part.stride = stride;
      part.phasors = phasors + index;
      part.sample_count = sample_count;
      for (int above = top; above > -RAYWAVE_TILE_ROWS; above -= plane.ny) {
        part.from = max(0, -above);
        part.to = min(RAYWAVE_TILE_ROWS, footprint.rows - above);
        if (part.from >= part.to) continue;
        part.across = middle_across + (left - footprint.columns / 2);
        part.up = middle_up + (above - footprint.rows / 2);
        for (part.lines = footprint.lines; part.lines > 0; part.lines -= 4) {
          if (part.lines > 2)
            add_four_lines(&part, &tile);
          else
            add_two_lines(&part, &tile);
          part.across += 4 * stride;
          part.up += 4 * stride;
        }
      }
    }
  }
  for (int frame = 0; frame < RAYWAVE_FRAMES; ++frame) {
    for (int row = 0; row < RAYWAVE_TILE_ROWS; ++row) {
      __global float2* out =
          field + ((size_t)frame * (size_t)plane.ny + (size_t)(tile.top + row)) * (size_t)plane.nx +
          (size_t)first;
      floatv re = 0.0f, im = 0.0f;
      if (!is_fresh[first_fresh + bin_row]) load_complex(out, &re, &im);
      store_complex(re + tile.re[frame][row], im + tile.im[frame][row], out);
    }
  }
}
