// SPDX-License-Identifier: Apache-2.0
#include "host/cli/frame_sources.hpp"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "host/animate/animate.hpp"
#include "host/animate/frame_files.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/output_set.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/encode/pictures.hpp"
#include "host/scene/image.hpp"

namespace raywave::cli {
namespace {
namespace fs = std::filesystem;

/// Pictures are kept in memory, for reading takes longer than a refresh.
constexpr double most_bytes = 4.0 * (1 << 30);

struct StoredFrame {
  fs::path file;
  std::string laser;
  std::int64_t place = -1;  // of a stream's frames, counted from 0
};

struct StoredFrames {
  std::vector<StoredFrame> all;
  glm::ivec2 stream_px{0, 0};
  double panel_hz = 0, rate_hz = 0;

  /// throws  InputError where the stream does not hold whole frames
  void add_stream(const fs::path& file, glm::ivec2 size_px, const std::vector<std::string>& lasers);
};

[[noreturn]] void refuse(const fs::path& file, const std::string& what) {
  throw InputError(in_quotes(file.string()) + ": " + what);
}

void StoredFrames::add_stream(const fs::path& file, glm::ivec2 size_px,
                              const std::vector<std::string>& lasers) {
  std::error_code error;
  const auto bytes = fs::file_size(file, error);
  if (error) refuse(file, "cannot be read: " + error.message());
  if (size_px.x < 1 || size_px.y < 1)
    refuse(file, "of which size? Give --size, or report.json that is beside it");
  const auto each = static_cast<std::uintmax_t>(size_px.x) * static_cast<unsigned>(size_px.y);
  if (bytes == 0 || bytes % each != 0)
    refuse(file,
           "has " + std::to_string(bytes) + " bytes, no whole frames of " + size_text(size_px));
  if (stream_px != glm::ivec2(0) && stream_px != size_px)
    refuse(file, "has frames of " + size_text(size_px) + " pixels, the stream before it of " +
                     size_text(stream_px));
  stream_px = size_px;
  for (std::uintmax_t i = 0; i < bytes / each; ++i)
    all.push_back(
        {file, lasers.empty() ? "" : lasers[i % lasers.size()], static_cast<std::int64_t>(i)});
}

bool is_picture(const fs::path& file) {
  const auto extension = extension_of(file);
  return extension == ".png" || extension == ".bmp" || extension == ".tif" || extension == ".tiff";
}

/// The PNGs of an animation, by number, lasers in the order of showing.
std::vector<StoredFrame> animation_pngs(const fs::path& folder,
                                        const std::vector<std::string>& lasers) {
  std::vector<std::pair<std::pair<int, std::size_t>, StoredFrame>> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const auto name = entry.path().filename().string();
    if (!name.starts_with("frame_")) continue;
    const int number = std::atoi(name.c_str() + 6);
    for (std::size_t i = 0; i < std::max<std::size_t>(lasers.size(), 1); ++i) {
      const auto laser = lasers.empty() ? "" : lasers[i];
      if (name == FrameFiles::png_name(number, laser))
        found.push_back({{number, i}, {entry.path(), laser}});
    }
  }
  std::sort(found.begin(), found.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<StoredFrame> frames;
  for (auto& [order, frame] : found) frames.push_back(std::move(frame));
  return frames;
}

/// The pictures of a report of several lasers, in turn.
std::vector<StoredFrame> pictures_of_lasers(const nlohmann::json& json, const fs::path& folder) {
  std::vector<StoredFrame> frames;
  const auto& lasers = json.at("colour").at("lasers");
  for (std::size_t frame = 0; frame < lasers.at(0).at("pictures").size(); ++frame)
    for (const auto& laser : lasers)
      frames.push_back(
          {folder / fs::path(laser.at("pictures").at(frame).get<std::string>()).filename(),
           laser_name(laser.at("wavelength_m").get<double>())});
  return frames;
}

/// The pictures that hold three lasers in their channels; none where render was not told --rgb.
std::vector<StoredFrame> rgb_pictures(const nlohmann::json& json, const fs::path& folder) {
  std::vector<StoredFrame> frames;
  for (std::size_t frame = 0; json.contains("files"); ++frame) {
    const auto name = name_of_frame(frame, "hologram_rgb");
    if (!json.at("files").contains(name)) break;
    frames.push_back({folder / name, ""});
  }
  return frames;
}

void add_report(StoredFrames& frames, const fs::path& report) {
  std::ifstream in(report);
  if (!in) refuse(report, "cannot be read");
  const auto folder = report.parent_path();
  try {
    const auto json = nlohmann::json::parse(in);
    if (json.contains("tiles"))
      refuse(report,
             "is of a hologram in tiles, which no SLM shows at once; show one of them, such as "
             "tile_00000.png");
    const bool in_colour = json.contains("colour");
    std::vector<std::string> lasers;
    if (in_colour)
      for (const auto& laser : json.at("colour").at("lasers"))
        lasers.push_back(laser_name(laser.at("wavelength_m").get<double>()));
    const auto& of_one = in_colour ? json.at("colour").at("lasers").at(0).at("report") : json;
    const auto format = of_one.contains("format")
                            ? picture_format_of(of_one.at("format").get<std::string>())
                            : PictureFormat::png;
    auto found = rgb_pictures(json, folder);
    const int each = found.empty() ? frames_each(format) : 3;
    if (json.contains("animation")) {
      const auto& animation = json.at("animation");
      frames.rate_hz = animation.at("slm_rate").get<double>() *
                       static_cast<double>(std::max<std::size_t>(lasers.size(), 1));
      const auto shape = animation.at("shape").get<std::vector<int>>();
      if (shape.size() < 3) refuse(report, "its animation has no shape");
      if (animation.at("files") == FrameFiles::stream_name)
        frames.add_stream(folder / FrameFiles::stream_name, {shape.back(), shape[shape.size() - 2]},
                          lasers);
      else
        found = animation_pngs(folder, lasers);
    } else {
      if (found.empty() && in_colour) found = pictures_of_lasers(json, folder);
      if (found.empty())
        for (const auto& name : picture_names(json))
          found.push_back({folder / fs::path(name).filename(), ""});
      if (found.empty() || !is_picture(found[0].file))
        refuse(report, std::string("its pictures have the format ") + name_of(format) +
                           ", which cannot be shown; encode with --format png");
      std::vector<fs::path> files;
      for (const auto& one : found) files.push_back(one.file);
      require_of_report(report, json, files);
    }
    frames.all.insert(frames.all.end(), found.begin(), found.end());
    if (const auto& slm = of_one.at("scene").at("slm");
        slm.contains("rate_per_s") && slm.at("rate_per_s").is_number())
      frames.panel_hz = slm.at("rate_per_s").get<double>() / each;
  } catch (const nlohmann::json::exception& error) {
    refuse(report, "not a report of raywave: " + json_reason(error));
  }
}

void add_frames(StoredFrames& frames, const fs::path& what, glm::ivec2 given_px) {
  std::error_code error;
  if (!fs::exists(what, error)) refuse(what, "there is no such file");
  if (fs::is_directory(what, error)) {
    if (fs::exists(what / "report.json", error)) return add_report(frames, what / "report.json");
    std::vector<fs::path> files;
    for (const auto& entry : fs::directory_iterator(what, error))
      if (is_picture(entry.path())) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    if (files.empty()) refuse(what, "holds neither report.json nor pictures (.png, .bmp, .tif)");
    for (auto& file : files) frames.all.push_back({std::move(file), ""});
  } else if (extension_of(what) == ".json") {
    add_report(frames, what);
  } else if (extension_of(what) == ".raw") {
    if (given_px == glm::ivec2(0) && fs::exists(what.parent_path() / "report.json", error))
      add_report(frames, what.parent_path() / "report.json");
    else
      frames.add_stream(what, given_px, {});
  } else if (is_picture(what)) {
    frames.all.push_back({what, ""});
  } else {
    refuse(what,
           "cannot be shown: give pictures (.png, .bmp, .tif), a stream (.raw), a folder, "
           "report.json, or - for standard input");
  }
}

std::shared_ptr<const LevelFrame> load_picture(const StoredFrame& stored) {
  const auto channels = load_channels(stored.file, "RGB", "");
  auto frame = std::make_shared<LevelFrame>();
  frame->size_px = {channels[0].width, channels[0].height};
  frame->name = stored.file.filename().string();
  frame->laser = stored.laser;
  const bool is_grey =
      channels[0].pixels == channels[1].pixels && channels[0].pixels == channels[2].pixels;
  frame->channels = is_grey ? 1 : 3;
  const auto count = static_cast<std::size_t>(frame->channels);
  frame->levels.resize(count * channels[0].pixels.size());
  for (std::size_t c = 0; c < count; ++c)
    for (std::size_t i = 0; i < channels[c].pixels.size(); ++i) {
      const float level = 255 * channels[c].pixels[i];
      if (std::abs(level - std::round(level)) > 0.002f)
        refuse(stored.file,
               "has levels of more than 8 bits, and outputs show 8; encode with --format red-blue "
               "for panels that take it");
      frame->levels[count * i + c] = static_cast<std::uint8_t>(std::lround(level));
    }
  return frame;
}

std::shared_ptr<const LevelFrame> load_from_stream(const StoredFrame& stored, glm::ivec2 size_px) {
  auto frame = std::make_shared<LevelFrame>();
  frame->size_px = size_px;
  frame->name = stored.file.filename().string() + ":" + std::to_string(stored.place);
  frame->laser = stored.laser;
  frame->levels.resize(static_cast<std::size_t>(size_px.x) * static_cast<std::size_t>(size_px.y));
  const auto bytes = static_cast<std::streamsize>(frame->levels.size());
  std::ifstream in(stored.file, std::ios::binary);
  in.seekg(stored.place * bytes);
  in.read(reinterpret_cast<char*>(frame->levels.data()), bytes);
  if (in.gcount() != bytes) refuse(stored.file, "became shorter while it was shown");
  return frame;
}

/// The next frame of standard input; none at its end, and when `stop` is set.
std::shared_ptr<const LevelFrame> read_frame(glm::ivec2 size_px, std::uint64_t number,
                                             const std::atomic<bool>& stop) {
  auto frame = std::make_shared<LevelFrame>();
  frame->size_px = size_px;
  frame->name = "-:" + std::to_string(number);
  frame->levels.resize(static_cast<std::size_t>(size_px.x) * static_cast<std::size_t>(size_px.y));
  for (std::size_t have = 0; have < frame->levels.size();) {
    pollfd input{STDIN_FILENO, POLLIN, 0};
    if (stop) return {};
    if (poll(&input, 1, 50) <= 0) continue;
    const auto got = read(STDIN_FILENO, frame->levels.data() + have, frame->levels.size() - have);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0)
      throw InputError(std::string("standard input cannot be read: ") + std::strerror(errno));
    if (got == 0 && have == 0) return {};
    if (got == 0)
      throw InputError("standard input ends within a frame of " + size_text(size_px) + " pixels");
    have += static_cast<std::size_t>(got);
  }
  return frame;
}

/// Holograms of an animation in their order, each picture computed when it is needed.
class LiveFrames {
public:
  LiveFrames(const std::vector<Scene>& scenes, const cl::Device& device)
      : animator_(device, scenes, cl::default_backend(device.info())), pictures_(animator_) {}

