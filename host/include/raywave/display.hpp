// SPDX-License-Identifier: Apache-2.0
/// An SLM that is an output of this computer.
#pragma once

#include <cstdint>
#include <memory>
#include <raywave/types.hpp>
#include <span>
#include <string>

namespace RAYWAVE_NAMESPACE {

struct DisplayOptions {
  std::string output{};   // its name, or maker, product and serial of its EDID; empty: the only one
  std::string backend{};  // "window", "kms"; empty: a window where there is a desktop
  double rate_hz = 0;     // that the output must have; 0: any
  bool read_back = false;  // each frame as it was drawn; else the first of a window
};

struct Flip {
  std::uint64_t refresh = 0;  // of the output, that the frame was new at; the first one's is 0
  double time_s = 0;          // of the monotonic clock
  double latency_s = 0;       // since it was handed over
};

/// An output that shows frames while this lives, and is as before after that. What proves that they
/// arrive depends on the backend (docs/slm.md). All calls come from one thread.
class RAYWAVE_API Display {
public:
  /// throws  InputError when the output's size or rate is another, or raywave was built without
  ///         what the backend needs; DeviceError when the output cannot be had
  Display(int columns, int rows, const DisplayOptions& options = {});
  ~Display();
  Display(Display&&) noexcept;
  Display& operator=(Display&&) noexcept;

  /// Shows a frame from the next refresh on, and waits for it.
  ///
  /// levels  a byte for each pixel, or three (red, green, blue), rows from the top
  /// throws  InputError for levels of another size, and when this is closed; DeviceError when the
  ///         output is gone
  Flip show(std::span<const std::uint8_t> levels);
  /// What shows, and which proof there is, as JSON.
  std::string report() const;
  void close() noexcept;

private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace RAYWAVE_NAMESPACE
