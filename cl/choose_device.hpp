// SPDX-License-Identifier: Apache-2.0
/// Which of the OpenCL devices is meant.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace raywave::cl {

enum class DeviceKind;  // device.hpp
constexpr std::array device_kinds{"gpu", "accelerator", "cpu", "other"};
constexpr const char* name_of(DeviceKind kind) {
  return device_kinds[static_cast<std::size_t>(kind)];
}

/// What a device is known by, and what decides between GPUs.
struct Offer {
  std::string index, platform, name, version;
  DeviceKind kind{};
  bool own_memory = false;      // apart from the host's
  std::uint64_t units_mhz = 0;  // compute units times clock
};

/// The device that `choice` names: an index ("0:1"), a kind ("gpu", "accelerator", "cpu"), or part
/// of its name, platform or version, letters of either case. When it is empty a GPU goes first,
/// then an accelerator, a CPU, any. Of several GPUs those with memory of their own go first, then
/// the largest product of compute units and clock; of other kinds the first listed.
///
/// offers   one at least
/// returns  its place among them
/// throws   DeviceError listing what there is when nothing, or more than one, fits
std::size_t choose_device(const std::vector<Offer>& offers, std::string_view choice);

}  // namespace raywave::cl
