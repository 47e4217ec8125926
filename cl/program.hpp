// SPDX-License-Identifier: Apache-2.0
/// Kernels: compiled from the files of kernels/ (or loaded from a cached binary) and launched with
/// checked arguments.
#pragma once

#include <compare>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <tuple>

#include "cl/buffer.hpp"
#include "host/common/rehearsal.hpp"

namespace raywave::cl {

/// The files of kernels/ by name, as they were when this program was built.
const std::map<std::string, std::string>& kernel_files();

/// A compile-time option of kernels by the name of its macro. Whoever knows the kernels declares a
/// constant for each (host/geometry/kernel_options.hpp).
struct Option {
  explicit constexpr Option(std::string_view macro) : name(macro) {}
  std::string_view name;
  auto operator<=>(const Option&) const = default;
};

/// Options of a kernel file and their values.
using Options = std::map<Option, std::string>;

/// `options` with `more` added or replaced.
Options with(Options options, const Options& more);

/// Sizes of up to three dimensions; 0 stands for a dimension that is not there.
struct Range {
  std::size_t x = 1, y = 0, z = 0;
};

/// The name OpenCL gives to T in a kernel's signature. Structs of kernels/common/shared.h name
/// themselves in host/geometry/shared_types.hpp.
template <class T>
struct TypeName;
#define RAYWAVE_CL_TYPE(T, text)               \
  template <>                                  \
  struct raywave::cl::TypeName<T> {            \
    static constexpr const char* value = text; \
  }

class Kernel {
public:
  /// launched  names of kernels of its program that have been launched, which drivers have compiled
  Kernel(Device device, ::cl::Kernel kernel, std::string name,
         std::shared_ptr<std::set<std::string>> launched);

  /// Types as the kernel declares them, e.g. "float*"; empty when the driver does not give them
  /// (some do not for programs from binaries).
  const std::vector<std::string>& argument_types() const { return argument_types_; }

  /// Enqueues the kernel over `global` work-items (rounded up to whole work-groups of `local`), or
  /// as one work-item where it is of that form (kernels/common/items.h).
  /// Buffers pass their memory, everything else its value. A std::tuple passes each of its members:
  /// arrays that many kernels take are bundled once.
  ///
  /// throws  DeviceError when the arguments do not fit the kernel in number or element type, or
  ///         when the launch fails
  template <class... Args>
  void run(Range global, Range local, const Args&... args) {
    if (is_rehearsal) return rehearse(local);
    check_count((count_of(args) + ... + 0));
    cl_uint i = 0;
    (pass(i, args), ...);
    enqueue(global, local);
  }

  /// Makes PoCL compile the kernel for such groups: launches one, with arguments that are zero,
  /// which has nothing to do.
  void compile(Range local);

private:
  template <class T>
  static constexpr std::size_t count_of(const T&) {
    return 1;
  }
  template <class... T>
  static constexpr std::size_t count_of(const std::tuple<T...>&) {
    return sizeof...(T);
  }
  template <class T>
  void pass(cl_uint& i, const T& argument) {
    set(i++, argument);
  }
  template <class... T>
  void pass(cl_uint& i, const std::tuple<T...>& bundle) {
    std::apply([&](const auto&... arguments) { (pass(i, arguments), ...); }, bundle);
  }
  template <class T>
  void set(cl_uint i, const Buffer<T>& buffer) {
    check_type(i, std::string(TypeName<T>::value) + "*");
    checked(device_.info(), [&] { kernel_.setArg(i, buffer.handle()); });
  }
  template <class T>
  void set(cl_uint i, const T& value) {
    check_type(i, TypeName<T>::value);
    checked(device_.info(), [&] { kernel_.setArg(i, sizeof(T), &value); });
  }
  void check_count(std::size_t given) const;
  void check_type(cl_uint i, const std::string& given) const;
  void enqueue(Range global, Range local);
  void rehearse(Range local) const;
  void launch_first(const ::cl::NDRange& global, const ::cl::NDRange& local);

  Device device_;
  ::cl::Kernel kernel_;
  std::string name_;
  bool is_single_item_ = false;  // kernels/common/items.h
  std::size_t rehearsed_ = 0;    // among those that rehearsals have asked for
  std::vector<std::string> argument_types_;
  std::shared_ptr<std::set<std::string>> launched_;  // kernels of its program, by name
};

class Program {
public:
  Program() = default;
  /// Compiles kernels/`file` with its includes, or loads it from RAYWAVE_PROGRAM_DIR
  /// (cl/program_folder.hpp).
  ///
  /// throws  DeviceError when the file has no such option; with device, driver, options and the
  ///         compiler's log when it does not compile
  Program(const Device& device, const std::string& file, const Options& options);

  Kernel kernel(const std::string& name) const;

private:
  std::shared_ptr<Device> device_;
  ::cl::Program program_;
  std::string file_;
  Options options_;
  std::shared_ptr<std::set<std::string>> launched_ = std::make_shared<std::set<std::string>>();
};

}  // namespace raywave::cl

RAYWAVE_CL_TYPE(float, "float");
RAYWAVE_CL_TYPE(double, "double");
RAYWAVE_CL_TYPE(std::int32_t, "int");
RAYWAVE_CL_TYPE(std::uint32_t, "uint");
RAYWAVE_CL_TYPE(std::uint8_t, "uchar");
RAYWAVE_CL_TYPE(std::uint16_t, "ushort");
RAYWAVE_CL_TYPE(std::complex<float>, "float2");
