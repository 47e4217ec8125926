// SPDX-License-Identifier: Apache-2.0
#include "cl/device.hpp"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <tuple>

#include "host/common/cache.hpp"
#include "host/common/environment.hpp"
#include "host/common/error.hpp"
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
  if (info.kind == DeviceKind::accelerator) info.float_lanes = fpga_lanes;
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

/// PoCL would compile a kernel for each size of its groups, which gains nothing (median frames of
/// three scenes within 2 %), and once more for a binary.
void have_pocl_compile_once(const ::cl::Platform& platform) {
  if (platform.getInfo<CL_PLATFORM_VERSION>().find(" PoCL 3.") != std::string::npos)
    setenv("POCL_WORK_GROUP_SPECIALIZATION", "0", /*overwrite=*/0);
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
      have_pocl_compile_once(platforms[p]);
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

std::string lower(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return result;
}

std::string listing(const std::vector<Offer>& offers, const std::vector<std::size_t>& places) {
  std::string text;
  for (const auto i : places)
    text += (text.empty() ? "" : ", ") + offers[i].index + " " + offers[i].name;
  return text;
}

/// Compute units of GPUs that share the host's memory are many and small; those of CPUs stand for
/// one machine, whichever platform counts them.
bool goes_before(const Offer& a, const Offer& b) {
  if (a.kind != b.kind) return a.kind < b.kind;
  return name_of(a.kind) == std::string_view("gpu") &&
         std::tie(a.own_memory, a.units_mhz) > std::tie(b.own_memory, b.units_mhz);
}

int exit_code = 0;  // 0: aborts are left alone
std::array<char, 512> work{};

void end_at_abort(int) {
  if (work[0] == '\0') return;  // no driver's fault: the usual end
  const char* at = work.data();
  for (const char* text :
       {"raywave: the OpenCL driver has ended the program while it compiled or ran ", at,
        "; its own message stands above. Another driver or --device may do it (raywave devices "
        "lists them)\n"})
    if (::write(STDERR_FILENO, text, std::strlen(text)) < 0) break;
  ::_exit(exit_code);
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
  // What is built lives as long as a device that uses it
  struct Opened : Programs {
    ::cl::Context context;
  };
  static std::mutex mutex;
  static std::map<std::string, std::weak_ptr<Opened>> all;
  checked(info_, [&] {
    handle_ = it->handle;
    const std::lock_guard lock(mutex);
    auto opened = all[info.index].lock();
    if (!opened) {
      opened = std::make_shared<Opened>();
      opened->context = ::cl::Context(handle_);
      all[info.index] = opened;
    }
    context_ = opened->context;
    programs_ = opened;
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

Device::Programs::~Programs() {
  try {
    for (const auto& keep : to_keep) keep();
  } catch (const DeviceError&) {  // they will be compiled again
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

std::size_t choose_device(const std::vector<Offer>& offers, std::string_view choice) {
  std::vector<std::size_t> all, of_kind, fitting;
  for (std::size_t i = 0; i < offers.size(); ++i) {
    const auto& o = offers[i];
    if (o.index == choice) return i;
    all.push_back(i);
    if (choice.empty() || name_of(o.kind) == lower(choice)) of_kind.push_back(i);
    // "pocl" is in PoCL's version alone
    if (lower(o.platform + " " + o.name + " " + o.version).find(lower(choice)) != std::string::npos)
      fitting.push_back(i);
  }
  if (!of_kind.empty())
    return *std::min_element(of_kind.begin(), of_kind.end(), [&](std::size_t a, std::size_t b) {
      return goes_before(offers[a], offers[b]);
    });
  if (fitting.size() == 1) return fitting[0];
  const std::string asked = "device \"" + std::string(choice) + "\"";
  if (fitting.empty())
    throw DeviceError(asked + ": no such device; there are: " + listing(offers, all));
  throw DeviceError(asked + " fits more than one, name its index: " + listing(offers, fitting));
}

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

void explain_aborts(int code) { exit_code = code; }

void driver_works_on(const std::string& what, const std::string& lacks) {
  if (exit_code == 0) return;  // a library's host program may call this from several threads
  std::snprintf(work.data(), work.size(), "%s%s", what.c_str(), lacks.c_str());
  // Once more each time: LLVM puts its own handler there, which goes on to abort.
  std::signal(SIGABRT, end_at_abort);
}

void driver_is_done() {
  if (exit_code != 0) work[0] = '\0';
}

bool is_pocl(const DeviceInfo& device) {
  return device.platform.find("Portable Computing Language") != std::string::npos;
}

bool compiles_once(const DeviceInfo& device) {
  return is_pocl(device) && device.driver.starts_with("3.");
}

bool needs_single_items(const DeviceInfo& device) {
  return is_pocl(device) && device.driver.starts_with("6.");
}

std::string missing_tool(const DeviceInfo& device) {
  if (!is_pocl(device)) return "";
  std::istringstream path(environment_variable("PATH"));
  for (std::string folder; std::getline(path, folder, ':');)
    if (access((std::filesystem::path(folder) / "ld").c_str(), X_OK) == 0) return "";
  return "; PoCL links kernels with ld, which no folder of PATH has: add its folder (/usr/bin) to "
         "PATH, or install binutils";
}

std::optional<std::filesystem::path> program_folder() {
  const auto folder = environment_variable("RAYWAVE_PROGRAM_DIR");
  if (folder.empty()) return std::nullopt;
  return folder;
}

std::filesystem::path pocl_cache_folder() {
  if (const auto own = environment_variable("POCL_CACHE_DIR"); !own.empty()) return own;
  const auto xdg = environment_variable("XDG_CACHE_HOME"), home = environment_variable("HOME");
  if (xdg.empty() && home.empty()) return {};
  return std::filesystem::path(xdg.empty() ? home + "/.cache" : xdg) / "pocl";
}

}  // namespace raywave::cl
