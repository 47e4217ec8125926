// SPDX-License-Identifier: Apache-2.0
// Compile-time options of encoding (kernels/common/options.h). Encoder decides them by [slm].
#ifndef RAYWAVE_ENCODE_OPTIONS_H
#define RAYWAVE_ENCODE_OPTIONS_H

// How a complex sample becomes one number.
#define ENCODING_PHASE 0         // its phase
#define ENCODING_DOUBLE_PHASE 1  // on a checkerboard, the two phases whose mean it is
#define ENCODING_OFF_AXIS 2      // its interference with a plane wave
#define ENCODING_BURCKHARDT 3    // one of its three parts, by column
#define ENCODING_LEE 4           // dark or bright
#ifndef RAYWAVE_ENCODING
#define RAYWAVE_ENCODING ENCODING_PHASE
#endif

// 1: the field comes as a transform that lacks the last step of compact propagation.
#ifndef RAYWAVE_TRANSFORMED
#define RAYWAVE_TRANSFORMED 0
#endif

// 1: a phase of its own is added to each pixel (carrier, lens, flatness).
#ifndef RAYWAVE_ADDED_TURNS
#define RAYWAVE_ADDED_TURNS 0
#endif

// 1: levels come from a table (LUTs, few levels); else they are proportional.
#ifndef RAYWAVE_LEVEL_TABLE
#define RAYWAVE_LEVEL_TABLE 0
#endif

// Entries of that table, for phases from 0 to 1 turn or amplitudes from 0 to 1.
#define LEVEL_TABLE_SIZE 4096

// Grey levels of the SLM; more than 256 take two bytes each.
#ifndef RAYWAVE_GREY_LEVELS
#define RAYWAVE_GREY_LEVELS 256
#endif

#define RAYWAVE_ENCODE_OPTIONS(OPTION)     \
  OPTION(encoding, RAYWAVE_ENCODING)       \
  OPTION(transformed, RAYWAVE_TRANSFORMED) \
  OPTION(added_turns, RAYWAVE_ADDED_TURNS) \
  OPTION(level_table, RAYWAVE_LEVEL_TABLE) \
  OPTION(grey_levels, RAYWAVE_GREY_LEVELS)

#endif
