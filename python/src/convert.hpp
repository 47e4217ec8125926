// SPDX-License-Identifier: Apache-2.0
/// Arrays and callbacks of Python's as values of the library's, and back.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <raywave/raywave.hpp>
#include <string>
#include <utility>

#include "arrays.hpp"

namespace raywave_python {

using namespace nb::literals;
using raywave::InputError;
using Complex = std::complex<float>;
using ComplexDouble = std::complex<double>;

inline constexpr const char* one_plane = "(ny, nx)";
inline constexpr const char* planes = "(ny, nx) or (frames, ny, nx)";
inline constexpr const char* pictures = "(ny, nx), or (ny, nx, 3) in colour";

/// A callback of Python's, called with the GIL on the thread that computes. Ctrl-C stops the
/// computation whether there is a callback or not.
inline raywave::Progress progress_of(const nb::object& callback) {
  if (!callback.is_none() && !PyCallable_Check(callback.ptr()))
    refuse("progress", "must be a function of (step, share)");
  return [callback = callback.ptr()](const std::string& what, double share) {
    const nb::gil_scoped_acquire gil;
    if (PyErr_CheckSignals() != 0) throw nb::python_error();
    if (callback == Py_None) return true;
    const nb::object answer = nb::handle(callback)(what, share);
    return !answer.is(nb::bool_(false));
  };
}

/// What `work` returns, while other threads of Python's may run.
auto without_gil(const auto& work) {
  const nb::gil_scoped_release release;
  return work();
}

/// The value of a name, or what the library chooses where it is empty.
template <raywave::Named Value>
std::optional<Value> optional_choice(const std::string& name, const char* what) {
  if (name.empty()) return std::nullopt;
  return raywave::choice_of<Value>(name, what);
}

inline raywave::DeviceOptions device_options(const std::string& device, const std::string& fft) {
  return {device, optional_choice<raywave::FftBackend>(fft, "fft")};
}

inline raywave::FieldView field_view(const AnyArray& array, const char* name) {
  const auto n = array.ndim();
  return {static_cast<int>(array.shape(n - 1)), static_cast<int>(array.shape(n - 2)),
          n == 3 ? static_cast<int>(array.shape(0)) : 1, data_of<Complex>(array, name)};
}

inline raywave::PictureView picture_view(const AnyArray& array, const char* name) {
  if (array.ndim() == 3 && array.shape(2) != 3)
    refuse(name, std::string("must have the shape ") + pictures + ", got " + shape_text(array));
  return {static_cast<int>(array.shape(1)), static_cast<int>(array.shape(0)),
          array.ndim() == 3 ? 3 : 1, data_of<float>(array, name)};
}

inline AnyArray samples_of(nb::handle object, const char* name, std::size_t most_dimensions,
                           const char* shape) {
  auto array = array_of(object, name, 2, most_dimensions, shape);
  for (std::size_t i = 0; i < array.ndim(); ++i)
    if (array.shape(i) > (std::size_t{1} << 30))
      refuse(name, "has more samples than raywave takes");
  return array;
}
inline AnyArray planes_of(nb::handle object, const char* name) {
  return samples_of(object, name, 3, planes);
}
inline AnyArray plane_of(nb::handle object, const char* name) {
  return samples_of(object, name, 2, one_plane);
}
inline AnyArray picture_of(nb::handle object, const char* name) {
  return samples_of(object, name, 3, pictures);
}

template <class T>
inline Array field_array(raywave::BasicField<T> field) {
  const auto shape = shape_of(field.frames, field.ny, field.nx);
  return as_numpy(std::move(field.values), shape);
}

inline Array picture_array(raywave::Picture picture) {
  auto shape = shape_of(1, picture.ny, picture.nx);
  if (picture.channels > 1) shape.push_back(static_cast<std::size_t>(picture.channels));
  return as_numpy(std::move(picture.values), shape);
}

inline Array levels_array(raywave::Levels levels) {
  const auto shape = shape_of(levels.frames, levels.ny, levels.nx);
  if (levels.bits > 8) return as_numpy(std::move(levels.values16), shape);
  return as_numpy(std::move(levels.values), shape);
}

/// Add parts of the module.
void add_light(nb::module_& m);
void add_display(nb::module_& m);
void add_live(nb::module_& m);

}  // namespace raywave_python
