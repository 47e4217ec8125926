// SPDX-License-Identifier: Apache-2.0
/// What a person would do, written down.
#pragma once

#include <filesystem>
#include <vector>

#include "host/live/live_scene.hpp"

namespace raywave {

struct Step : Viewing {
  bool saves = false;  // the scene, too
};

/// What is seen after each [[step]] of a TOML file, `repeat` times each: `object` is turned by
/// `turn` (Pose::turn) and moved by `move`; `light` has `direction`, `position` and `intensity`, as
/// in scenes, and `focus`, `eye` (as a viewer sees it, like --view), `part`, or `pupil` in its
/// place, `hologram`, `lens`, `stops`, `preset` and `refined` are those of Viewing from then on.
/// `save` is for the last picture of the step.
///
/// start         before the first step
/// has_eyepiece  parts of the hologram are not looked through, then
/// throws        InputError with file and line
std::vector<Step> read_steps(const std::filesystem::path& file, const Viewing& start,
                             bool has_eyepiece);

}  // namespace raywave
