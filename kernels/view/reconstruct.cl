// SPDX-License-Identifier: Apache-2.0
// Adds the intensity of a tile to a larger picture. OpenCL C 1.2.

// intensity[y0 + y, x0 + x] += weight |field[y, x]|^2 for the part of the tile, nx columns wide,
// that lies in the window of window_nx columns. x0, y0: position of the tile's first sample in the
// window; columns, rows: size of the part in the window.
__kernel void add_intensity(const __global float2* restrict field,
                            __global float* restrict intensity, int nx, int window_nx, int x0,
                            int y0, int columns, int rows, float weight) {
  const int row = (int)get_global_id(1);
  if (row >= rows) return;
  const __global float2* source = field + (size_t)nx * (size_t)row;
  __global float* target = intensity + (size_t)window_nx * (size_t)(y0 + row) + x0;
  const int step = (int)get_global_size(0);
  for (int i = (int)get_global_id(0); i < columns; i += step) {
    const float2 u = source[i];
    target[i] += weight * (u.x * u.x + u.y * u.y);
  }
}
