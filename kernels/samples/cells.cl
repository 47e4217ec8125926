// SPDX-License-Identifier: Apache-2.0
// Where the samples of each cell of a band begin in the sample table, from the sums of counts that
// find_samples has left (samples.cl, kernels/common/scan.cl).
//
// place_cells  counts, first: of the band's cells, which begin with first_cell; first has one more.
//              first_of_cell: of the whole lattice. first_of_row: `first` of the first cell of each
//              row. found: largest number of samples in a cell (0 before), then `first` after the
//              last cell
//
// One work-item per cell, and one more. OpenCL C 1.2.
__kernel void place_cells(__global const int2* counts, __global const int2* first, int cells,
                          int first_cell, int nx, __global int* first_of_cell,
                          __global int2* first_of_row, __global int* found) {
  const int cell = (int)get_global_id(0);
  if (cell > cells) return;
  first_of_cell[first_cell + cell] = first[cell].x;
  if ((first_cell + cell) % nx == 0) first_of_row[(first_cell + cell) / nx] = first[cell];
  if (cell < cells) {
    atomic_max(found, counts[cell].x);
  } else {
    found[1] = first[cell].x;
    found[2] = first[cell].y;
  }
}
