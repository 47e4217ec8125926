// SPDX-License-Identifier: Apache-2.0
/// OpenCL devices: which there are, what each can do, and one opened for work. Nothing in cl/ knows
/// of optics.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cl/opencl.hpp"
#include "host/common/choices.hpp"
#include "host/common/error.hpp"
#include "host/common/memory_need.hpp"

namespace raywave::cl {

using raywave::DeviceError;
using raywave::DeviceKind;
using raywave::format_bytes;
using raywave::MemoryError;
using raywave::name_of;

/// How kernels share out the pixels of a plane among work-items.
struct WorkShape {
  int lanes = 1;      // neighbouring pixels that a work-item handles side by side
  int tile_rows = 1;  // rows of pixels, of all frames together, that a work-item fills
  // Work-items side by side before the next rows begin; 0: as many as the plane is wide
  int strip_tiles = 0;
  bool operator==(const WorkShape&) const = default;
};

/// Samples side by side on accelerators, which are FPGAs: 8 complex ones are 64 bytes, as wide as a
/// board's memory.
constexpr int fpga_lanes = 8;

struct DeviceInfo {
  std::string index;  // "0:1": platform and device within it
  std::string platform, name, vendor, version, driver;
  DeviceKind kind = DeviceKind::other;
  unsigned compute_units = 0;
  std::uint64_t memory_bytes = 0, largest_buffer_bytes = 0, local_bytes = 0;
  bool fp64 = false;
  bool online_compiler = false;   // and RAYWAVE_PROGRAM_DIR does not forbid its use
  bool compiles_always = false;   // RAYWAVE_PROGRAM_DIR is for another device beside it
  int float_lanes = 1;            // native SIMD width in floats, 1 on GPUs; see fpga_lanes
  std::optional<WorkShape> work;  // as measured; none: what suits devices of this kind
};

/// Every device of every platform, in the order of the ICD loader; empty when there is none.
std::vector<DeviceInfo> list_devices();

/// The device that `choice` names: an index ("0:1"), a kind ("gpu") or part of its name, platform
/// or version, letters of either case; empty: that of the environment's RAYWAVE_DEVICE, else a GPU,
/// the fastest of several, else the first accelerator, CPU, any.
///
/// throws  DeviceError listing what there is when nothing, or more than one, fits
DeviceInfo find_device(std::string_view choice = {});

/// A device opened for work: context, one in-order queue for the work, and one for copies to the
/// host that go on beside it. Copies of this share all three, and the programs built for it.
class Device {
public:
  explicit Device(const DeviceInfo& info);

  const DeviceInfo& info() const { return info_; }
  const ::cl::Context& context() const { return context_; }
  const ::cl::CommandQueue& queue() const { return queue_; }
  /// Equals queue() on devices that give only one.
  const ::cl::CommandQueue& copy_queue() const { return copy_queue_; }
  /// Its events tell when launches were submitted and started. Empty on devices that give no such
  /// queue beside the others.
  const ::cl::CommandQueue& timing_queue() const { return timing_queue_; }
  const ::cl::Device& handle() const { return handle_; }

  /// Waits for queue().
  void finish() const;

  std::uint64_t allocated_bytes() const { return meter_->now; }
  std::uint64_t peak_bytes() const { return meter_->peak; }

private:
  friend class Memory;
  friend class Program;
  struct Meter {
    std::uint64_t now = 0, peak = 0;
  };
  struct Programs {  // by what they are built of
    ~Programs();
    std::mutex mutex;
    std::map<std::string, ::cl::Program> built;
    std::vector<std::function<void()>> to_keep;  // puts binaries into the cache, at the end
  };
  DeviceInfo info_;
  ::cl::Device handle_;
  ::cl::Context context_;
  ::cl::CommandQueue queue_, copy_queue_, timing_queue_;
  std::shared_ptr<Meter> meter_ = std::make_shared<Meter>();
  std::shared_ptr<Programs> programs_ = std::make_shared<Programs>();
};

/// "clEnqueueMapBuffer: CL_OUT_OF_RESOURCES (-5) on <device>" as a DeviceError.
[[noreturn]] void throw_device_error(const ::cl::Error& error, const DeviceInfo& info);

/// Runs `f` and turns OpenCL's exceptions into DeviceError.
template <class F>
auto checked(const DeviceInfo& info, F&& f) {
  try {
    return f();
  } catch (const ::cl::Error& error) {
    throw_device_error(error, info);
  }
}

// Which of the OpenCL devices is meant.

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

// Numbers of OpenCL's errors in words.

/// "CL_OUT_OF_RESOURCES (-5): out of device resources ...", with what to do.
std::string error_text(cl_int code);

// Drivers that end the whole program, as those with LLVM do where it cannot compile a kernel.

/// From now on, a driver that aborts leaves a line on standard error that says at which kernel, and
/// this exit code.
void explain_aborts(int exit_code);

/// What the driver is asked to do, "kernels/samples/samples.cl: find_samples on NAME", until it is
/// waited for; and what it may lack, empty: nothing known.
void driver_works_on(const std::string& what, const std::string& lacks);
void driver_is_done();

// What PoCL needs. 6.0: its passes that make a loop over the items of a work-group end the process
// on long kernels (docs/devices.md). A group of one item needs no loop.

bool is_pocl(const DeviceInfo& device);

/// Whether it compiles kernels once, for groups of any size. Later versions were not tried.
bool compiles_once(const DeviceInfo& device);

/// Whether kernels must be launched in work-groups of one item, and programs be kept as objects:
/// the binary of a built program holds its kernels for groups of any size, which have the loop.
bool needs_single_items(const DeviceInfo& device);

/// "; PoCL needs ld ...", where it is PoCL's device and no folder of PATH has ld; else empty.
std::string missing_tool(const DeviceInfo& device);

// Folders that the environment names.

/// RAYWAVE_PROGRAM_DIR, where it is set. Nothing is compiled then: programs come from this folder,
/// and the FFT runs on the host.
std::optional<std::filesystem::path> program_folder();

/// Where PoCL keeps the kernels that it has compiled; empty: a temporary folder of its own.
std::filesystem::path pocl_cache_folder();

}  // namespace raywave::cl
