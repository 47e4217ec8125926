// SPDX-License-Identifier: Apache-2.0
// Sizes of compact gathering (compact.cl), for the device and, as C++, for
// host/trace/compact_gatherer.cpp.
#ifndef RAYWAVE_COMPACT_H
#define RAYWAVE_COMPACT_H

// Pixels per side of a bin: each has a list of the samples that light it
#define COMPACT_BIN 16

// A footprint is the transform of as many nodes as it has pixels, and a few, so that it does not
// meet itself in the next period. Their number is a multiple of COMPACT_STEP: each has a table of
// rotors, which lie one after another from the smallest on. The table for n has for each of n nodes
// the cosines, then the sines, of n pixels.
#define COMPACT_STEP 8
#define COMPACT_SPARE_NODES 6
#define COMPACT_NODES_FOR(pixels) \
  (((pixels) + COMPACT_SPARE_NODES + COMPACT_STEP - 1) / COMPACT_STEP * COMPACT_STEP)
// Pixels along a footprint at most; what is longer is cut off on both sides
#define COMPACT_WIDEST 250
// Room for their nodes, which reach beyond the period by half of it at most, in packets
#define COMPACT_NODES (2 * 256 + 32)

#define COMPACT_ROTORS_BEFORE(n)     \
  (2 * COMPACT_STEP * COMPACT_STEP * \
   (((n) / COMPACT_STEP - 1) * ((n) / COMPACT_STEP) * (2 * ((n) / COMPACT_STEP) - 1) / 6))

// Nodes on each side of the middle one: the bell is zero beyond. size and tile: pixels along the
// virtual plane and along the tile
#define COMPACT_HALF_NODES(n, size, tile) (((n) * (2 * (size) - (tile)) - 1) / (2 * (size)))

// Weights of nodes, in rows of COMPACT_NODE_ROOM floats, for one size after another: the bell along
// x; the splines of the parts along x; along y, times its bell, Lagrange's polynomials of the scan
// lines, and the splines of the parts. First of all come the places of the scan lines and of the
// parts along y, in half tiles.
#define COMPACT_NODE_ROOM(n) (2 * (n) + 16)
#define COMPACT_WEIGHTS(lines, splines) (1 + 2 * (splines) + (lines))
#define COMPACT_PLACES 64
#define COMPACT_WEIGHTS_BEFORE(n, rows)                                                        \
  (COMPACT_PLACES + (rows) * (COMPACT_STEP * ((n) / COMPACT_STEP - 1) * ((n) / COMPACT_STEP) + \
                              16 * ((n) / COMPACT_STEP - 1)))

// Floats of a profile for so many pixels: whole packets of any device
#define COMPACT_ROOM(pixels) (((pixels) + 15) / 16 * 16)

#endif
