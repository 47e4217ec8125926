// SPDX-License-Identifier: Apache-2.0
/// Intercepts OpenCL calls of raywave and clFFT: adds canaries behind every buffer, records
/// launched kernels and copies to the host, and can refuse the compiler or further queues. Include
/// it in only one .cpp of a test program: its definitions take precedence over those of the OpenCL
/// library.
#pragma once

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <mutex>
#include <numeric>
#include <set>
#include <string>
#include <vector>

#include "cl/device.hpp"

namespace raywave::test {

struct OpenclSpy {
  static constexpr std::size_t canary_bytes = 4096;
  static constexpr unsigned char canary = 0xa5;
  // Initial contents of buffers: NaN as floats, -1 as integers
  static constexpr unsigned char junk = 0xff;

  /// Off under oclgrind, which checks the ends of buffers itself. Oclgrind 21.10 reports as
  /// uninitialised: filled memory, memory written through a map for reading and writing, and a
  /// buffer that reuses the handle of a released one. Fills and maps therefore become plain writes
  /// here, and no handle is reused.
  bool canaries = true;
  bool refuse_compiler = false;                    // programs are built from binaries only
  int queues_left = -1;                            // that may be made; -1: any number
  std::set<std::string> launched, launched_alone;  // alone: as one work-item
  std::size_t largest_group = 0;                   // of those launched, along any dimension
  int watched = 0;                                 // number of buffers whose canary was checked
  std::vector<std::size_t> overrun;  // sizes in bytes of buffers whose canary was overwritten

  /// A copy of a whole buffer, or of its rows, to the host.
  struct Read {
    cl_command_queue queue;
    std::size_t bytes;
    bool blocking;
    cl_uint waits;  // number of events that it waits for
  };
  std::vector<Read> reads;
  std::set<cl_command_queue> launched_on;

  struct Watched {
    std::size_t bytes = 0;
    // References held by the program; references of the driver may outlive their launches.
    int owners = 1;
  };

  std::mutex mutex;
  std::map<cl_mem, Watched> live;
  std::map<cl_context, std::set<cl_command_queue>> queues;
  // Maps for writing: offset and size in bytes
  std::map<void*, std::pair<std::size_t, std::size_t>> maps;
};

inline OpenclSpy& opencl_spy() {
  static OpenclSpy& spy = *new OpenclSpy;  // outlives every buffer
  return spy;
}

/// The function of the OpenCL library that a definition in this file replaces.
template <class F>
F* hidden(F*, const char* name) {
  auto* address = reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
  if (!address) std::abort();
  return address;
}

inline auto* real_read_buffer() {
  static auto* const real = hidden(&clEnqueueReadBuffer, "clEnqueueReadBuffer");
  return real;
}

inline void note_read(cl_command_queue queue, std::size_t bytes, cl_bool blocking, cl_uint waits) {
  const std::lock_guard lock(opencl_spy().mutex);
  opencl_spy().reads.push_back({queue, bytes, blocking != CL_FALSE, waits});
}

/// Called before the program releases a reference.
inline void check_canary(cl_mem memory) {
  auto& spy = opencl_spy();
  const auto it = spy.live.find(memory);
  if (it == spy.live.end() || --it->second.owners > 0) return;
  const std::size_t bytes = it->second.bytes;
  cl_context context = nullptr;
  clGetMemObjectInfo(memory, CL_MEM_CONTEXT, sizeof context, &context, nullptr);
  const auto found = spy.queues.find(context);
  const auto queues = found == spy.queues.end() ? std::set<cl_command_queue>() : found->second;
  const bool finished = std::all_of(queues.begin(), queues.end(),
                                    [](auto queue) { return clFinish(queue) == CL_SUCCESS; });
  std::vector<unsigned char> behind(OpenclSpy::canary_bytes);
  if (queues.empty() || !finished ||
      real_read_buffer()(*queues.begin(), memory, CL_TRUE, bytes, behind.size(), behind.data(), 0,
                         nullptr, nullptr) != CL_SUCCESS ||
      std::any_of(behind.begin(), behind.end(),
                  [](unsigned char b) { return b != OpenclSpy::canary; }))
    spy.overrun.push_back(bytes);
  ++spy.watched;
  spy.live.erase(it);
}

}  // namespace raywave::test

