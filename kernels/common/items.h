// SPDX-License-Identifier: Apache-2.0
// The items of a launch, for kernels whose work is regular. With RAYWAVE_FPGA one work-item does
// it all, in loops that a pipeline can be made of; RAYWAVE_LANES is how far they are unrolled.
// cl/program.cpp sets it for accelerators, and launches such kernels so.
#ifndef RAYWAVE_ITEMS_H
#define RAYWAVE_ITEMS_H

// FOR_ITEMS: for each i from 0 to count, which is `place` in a launch of one item for each.
#ifdef RAYWAVE_FPGA
#define SINGLE_ITEM_KERNEL \
  __kernel __attribute__((reqd_work_group_size(1, 1, 1), uses_global_work_offset(0)))
#define FOR_ITEMS(i, count, place) for (int i = 0; i < (count); ++i)
#define ITEM(axis) 0
#define ITEMS(axis) 1
#else
#define SINGLE_ITEM_KERNEL __kernel
#define FOR_ITEMS(i, count, place) for (int i = (int)(place); i < (count); i = (count))
#define ITEM(axis) (int)get_global_id(axis)
#define ITEMS(axis) (int)get_global_size(axis)
#endif

// How many of a length cover n.
#define TO_COVER(n, length) (((n) + (length)-1) / (length))

#endif
