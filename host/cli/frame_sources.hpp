// SPDX-License-Identifier: Apache-2.0
/// What `raywave show` shows: frames from files, reports, streams and standard input.
#pragma once

#include <string>
#include <vector>

#include "cl/device.hpp"
#include "host/display/show.hpp"
#include "host/scene/scene.hpp"

namespace raywave::cli {

struct FrameSource {
  glm::ivec2 size_px{0, 0};
  std::uint64_t frames = 0;  // of one turn; 0: nobody knows (standard input)
  std::string first;         // file of the first frame; empty: it has none
  // As report.json or the scene says it; 0: not said
  double panel_hz = 0;  // slm.rate, of pictures: one may hold frames of several
  double rate_hz = 0;   // of an animation's holograms
  NextFrame next;       // may be called after the last frame of a turn: the next turn begins

  /// what     files, folders, reports, or "-"
  /// size_px  of raw levels, where nothing else tells it; (0, 0): not given
  /// stop     ends waiting for standard input
  /// throws   InputError
  FrameSource(const std::vector<std::string>& what, glm::ivec2 given_px,
              const std::atomic<bool>& stop);
  /// An animation, which is computed while it is shown.
  ///
  /// scenes  of all lasers
  FrameSource(const std::vector<Scene>& scenes, const cl::Device& device);
};

}  // namespace raywave::cli
