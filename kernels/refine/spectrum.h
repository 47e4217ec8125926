// SPDX-License-Identifier: Apache-2.0
// Phases of a propagation over the spectrum, for kernels/refine/refine.cl and, compiled as C++, for
// host/refine/light_passes.cpp.
#ifndef RAYWAVE_REFINE_SPECTRUM_H
#define RAYWAVE_REFINE_SPECTRUM_H

#include "kernels/common/phase.h"

// Cosine and sine of turns b + more b^2, b being 1 - sqrt(1 - square). `square` sums the squares of
// the light's two sines; from 1 on there is no light. An angular spectrum's propagation over z
// turns by z / wavelength, and more than Fresnel's by more = z / (2 wavelength).
static inline void spectrum_phase(floatv square, float turns, float more, floatv* c, floatv* s) {
  const floatv bent = square / (1.0f + sqrt(fmax(1.0f - square, (floatv)(0.0f))));
  cos_sin_turns((turns + more * bent) * bent, c, s);
}

#endif
