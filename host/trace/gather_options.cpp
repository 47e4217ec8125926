// SPDX-License-Identifier: Apache-2.0
#include "host/trace/gather_options.hpp"

namespace raywave {

std::string precision_option(const cl::DeviceInfo& device, Precision precision) {
  if (precision == Precision::doubles && !device.fp64)
    throw cl::DeviceError(
        device.name + " has no double precision; set accuracy.precision to \"float\" or \"auto\"");
  return precision == Precision::doubles ? "2" : "0";
}

}  // namespace raywave
