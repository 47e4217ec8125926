// SPDX-License-Identifier: Apache-2.0
/// The program ffmpeg, where it is installed: videos of pictures, and pictures of videos.
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace raywave {

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
