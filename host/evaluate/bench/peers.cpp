// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <nlohmann/json.hpp>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/bench/bench.hpp"

extern char** environ;

namespace raywave {
namespace {

using Json = nlohmann::ordered_json;

/// Runs a program and returns its standard output.
std::string output_of(const std::string& program, const std::vector<std::string>& arguments) {
  std::vector<std::string> words{program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (auto& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);

  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw InputError(program + ": no pipe to it");
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  pid_t child = 0;
  const int failed =
      posix_spawn(&child, program.c_str(), &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  std::string printed;
  std::array<char, 4096> chunk;
  for (ssize_t got = 0; failed == 0 && ((got = read(ends[0], chunk.data(), chunk.size())) > 0 ||
                                        (got < 0 && errno == EINTR));)
    printed.append(chunk.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  close(ends[0]);
  if (failed != 0) throw InputError(program + ": cannot be started");
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) throw InputError(program + ": failed");
  return printed;
}

}  // namespace

std::string peer_json(const std::vector<BenchRow>& rows) {
  Json json = Json::array();
  for (const auto& row : rows) {
    Json frames = Json::array();
    for (const auto& f : row.frames)
      frames.push_back(
          {{"wall_s", f.wall_s}, {"processor_s", f.processor_s}, {"stages_s", f.stages_s}});
    json.push_back({{"name", row.name}, {"frames", frames}});
  }
  return json.dump() + "\n";
}

std::vector<BenchRow> run_peer(const std::filesystem::path& program,
                               const std::vector<std::string>& arguments) {
  const auto printed = output_of(program.string(), arguments);
  try {
    std::vector<BenchRow> rows;
    for (const auto& json : Json::parse(printed)) {
      BenchRow row;
      row.group = "peer";
      row.peer = true;
      row.name = json.at("name").get<std::string>();
      for (const auto& f : json.at("frames")) {
        row.frames.push_back({f.at("wall_s").get<double>(), f.at("processor_s").get<double>(),
                              f.at("stages_s").get<std::map<std::string, double>>()});
      }
      rows.push_back(std::move(row));
    }
    return rows;
  } catch (const nlohmann::json::exception& error) {
    throw InputError(program.string() + ": printed no rows: " + json_reason(error));
  }
}

}  // namespace raywave
