// SPDX-License-Identifier: Apache-2.0
/// Exclusive sums in device memory (kernels/common/scan.cl).
#pragma once

#include <glm/vec2.hpp>

#include "cl/program.hpp"
#include "host/geometry/shared_types.hpp"

namespace raywave {

/// Where lists are counted and placed. The host is faster on CPUs, whose memory it shares; other
/// devices send it a few numbers only.
enum class Counting { on_host, on_device };
inline Counting counting_of(const cl::DeviceInfo& device) {
  return device.kind == cl::DeviceKind::cpu ? Counting::on_host : Counting::on_device;
}

/// T  int or int2
template <class T>
class Scan {
public:
  explicit Scan(const cl::Device& device)
      : program_(device, "kernels/common/scan.cl", {}),
        sum_segments_(kernel("sum_segments_")),
        scan_sums_(kernel("scan_sums_")),
        scan_segments_(kernel("scan_segments_")),
        sums_(device, segments, "sums of segments") {}

  /// values[first + i] becomes `base` and the sum of the i values from values[first] on, up to
  /// i = count: the buffer has an element more.
  void run(cl::Buffer<T>& values, int first, int count, T base = T(0)) {
    const int segment = (count + segments - 1) / segments;
    const cl::Range all{segments}, group{64};
    sum_segments_.run(all, group, values, first, count, segment, sums_);
    scan_sums_.run({1}, {1}, sums_, std::int32_t{segments}, base);
    scan_segments_.run(all, group, values, first, count, segment, sums_);
  }

private:
  static constexpr int segments = 512;

  cl::Kernel kernel(const char* name) const {
    return program_.kernel(std::string(name) + cl::TypeName<T>::value);
  }

  cl::Program program_;
  cl::Kernel sum_segments_, scan_sums_, scan_segments_;
  cl::Buffer<T> sums_;
};

}  // namespace raywave
