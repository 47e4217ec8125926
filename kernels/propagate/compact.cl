// SPDX-License-Identifier: Apache-2.0
// The last step of compact propagation (transformed.h): from the transform of the virtual plane to
// the field on the hologram's tile.
//
// finish  field: rows of field_nx pixels; accumulate: the tile's light is added to it
//
// A work-item takes one row (get_global_id(1)) and every get_global_size(0)-th packet of it. OpenCL
// C 1.2.
#include "kernels/common/items.h"
#include "kernels/propagate/transformed.h"

SINGLE_ITEM_KERNEL void finish(TRANSFORMED_PARAMETERS, int field_nx, int field_ny, int accumulate,
                               __global float2* restrict field) {
  FOR_ITEMS(row, field_ny, get_global_id(1)) {
    const Transformed from = TRANSFORMED_OF_PARAMETERS;
    const __global float2* source = transformed_row(&from, row);
    __global float2* target = field + (size_t)field_nx * (size_t)row;
    const int step = RAYWAVE_LANES * ITEMS(0);
    for (int i = RAYWAVE_LANES * ITEM(0); i < field_nx; i += step) {
      floatv c, s, re, im;
      cos_sin_turns(reference_turns(&from, i, row), &c, &s);
      const floatv share = transformed_share(&from, i, row);
      load_transformed(&from, source + i, field_nx - i, &re, &im);
      floatv sum_re = share * (re * c - im * s), sum_im = share * (re * s + im * c);
      if (accumulate) {
        floatv old_re, old_im;
        load_some_complex(target + i, field_nx - i, &old_re, &old_im);
        sum_re += old_re;
        sum_im += old_im;
      }
      store_some_complex(sum_re, sum_im, target + i, field_nx - i);
    }
  }
}