  const Animator& animator() const { return animator_; }

  std::shared_ptr<const LevelFrame> next() {
    if (at_ == made_.levels.size()) {
      number_ = (number_ + 1) % animator_.schedule().pictures();
      made_ = pictures_.make(number_);
      animator_.turn(made_.levels);
      at_ = 0;
    }
    auto frame = std::make_shared<LevelFrame>();
    frame->size_px = animator_.stored_size();
    frame->name = "picture " + std::to_string(number_);
    if (const auto lasers = animator_.laser_names(); !lasers.empty())
      frame->laser = lasers[at_ % lasers.size()];
    frame->levels = std::move(made_.levels[at_++]);
    return frame;
  }

private:
  Animator animator_;
  Animator::Pictures pictures_;
  AnimatedPicture made_;
  std::size_t at_ = 0;
  int number_ = -1;
};

}  // namespace

FrameSource::FrameSource(const std::vector<Scene>& scenes, const cl::Device& device) {
  const auto live = std::make_shared<LiveFrames>(scenes, device);
  const auto& animator = live->animator();
  const auto lasers = animator.lasers();
  size_px = animator.stored_size();
  frames = static_cast<std::uint64_t>(animator.schedule().holograms()) * lasers;
  panel_hz = scenes[0].slm.rate_per_s.value_or(0);
  rate_hz = animator.schedule().slm_rate_per_s() * static_cast<double>(lasers);
  next = [live] { return live->next(); };
}

