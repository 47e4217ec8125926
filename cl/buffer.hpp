// SPDX-License-Identifier: Apache-2.0
/// Device memory with an element type.
#pragma once

#include <algorithm>
#include <complex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cl/device.hpp"

namespace raywave::cl {

using raywave::MemoryNeed;

/// What is short, with the caller's advice, when one need is larger than the device's largest
/// buffer, or all together are more than its memory; empty when they fit.
std::string memory_shortage(const Device& device, std::span<const MemoryNeed> needs);

/// Refuses needs that cannot fit, before any memory is taken.
///
/// throws  DeviceError, with the memory_shortage
void require_memory(const Device& device, std::span<const MemoryNeed> needs);

/// A copy to the host that is in progress. The memory that it writes to, and the buffer that it
/// reads from, stay until it has ended: it is waited for at the latest when this goes. Movable, not
/// copyable.
class [[nodiscard]] Copy {
public:
  Copy() = default;
  Copy(const Device& device, ::cl::Event done)
      : device_(std::make_unique<Device>(device)), done_(std::move(done)) {}
  Copy(Copy&& other) noexcept { *this = std::move(other); }
  Copy& operator=(Copy&& other) noexcept;
  ~Copy();

  /// Returns when the host has the data; at once when there is nothing to wait for.
  ///
  /// throws  DeviceError when the copy, or the work before it, has failed
  void wait();

private:
  std::unique_ptr<Device> device_;  // none: no copy is in progress
  ::cl::Event done_;
};

/// Bytes on a device, counted by it. Movable, not copyable.
class Memory {
public:
  Memory() = default;
  /// name  for messages ("WRP field"); at least one byte is taken
  /// throws MemoryError when it is larger than the device's largest buffer, or than what is left of
  /// the device's memory
  Memory(const Device& device, std::size_t bytes, const std::string& name);
  Memory(Memory&& other) noexcept { *this = std::move(other); }
  Memory& operator=(Memory&& other) noexcept;
  ~Memory();

  const ::cl::Buffer& handle() const { return handle_; }

protected:
  Device device() const { return *device_; }
  void write(const void* data, std::size_t bytes, std::size_t offset_bytes);
  void read(void* data, std::size_t bytes, std::size_t offset_bytes) const;
  Copy start_reading_rows(void* data, std::size_t bytes, std::size_t row_bytes,
                          std::size_t stride_bytes) const;
  void copy_from(const Memory& other, std::size_t bytes, std::size_t offset_bytes);
  void copy_rows_from(const Memory& other, std::size_t bytes, std::size_t offset_bytes,
                      std::size_t row_bytes, std::size_t stride_bytes);
  void fill_zero(std::size_t bytes);
  void* map(std::size_t bytes, cl_map_flags flags, std::size_t offset_bytes = 0,
            bool waits = true) const;
  /// What is launched later waits for it; the host need not.
  void unmap(void* pointer) const;

private:
  std::unique_ptr<Device> device_;
  std::size_t bytes_ = 0;
  ::cl::Buffer handle_;
};

/// `size()` elements of T on the device. T is a scalar, std::complex<float> (float2 in kernels) or
/// a struct of kernels/common/shared.h.
template <class T>
class Buffer : public Memory {
public:
  Buffer() = default;
  Buffer(const Device& device, std::size_t size, const std::string& name)
      : Memory(device, size * sizeof(T), name), size_(size) {}
  Buffer(const Device& device, std::span<const T> data, const std::string& name)
      : Buffer(device, data.size(), name) {
    write(data);
  }

  std::size_t size() const { return size_; }
  /// Writes from element `first` on.
  void write(std::span<const T> data, std::size_t first = 0) {
    Memory::write(data.data(), data.size_bytes(), first * sizeof(T));
  }
  /// Waits, then copies data.size() elements from element `first` on.
  void read(std::span<T> data, std::size_t first = 0) const {
    Memory::read(data.data(), data.size_bytes(), first * sizeof(T));
  }
  std::vector<T> read() const {
    std::vector<T> data(size_);
    read(data);
    return data;
  }
  /// Begins to copy all, as the work launched so far leaves it: rows of `width` elements, from the
  /// first on, to places `stride` elements apart. Work launched later goes on beside the copy and
  /// must not write to this buffer.
  Copy start_reading_rows(T* to, std::size_t width, std::size_t stride) const {
    return Memory::start_reading_rows(to, size_ * sizeof(T), width * sizeof(T), stride * sizeof(T));
  }
  /// Takes size() elements of `other`, from element `first` on, without the host.
  void copy_from(const Buffer& other, std::size_t first) { copy_from(other, first, size_); }

