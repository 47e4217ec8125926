// SPDX-License-Identifier: Apache-2.0
/// The files of an animation's holograms, or of a hologram's tiles, and the report that says which
/// of them are there.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <map>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "host/animate/timeline.hpp"
#include "host/common/json.hpp"

namespace raywave {

/// How holograms are stored: a PNG each (frame_00000.png ...), or all of them in frames.raw, one
/// after another, a byte for each pixel. In colour, a number has a hologram of each laser, in turn
/// (frame_00000_638nm.png ...). Of a hologram in tiles each has a PNG (tile_00000.png ...), and is
/// what is called a picture here.
enum class FrameStorage { pngs, stream, tiles };

/// Pictures counted from 0: first <= picture < end.
struct PictureRange {
  int first = 0, end = 0;
};

/// What is stored: pictures of one or more holograms each. A picture's line in a report is written
/// after its holograms, and names their digests: what it names is whole, the rest is missing.
///
/// Several programs, on several machines, may each make a part of the pictures in one folder. The
/// names and places of holograms are those of the whole animation. Each part has a report of its
/// own (report_00010_00019.jsonl); the program that is given all pictures puts them together.
class FrameFiles {
public:
  static constexpr const char* report_name = "report.jsonl";
  static constexpr const char* stream_name = "frames.raw";
  /// In the lines of helpers: AnimateResult's, of one picture.
  static constexpr const char* times_key = "processor_seconds";
  static constexpr const char* shared_name = "shared.json";  // of Animator; goes when all is there
  /// Pattern of the PNGs' names, as printf and ffmpeg read it.
  ///
  /// laser  "638nm"; empty: of one wavelength
  static std::string png_pattern(const std::string& laser = {});

  /// Finds out which of the wanted pictures are there.
  ///
  /// folder   HeldFolder, shared of parts
  /// run      stands for all that holograms depend on: lines of another run are refused
  /// size_px  of a hologram as it is stored
  /// lasers   in the names of their PNGs; none: one wavelength
  /// wanted   all pictures when not given
  /// is_helper  another program holds the folder and makes reports: its queue of pictures that are
  ///          missing is standard input, and lines go to standard output
  /// throws   InputError for lines of another run, where another program makes the same part, or
  ///          where the folder cannot be written
  FrameFiles(std::filesystem::path folder, FrameStorage storage, std::string run, Schedule schedule,
             glm::ivec2 size_px, std::vector<std::string> lasers = {},
             std::optional<PictureRange> wanted = {}, bool is_helper = false);
  ~FrameFiles();
  FrameFiles(const FrameFiles&) = delete;
  FrameFiles& operator=(const FrameFiles&) = delete;

  PictureRange wanted() const { return wanted_; }
  bool is_part() const { return is_helper_ || wanted_.end - wanted_.first < schedule_.pictures(); }
  bool is_helper() const { return is_helper_; }
  /// Wanted or not.
  int all() const { return schedule_.pictures(); }
  /// "picture", or "tile": in messages and lines.
  const char* word() const { return storage_ == FrameStorage::tiles ? "tile" : "picture"; }
  bool has(int picture) const { return lines_.contains(picture); }
  /// The wanted pictures that were not there at first.
  const std::vector<int>& missing() const { return missing_; }
  /// The next of them; of a helper the next in the queue, which is no other helper's.
  std::optional<int> next();
  /// The wanted pictures that are there.
  int pictures() const { return static_cast<int>(lines_.size()); }

  /// Stores a picture: its holograms, then its line, to which `run` and `holograms` (file or place
  /// in the stream, digest) are added.
  ///
  /// throws  InputError when something cannot be written; the picture is then not there
  void add(int picture, std::span<const std::vector<std::uint8_t>> holograms, Json line);

  /// Adds the line of a picture that a helper has stored, without its times, and returns it.
  ///
  /// throws  InputError for a line of another run
  Json add_line(const std::string& text);

  /// After the last picture: of all pictures, one report in their order, and the stream's name.
  void finish();

  /// Removes an animation's holograms and their reports from a folder.
  static void remove(const std::filesystem::path& folder);

  static std::string png_name(int hologram, const std::string& laser = {});
  static constexpr const char* tile_pattern = "tile_%05d.png";
  static std::string tile_name(int hologram);
  /// The digests of a folder's PNGs by their names, as its reports have them.
  static std::map<std::string, std::string> digests(const std::filesystem::path& folder);

  /// Of all lines of a folder's reports, each once.
  static std::vector<std::string> notes(const std::filesystem::path& folder);

  /// "powers" of the lines of a report, empty where a line has none.
  static std::vector<std::vector<double>> powers(const std::filesystem::path& folder);

private:
  std::size_t pixels() const {
    return static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y);
  }
  int lasers() const { return lasers_.empty() ? 1 : static_cast<int>(lasers_.size()); }
  /// Of a hologram by its place in the order of showing.
  std::string name_of(int place) const;
  std::filesystem::path own_report() const;
  void read_reports();
  void open_report();
  void open_to_add();
  /// Whether the holograms that a picture's line names are there and as it says.
  bool is_whole(int picture, const Json& line) const;
  std::string digest_in_stream(int place) const;
  std::filesystem::path partial_stream() const;

  std::filesystem::path folder_;
  FrameStorage storage_;
  std::string run_;
  Schedule schedule_;
  glm::ivec2 size_;
  std::vector<std::string> lasers_;
  PictureRange wanted_;
  bool is_helper_;
  std::vector<int> missing_;
  std::size_t taken_ = 0;             // of the missing ones
  std::map<int, std::string> lines_;  // of the wanted pictures that are there
  int report_ = -1, stream_ = -1;     // descriptors
  std::vector<std::uint8_t> png_;     // the last one
};

/// Work that a thread of its own does in order, such as writing files, while the caller goes on.
/// The queue is short: memory does not grow when writing is slower than computing.
class WriteQueue {
public:
  /// longest  number of jobs that wait, >= 1
  explicit WriteQueue(std::size_t longest);
  /// Waits for the job at work and leaves out those that wait.
  ~WriteQueue();
  WriteQueue(const WriteQueue&) = delete;
  WriteQueue& operator=(const WriteQueue&) = delete;

  /// Adds a job; waits while the queue is full.
  ///
  /// throws  what an earlier job has thrown; no job is done after that
  void push(std::function<void()> job);
  /// Waits until all jobs are done.
  ///
  /// throws  as push
  void finish();

private:
  void work();
  void require_success();

  std::size_t longest_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> jobs_;  // the first is at work
  std::exception_ptr failure_;
  bool ends_ = false;
  std::thread thread_;
};

}  // namespace raywave
