// SPDX-License-Identifier: Apache-2.0
// Packets of RAYWAVE_LANES complex samples: interleaved in memory, separate vectors of real and
// imaginary parts in registers. Function calls and interleaved arithmetic would stop PoCL's
// vectoriser.
#ifndef RAYWAVE_COMPLEX_LANES_H
#define RAYWAVE_COMPLEX_LANES_H

#include "kernels/common/lanes.h"

// Real and imaginary parts of samples that were loaded from memory into two vectors.
static inline void split_complex(floatv first, floatv second, floatv* re, floatv* im) {
#if RAYWAVE_LANES == 1
  *re = first;
  *im = second;
#elif RAYWAVE_LANES == 4  // one by one: oclgrind 21.10 crashes where halves of vectors are joined
  *re = (floatv)(first.s0, first.s2, second.s0, second.s2);
  *im = (floatv)(first.s1, first.s3, second.s1, second.s3);
#else
  *re = (floatv)(first.even, second.even);
  *im = (floatv)(first.odd, second.odd);
#endif
}

#if RAYWAVE_LANES == 1
static inline void load_complex(const __global float2* p, floatv* re, floatv* im) {
  *re = p->x;
  *im = p->y;
}
static inline void store_complex(floatv re, floatv im, __global float2* p) {
  *p = (float2)(re, im);
}
#elif RAYWAVE_LANES == 16
static inline void load_complex(const __global float2* p, floatv* re, floatv* im) {
  split_complex(vload16(0, (const __global float*)p), vload16(1, (const __global float*)p), re, im);
}
static inline void store_complex(floatv re, floatv im, __global float2* p) {
  float16 a, b;
  a.even = re.lo;
  a.odd = im.lo;
  b.even = re.hi;
  b.odd = im.hi;
  vstore16(a, 0, (__global float*)p);
  vstore16(b, 1, (__global float*)p);
}
#else
#if RAYWAVE_LANES == 4
typedef float8 complexv;
#define COMPLEX_LOAD vload8
#define COMPLEX_STORE vstore8
#else
typedef float16 complexv;
#define COMPLEX_LOAD vload16
#define COMPLEX_STORE vstore16
#endif
static inline void load_complex(const __global float2* p, floatv* re, floatv* im) {
  const complexv z = COMPLEX_LOAD(0, (const __global float*)p);
  *re = z.even;
  *im = z.odd;
}
static inline void store_complex(floatv re, floatv im, __global float2* p) {
  complexv z;
  z.even = re;
  z.odd = im;
  COMPLEX_STORE(z, 0, (__global float*)p);
}
#endif

// Loads the first `count` samples of the packet, or the whole packet where `count` exceeds it; the
// others are zero.
static inline void load_some_complex(const __global float2* p, int count, floatv* re, floatv* im) {
  if (count >= RAYWAVE_LANES) {
    load_complex(p, re, im);
    return;
  }
  float res[RAYWAVE_LANES], ims[RAYWAVE_LANES];
  for (int i = 0; i < RAYWAVE_LANES; ++i) {
    res[i] = i < count ? p[i].x : 0.0f;
    ims[i] = i < count ? p[i].y : 0.0f;
  }
  *re = LANES_LOAD(res);
  *im = LANES_LOAD(ims);
}

// Stores the first `count` samples of the packet, or the whole packet where `count` exceeds it.
static inline void store_some_complex(floatv re, floatv im, __global float2* p, int count) {
  if (count >= RAYWAVE_LANES) {
    store_complex(re, im, p);
    return;
  }
  float res[RAYWAVE_LANES], ims[RAYWAVE_LANES];
  LANES_STORE(re, res);
  LANES_STORE(im, ims);
  for (int i = 0; i < count; ++i) p[i] = (float2)(res[i], ims[i]);
}

#endif