  /// Takes `count` elements of `other` to the beginning of this buffer.
  void copy_from(const Buffer& other, std::size_t first, std::size_t count) {
    Memory::copy_from(other, count * sizeof(T), first * sizeof(T));
  }
  /// Takes size() elements of `other`, from element `first` on: rows of `width` elements that
  /// begin `stride` elements apart.
  void copy_rows_from(const Buffer& other, std::size_t first, std::size_t width,
                      std::size_t stride) {
    Memory::copy_rows_from(other, size_ * sizeof(T), first * sizeof(T), width * sizeof(T),
                           stride * sizeof(T));
  }
  void fill_zero() { Memory::fill_zero(size_ * sizeof(T)); }

  /// Waits, lends the elements to the host (no copy on CPU devices), and takes them back when `f`
  /// returns.
  template <class F>
  void on_host(F&& f, cl_map_flags flags = CL_MAP_READ | CL_MAP_WRITE) {
    lend<T>(f, flags, 0, size_);
  }
  /// The same of `count` elements from element `first` on.
  template <class F>
  void change_on_host(F&& f, std::size_t first, std::size_t count) {
    lend<T>(f, CL_MAP_READ | CL_MAP_WRITE, first, count);
  }
  /// Lends `count` elements from element `first` on, to be read only.
  template <class F>
  void on_host(F&& f, std::size_t first, std::size_t count) const {
    lend<const T>(f, CL_MAP_READ, first, count);
  }
  /// Lends `count` elements from element `first` on, and all of another buffer: threads of a driver
  /// wake once, which takes 0.1 ms.
  template <class F>
  void on_host_with(Buffer& other, F&& f, std::size_t first, std::size_t count) {
    lend_with<T>(other, f, CL_MAP_READ | CL_MAP_WRITE, first, count);
  }
  /// The same, to be read only.
  template <class F>
  void on_host_with(Buffer& other, F&& f, std::size_t first, std::size_t count) const {
    lend_with<const T>(other, f, CL_MAP_READ, first, count);
  }

private:
  template <class Element>
  void lend(auto&& f, cl_map_flags flags, std::size_t first, std::size_t count) const {
    give_back(static_cast<T*>(map(count * sizeof(T), flags, first * sizeof(T))),
              [&](T* data) { f(std::span<Element>(data, count)); });
  }
  template <class Element>
  void lend_with(Buffer& other, auto&& f, cl_map_flags flags, std::size_t first,
                 std::size_t count) const {
    give_back(
        static_cast<T*>(map(count * sizeof(T), flags, first * sizeof(T), /*waits=*/false)),
        [&](T* data) {
          other.on_host([&](std::span<T> others) { f(std::span<Element>(data, count), others); });
        });
  }
  void give_back(T* data, auto&& after) const {
    try {
      after(data);
    } catch (...) {
      try {
        unmap(data);
      } catch (const DeviceError&) {
        // The first error says what went wrong.
      }
      throw;
    }
    unmap(data);
  }

  std::size_t size_ = 0;
};

/// Writes into the buffer when the size fits, else into a new one.
template <class T>
void put(const Device& device, Buffer<T>& buffer, const std::vector<T>& data,
         const std::string& name) {
  if (buffer.size() == data.size())
    buffer.write(data);
  else
    buffer = {device, std::span<const T>(data), name};
}

/// Reallocates a buffer that is too small, with an eighth to spare: a moving scene sometimes needs
/// a little more, and new memory is slow at first. The contents are lost.
template <class T>
void make_room(const Device& device, Buffer<T>& buffer, std::size_t size, const char* name) {
  if (buffer.size() >= size) return;
  buffer = {};  // frees the old memory first
  buffer = {device, size + size / 8, name};
}

/// Writes into the buffer, or into a larger one.
template <class T>
void upload(const Device& device, const std::vector<T>& data, Buffer<T>& buffer, const char* name) {
  make_room(device, buffer, std::max<std::size_t>(data.size(), 1), name);
  buffer.write(data);
}

using ComplexBuffer = Buffer<std::complex<float>>;

}  // namespace raywave::cl