extern "C" {

cl_mem clCreateBuffer(cl_context context, cl_mem_flags flags, size_t size, void* host,
                      cl_int* error) {
  using namespace raywave::test;
  static auto* const real = hidden(&clCreateBuffer, "clCreateBuffer");
  auto& spy = opencl_spy();
  if (!spy.canaries) {
    // These buffers take the handles that launches have released.
    for (int i = 0; i < 8; ++i) real(context, CL_MEM_READ_WRITE, 1, nullptr, error);
    return real(context, flags, size, host, error);
  }
  if (size == 0 || (flags & CL_MEM_USE_HOST_PTR)) return real(context, flags, size, host, error);
  std::vector<unsigned char> bytes(size + OpenclSpy::canary_bytes, OpenclSpy::canary);
  if (flags & CL_MEM_COPY_HOST_PTR)
    std::copy_n(static_cast<const unsigned char*>(host), size, bytes.begin());
  else
    std::fill_n(bytes.begin(), size, OpenclSpy::junk);
  const cl_mem memory =
      real(context, flags | CL_MEM_COPY_HOST_PTR, bytes.size(), bytes.data(), error);
  const std::lock_guard lock(spy.mutex);
  if (memory) spy.live[memory] = {size};
  return memory;
}

cl_int clRetainMemObject(cl_mem memory) {
  using namespace raywave::test;
  static auto* const real = hidden(&clRetainMemObject, "clRetainMemObject");
  {
    const std::lock_guard lock(opencl_spy().mutex);
    if (const auto it = opencl_spy().live.find(memory); it != opencl_spy().live.end())
      ++it->second.owners;
  }
  return real(memory);
}

cl_int clReleaseMemObject(cl_mem memory) {
  using namespace raywave::test;
  static auto* const real = hidden(&clReleaseMemObject, "clReleaseMemObject");
  if (!opencl_spy().canaries) return CL_SUCCESS;  // keeps the handle from being reused
  {
    const std::lock_guard lock(opencl_spy().mutex);
    check_canary(memory);
  }
  return real(memory);
}

cl_int clEnqueueFillBuffer(cl_command_queue queue, cl_mem memory, const void* pattern,
                           size_t pattern_bytes, size_t offset, size_t size, cl_uint events,
                           const cl_event* wait, cl_event* event) {
  using namespace raywave::test;
  static auto* const real = hidden(&clEnqueueFillBuffer, "clEnqueueFillBuffer");
  if (opencl_spy().canaries)
    return real(queue, memory, pattern, pattern_bytes, offset, size, events, wait, event);
  std::vector<unsigned char> bytes(size);
  for (std::size_t i = 0; i < size; ++i)
    bytes[i] = static_cast<const unsigned char*>(pattern)[i % pattern_bytes];
  return clEnqueueWriteBuffer(queue, memory, CL_TRUE, offset, size, bytes.data(), events, wait,
                              event);
}

void* clEnqueueMapBuffer(cl_command_queue queue, cl_mem memory, cl_bool blocking,
                         cl_map_flags flags, size_t offset, size_t size, cl_uint events,
                         const cl_event* wait, cl_event* event, cl_int* error) {
  using namespace raywave::test;
  static auto* const real = hidden(&clEnqueueMapBuffer, "clEnqueueMapBuffer");
  void* const pointer =
      real(queue, memory, blocking, flags, offset, size, events, wait, event, error);
  const std::lock_guard lock(opencl_spy().mutex);
  if (pointer && !opencl_spy().canaries && (flags & CL_MAP_WRITE))
    opencl_spy().maps[pointer] = {offset, size};
  return pointer;
}

cl_int clEnqueueUnmapMemObject(cl_command_queue queue, cl_mem memory, void* pointer, cl_uint events,
                               const cl_event* wait, cl_event* event) {
  using namespace raywave::test;
  static auto* const real = hidden(&clEnqueueUnmapMemObject, "clEnqueueUnmapMemObject");
  std::size_t offset = 0;
  std::vector<unsigned char> bytes;
  {
    const std::lock_guard lock(opencl_spy().mutex);
    if (const auto it = opencl_spy().maps.find(pointer); it != opencl_spy().maps.end()) {
      offset = it->second.first;
      bytes.assign(static_cast<unsigned char*>(pointer),
                   static_cast<unsigned char*>(pointer) + it->second.second);
      opencl_spy().maps.erase(it);
    }
  }
  const cl_int error = real(queue, memory, pointer, events, wait, event);
  if (error != CL_SUCCESS || bytes.empty()) return error;
  // From the buffer's beginning: oclgrind 21.10 takes another place for written
  std::vector<unsigned char> before(offset);
  if (offset > 0)
    clEnqueueReadBuffer(queue, memory, CL_TRUE, 0, offset, before.data(), 0, nullptr, nullptr);
  bytes.insert(bytes.begin(), before.begin(), before.end());
  return clEnqueueWriteBuffer(queue, memory, CL_TRUE, 0, bytes.size(), bytes.data(), 0, nullptr,
                              nullptr);
}

cl_context clCreateContext(const cl_context_properties* properties, cl_uint count,
                           const cl_device_id* devices,
                           void(CL_CALLBACK* notify)(const char*, const void*, size_t, void*),
                           void* data, cl_int* error) {
  using namespace raywave::test;
  static auto* const real = hidden(&clCreateContext, "clCreateContext");
  const cl_context context = real(properties, count, devices, notify, data, error);
  const std::lock_guard lock(opencl_spy().mutex);
  opencl_spy().queues[context].clear();  // queues of an earlier context with this handle
  return context;
}

cl_command_queue clCreateCommandQueue(cl_context context, cl_device_id device,
                                      cl_command_queue_properties properties, cl_int* error) {
  using namespace raywave::test;
  static auto* const real = hidden(&clCreateCommandQueue, "clCreateCommandQueue");
  const std::lock_guard lock(opencl_spy().mutex);
  if (opencl_spy().queues_left == 0) {
    if (error) *error = CL_OUT_OF_RESOURCES;
    return nullptr;
  }
  if (opencl_spy().queues_left > 0) --opencl_spy().queues_left;
  const cl_command_queue queue = real(context, device, properties, error);
  if (queue) clRetainCommandQueue(queue);  // devices share contexts, which outlive their queues
  opencl_spy().queues[context].insert(queue);
  return queue;
}

cl_int clEnqueueReadBuffer(cl_command_queue queue, cl_mem memory, cl_bool blocking, size_t offset,
                           size_t size, void* to, cl_uint events, const cl_event* wait,
                           cl_event* event) {
  using namespace raywave::test;
  note_read(queue, size, blocking, events);
  return real_read_buffer()(queue, memory, blocking, offset, size, to, events, wait, event);
}

cl_int clEnqueueReadBufferRect(cl_command_queue queue, cl_mem memory, cl_bool blocking,
                               const size_t* offset, const size_t* host_offset,
                               const size_t* region, size_t row, size_t slice, size_t host_row,
                               size_t host_slice, void* to, cl_uint events, const cl_event* wait,
                               cl_event* event) {
  using namespace raywave::test;
  static auto* const real = hidden(&clEnqueueReadBufferRect, "clEnqueueReadBufferRect");
  note_read(queue, region[0] * region[1] * region[2], blocking, events);
  return real(queue, memory, blocking, offset, host_offset, region, row, slice, host_row,
              host_slice, to, events, wait, event);
}

cl_int clEnqueueNDRangeKernel(cl_command_queue queue, cl_kernel kernel, cl_uint dimensions,
                              const size_t* offset, const size_t* global, const size_t* local,
                              cl_uint events, const cl_event* wait, cl_event* event) {
  using namespace raywave::test;
  static auto* const real = hidden(&clEnqueueNDRangeKernel, "clEnqueueNDRangeKernel");
  char name[256] = "";
  clGetKernelInfo(kernel, CL_KERNEL_FUNCTION_NAME, sizeof name, name, nullptr);
  {
    const std::lock_guard lock(opencl_spy().mutex);
    opencl_spy().launched.insert(name);
    opencl_spy().launched_on.insert(queue);
    auto& largest = opencl_spy().largest_group;
    for (cl_uint i = 0; local && i < dimensions; ++i) largest = std::max(largest, local[i]);
    if (std::accumulate(global, global + dimensions, std::size_t{1}, std::multiplies<>()) == 1)
      opencl_spy().launched_alone.insert(name);
  }
  return real(queue, kernel, dimensions, offset, global, local, events, wait, event);
}

cl_program clCreateProgramWithSource(cl_context context, cl_uint count, const char** texts,
                                     const size_t* lengths, cl_int* error) {
  using namespace raywave::test;
  static auto* const real = hidden(&clCreateProgramWithSource, "clCreateProgramWithSource");
  if (!opencl_spy().refuse_compiler) return real(context, count, texts, lengths, error);
  if (error) *error = CL_COMPILER_NOT_AVAILABLE;
  return nullptr;
}

}  // extern "C"
