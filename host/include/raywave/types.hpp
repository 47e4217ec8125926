// SPDX-License-Identifier: Apache-2.0
/// Plain values that the library takes and returns.
///
/// Frame: right-handed, the hologram in the plane z = 0 centred on the z axis, y up; light
/// travels towards -z. Lengths are metres. Planes are row-major, row 0 on top (largest
/// y), column 0 left (smallest x), as seen along the light.
#pragma once

#include <raywave/export.h>

#include <array>
#include <complex>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <raywave/choices.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

// Names of the library have a version of their own: rooms of the library that were never meant for
// others may have the same names (raywave::Scene), and stay apart from them.
#ifdef RAYWAVE_BUILDING
#define RAYWAVE_NAMESPACE raywave::v0
#else
#define RAYWAVE_NAMESPACE raywave::inline v0
#endif

namespace RAYWAVE_NAMESPACE {

/// The place of a name among all.
///
/// throws  InputError that lists the names when it is none of them
RAYWAVE_API std::size_t place_of(std::string_view name, std::span<const char* const> names,
                                 std::string_view what);

/// The value of this name: choice_of<Method>("rays", "method"). `what` begins a refusal.
///
/// throws  InputError that lists the names when it is none of them
template <Named Value>
Value choice_of(std::string_view name, std::string_view what) {
  return static_cast<Value>(v0::place_of(name, names_of(Value{}), what));
}

using Vec2 = std::array<double, 2>;  // x right, y up
using Vec3 = std::array<double, 3>;

// Planes of ny rows of nx values, one after the other: `values` of all, in the order of their
// sizes. Views are the same in memory of the caller's, which must stay until the call returns.

template <class Sample>
struct BasicFieldView {
  int nx = 0, ny = 0, frames = 1;
  const std::complex<Sample>* values = nullptr;

  std::size_t size() const {
    return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) *
           static_cast<std::size_t>(frames);
  }
};
using FieldView = BasicFieldView<float>;
using FieldDoubleView = BasicFieldView<double>;

template <class Sample>
struct BasicField {
  int nx = 0, ny = 0, frames = 1;
  std::vector<std::complex<Sample>> values{};

  operator BasicFieldView<Sample>() const { return {nx, ny, frames, values.data()}; }
};
using Field = BasicField<float>;
using FieldDouble = BasicField<double>;

/// Linear values. In colour, red, green and blue of each pixel lie side by side, in linear sRGB,
/// and channels is 3.
struct PictureView {
  int nx = 0, ny = 0, channels = 1;
  const float* values = nullptr;
};

struct Picture {
  int nx = 0, ny = 0, channels = 1;
  std::vector<float> values{};

  operator PictureView() const { return {nx, ny, channels, values.data()}; }
};

/// Grey levels of an SLM, frame by frame. Those of more than 8 bits are in `values16`, and `values`
/// is empty.
struct Levels {
  int nx = 0, ny = 0, frames = 1, bits = 8;
  std::vector<std::uint8_t> values{};
  std::vector<std::uint16_t> values16{};
};

/// The pixels that a field or hologram is sampled on.
struct Pixels {
  Vec2 pitch_m{0, 0};
  double wavelength_m = 0;
};

/// A mesh in memory of the caller's. The library copies it.
struct MeshView {
  std::span<const Vec3> vertices{};
  // Counter-clockwise from outside; with `radii` none: the vertices are points
  std::span<const std::array<std::uint32_t, 3>> faces{};
  std::span<const Vec2> uvs{};      // one per vertex, or none; (0, 0) is the texture's bottom left
  std::span<const Vec3> normals{};  // one per vertex, or none
  // One per vertex, or none: linear red, green and blue, and alpha, 0 to 1
  std::span<const std::array<float, 4>> colours{};
  std::span<const std::uint8_t> texture{};  // a picture file (PNG ...) in memory, or none
  // Of points, one each: a disc across the vertex's normal, or a small ball where it has none. 0:
  // up to the fifth neighbour
  std::span<const double> radii{};
};

/// Called with the current step ("WRP 2 of 4") and the completed share, 0 to 1, on the thread that
/// computes. Returning false stops the computation, which then throws Cancelled; exceptions that it
/// throws itself pass through.
using Progress = std::function<bool(const std::string& what, double share)>;

}  // namespace RAYWAVE_NAMESPACE
