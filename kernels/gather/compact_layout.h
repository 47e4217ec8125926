// SPDX-License-Identifier: Apache-2.0
// Sizes of compact gathering (compact.cl), for the device and, as C++, for
// host/carriers/virtual_planes/compact_gatherer.cpp.
#ifndef RAYWAVE_COMPACT_LAYOUT_H
#define RAYWAVE_COMPACT_LAYOUT_H

// Pixels per side of a bin: each has a list of the samples that light it
#define COMPACT_BIN 16

// A footprint is the transform of as many nodes as it has pixels, and a few, so that it does not
// meet itself in the next period. Their number n is a multiple of COMPACT_STEP. Nodes lie at whole
// steps from the middle one; pixels, an even number of them, at half steps from their middle. Each
// n has a table of twiddles, which lie one after another from the smallest on: for each of n nodes
// right of the middle one the cosines, then the sines, of the n / 2 pixels right of the middle.
#define COMPACT_STEP 8
#define COMPACT_SPARE_NODES 6
#define COMPACT_NODES_FOR(pixels) \
  (((pixels) + COMPACT_SPARE_NODES + COMPACT_STEP - 1) / COMPACT_STEP * COMPACT_STEP)
// Pixels along a footprint at most; what is longer is cut off on both sides
#define COMPACT_WIDEST 250
// Light that is too steep for the pixels fades out over a smooth step, e^2 (3 - 2 e): its width on
// the tile, in half tiles, and the share of it beyond the limit. It keeps the energy of a hard
// edge: the integral of the step's square is 13 / 35.
#define COMPACT_EDGE 0.35
#define COMPACT_EDGE_BEYOND (1.0f - 13.0f / 35.0f)
// Room for the nodes on one side of the middle one, in packets
#define COMPACT_NODES (256 + 16)

#define COMPACT_TWIDDLES_BEFORE(n) \
  (COMPACT_STEP * COMPACT_STEP *   \
   (((n) / COMPACT_STEP - 1) * ((n) / COMPACT_STEP) * (2 * ((n) / COMPACT_STEP) - 1) / 6))

// Nodes on each side of the middle one: the window function is zero beyond. size and tile: pixels
// along the virtual plane and along the tile
#define COMPACT_HALF_NODES(n, size, tile) (((n) * (2 * (size) - (tile)) - 1) / (2 * (size)))

// Knots: places along an axis of the tile at which the light on a line is computed. Polynomials
// between them give it at the nodes. The first half of the knots lies right of the middle; the
// others are their mirror images.
#define COMPACT_MOST_KNOTS 32
// Scan lines of a sample that nothing hides, at most
#define COMPACT_MOST_LINES 8
// Error of so many lines, relative, rms over the tile. odd, even: radians at the tile's sides by
// which the light on its top and bottom rows differs from that on the middle row, in the part that
// is odd, or even, in the row; power: (odd + even)^lines. Chebyshev interpolation of exp(i odd u
// v), whose error is odd^K / (K! 2^(K - 1)) times T_K(v) u^K; one line, or two, do not hold v^2
// either.
#define COMPACT_LINES_ERROR(lines, even, power)                    \
  ((power)*COMPACT_LINES_FACTOR(lines) + ((lines) == 1   ? 0.2f    \
                                          : (lines) == 2 ? 0.13f   \
                                                         : 0.0f) * \
                                             (even))
// 1 / (K! 2^(K - 1) sqrt(2 (2 K + 1)))
#define COMPACT_LINES_FACTOR(lines) \
  ((lines) == 1   ? 0.408f          \
   : (lines) == 2 ? 0.0791f         \
   : (lines) == 3 ? 0.0111f         \
   : (lines) == 4 ? 1.23e-3f        \
   : (lines) == 5 ? 1.11e-4f        \
   : (lines) == 6 ? 8.51e-6f        \
                  : 5.66e-7f)
// Lines of all counts up to `most`, one count after another
#define COMPACT_LINES_UP_TO(most) ((most) * ((most) + 1) / 2)

// Weights of nodes, in rows of COMPACT_NODE_ROOM floats, for one size after another. A row has n
// floats for the nodes right of the middle one, n for those left of it, and that of the middle one.
// Rows: the window function along x; the splines of the parts along x; along y, times its window
// function, Lagrange's polynomials of one scan line, of two lines, and so on, and the splines of
// the parts; and for each pair of knots along x, then along y, the even and the odd part of their
// polynomial (in place of right and left).
#define COMPACT_NODE_ROOM(n) (2 * (n) + 16)
#define COMPACT_WEIGHTS(lines, splines, knots) \
  (1 + 2 * (splines) + COMPACT_LINES_UP_TO(lines) + (knots))
#define COMPACT_WEIGHTS_BEFORE(n, rows)                                                        \
  (COMPACT_PLACES + (rows) * (COMPACT_STEP * ((n) / COMPACT_STEP - 1) * ((n) / COMPACT_STEP) + \
                              16 * ((n) / COMPACT_STEP - 1)))

// First of all come places on the tile, in half tiles: of the knots along x, and along y, each list
// repeated to whole packets; then the row of each scan line, and of each row of parts, once for
// every knot.
#define COMPACT_KNOT_ROOM (COMPACT_MOST_KNOTS + 16)
#define COMPACT_PLACES_OF_LINES (2 * COMPACT_KNOT_ROOM)
#define COMPACT_PLACES 2048

// Floats of a profile for so many pixels, an even number: a multiple of eight on both sides of the
// middle
#define COMPACT_ROOM(pixels) (((pixels) + 15) / 16 * 16)

// Numbers that `aim` leaves for `profile` of each sample, each a float or a double
#define COMPACT_SEEN 12

// Packets of so many floats are read that begin before a profile, or end after it.
#define COMPACT_PACKET 16
// Floats of profiles come in units: FOOTPRINT_UNITS of a footprint f.
#define FOOTPRINT_UNIT 32
#define FOOTPRINT_UNITS(f) ((f).lines * ((COMPACT_ROOM((f).columns) + COMPACT_ROOM((f).rows)) / 16))

// Results of binning on the device (bins.cl): numbers for all samples, then BATCH_NUMBERS for each
// batch. Columns are pixels; rows are rows of bins, which may lie beyond the plane.
#define FOUND_BATCHES 0
#define FOUND_SAMPLES 1  // that light some of the plane
#define FOUND_LEFT 2
#define FOUND_RIGHT 3  // after the last one
#define FOUND_LONGEST 4
#define BATCH_FIRST 0  // among the samples that light some
#define BATCH_SAMPLES 1
#define BATCH_BEGIN 2  // units before its profiles
#define BATCH_UNITS 3
#define BATCH_TOP 4
#define BATCH_BOTTOM 5   // last one
#define BATCH_ENTRIES 6  // samples in all of its bins
#define BATCH_NUMBERS 8
#define FOOTPRINT_BATCH(number) (BATCH_NUMBERS * (1 + (number)))

#endif
