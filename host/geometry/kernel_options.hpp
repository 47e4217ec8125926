// SPDX-License-Identifier: Apache-2.0
/// Names of the kernels' compile-time options, from the options.h of each room of kernels/:
/// option::lanes is RAYWAVE_LANES, and so on. A misspelt option does not compile here, and
/// cl::Program refuses one that its kernel file does not have.
#pragma once

#include "cl/program.hpp"
#include "kernels/common/options.h"
#include "kernels/encode/options.h"
#include "kernels/gather/options.h"
#include "kernels/propagate/options.h"
#include "kernels/samples/options.h"
#include "kernels/scene/options.h"

namespace raywave::option {

// Evaluating the macro makes an option without a default an error.
#define RAYWAVE_KERNEL_OPTION(name, macro) \
  inline constexpr cl::Option name{(static_cast<void>(macro), #macro)};
RAYWAVE_COMMON_OPTIONS(RAYWAVE_KERNEL_OPTION)
RAYWAVE_SCENE_OPTIONS(RAYWAVE_KERNEL_OPTION)
RAYWAVE_SAMPLES_OPTIONS(RAYWAVE_KERNEL_OPTION)
RAYWAVE_GATHER_OPTIONS(RAYWAVE_KERNEL_OPTION)
RAYWAVE_PROPAGATE_OPTIONS(RAYWAVE_KERNEL_OPTION)
RAYWAVE_ENCODE_OPTIONS(RAYWAVE_KERNEL_OPTION)
#undef RAYWAVE_KERNEL_OPTION

}  // namespace raywave::option
