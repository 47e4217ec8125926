// SPDX-License-Identifier: Apache-2.0
// Compile-time options of all kernels. Each room of kernels/ has a header like this one: defaults
// first, then the list from which the host makes its names (host/geometry/kernel_options.hpp).
// Each option states its meaning, its unit, its values and who sets it.
#ifndef RAYWAVE_COMMON_OPTIONS_H
#define RAYWAVE_COMMON_OPTIONS_H

// Neighbours that one work-item handles side by side: 1, 4, 8 or 16 (kernels/common/lanes.h). All
// programs; host/trace/work_shape.cpp and DeviceInfo::float_lanes decide.
#ifndef RAYWAVE_LANES
#define RAYWAVE_LANES 1
#endif

// Numbers for optical paths (kernels/common/double_single.h). Tracer, Gatherer; the Plan decides.
#define PRECISION_FLOAT 0     // floats within a tile, pairs of floats for the path they count from
#define PRECISION_EXTENDED 1  // pairs of floats
#define PRECISION_DOUBLE 2    // doubles, where the device has them
#ifndef RAYWAVE_PRECISION
#define RAYWAVE_PRECISION PRECISION_FLOAT
#endif

// 1: the light on the SLM is not even. Encoder gives back what a pixel lacks, as far as its
// amplitude goes; the refiner counts with it.
#ifndef RAYWAVE_BEAM
#define RAYWAVE_BEAM 0
#endif

#define RAYWAVE_COMMON_OPTIONS(OPTION) \
  OPTION(lanes, RAYWAVE_LANES)         \
  OPTION(beam, RAYWAVE_BEAM)           \
  OPTION(precision, RAYWAVE_PRECISION)

#endif
