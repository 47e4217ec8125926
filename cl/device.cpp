// SPDX-License-Identifier: Apache-2.0
#include "cl/device.hpp"

#include <algorithm>
#include <cctype>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <utility>

#include "cl/aborts.hpp"
#include "cl/choose_device.hpp"
#include "cl/environment.hpp"
#include "cl/error_text.hpp"
#include "host/common/cache.hpp"
#include "host/common/environment.hpp"
#include "host/common/text.hpp"

namespace raywave::cl {
namespace {

struct Found {
  DeviceInfo info;
  ::cl::Device handle;
};

DeviceKind kind_of(cl_device_type type) {
  if (type & CL_DEVICE_TYPE_GPU) return DeviceKind::gpu;
  if (type & CL_DEVICE_TYPE_ACCELERATOR) return DeviceKind::accelerator;
  if (type & CL_DEVICE_TYPE_CPU) return DeviceKind::cpu;
  return DeviceKind::other;
}

std::string trimmed(std::string text) {
  while (!text.empty() &&
         (std::isspace(static_cast<unsigned char>(text.back())) || text.back() == '\0'))
    text.pop_back();
  return text;
}

DeviceInfo describe(const ::cl::Device& device, const std::string& index) {
  DeviceInfo info;
  info.index = index;
  info.platform =
      trimmed(::cl::Platform(device.getInfo<CL_DEVICE_PLATFORM>()).getInfo<CL_PLATFORM_NAME>());
  info.name = trimmed(device.getInfo<CL_DEVICE_NAME>());
  info.vendor = trimmed(device.getInfo<CL_DEVICE_VENDOR>());
  info.version = trimmed(device.getInfo<CL_DEVICE_VERSION>());
  info.driver = trimmed(device.getInfo<CL_DRIVER_VERSION>());
  info.kind = kind_of(device.getInfo<CL_DEVICE_TYPE>());
  info.compute_units = device.getInfo<CL_DEVICE_MAX_COMPUTE_UNITS>();
  info.memory_bytes = device.getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>();
  info.largest_buffer_bytes = device.getInfo<CL_DEVICE_MAX_MEM_ALLOC_SIZE>();
  info.local_bytes = device.getInfo<CL_DEVICE_LOCAL_MEM_SIZE>();
  info.fp64 = device.getInfo<CL_DEVICE_DOUBLE_FP_CONFIG>() != 0;
  info.online_compiler = device.getInfo<CL_DEVICE_COMPILER_AVAILABLE>() && !program_folder();
  if (info.kind == DeviceKind::cpu)
    info.float_lanes =
        std::max(1, static_cast<int>(device.getInfo<CL_DEVICE_NATIVE_VECTOR_WIDTH_FLOAT>()));
  return info;
}

/// PoCL lists no device where it cannot write its cache of kernels. Returns what a user should do
/// about it; empty where nothing is wrong, or a folder of ours stands in.
std::string give_pocl_a_cache(const ::cl::Platform& platform) {
  if (platform.getInfo<CL_PLATFORM_NAME>().find("Portable Computing Language") == std::string::npos)
    return "";
  const std::string cure = "; set POCL_CACHE_DIR to a folder that can";
  if (const auto own = environment_variable("POCL_CACHE_DIR"); !own.empty())
    return is_writable_folder(own)
               ? ""
               : "POCL_CACHE_DIR=" + own + " cannot be written, so that PoCL has no device" + cure;
  const auto usual = pocl_cache_folder();
  if (usual.empty()) return "";  // PoCL takes a temporary folder itself
  if (is_writable_folder(usual)) return "";
  const auto ours = temporary_cache_folder();
  if (ours.empty()) return usual.string() + " cannot be written, so that PoCL has no device" + cure;
  setenv("POCL_CACHE_DIR", (ours / "pocl").c_str(), /*overwrite=*/0);
  return "";
}

struct AllFound {
  std::vector<Found> devices;
  std::string hint;  // why there may be none
};

AllFound find_all() {
  AllFound all;
  auto& found = all.devices;
  std::vector<::cl::Platform> platforms;
  try {
    ::cl::Platform::get(&platforms);
  } catch (const ::cl::Error&) {
    return all;  // a loader without any platform reports an error
  }
  for (std::size_t p = 0; p < platforms.size(); ++p) {
    std::vector<::cl::Device> devices;
    try {
      if (auto hint = give_pocl_a_cache(platforms[p]); !hint.empty()) all.hint = hint;
      platforms[p].getDevices(CL_DEVICE_TYPE_ALL, &devices);
    } catch (const ::cl::Error&) {
      continue;  // a platform without devices reports an error
    }
    for (std::size_t d = 0; d < devices.size(); ++d)
      found.push_back(
          {describe(devices[d], std::to_string(p) + ":" + std::to_string(d)), devices[d]});
  }
  return all;
}

/// What may be why there is no device, and what to do.
std::string cure_of(const AllFound& all) {
  if (!all.hint.empty()) return all.hint;
  const std::string usual = "install a vendor's driver, or PoCL (apt install pocl-opencl-icd)";
  for (const char* name :
       {"OCL_ICD_VENDORS", "OCL_ICD_FILENAMES", "OPENCL_VENDOR_PATH", "POCL_DEVICES"})
    if (const auto value = environment_variable(name); !value.empty())
      return std::string(name) + " is set to \"" + one_line(value) +
             "\", which gives none: unset it, or " + usual;
  return usual;
}

}  // namespace

std::vector<DeviceInfo> list_devices() {
  std::vector<DeviceInfo> infos;
  for (const auto& found : find_all().devices) infos.push_back(found.info);
  return infos;
}

DeviceInfo find_device(std::string_view choice) {
  const auto all = find_all();
  if (all.devices.empty()) throw DeviceError("no OpenCL device found: " + cure_of(all));
  const auto preferred = environment_variable("RAYWAVE_DEVICE");
  if (choice.empty()) choice = preferred;
  std::vector<Offer> offers;
  for (const auto& [info, handle] : all.devices)
    offers.push_back(
        {info.index, info.platform, info.name, info.version, info.kind,
         !handle.getInfo<CL_DEVICE_HOST_UNIFIED_MEMORY>(),
         std::uint64_t{info.compute_units} * handle.getInfo<CL_DEVICE_MAX_CLOCK_FREQUENCY>()});
  return all.devices[choose_device(offers, choice)].info;
}

Device::Device(const DeviceInfo& info) : info_(info) {
  const auto devices = find_all().devices;
  const auto it = std::find_if(devices.begin(), devices.end(),
                               [&](const Found& f) { return f.info.index == info.index; });
  if (it == devices.end()) throw DeviceError("device " + info.index + " " + info.name + " is gone");
  checked(info_, [&] {
    handle_ = it->handle;
    context_ = ::cl::Context(handle_);
    queue_ = ::cl::CommandQueue(context_, handle_);
  });
  try {
    copy_queue_ = ::cl::CommandQueue(context_, handle_);
  } catch (const ::cl::Error&) {
    copy_queue_ = queue_;  // copies then take their turn
  }
  try {
    timing_queue_ = ::cl::CommandQueue(context_, handle_, CL_QUEUE_PROFILING_ENABLE);
  } catch (const ::cl::Error&) {
    timing_queue_ = {};  // nothing is timed then
  }
}

void Device::finish() const {
  checked(info_, [&] { queue_.finish(); });
  driver_is_done();
}

void throw_device_error(const ::cl::Error& error, const DeviceInfo& info) {
  throw DeviceError(std::string(error.what()) + " on " + info.name + ": " +
                    error_text(error.err()));
}

}  // namespace raywave::cl
