// SPDX-License-Identifier: Apache-2.0
// Compile-time options of the sample table (kernels/common/options.h).
#ifndef RAYWAVE_SAMPLES_OPTIONS_H
#define RAYWAVE_SAMPLES_OPTIONS_H

// Rays per side of a lattice cell besides the ray through its centre: 0, 2 or 4; SampleTable
#ifndef RAYWAVE_ANTIALIAS
#define RAYWAVE_ANTIALIAS 4
#endif

// 1: the parts of a cell differ in more than coverage, so that all of them are traced and shaded;
// SampleTable, by shades_parts
#ifndef RAYWAVE_PARTS_DIFFER
#define RAYWAVE_PARTS_DIFFER 1
#endif

// Parts per side of the hologram's window in a sample's visibility mask: 4, 8 or 16; 0: nothing
// hides anything; SampleTable and Gatherer, from the Plan
#ifndef RAYWAVE_VISIBILITY_PARTS
#define RAYWAVE_VISIBILITY_PARTS 8
#endif

// 1: paths over mirrors and through glass are polynomials over the window; 0: light from there
// comes from virtual points; SampleTable and Gatherer, from the Plan
#ifndef RAYWAVE_PATHS
#define RAYWAVE_PATHS 0
#endif

#define RAYWAVE_SAMPLES_OPTIONS(OPTION)      \
  OPTION(antialias, RAYWAVE_ANTIALIAS)       \
  OPTION(parts_differ, RAYWAVE_PARTS_DIFFER) \
  OPTION(paths, RAYWAVE_PATHS)               \
  OPTION(visibility_parts, RAYWAVE_VISIBILITY_PARTS)

#endif
