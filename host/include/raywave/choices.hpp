// SPDX-License-Identifier: Apache-2.0
/// Values that have names: the same in C++, in scene files, on the command line and in Python.
#pragma once

#include <array>
#include <cstddef>

namespace raywave {

/// Which library transforms padded planes.
enum class FftBackend {
  host,   // FFTW on the host, line by line: no transfer on CPU devices, one copy each way on others
  clfft,  // clFFT on the device
  vkfft,  // VkFFT on the device
};
constexpr auto names_of(FftBackend) { return std::array{"host", "clfft", "vkfft"}; }

enum class DeviceKind { gpu, accelerator, cpu, other };
constexpr auto names_of(DeviceKind) { return std::array{"gpu", "accelerator", "cpu", "other"}; }

/// How the field at the hologram comes about.
enum class Method {
  wrp,  // light is gathered on wavefront recording planes and propagated to the hologram
  // Light of every surface sample at every hologram pixel, with visibility: point-based holography,
  // the gold standard
  points,
  rays,  // rays cast from each hologram pixel
};
constexpr auto names_of(Method) { return std::array{"wrp", "points", "rays"}; }

/// Points on a scene's curve of accuracy against time.
enum class Preset { draft, balanced, accurate, reference };
constexpr auto names_of(Preset) { return std::array{"draft", "balanced", "accurate", "reference"}; }

/// A test picture for an SLM.
enum class Pattern {
  lens,     // focuses the light: tells the sign of phase
  blaze,    // turns the light to one side: tells flips and turns
  checker,  // squares half a turn apart: no light stays on the axis where a turn is a turn
  ramp      // grey rises by a turn from left to right, below a plain quarter: to be looked at
};
constexpr auto names_of(Pattern) { return std::array{"lens", "blaze", "checker", "ramp"}; }

/// As seen along the light.
enum class Side { right, left, up, down };
constexpr auto names_of(Side) { return std::array{"right", "left", "up", "down"}; }

/// The quantity that pixels are compared as. Papers of the field use all three.
enum class Domain {
  intensity,  // linear values, as they are
  amplitude,  // their square roots; values below zero are black
  srgb        // encoded as a screen shows them, 0 to 1, with max(a) as white
};
constexpr auto names_of(Domain) { return std::array{"intensity", "amplitude", "srgb"}; }

/// names_of gives the names in the order of the values, which begin at 0.
template <class Value>
concept Named = requires(Value value) {
  names_of(value);
};

template <Named Value>
constexpr const char* name_of(Value value) {
  return names_of(value)[static_cast<std::size_t>(value)];
}

}  // namespace raywave
