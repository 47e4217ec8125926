// SPDX-License-Identifier: Apache-2.0
/// Runs the program as a user does, in a temporary folder.
#pragma once

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"
#include "tests/support/scenes.hpp"

namespace raywave::test {

struct Outcome {
  int code = -1;  // exit code; -1 when a signal ended it, for example at the time limit
  std::string out, err;
  std::uint64_t peak_bytes = 0;  // peak resident memory of the program or of a child
};

/// A folder with a small scene, in which the program runs.
class Desk {
public:
  Desk() {
    folder_.write("square.obj", square_obj());
    scene("");
  }

  /// Writes scene.toml with these lines added at its end.
  void scene(const std::string& more) {
    folder_.write(
        "scene.toml",
        "[hologram]\nresolution = [48, 32]\npitch = \"4 um\"\n[sampling]\npitch = \"20 "
        "um\"\n[[light]]\ndirection = [0, 0, 1]\n"
        "[[object]]\nmesh = \"square.obj\"\nwidth = \"0.2 mm\"\nposition = [0, 0, \"10 mm\"]\n" +
            more);
  }

  /// environment  "NAME=value" each, added to the environment of this process
  Outcome run(const std::vector<std::string>& arguments,
              const std::vector<std::string>& environment = {}) const {
    return outcome_of(start(arguments, environment));
  }

  /// Runs a line in a shell, in this folder; $RAYWAVE is the program.
  Outcome shell(const std::string& line) const {
    return outcome_of(start_words({"/bin/sh", "-c", "cd '" + file("") + "'; " + line},
                                  {std::string("RAYWAVE=") + RAYWAVE_PROGRAM}));
  }

  /// Waits for a program that `start` has started.
  Outcome outcome_of(pid_t program) const {
    int status = 0;
    rusage usage{};
    while (wait4(program, &status, 0, &usage) < 0 && errno == EINTR) {
    }
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, bytes_of(file("stdout")),
            bytes_of(file("stderr")), static_cast<std::uint64_t>(usage.ru_maxrss) * 1024};
  }

  /// Starts the program and does not wait for it.
  pid_t start(const std::vector<std::string>& arguments,
              const std::vector<std::string>& environment = {}) const {
    std::vector<std::string> words{RAYWAVE_PROGRAM};
    words.insert(words.end(), arguments.begin(), arguments.end());
    return start_words(std::move(words), environment);
  }

  /// The outcome of a run with these words and more, which must succeed.
  Outcome succeed(std::vector<std::string> words, const std::vector<std::string>& more = {}) const {
    words.insert(words.end(), more.begin(), more.end());
    auto outcome = run(words);
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    return outcome;
  }

  Outcome render(std::vector<std::string> more = {}) const {
    more.insert(more.begin(), {"render", file("scene.toml"), "-o", file("out")});
    return run(more);
  }

  std::string file(const std::string& name) const { return (folder_ / name).string(); }
  std::filesystem::path out(const std::string& name) const { return folder_ / "out" / name; }
  bool has_output() const { return std::filesystem::exists(folder_ / "out"); }
  const Folder& folder() const { return folder_; }

private:
  pid_t start_words(std::vector<std::string> words,
                    const std::vector<std::string>& environment) const {
    constexpr unsigned time_limit_s = 300;
    std::vector<char*> pointers;
    for (auto& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    const std::string out = file("stdout"), err = file("stderr");
    const pid_t program = fork();
    REQUIRE(program >= 0);
    if (program > 0) return program;
    for (const auto& variable : environment) putenv(const_cast<char*>(variable.c_str()));
    alarm(time_limit_s);
    for (const auto& [name, descriptor] : {std::pair("/dev/null", STDIN_FILENO),
                                           {out.c_str(), STDOUT_FILENO},
                                           {err.c_str(), STDERR_FILENO}})
      dup2(open(name, O_RDWR | O_CREAT | O_TRUNC, 0600), descriptor);
    execv(pointers[0], pointers.data());
    _exit(127);
  }

  Folder folder_;
};

/// True when stderr has exactly one line, as every refusal must have.
inline bool is_one_line(const std::string& err) {
  return std::count(err.begin(), err.end(), '\n') == 1 && err.starts_with("raywave: ") &&
         err.ends_with('\n');
}

/// True where stderr has notes for the user, a line each, and nothing else: no progress, no error.
inline bool has_notes_alone(const std::string& err) {
  std::istringstream lines(err);
  for (std::string line; std::getline(lines, line);)
    if (!line.starts_with("raywave: ") || line.starts_with("raywave:  ")) return false;
  return true;
}

/// Checks a refusal: a last line on stderr that contains `says`, notes alone before it, nothing on
/// stdout, this exit code.
inline void check_refused(const Outcome& outcome, int code, const std::string& says) {
  INFO("stdout: " << outcome.out << "\nstderr: " << outcome.err);
  CHECK(outcome.code == code);
  CHECK(outcome.out.empty());
  CHECK(has_notes_alone(outcome.err));
  CHECK(outcome.err.ends_with('\n'));
  const auto before = outcome.err.rfind('\n', std::max<std::size_t>(outcome.err.size(), 2) - 2);
  CHECK_THAT(outcome.err.substr(before == std::string::npos ? 0 : before + 1),
             Catch::Matchers::ContainsSubstring(says));
}

}  // namespace raywave::test
