// SPDX-License-Identifier: Apache-2.0
/// Arrays of Python's as memory of the library's, and back, without copies where the samples lie
/// one behind another. Every refusal is an InputError that begins with the argument's name.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include <complex>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <raywave/error.hpp>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

namespace raywave_python {

namespace nb = nanobind;

/// Any array in host memory: NumPy's, a buffer's, or one with DLPack.
using AnyArray = nb::ndarray<nb::ro>;

inline std::string dtype_name(nb::dlpack::dtype type) {
  const auto bits = std::to_string(type.bits);
  switch (static_cast<nb::dlpack::dtype_code>(type.code)) {
    case nb::dlpack::dtype_code::Int:
      return "int" + bits;
    case nb::dlpack::dtype_code::UInt:
      return "uint" + bits;
    case nb::dlpack::dtype_code::Float:
      return "float" + bits;
    case nb::dlpack::dtype_code::Complex:
      return "complex" + bits;
    case nb::dlpack::dtype_code::Bool:
      return "bool";
    default:
      return "another type";
  }
}

[[noreturn]] inline void refuse(const char* name, const std::string& what) {
  throw raywave::InputError(std::string(name) + ": " + what);
}

inline std::string shape_text(const auto& array) {
  std::string text;
  for (std::size_t i = 0; i < array.ndim(); ++i)
    text += (i ? ", " : "") + std::to_string(array.shape(i));
  return "(" + text + (array.ndim() == 1 ? ",)" : ")");
}

template <class Array>
bool is_contiguous(const Array& array) {
  std::int64_t expected = 1;
  for (std::size_t i = array.ndim(); i-- > 0;) {
    if (array.shape(i) != 1 && array.stride(i) != expected) return false;
    expected *= static_cast<std::int64_t>(array.shape(i));
  }
  return true;
}

/// What all arguments must be: in host memory, not empty, row-major.
template <class Array>
void require_plain(const Array& array, const char* name, std::size_t least_dimensions,
                   std::size_t most_dimensions, const char* shape) {
  if (array.device_type() != nb::device::cpu::value)
    refuse(name, "must be in host memory: OpenCL shares none with other devices");
  if (array.ndim() < least_dimensions || array.ndim() > most_dimensions)
    refuse(name, std::string("must have the shape ") + shape + ", got " + shape_text(array));
  for (std::size_t i = 0; i < array.ndim(); ++i)
    if (array.shape(i) == 0) refuse(name, "is empty, shape " + shape_text(array));
  if (!is_contiguous(array))
    refuse(name,
           "must be C-contiguous; numpy.ascontiguousarray makes such a copy, and .copy() one "
           "of a Field that keeps its pitch");
}

/// Masks would be ignored; some versions of torch hand on tensors whose numbers are not those in
/// memory, or whose gradient would be lost.
inline void require_resolved(nb::handle object, const char* name) {
  if (nb::hasattr(object, "mask") && nb::hasattr(object, "filled"))
    refuse(name, "is masked: pass .filled(0), or another value, of it");
  const auto is = [&](const char* question, bool is_call) {
    if (!nb::hasattr(object, question)) return false;
    const nb::object answer = object.attr(question);
    return (is_call && PyCallable_Check(answer.ptr()) ? answer() : answer).is(nb::bool_(true));
  };
  if (is("requires_grad", false))
    refuse(name, "needs a gradient: pass u.detach(), or use raywave.torch");
  if (is("is_conj", true) || is("is_neg", true))
    refuse(name, "is a view of other numbers: pass u.resolve_conj().resolve_neg()");
}

inline bool is_swapped(nb::handle object) {
  if (!nb::hasattr(object, "dtype")) return false;
  return nb::getattr(object.attr("dtype"), "isnative", nb::none()).is(nb::bool_(false));
}

inline bool try_array(nb::handle object, AnyArray& array) {
  return nb::try_cast<AnyArray>(object, array, false) && array.is_valid();
}

/// A copy as NumPy makes it: `copy`, or `astype` of a type.
inline AnyArray copied(const AnyArray& array, const char* method, auto... type) {
  const std::vector<std::size_t> shape(array.shape_ptr(), array.shape_ptr() + array.ndim());
  const nb::ndarray<nb::numpy, nb::ro> view(array.data(), shape.size(), shape.data(), nb::handle(),
                                            array.stride_ptr(), array.dtype());
  const nb::object copy = nb::cast(view, nb::rv_policy::reference).attr(method)(type...);
  return nb::cast<AnyArray>(copy);
}

/// An array that is only read; samples apart are copied together.
inline AnyArray array_of(nb::handle object, const char* name, std::size_t least_dimensions,
                         std::size_t most_dimensions, const char* shape) {
  AnyArray array;
  require_resolved(object, name);
  nb::object native;
  if (is_swapped(object)) {
    native = object.attr("astype")(object.attr("dtype").attr("newbyteorder")("="));
    object = native;
  }
  if (!try_array(object, array))
    refuse(name, std::string("must be an array of numbers in host memory (NumPy, a buffer, or "
                             "DLPack as a detached torch tensor), got ") +
                     Py_TYPE(object.ptr())->tp_name);
  if (array.device_type() == nb::device::cpu::value && !is_contiguous(array))
    array = copied(array, "copy");
  require_plain(array, name, least_dimensions, most_dimensions, shape);
  return array;
}

template <class T>
bool is_of(const auto& array) {
  return array.dtype() == nb::dtype<T>();
}

/// The elements of an array that must have this type.
template <class T>
const T* data_of(const AnyArray& array, const char* name) {
  if (!is_of<T>(array))
    refuse(name, "must be " + dtype_name(nb::dtype<T>()) + ", got " + dtype_name(array.dtype()) +
                     (std::is_same_v<T, std::complex<float>> && is_of<std::uint8_t>(array)
                          ? "; raywave.shown makes a field of levels"
                          : ""));
  return static_cast<const T*>(array.data());
}

/// Calls `use` with the elements of an array that has one of these types.
template <class... Types>
void with_data(const AnyArray& array, const char* name, const char* types, const auto& use) {
  const auto used_as = [&]<class T>(const T* data) {
    if (is_of<T>(array)) use(data);
    return is_of<T>(array);
  };
  if (!(used_as(static_cast<const Types*>(array.data())) || ...))
    refuse(name, std::string("must be ") + types + ", got " + dtype_name(array.dtype()));
}

/// The array in single precision, if it is one of this type in double precision.
template <class T>
AnyArray in_single(AnyArray array) {
  constexpr bool is_complex = std::is_same_v<T, std::complex<float>>;
  using Double = std::conditional_t<is_complex, std::complex<double>, double>;
  if (!is_of<Double>(array)) return array;
  return copied(array, "astype", dtype_name(nb::dtype<T>()).c_str());
}

/// (ny, nx), or (frames, ny, nx) for several frames, as field.npy.
inline std::vector<std::size_t> shape_of(int frames, int ny, int nx) {
  std::vector<std::size_t> shape{static_cast<std::size_t>(ny), static_cast<std::size_t>(nx)};
  if (frames != 1) shape.insert(shape.begin(), static_cast<std::size_t>(frames));
  return shape;
}

/// The same of one laser; (lasers, frames, ny, nx) of several, whose frames come one after another.
inline std::vector<std::size_t> shape_of(int lasers, int frames, int ny, int nx) {
  if (lasers == 1) return shape_of(frames, ny, nx);
  return {static_cast<std::size_t>(lasers), static_cast<std::size_t>(frames),
          static_cast<std::size_t>(ny), static_cast<std::size_t>(nx)};
}

/// Memory of the caller's for results of this shape; a plane may also be one of one frame.
template <class T>
T* out_data(nb::handle object, const char* name, const std::vector<std::size_t>& wanted,
            nb::ndarray<>& array) {
  require_resolved(object, name);
  if (!nb::try_cast<nb::ndarray<>>(object, array, false) || !array.is_valid()) {
    AnyArray read_only;
    if (try_array(object, read_only)) refuse(name, "is read-only");
    if (is_swapped(object)) refuse(name, "must have the machine's byte order");
    refuse(name, std::string("must be a NumPy array, or a buffer, in host memory, got ") +
                     Py_TYPE(object.ptr())->tp_name);
  }
  std::string shape;
  for (const auto side : wanted) shape += (shape.empty() ? "(" : ", ") + std::to_string(side);
  shape += ")";
  const bool is_plane = wanted.size() == 2;
  require_plain(array, name, wanted.size(), is_plane ? 3 : wanted.size(), shape.c_str());
  std::vector<std::size_t> sides(array.shape_ptr(), array.shape_ptr() + array.ndim());
  if (is_plane && sides.size() == 3 && sides[0] == 1) sides.erase(sides.begin());
  if (sides != wanted) refuse(name, "must have the shape " + shape + ", got " + shape_text(array));
  if (!is_of<T>(array))
    refuse(name, "must be " + dtype_name(nb::dtype<T>()) + ", got " + dtype_name(array.dtype()));
  return static_cast<T*>(array.data());
}

/// A NumPy array; the package says which.
using Array = nb::any;

/// A NumPy array on memory that `owner` keeps.
template <class T, class Owner>
Array numpy_view(const T* data, const std::vector<std::size_t>& shape, Owner owner) {
  auto* kept = new Owner(std::move(owner));
  nb::capsule capsule(kept, [](void* p) noexcept { delete static_cast<Owner*>(p); });
  const nb::ndarray<nb::numpy, T> view(const_cast<T*>(data), shape.size(), shape.data(), capsule);
  return nb::borrow<Array>(nb::cast(view, nb::rv_policy::reference));
}

/// A NumPy array that takes over a vector.
template <class T>
Array as_numpy(std::vector<T> values, const std::vector<std::size_t>& shape) {
  auto kept = std::make_shared<std::vector<T>>(std::move(values));
  const T* data = kept->data();
  return numpy_view(data, shape, std::move(kept));
}

}  // namespace raywave_python
