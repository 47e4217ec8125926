// SPDX-License-Identifier: Apache-2.0
#include "host/animate/videos.hpp"

#include <unistd.h>

#include <algorithm>
#include <sstream>
#include <system_error>

#include "host/common/child_program.hpp"
#include "host/common/environment.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/encode/panel.hpp"
#include "host/encode/shown.hpp"
#include "host/view/colour_picture.hpp"
#include "host/view/compare.hpp"
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
                std::uint64_t skipped_bytes, const std::string& pixels = "gray") {
  return {"-f",
          "rawvideo",
          "-pix_fmt",
          pixels,
          "-video_size",
          std::to_string(size_px.x) + "x" + std::to_string(size_px.y),
          "-framerate",
          rate_text(rate_per_s),
          "-skip_initial_bytes",
          std::to_string(skipped_bytes),
          "-i",
          name};
}

std::size_t lasers_of(const StoredHolograms& holograms) {
  return std::max<std::size_t>(1, holograms.lasers.size());
}

/// The holograms from number `first` on, named relative to their folder: those of one laser, or
/// all of a stream.
Words input_of(const StoredHolograms& holograms, int first, std::size_t laser = 0) {
  if (holograms.storage == FrameStorage::pngs)
    return {"-framerate",
            rate_text(holograms.rate_per_s),
            "-start_number",
            std::to_string(first),
            "-i",
            FrameFiles::png_pattern(holograms.lasers.empty() ? "" : holograms.lasers[laser])};
  const auto pixels = static_cast<std::uint64_t>(holograms.size_px.x) * holograms.size_px.y;
  return raw_input(holograms.size_px, holograms.rate_per_s, FrameFiles::stream_name,
                   static_cast<std::uint64_t>(first) * pixels * lasers_of(holograms));
}

/// Reads holograms one after another, those of the lasers in turn.
class HologramReader {
public:
  HologramReader(const fs::path& ffmpeg, const StoredHolograms& holograms, int first)
      : size_(holograms.size_px) {
    const auto files = holograms.storage == FrameStorage::pngs ? lasers_of(holograms) : 1;
    for (std::size_t i = 0; i < files; ++i)
      programs_.push_back(
          std::make_unique<ChildProgram>(ffmpeg,
                                         common_words() + input_of(holograms, first, i) +
                                             Words{"-f", "rawvideo", "-pix_fmt", "gray", "pipe:1"},
                                         holograms.folder, ChildProgram::Held::output));
  }

  /// As it is stored.
  std::vector<std::uint8_t> next() {
    std::vector<std::uint8_t> levels(static_cast<std::size_t>(size_.x) *
                                     static_cast<std::size_t>(size_.y));
    programs_[place_++ % programs_.size()]->read(levels);
    return levels;
  }

  /// In the hologram's frame.
  std::vector<std::uint8_t> next(const SlmSpec& slm) {
    return from_slm(LevelPicture{size_, next()}, slm).levels;
  }

private:
  glm::ivec2 size_;
  std::vector<std::unique_ptr<ChildProgram>> programs_;
  std::size_t place_ = 0;
};

/// Of a preview, which otherwise takes longer to compress than to compute.
constexpr int longest_side_px = 1280;

/// What is seen of pictures.
class Viewer {
public:
  Viewer(const cl::Device& device, cl::FftBackend fft, const Animator& animator,
         const fs::path& folder)
      : device_(device), fft_(fft), animator_(animator), colours_(animator.colours()) {
    for (std::size_t i = 0; i < animator.lasers(); ++i) {
      const auto& plan = animator.plan(i);
      lasers_.push_back(
          {Panel(plan.slm, plan.hologram.size, plan.hologram.pitch_m, plan.hologram.wavelength_m),
           {}});
      auto& spec = lasers_.back().spec;
      spec.resolution = plan.hologram.size;
      spec.pitch_m = plan.hologram.pitch_m;
      spec.wavelength_m = plan.hologram.wavelength_m;
    }
    if (!colours_) return;
    powers_ = FrameFiles::powers(folder);
    const bool is_whole =
        powers_.size() == static_cast<std::size_t>(animator.schedule().pictures()) &&
        std::all_of(powers_.begin(), powers_.end(),
                    [&](const auto& powers) { return powers.size() == lasers_.size(); });
    if (!is_whole)
      throw InputError(in_quotes((folder / FrameFiles::report_name).string()) +
                       ": lacks the lasers' powers; give --restart to make it anew");
  }

