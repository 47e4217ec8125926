// SPDX-License-Identifier: Apache-2.0
/// Frames shown one after another, counted and timed.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <vector>

#include "host/display/display.hpp"

namespace raywave {

/// The next frame; none: it was the last. Called from a thread of its own.
using NextFrame = std::function<std::shared_ptr<const LevelFrame>()>;

/// Each refresh of the output, from the first frame's to the end of the last one's, is one of
/// three.
struct RefreshCount {
  std::uint64_t shown = 0;      // with a new frame
  std::uint64_t repeated = 0;   // with the frame before, as the rate wants it
  std::uint64_t missed = 0;     // with the frame before, as the new one came late
  std::uint64_t refreshes = 0;  // by the display's own count
};

struct ShownFrames {
  RefreshCount count;
  double seconds = 0;               // from the first frame to the last
  std::vector<double> latencies_s;  // from a frame's being handed over to its flip, sorted

  /// The latency that this share of frames keeps.
  double latency_s(double share) const;
};

/// Shows frames until there are no more, or `stop` is set.
///
/// display    opened
/// output_hz  its refreshes a second
/// rate_hz    frames a second; 0: one each refresh
/// tell       called with each frame, its flip and the refreshes that it missed
/// throws     InputError when a frame has another size than the one before it
ShownFrames show_frames(
    Display& display, double output_hz, double rate_hz, const NextFrame& next,
    const std::atomic<bool>& stop,
    const std::function<void(const LevelFrame&, const Flip&, std::uint64_t missed)>& tell = {});

}  // namespace raywave
