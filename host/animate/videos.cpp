// SPDX-License-Identifier: Apache-2.0
#include "host/animate/videos.hpp"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "host/animate/video_program.hpp"
#include "host/common/output.hpp"
#include "host/encode/panel.hpp"
#include "host/encode/shown.hpp"
#include "host/view/reconstruct.hpp"

namespace raywave {
namespace fs = std::filesystem;

namespace {

using Words = std::vector<std::string>;

std::string rate_text(double rate_per_s) { return std::to_string(rate_per_s); }

Words operator+(Words a, const Words& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// Quiet, and the same bytes each time.
Words common_words() {
  return {"-hide_banner", "-nostdin", "-loglevel", "error",    "-y",
          "-threads",     "2",        "-fflags",   "+bitexact"};
}

Words raw_input(glm::ivec2 size_px, double rate_per_s, const std::string& name,
                std::uint64_t skipped_bytes) {
  return {"-f",
          "rawvideo",
          "-pix_fmt",
          "gray",
          "-video_size",
          std::to_string(size_px.x) + "x" + std::to_string(size_px.y),
          "-framerate",
          rate_text(rate_per_s),
          "-skip_initial_bytes",
          std::to_string(skipped_bytes),
          "-i",
          name};
}

/// The holograms from number `first` on, named relative to their folder.
Words input_of(const StoredHolograms& holograms, int first) {
  if (holograms.storage == FrameStorage::pngs)
    return {"-framerate", rate_text(holograms.rate_per_s), "-start_number", std::to_string(first),
            "-i",         FrameFiles::png_pattern};
  const auto pixels = static_cast<std::uint64_t>(holograms.size_px.x) * holograms.size_px.y;
  return raw_input(holograms.size_px, holograms.rate_per_s, FrameFiles::stream_name,
                   static_cast<std::uint64_t>(first) * pixels);
}

/// Reads holograms one after another, in the hologram's frame.
class HologramReader {
public:
  HologramReader(const fs::path& ffmpeg, const StoredHolograms& holograms, int first)
      : size_(holograms.size_px),
        program_(ffmpeg,
                 common_words() + input_of(holograms, first) +
                     Words{"-f", "rawvideo", "-pix_fmt", "gray", "pipe:1"},
                 holograms.folder, VideoProgram::Held::output) {}

  std::vector<std::uint8_t> next(const SlmSpec& slm) {
    LevelPicture picture{size_, std::vector<std::uint8_t>(static_cast<std::size_t>(size_.x) *
                                                          static_cast<std::size_t>(size_.y))};
    program_.read(picture.levels);
    return from_slm(std::move(picture), slm).levels;
  }

private:
  glm::ivec2 size_;
  VideoProgram program_;
};

/// What is seen of pictures.
class Viewer {
public:
  Viewer(const cl::Device& device, cl::FftBackend fft, const Animator& animator)
      : device_(device),
        fft_(fft),
        animator_(animator),
        panel_(animator.plan().slm, animator.plan().size, animator.plan().pitch_m,
               animator.plan().wavelength_m) {
    spec_.resolution = animator.plan().size;
    spec_.pitch_m = animator.plan().pitch_m;
    spec_.wavelength_m = animator.plan().wavelength_m;
  }

  /// The next picture of a reader.
  Image see(int picture, HologramReader& reader) const {
    std::vector<std::vector<std::uint8_t>> levels;
    for (int i = 0; i < animator_.schedule().count_of(picture); ++i)
      levels.push_back(reader.next(panel_.slm()));
    const auto camera = animator_.camera(picture);
    ReconstructSpec what;
    what.z_m = camera.depth_m.value();
    what.view = camera.view;
    what.aperture = camera.aperture;
    what.window_m = camera.window_m;
    return reconstruct(device_, fft_, shown_field(panel_, levels), spec_, what);
  }

private:
  const cl::Device& device_;
  cl::FftBackend fft_;
  const Animator& animator_;
  Panel panel_;
  HologramSpec spec_;
};

constexpr double exposed_percentile = 99.5;

}  // namespace

void write_hologram_video(const fs::path& ffmpeg, const StoredHolograms& holograms,
                          const fs::path& file) {
  write_whole_by_name(file, [&](const fs::path& temporary) {
    VideoProgram program(
        ffmpeg,
        common_words() + input_of(holograms, 0) +
            Words{"-frames:v", std::to_string(holograms.count), "-c:v", "ffv1", "-level", "3", "-g",
                  "1", "-slicecrc", "1", "-pix_fmt", "gray", "-flags:v", "+bitexact",
                  "file:" + temporary.filename().string()},
        holograms.folder, VideoProgram::Held::none);
    program.finish();
  });
}

void write_preview(const fs::path& ffmpeg, const cl::Device& device, cl::FftBackend fft,
                   const Animator& animator, const StoredHolograms& holograms, const fs::path& file,
                   double rate_per_s, const std::function<void(double)>& progress) {
  const Viewer viewer(device, fft, animator);
  const auto& schedule = animator.schedule();
  const int pictures = schedule.pictures();
  double white = 0;
  glm::ivec2 size(0);
  for (const int picture : schedule.spread(Schedule::pictures_that_scale)) {
    HologramReader reader(ffmpeg, holograms, schedule.first_of(picture));
    const auto image = viewer.see(picture, reader);
    size = {image.width, image.height};
    double here = 0;
    expose(image, exposed_percentile, &here);
    white = std::max(white, here);
  }
  write_whole_by_name(file, [&](const fs::path& temporary) {
    // Players want sides that are even, and chroma
    VideoProgram video(
        ffmpeg,
        common_words() + raw_input(size, rate_per_s, "pipe:0", 0) +
            Words{"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "-flags:v",
                  "+bitexact", "-movflags", "+faststart", "file:" + temporary.filename().string()},
        holograms.folder, VideoProgram::Held::input);
    HologramReader reader(ffmpeg, holograms, 0);
    for (int picture = 0; picture < pictures; ++picture) {
      video.write(expose_to(viewer.see(picture, reader), white));
      if (progress) progress(static_cast<double>(picture + 1) / pictures);
    }
    video.finish();
  });
}

}  // namespace raywave
