// SPDX-License-Identifier: Apache-2.0
/// Reader processes: third-party libraries read untrusted files in a program of their own, so that
/// a crash or a hang stays there.
///
/// The programs, raywave_mesh_reader and raywave_image_reader (host/scene/reader/), are started
/// with posix_spawn: a fork would copy a process in which OpenCL drivers run threads.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "host/scene/reader_reply.hpp"

namespace raywave {

struct ReaderLimits {
  unsigned seconds;     // of processor time; ten times as much by the clock
  std::uint64_t bytes;  // of memory, beyond what the program takes at its start
};

/// Finds a reader program: in the folder that the environment variable RAYWAVE_READER_DIR names;
/// without it, beside the running program or the raywave library, in the folder above, or in
/// libexec/raywave one or two folders up.
///
/// throws  InputError when it is in none of them
std::filesystem::path find_reader(const std::string& name);

/// Starts a reader program (arguments: the limits, then `arguments`), whose output is discarded,
/// and calls `receive` on the pipe once it has a result.
///
/// input   descriptor that the program has as its stdin; -1: /dev/null
/// throws  std::runtime_error with the reader's own message, or one that says how it ended
void run_reader(const std::filesystem::path& program, const ReaderLimits& limits,
                const std::vector<std::string>& arguments,
                const std::function<void(ReaderPipe&)>& receive, int input = -1);

}  // namespace raywave
