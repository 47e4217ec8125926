// SPDX-License-Identifier: Apache-2.0
/// Numbers of OpenCL's errors in words.
#pragma once

#include <string>

#include "cl/opencl.hpp"

namespace raywave::cl {

/// "CL_OUT_OF_RESOURCES (-5): out of device resources ...", with what to do.
std::string error_text(cl_int code);

}  // namespace raywave::cl
