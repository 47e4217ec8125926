// SPDX-License-Identifier: Apache-2.0
#include "host/animate/video_program.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <sstream>
#include <system_error>
#include <utility>

#include "host/common/environment.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"

extern char** environ;

namespace raywave {
namespace fs = std::filesystem;

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

VideoProgram::VideoProgram(const fs::path& program, const std::vector<std::string>& arguments,
                           const fs::path& folder, Held held)
    : name_(program.filename().string()), said_(std::tmpfile(), std::fclose) {
  const auto refuse = [&](int reason) {
    throw InputError(in_quotes(program.string()) +
                     ": cannot be started: " + std::generic_category().message(reason));
  };
  if (!said_) refuse(errno);
  // A socket, as writing to a pipe that nobody reads raises a signal
  std::array<int, 2> ends{-1, -1};
  if (held != Held::none && socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    refuse(errno);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  const auto give = [&](Held stream, int number, int flags) {
    if (held == stream)
      posix_spawn_file_actions_adddup2(&actions, ends[1], number);
    else
      posix_spawn_file_actions_addopen(&actions, number, "/dev/null", flags, 0);
  };
  give(Held::input, STDIN_FILENO, O_RDONLY);
  give(Held::output, STDOUT_FILENO, O_WRONLY);
  posix_spawn_file_actions_adddup2(&actions, fileno(said_.get()), STDERR_FILENO);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());

  std::vector<std::string> words{program.string()};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (auto& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const int reason =
      posix_spawn(&process_, program.c_str(), &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (ends[1] >= 0) close(ends[1]);
  stream_ = ends[0];
  if (reason == 0) return;
  process_ = 0;
  if (stream_ >= 0) close(stream_);
  refuse(reason);
}

VideoProgram::~VideoProgram() {
  if (stream_ >= 0) close(stream_);
  if (process_ <= 0) return;
  kill(process_, SIGKILL);
  wait();
}

bool VideoProgram::wait() {
  int status = 0;
  while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = 0;
  return WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

void VideoProgram::fail() {
  if (stream_ >= 0) close(std::exchange(stream_, -1));
  if (process_ > 0) wait();
  std::string text(4096, '\0');
  std::rewind(said_.get());
  text.resize(std::fread(text.data(), 1, text.size(), said_.get()));
  text.erase(std::find(text.begin(), text.end(), '\n'), text.end());
  throw InputError(name_ + " has failed" + (text.empty() ? "" : ": " + one_line(text)));
}

void VideoProgram::write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const auto sent = send(stream_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) fail();
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
}

void VideoProgram::read(std::span<std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const auto got = ::read(stream_, bytes.data(), bytes.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) fail();
    bytes = bytes.subspan(static_cast<std::size_t>(got));
  }
}

void VideoProgram::finish() {
  if (stream_ >= 0) close(std::exchange(stream_, -1));
  if (!wait()) fail();
}

}  // namespace raywave