  /// What an eye sees of the next picture of a reader: one channel, or red, green and blue.
  std::vector<Image> see(int picture, HologramReader& reader) const {
    std::vector<std::vector<std::vector<std::uint8_t>>> levels(lasers_.size());
    for (int i = 0; i < animator_.schedule().count_of(picture); ++i)
      for (std::size_t laser = 0; laser < lasers_.size(); ++laser)
        levels[laser].push_back(reader.next(lasers_[laser].panel.slm()));
    const auto camera = animator_.camera(picture);
    ReconstructSpec what;
    what.z_m = camera.depth_m.value();
    what.view = camera.view;
    what.aperture = camera.aperture;
    what.window_m = camera.window_m;
    what.pupil = animator_.pupil();
    std::vector<Image> light;
    for (std::size_t laser = 0; laser < lasers_.size(); ++laser) {
      const auto& [panel, spec] = lasers_[laser];
      const auto seen = reconstruct(device_, fft_, shown_field(panel, levels[laser]), spec, what);
      const int longest = std::max(seen.width, seen.height),
                factor = (longest + longest_side_px - 1) / longest_side_px;
      const double blur_px = eye_blur_m(animator_.viewer(), what.z_m) / spec.pitch_m.x / factor;
      light.push_back(in_frame(blurred(averaged(seen, factor), blur_px), Frame::eye));
    }
    if (!colours_) return light;
    for (std::size_t laser = 0; laser < lasers_.size(); ++laser) {
      const double gain =
          powers_[static_cast<std::size_t>(picture)][laser] / colours_->white_powers[laser];
      for (float& pixel : light[laser].pixels) pixel = static_cast<float>(double{pixel} * gain);
    }
    const auto rgb = picture_of_lasers(*colours_, light);
    return {rgb.channels.begin(), rgb.channels.end()};
  }

private:
  struct Laser {
    Panel panel;
    HologramSpec spec;
  };
  const cl::Device& device_;
  cl::FftBackend fft_;
  const Animator& animator_;
  std::optional<LaserSet> colours_;
  std::vector<Laser> lasers_;
  std::vector<std::vector<double>> powers_;  // of each picture's lasers
};

constexpr double exposed_percentile = 99.5;

}  // namespace

void write_hologram_video(const fs::path& ffmpeg, const StoredHolograms& holograms,
                          const fs::path& file) {
  // PNGs of several lasers pass through this program, which puts them in order
  const bool in_turn = holograms.storage == FrameStorage::pngs && lasers_of(holograms) > 1;
  write_whole_by_name(file, [&](const fs::path& temporary) {
    const auto input = in_turn ? raw_input(holograms.size_px, holograms.rate_per_s, "pipe:0", 0)
                               : input_of(holograms, 0);
    ChildProgram program(
        ffmpeg,
        common_words() + input +
            Words{"-frames:v", std::to_string(holograms.count), "-c:v", "ffv1", "-level", "3", "-g",
                  "1", "-slicecrc", "1", "-pix_fmt", "gray", "-flags:v", "+bitexact",
                  "file:" + temporary.filename().string()},
        holograms.folder, in_turn ? ChildProgram::Held::input : ChildProgram::Held::none);
    if (in_turn) {
      HologramReader reader(ffmpeg, holograms, 0);
      for (int i = 0; i < holograms.count; ++i) program.write(reader.next());
    }
    program.finish();
  });
}

void write_preview(const fs::path& ffmpeg, const cl::Device& device, cl::FftBackend fft,
                   const Animator& animator, const StoredHolograms& holograms, const fs::path& file,
                   double rate_per_s, const std::function<void(double)>& progress) {
  const Viewer viewer(device, fft, animator, holograms.folder);
  const auto& schedule = animator.schedule();
  const int pictures = schedule.pictures();
  double white = 0;
  glm::ivec2 size(0);
  for (const int picture : schedule.spread(Schedule::pictures_that_scale)) {
    HologramReader reader(ffmpeg, holograms, schedule.first_of(picture));
    const auto seen = viewer.see(picture, reader);
    size = {seen[0].width, seen[0].height};
    white = std::max(white, white_of(seen, exposed_percentile));
  }
  write_whole_by_name(file, [&](const fs::path& temporary) {
    // Players want sides that are even, and chroma
    const std::string pad = "pad=ceil(iw/2)*2:ceil(ih/2)*2";
    const bool is_colour = animator.lasers() > 1;
    const auto colours = is_colour ? Words{"-vf",
                                           pad + ",scale=out_color_matrix=bt709:out_range=tv",
                                           "-colorspace",
                                           "bt709",
                                           "-color_primaries",
                                           "bt709",
                                           "-color_trc",
                                           "iec61966-2-1"}
                                   : Words{"-vf", pad};
    ChildProgram video(ffmpeg,
                       common_words() +
                           raw_input(size, rate_per_s, "pipe:0", 0, is_colour ? "rgb24" : "gray") +
                           colours +
                           Words{"-pix_fmt", "yuv420p", "-flags:v", "+bitexact", "-movflags",
                                 "+faststart", "file:" + temporary.filename().string()},
                       holograms.folder, ChildProgram::Held::input);
    HologramReader reader(ffmpeg, holograms, 0);
    for (int picture = 0; picture < pictures; ++picture) {
      video.write(expose_to(viewer.see(picture, reader), white));
      if (progress) progress(static_cast<double>(picture + 1) / pictures);
    }
    video.finish();
  });
}

std::optional<fs::path> find_program(const std::string& name) {
  std::istringstream folders(environment_variable("PATH"));
  std::error_code error;
  for (std::string folder; std::getline(folders, folder, ':');) {
    const auto file = fs::path(folder) / name;
    if (!folder.empty() && fs::is_regular_file(file, error) && access(file.c_str(), X_OK) == 0)
      return fs::absolute(file);
  }
  return std::nullopt;
}

}  // namespace raywave
