// SPDX-License-Identifier: Apache-2.0
// Compile-time options of propagation (kernels/common/options.h).
#ifndef RAYWAVE_PROPAGATE_OPTIONS_H
#define RAYWAVE_PROPAGATE_OPTIONS_H

// 1: the remainder R of transfer.h exceeds a few turns and takes pairs of floats. The device engine
// (host/propagate/propagator_device.cpp) decides it for each propagation.
#ifndef RAYWAVE_TWO_FLOATS
#define RAYWAVE_TWO_FLOATS 0
#endif

#define RAYWAVE_PROPAGATE_OPTIONS(OPTION) OPTION(two_floats, RAYWAVE_TWO_FLOATS)

#endif
