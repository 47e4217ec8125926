// SPDX-License-Identifier: Apache-2.0
/// What a person would do, written down.
#pragma once

#include <filesystem>
#include <vector>

#include "host/live/live_scene.hpp"

namespace raywave {

/// What is seen after each [[step]] of a TOML file, `repeat` times each: `object` is turned by
/// `turn` (Pose::turn) and moved by `move`; `focus`, `eye` (as a viewer sees it, like --view),
/// `part`, `hologram`, `lens`, `stops`, `preset` and `refined` are those of Viewing from then on.
///
/// start   before the first step
/// throws  InputError with file and line
std::vector<Viewing> read_steps(const std::filesystem::path& file, const Viewing& start);

}  // namespace raywave
