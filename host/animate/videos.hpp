// SPDX-License-Identifier: Apache-2.0
/// Videos of an animation's holograms, through the program ffmpeg.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "host/animate/animate.hpp"

namespace raywave {

/// The holograms of an animation that is complete, those of all lasers counted.
struct StoredHolograms {
  std::filesystem::path folder;
  FrameStorage storage = FrameStorage::pngs;
  glm::ivec2 size_px{0, 0};  // as stored
  int count = 0;
  double rate_per_s = 0;
  std::vector<std::string> lasers{};  // in the names of their files; empty: one wavelength
};

/// All holograms as lossless grey FFV1 at the SLM's rate, those of the lasers in turn. The file
/// appears whole or not at all.
///
/// ffmpeg  the program
/// throws  InputError when it fails, with what it says
void write_hologram_video(const std::filesystem::path& ffmpeg, const StoredHolograms& holograms,
                          const std::filesystem::path& file);

/// What a viewer sees, at the rate of the pictures: reconstructions (host/view/reconstruct.hpp) at
/// the camera's depth of what the SLM shows, mean over the holograms of each picture. All pictures
/// share one exposure, where 99.5 % of the brightest of eight stay at or below white. In colour,
/// they are sRGB, and each laser has the power that report.jsonl tells.
///
/// animator  that has made the holograms
/// progress  called with 0..1
/// throws    as write_hologram_video
void write_preview(const std::filesystem::path& ffmpeg, const cl::Device& device,
                   cl::FftBackend fft, const Animator& animator, const StoredHolograms& holograms,
                   const std::filesystem::path& file, double rate_per_s,
                   const std::function<void(double)>& progress);

// The program ffmpeg, where it is installed: videos of pictures, and pictures of videos.

/// Where the program of this name is on PATH, if it is.
std::optional<std::filesystem::path> find_program(const std::string& name);

}  // namespace raywave
