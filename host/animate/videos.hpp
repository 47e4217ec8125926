// SPDX-License-Identifier: Apache-2.0
/// Videos of an animation's holograms, through the program ffmpeg.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
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

/// A program that runs beside this one and takes or gives bytes.
class VideoProgram {
public:
  /// Which of the program's streams this one holds the other end of.
  enum class Held { none, input, output };

  /// folder   where it works: names among the arguments are relative to it
  /// throws   InputError when it cannot be started
  VideoProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments,
               const std::filesystem::path& folder, Held held);
  /// Ends the program where it still runs.
  ~VideoProgram();
  VideoProgram(const VideoProgram&) = delete;
  VideoProgram& operator=(const VideoProgram&) = delete;

  /// Sends bytes to its input.
  ///
  /// throws  InputError when it has ended, with what it said
  void write(std::span<const std::uint8_t> bytes);
  /// Fills `bytes` from its output.
  ///
  /// throws  InputError when it has ended before, with what it said
  void read(std::span<std::uint8_t> bytes);
  /// Closes the stream and waits for the end.
  ///
  /// throws  InputError when the program has failed, with what it said
  void finish();

private:
  [[noreturn]] void fail();
  bool wait();

  std::string name_;
  int stream_ = -1;
  pid_t process_ = 0;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> said_;
};

}  // namespace raywave
