// SPDX-License-Identifier: Apache-2.0
/// Desks whose scenes move, and the files that films of them are.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <thread>

#include "host/animate/animate.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/program.hpp"
#include "tests/support/scenes.hpp"

namespace raywave::test {

/// A bar that turns and comes nearer, a wall that leans, a light that dims: 7 pictures of 2
/// holograms.
inline constexpr const char* moving_lines =
    "[[object]]\nmesh = \"square.obj\"\nwidth = \"0.05 mm\"\nposition = [0, 0, \"8 mm\"]\n"
    "[animation]\nframes = 7\nrate = 10\nsubframes = 2\n"
    "[[animation.track]]\nof = \"object.1.rotation\"\nat = [0, 7]\nvalues = [[0, 0, 0], [0, 40, "
    "180]]\n"
    "[[animation.track]]\nof = \"object.1.position\"\nat = [0, 3, 7]\nsteps = \"cubic\"\nvalues = "
    "[[0, 0, \"8 mm\"], [\"0.03 mm\", 0, \"4 mm\"], [0, 0, \"8 mm\"]]\n"
    "[[animation.track]]\nof = \"object.0.rotation\"\nat = [2, 4]\nvalues = [[0, 0, 0], [0, 9, "
    "0]]\n"
    "[[animation.track]]\nof = \"light.0.intensity\"\nat = [0, 7]\nvalues = [1, 0.2]\n";

/// All files of a folder.
inline std::map<std::string, std::string> files_of(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder))
    files[entry.path().filename().string()] = bytes_of(entry.path());
  return files;
}

inline bool waits_for(const std::function<bool()>& holds) {
  for (int i = 0; i < 24000 && !holds(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  return holds();
}

inline AnimateResult run(const Animator& animator, const std::filesystem::path& folder,
                         FrameStorage storage) {
  FrameFiles files(folder, storage, animator.run_name(storage), animator.schedule(),
                   animator.stored_size());
  return animator.make_frames(files, {});
}

}  // namespace raywave::test
