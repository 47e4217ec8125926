// SPDX-License-Identifier: Apache-2.0
#include "cl/buffer.hpp"

#include <algorithm>

#include "cl/device.hpp"
#include "host/common/rehearsal.hpp"

namespace raywave::cl {

namespace {

std::string too_large(const DeviceInfo& info, const std::string& name, std::uint64_t bytes) {
  return name + ": " + format_bytes(bytes) + " asked in one buffer, " + info.name + " allows " +
         format_bytes(info.largest_buffer_bytes);
}

}  // namespace

std::string memory_shortage(const Device& device, std::span<const MemoryNeed> needs) {
  const auto& info = device.info();
  std::uint64_t total = 0;
  for (const auto& need : needs) {
    if (need.bytes > info.largest_buffer_bytes)
      return too_large(info, need.name, need.bytes) + "; " + need.advice;
    total += need.bytes;
  }
  if (total <= info.memory_bytes) return "";
  const auto largest = std::max_element(
      needs.begin(), needs.end(), [](const auto& a, const auto& b) { return a.bytes < b.bytes; });
  return format_bytes(total) + " of device memory asked, " + info.name + " has " +
         format_bytes(info.memory_bytes) + "; most goes to: " + largest->name + ", " +
         format_bytes(largest->bytes) + "; " + largest->advice;
}

void require_memory(const Device& device, std::span<const MemoryNeed> needs) {
  if (const auto shortage = memory_shortage(device, needs); !shortage.empty())
    throw DeviceError(shortage);
}

Copy& Copy::operator=(Copy&& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(done_, other.done_);
  return *this;
}

Copy::~Copy() {
  try {
    wait();
  } catch (const DeviceError&) {
    // A caller that wants the data has waited; one that left without has an error of its own.
  }
}

void Copy::wait() {
  if (const auto device = std::move(device_)) checked(device->info(), [&] { done_.wait(); });
}

Memory::Memory(const Device& device, std::size_t bytes, const std::string& name)
    : device_(std::make_unique<Device>(device)) {
  bytes = std::max<std::size_t>(bytes, 1);
  const auto& info = device.info();
  if (bytes > info.largest_buffer_bytes) throw MemoryError(too_large(info, name, bytes));
  // Not every driver checks this: some begin to swap, or fail at a launch.
  if (device.allocated_bytes() + bytes > info.memory_bytes) {
    throw MemoryError(name + ": " + format_bytes(bytes) + " asked, " + info.name + " has " +
                      format_bytes(info.memory_bytes) + " of which " +
                      format_bytes(device.allocated_bytes()) + " are taken");
  }
  try {
    handle_ = ::cl::Buffer(device.context(), CL_MEM_READ_WRITE, bytes);
  } catch (const ::cl::Error& error) {
    throw MemoryError(name + ": " + format_bytes(bytes) + " asked, out of memory on " + info.name +
                      " with " + format_bytes(device.allocated_bytes()) + " taken; " +
                      error_text(error.err()));
  }
  bytes_ = bytes;
  if (is_rehearsal) fill_zero(bytes);
  auto& meter = *device_->meter_;
  meter.now += bytes_;
  meter.peak = std::max(meter.peak, meter.now);
}

Memory& Memory::operator=(Memory&& other) noexcept {
  std::swap(device_, other.device_);
  std::swap(bytes_, other.bytes_);
  std::swap(handle_, other.handle_);
  return *this;
}

Memory::~Memory() {
  if (device_) device_->meter_->now -= bytes_;
}

void Memory::write(const void* data, std::size_t bytes, std::size_t offset_bytes) {
  if (bytes)
    checked(device_->info(), [&] {
      device_->queue().enqueueWriteBuffer(handle_, CL_TRUE, offset_bytes, bytes, data);
    });
}

void Memory::read(void* data, std::size_t bytes, std::size_t offset_bytes) const {
  if (bytes)
    checked(device_->info(), [&] {
      device_->queue().enqueueReadBuffer(handle_, CL_TRUE, offset_bytes, bytes, data);
    });
}

Copy Memory::start_reading_rows(void* data, std::size_t bytes, std::size_t row_bytes,
                                std::size_t stride_bytes) const {
  if (bytes == 0) return {};
  ::cl::Event done;
  checked(device_->info(), [&] {
    std::vector<::cl::Event> launched(1);
    device_->queue().enqueueMarkerWithWaitList(nullptr, &launched[0]);
    device_->queue().flush();  // another queue may wait only for work that has been submitted
    const auto& queue = device_->copy_queue();
    if (row_bytes == stride_bytes)
      queue.enqueueReadBuffer(handle_, CL_FALSE, 0, bytes, data, &launched, &done);
    else
      queue.enqueueReadBufferRect(handle_, CL_FALSE, {0, 0, 0}, {0, 0, 0},
                                  {row_bytes, bytes / row_bytes, 1}, row_bytes, 0, stride_bytes, 0,
                                  data, &launched, &done);
    queue.flush();
  });
  return {*device_, std::move(done)};
}

void Memory::copy_from(const Memory& other, std::size_t bytes, std::size_t offset_bytes) {
  if (bytes)
    checked(device_->info(), [&] {
      device_->queue().enqueueCopyBuffer(other.handle_, handle_, offset_bytes, 0, bytes);
    });
}

void Memory::copy_rows_from(const Memory& other, std::size_t bytes, std::size_t offset_bytes,
                            std::size_t row_bytes, std::size_t stride_bytes) {
  if (row_bytes == stride_bytes) return copy_from(other, bytes, offset_bytes);
  if (bytes)
    checked(device_->info(), [&] {
      device_->queue().enqueueCopyBufferRect(
          other.handle_, handle_, {offset_bytes % stride_bytes, offset_bytes / stride_bytes, 0},
          {0, 0, 0}, {row_bytes, bytes / row_bytes, 1}, stride_bytes, 0, row_bytes, 0);
    });
}

void Memory::fill_zero(std::size_t bytes) {
  if (bytes)
    checked(device_->info(),
            [&] { device_->queue().enqueueFillBuffer(handle_, cl_uchar{0}, 0, bytes); });
}

void* Memory::map(std::size_t bytes, cl_map_flags flags, std::size_t offset_bytes,
                  bool waits) const {
  return checked(device_->info(), [&] {
    return device_->queue().enqueueMapBuffer(handle_, waits ? CL_TRUE : CL_FALSE, flags,
                                             offset_bytes, std::max<std::size_t>(bytes, 1));
  });
}

void Memory::unmap(void* pointer) const {
  checked(device_->info(), [&] { device_->queue().enqueueUnmapMemObject(handle_, pointer); });
}

}  // namespace raywave::cl
