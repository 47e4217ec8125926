// SPDX-License-Identifier: Apache-2.0
#include "cl/error_text.hpp"

#include <cctype>
#include <cstdint>
#include <sstream>
#include <string_view>

namespace raywave::cl {

std::string error_text(cl_int code) {
  // From 0 and from -30 downwards, as in CL/cl.h
  static constexpr std::string_view names =
      "0 DEVICE_NOT_FOUND DEVICE_NOT_AVAILABLE COMPILER_NOT_AVAILABLE "
      "MEM_OBJECT_ALLOCATION_FAILURE OUT_OF_RESOURCES OUT_OF_HOST_MEMORY "
      "PROFILING_INFO_NOT_AVAILABLE MEM_COPY_OVERLAP IMAGE_FORMAT_MISMATCH "
      "IMAGE_FORMAT_NOT_SUPPORTED BUILD_PROGRAM_FAILURE MAP_FAILURE MISALIGNED_SUB_BUFFER_OFFSET "
      "EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST COMPILE_PROGRAM_FAILURE LINKER_NOT_AVAILABLE "
      "LINK_PROGRAM_FAILURE DEVICE_PARTITION_FAILED KERNEL_ARG_INFO_NOT_AVAILABLE "
      "20 21 22 23 24 25 26 27 28 29 VALUE DEVICE_TYPE PLATFORM DEVICE CONTEXT QUEUE_PROPERTIES "
      "COMMAND_QUEUE HOST_PTR MEM_OBJECT IMAGE_FORMAT_DESCRIPTOR IMAGE_SIZE SAMPLER BINARY "
      "BUILD_OPTIONS PROGRAM PROGRAM_EXECUTABLE KERNEL_NAME KERNEL_DEFINITION KERNEL ARG_INDEX "
      "ARG_VALUE ARG_SIZE KERNEL_ARGS WORK_DIMENSION WORK_GROUP_SIZE WORK_ITEM_SIZE GLOBAL_OFFSET "
      "EVENT_WAIT_LIST EVENT OPERATION GL_OBJECT BUFFER_SIZE MIP_LEVEL GLOBAL_WORK_SIZE PROPERTY "
      "IMAGE_DESCRIPTOR COMPILER_OPTIONS LINKER_OPTIONS DEVICE_PARTITION_COUNT";
  const auto means = [&] {
    switch (code) {
      case CL_OUT_OF_HOST_MEMORY:
        return ": out of host memory";
      case CL_MEM_OBJECT_ALLOCATION_FAILURE:
        return ": out of device memory";
      case CL_OUT_OF_RESOURCES:
        return ": out of device resources (memory, registers or time)";
      case CL_INVALID_BUFFER_SIZE:
        return ": the buffer is larger than the device allows";
      case CL_DEVICE_NOT_AVAILABLE:
        return ": the device is in use, or was taken away";
      case CL_COMPILER_NOT_AVAILABLE:
        return ": the device has no compiler; raywave kernels builds ahead";
      case CL_INVALID_WORK_GROUP_SIZE:
        return ": the work-group is larger than the device allows";
      default:
        return ": another driver or --device may do it";
    }
  }();
  std::istringstream words{std::string(names)};
  std::string name;
  for (int i = 0; i <= -std::int64_t{code} && words >> name; ++i) {
  }
  if (!words || code >= 0 || std::isdigit(static_cast<unsigned char>(name[0])))
    name = "error";
  else
    name = (code <= CL_INVALID_VALUE ? "CL_INVALID_" : "CL_") + name;
  return name + " (" + std::to_string(code) + ')' + means;
}

}  // namespace raywave::cl