FrameSource::FrameSource(const std::vector<std::string>& what, glm::ivec2 given_px,
                         const std::atomic<bool>& stop) {
  if (std::find(what.begin(), what.end(), "-") != what.end()) {
    if (what.size() > 1) throw InputError("show: - (standard input) is given alone");
    if (given_px == glm::ivec2(0))
      throw InputError("show -: --size is needed, as in --size 1920x1080; a byte for each pixel");
    size_px = given_px;
    next = [given_px, &stop, number = std::uint64_t{0}]() mutable {
      return read_frame(given_px, number++, stop);
    };
    return;
  }
  StoredFrames stored;
  for (const auto& one : what) add_frames(stored, one, given_px);
  if (stored.all.empty()) throw InputError(in_quotes(what.at(0)) + ": holds no frames");
  frames = stored.all.size();
  first = stored.all[0].file.filename().string();
  panel_hz = stored.panel_hz;
  rate_hz = stored.rate_hz;

  std::vector<std::shared_ptr<const LevelFrame>> kept;
  for (const auto& one : stored.all) {
    if (stop) break;
    auto& frame = kept.emplace_back();
    if (one.place < 0) frame = load_picture(one);
    const auto size = frame ? frame->size_px : stored.stream_px;
    if (kept.size() == 1) size_px = size;
    if (size != size_px)
      refuse(one.file,
             "is " + size_text(size) + " pixels, the frames before it " + size_text(size_px));
    if (frame &&
        static_cast<double>(frame->levels.size()) * static_cast<double>(kept.size()) > most_bytes)
      refuse(one.file,
             "up to here, pictures take 4 GiB of memory; animate --stream makes "
             "frames.raw, which is read as it is shown");
  }
  next = [kept = std::move(kept), all = std::move(stored.all), size = size_px,
          at = std::size_t{0}]() mutable {
    const auto i = at++ % all.size();
    return kept[i] ? kept[i] : load_from_stream(all[i], size);
  };
}

}  // namespace raywave::cli
