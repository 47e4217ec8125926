// SPDX-License-Identifier: Apache-2.0
/// What is made part by part: the pictures of an animation, the tiles of a hologram.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "cl/device.hpp"
#include "host/animate/frame_files.hpp"
#include "host/cli/options.hpp"
#include "host/forecast/presets.hpp"
#include "host/scene/scene.hpp"

namespace raywave::cli {

/// --pictures and --tiles: "12", or "10..20" with both ends; "all", or empty: all.
///
/// option  its name
/// what    of which there are so many: "picture"
/// throws  InputError
PictureRange range_of(const std::string& option, const std::string& text, const char* what,
                      int count);

/// "1 picture", "2 pictures"
std::string count_text(int count, const char* what);

/// Chooses what the scenes of the lasers leave open for a goal, by the scene at rest. What it chose
/// is in their digests.
///
/// by_tile  each tile is a result of its own
/// returns  the plans of the goal, or none; and a line on colours, or none
std::pair<std::vector<Planned>, std::string> choose(const Goal& goal, std::vector<Scene>& scenes,
                                                    const cl::Device& device, bool by_tile = false);

/// What other parts of a run have said, as far as its folder knows.
///
/// kind  in report.json: "animation", "tiles"
std::vector<std::string> said_by_parts(const std::filesystem::path& folder, const char* kind,
                                       const std::string& run);
/// Prints what has not been said, and adds it to that.
void say(const ReportOptions& report, const std::vector<std::string>& notes,
         std::vector<std::string>& said);

/// throws  InputError for scenes of several lasers, whose tiles are not made together
void require_one_laser(const std::vector<Scene>& scenes);

/// What commands that make parts are asked for.
struct PartsArguments : SceneArguments {
  std::string out, parts;  // --pictures, --tiles
};

/// `render --tiles`
void run_tiles(const PartsArguments& options);

}  // namespace raywave::cli
