// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace raywave {

/// A program that runs beside this one and takes or gives bytes.
class ChildProgram {
public:
  /// Which of the program's streams this one holds the other end of.
  enum class Held { none, input, output };

  /// folder   where it works: names among the arguments are relative to it
  /// input    descriptor of what it reads where its input is not held; -1: nothing
  /// throws   InputError when it cannot be started
  ChildProgram(const std::filesystem::path& program, const std::vector<std::string>& arguments,
               const std::filesystem::path& folder, Held held, int input = -1);
  /// Ends the program where it still runs.
  ~ChildProgram();
  ChildProgram(const ChildProgram&) = delete;
  ChildProgram& operator=(const ChildProgram&) = delete;

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

  // For those who wait for several programs.

  /// Of the stream that is held; -1 from its end on.
  int stream() const { return stream_; }
  /// Adds to `text` what its output has, and waits for some; false at its end.
  bool receive(std::string& text);
  /// Asks it to end.
  void stop() const;
  /// How it ended, as waitpid tells.
  int end();
  /// What it wrote to standard error.
  std::string said() const;

private:
  [[noreturn]] void fail();

  std::string name_;
  int stream_ = -1;
  pid_t process_ = 0;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> said_;
};

}  // namespace raywave
