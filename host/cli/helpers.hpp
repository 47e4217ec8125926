// SPDX-License-Identifier: Apache-2.0
/// Helpers: processes that make pictures, or tiles, for another one, each on a device of its own.
/// Drivers compile on one thread at a time, and may end their process.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cl/device.hpp"
#include "host/animate/animate.hpp"
#include "host/animate/frame_files.hpp"
#include "host/cli/options.hpp"

namespace raywave::cli {

/// In place of the pictures: those in the queue that another process gives.
constexpr const char* from_queue = "-";

/// Words of a command line that makes the whole, but for --device; files are named as they were
/// given.
std::vector<std::string> words_of(const char* command, const SceneArguments& options);

/// Makes what `files` lacks: a helper on each device takes the next picture whenever it has time.
///
/// words   a command that makes one part, without it: ... "--pictures"
/// throws  InputError or DeviceError where a helper fails, with what it says and its device; what
///         was made stays, the others are stopped
AnimateResult make_on(const std::vector<cl::DeviceInfo>& devices,
                      const std::vector<std::string>& words, FrameFiles& files,
                      const Progress& progress);

/// "NAME", or "2 x NAME (0:0: 31, 0:1: 29)" with what each has made.
std::string devices_text(const cl::DeviceInfo& first, const AnimateResult& made);

/// Ends this process with the one that has started it.
void end_with_parent();

/// Makes pictures of an Animator, or tiles of HologramTiles, for another process.
template <class Whole>
void help(const Whole& whole, const std::filesystem::path& folder, FrameStorage storage) {
  FrameFiles files(folder, storage, whole.run_name(storage), whole.schedule(), whole.stored_size(),
                   whole.laser_names(), {}, /*is_helper=*/true);
  whole.make_frames(files, {});
}

}  // namespace raywave::cli
