// SPDX-License-Identifier: Apache-2.0
/// The files of an animation's holograms, and the report that says which of them are there.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <exception>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "host/common/json.hpp"

namespace raywave {

/// How holograms are stored: a PNG each (frame_00000.png ...), or all of them in frames.raw, one
/// after another, a byte for each pixel. In colour, a number has a hologram of each laser, in turn
/// (frame_00000_638nm.png ...).
enum class FrameStorage { pngs, stream };

/// What a folder begins with: a part of an animation not with its first picture.
struct FirstOfFiles {
  int picture = 0, hologram = 0;  // that of each laser has the same number
};

/// What is stored: pictures of one or more holograms each, in order. A picture's line in
/// report.jsonl is written after its holograms, and names their digests: what it names is whole.
/// Later runs go on after the last such line. A part of an animation has the files and lines that
/// the whole has of its pictures; its stream holds them alone.
class FrameFiles {
public:
  static constexpr const char* report_name = "report.jsonl";
  static constexpr const char* stream_name = "frames.raw";
  /// Pattern of the PNGs' names, as printf and ffmpeg read it.
  ///
  /// laser  "638nm"; empty: of one wavelength
  static std::string png_pattern(const std::string& laser = {});

  /// Finds out what is there, and takes away what is not whole.
  ///
  /// folder   where no other program writes (HeldFolder)
  /// run      stands for all that holograms depend on: lines of another run are refused
  /// size_px  of a hologram as it is stored
  /// lasers   in the names of their PNGs; none: one wavelength
  /// first    picture that the folder begins with, and its first hologram (Schedule::first_of)
  /// throws   InputError for lines of another run, or that begin with another picture, or where the
  ///          folder cannot be written
  FrameFiles(std::filesystem::path folder, FrameStorage storage, std::string run,
             glm::ivec2 size_px, std::vector<std::string> lasers = {}, FirstOfFiles first = {});
  ~FrameFiles();
  FrameFiles(const FrameFiles&) = delete;
  FrameFiles& operator=(const FrameFiles&) = delete;

  /// Pictures that are there, and their holograms, those of each laser counted.
  int pictures() const { return pictures_; }
  int holograms() const { return holograms_; }
  /// The number of the picture that `add` stores.
  int next() const { return first_.picture + pictures_; }

  /// Stores the next picture: its holograms, then its line, to which `run` and `holograms` (file or
  /// place in the stream, digest) are added.
  ///
  /// throws  InputError when something cannot be written; the picture is then not there
  void add(std::span<const std::vector<std::uint8_t>> holograms, Json line);

  /// Gives the stream its name, after the last picture.
  void finish();

  /// Removes an animation's holograms and their report from a folder.
  static void remove(const std::filesystem::path& folder);

  static std::string png_name(int hologram, const std::string& laser = {});

  /// "powers" of the lines of a report, empty where a line has none.
  static std::vector<std::vector<double>> powers(const std::filesystem::path& folder);

private:
  std::size_t pixels() const {
    return static_cast<std::size_t>(size_.x) * static_cast<std::size_t>(size_.y);
  }
  /// Of a hologram by its place in the order of showing.
  std::string name_of(int place) const;
  /// In the order of showing, of the hologram that `add` stores next.
  int next_place() const;
  void read_report();
  /// Whether a line is that of the next picture, and its holograms are there and as it says.
  ///
  /// count  receives their number
  bool is_whole(const Json& line, int& count) const;
  /// hologram  of those that the stream holds
  std::string digest_in_stream(int hologram) const;
  std::filesystem::path partial_stream() const;

  std::filesystem::path folder_;
  FrameStorage storage_;
  std::string run_;
  glm::ivec2 size_;
  std::vector<std::string> lasers_;
  FirstOfFiles first_;
  int pictures_ = 0, holograms_ = 0;
  int report_ = -1, stream_ = -1;  // descriptors
  std::vector<std::uint8_t> png_;  // the last one
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
