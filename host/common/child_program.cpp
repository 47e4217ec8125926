// SPDX-License-Identifier: Apache-2.0
#include "host/common/child_program.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <system_error>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/text.hpp"

extern char** environ;

namespace raywave {
namespace fs = std::filesystem;

ChildProgram::ChildProgram(const fs::path& program, const std::vector<std::string>& arguments,
                           const fs::path& folder, Held held, int input)
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
    const int given = held == stream ? ends[1] : stream == Held::input ? input : -1;
    if (given >= 0)
      posix_spawn_file_actions_adddup2(&actions, given, number);
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

ChildProgram::~ChildProgram() {
  if (process_ > 0) kill(process_, SIGKILL);
  end();
}

int ChildProgram::end() {
  if (stream_ >= 0) close(std::exchange(stream_, -1));
  int status = 0;
  while (process_ > 0 && waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = 0;
  return status;
}

void ChildProgram::stop() const {
  if (process_ > 0) kill(process_, SIGTERM);
}

std::string ChildProgram::said() const {
  std::fseek(said_.get(), 0, SEEK_END);
  std::string text(static_cast<std::size_t>(std::max(std::ftell(said_.get()), 0L)), '\0');
  std::rewind(said_.get());
  text.resize(std::fread(text.data(), 1, text.size(), said_.get()));
  return text;
}

void ChildProgram::fail() {
  end();
  auto text = said();
  text.erase(std::find(text.begin(), text.end(), '\n'), text.end());
  throw InputError(name_ + " has failed" + (text.empty() ? "" : ": " + one_line(text)));
}

void ChildProgram::write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const auto sent = send(stream_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (sent < 0 && errno == EINTR) continue;
    if (sent <= 0) fail();
    bytes = bytes.subspan(static_cast<std::size_t>(sent));
  }
}

void ChildProgram::read(std::span<std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const auto got = ::read(stream_, bytes.data(), bytes.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) fail();
    bytes = bytes.subspan(static_cast<std::size_t>(got));
  }
}

bool ChildProgram::receive(std::string& text) {
  std::array<char, 4096> bytes;
  ssize_t got = -1;
  do got = ::read(stream_, bytes.data(), bytes.size());
  while (got < 0 && errno == EINTR);
  text.append(bytes.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  return got > 0;
}

void ChildProgram::finish() {
  if (end() != 0) fail();
}

}  // namespace raywave
