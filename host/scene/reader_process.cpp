// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader_process.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "host/common/environment.hpp"
#include "host/common/error.hpp"

extern char** environ;

namespace raywave {
namespace {

namespace fs = std::filesystem;

/// Exit status of a program that the dynamic loader cannot start.
constexpr int kNotStarted = 127;

/// Folders of the running program and of the file that holds this code: the same for a program
/// that links the library statically, the library's for one that loads it (Python).
std::vector<fs::path> own_folders() {
  std::vector<fs::path> folders;
  std::error_code error;
  const auto add = [&](const fs::path& file) {
    const auto whole = fs::canonical(file, error);
    if (!error && (folders.empty() || folders.front() != whole.parent_path()))
      folders.push_back(whole.parent_path());
  };
  add("/proc/self/exe");
  Dl_info info{};
  static const char here = 0;
  if (dladdr(&here, &info) != 0 && info.dli_fname) add(info.dli_fname);
  return folders;
}

bool is_program(const fs::path& file) {
  std::error_code error;
  return fs::is_regular_file(file, error) && access(file.c_str(), X_OK) == 0;
}

/// What posix_spawn takes besides the program, freed at the end.
class SpawnSettings {
public:
  /// reply  the descriptor that becomes the program's stdout
  /// input  the one that becomes its stdin; -1: none
  SpawnSettings(int reply, int input) {
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, reply, STDOUT_FILENO);
    if (input >= 0)
      posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
    else
      posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    // The host program may block or ignore signals that must end a reader.
    posix_spawnattr_init(&attributes);
    sigset_t none, all;
    sigemptyset(&none);
    sigfillset(&all);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &all);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  }
  ~SpawnSettings() {
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
  }
  SpawnSettings(const SpawnSettings&) = delete;
  SpawnSettings& operator=(const SpawnSettings&) = delete;

  posix_spawn_file_actions_t actions{};
  posix_spawnattr_t attributes{};
};

/// throws  std::runtime_error when the program cannot be started
pid_t start(const fs::path& program, std::vector<std::string> words, int reply, int input) {
  std::vector<char*> pointers;
  for (auto& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  const SpawnSettings settings(reply, input);
  pid_t reader = 0;
  if (const int error = posix_spawn(&reader, program.c_str(), &settings.actions,
                                    &settings.attributes, pointers.data(), environ))
    throw std::runtime_error("no process can be started: " +
                             std::generic_category().message(error));
  return reader;
}

/// Waits, and says in words how the reader ended when it did not say so itself.
std::string end_of(pid_t reader, const fs::path& program) {
  int status = 0;
  while (waitpid(reader, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFEXITED(status) && WEXITSTATUS(status) == kNotStarted)
    return "its reader does not start; run " + program.string() + " to see why";
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  return signal == SIGXCPU || signal == SIGALRM ? "its reader took too long" : "its reader crashed";
}

}  // namespace

fs::path find_reader(const std::string& name) {
  if (const auto folder = environment_variable("RAYWAVE_READER_DIR"); !folder.empty()) {
    if (const auto file = fs::path(folder) / name; is_program(file)) return file;
    throw InputError("there is no program " + name + " in " + folder +
                     ", which RAYWAVE_READER_DIR names; raywave needs it to read files");
  }
  const auto folders = own_folders();
  for (const auto& folder : folders) {
    for (const fs::path beside : {"", "..", "../libexec/raywave", "../../libexec/raywave"}) {
      if (const auto file = (folder / beside / name).lexically_normal(); is_program(file))
        return file;
    }
  }
  throw InputError("there is no program " + name + " beside " +
                   (folders.empty() ? "raywave" : folders.front().string()) +
                   ", and raywave needs it to read files; put it there, or set RAYWAVE_READER_DIR "
                   "to its folder");
}

void run_reader(const fs::path& program, const ReaderLimits& limits,
                const std::vector<std::string>& arguments,
                const std::function<void(ReaderPipe&)>& receive, int input) {
  std::vector<std::string> words{program.string(), std::to_string(limits.seconds),
                                 std::to_string(limits.bytes)};
  words.insert(words.end(), arguments.begin(), arguments.end());
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("no pipe can be made");
  pid_t reader = 0;
  try {
    reader = start(program, std::move(words), ends[1], input);
  } catch (...) {
    close(ends[0]);
    close(ends[1]);
    throw;
  }
  close(ends[1]);

  bool has_failed = false;
  std::string failure;
  ReaderPipe pipe(ends[0]);
  try {
    Verdict verdict{};
    pipe.read_value(verdict);
    if (verdict == Verdict::done) {
      receive(pipe);
    } else {
      has_failed = true;
      std::vector<char> message;
      pipe.read_vector(message, 1 << 16);
      failure.assign(message.begin(), message.end());
    }
  } catch (const std::exception&) {
    has_failed = true;
  }
  close(ends[0]);  // first: a reader that still writes then ends too
  const std::string end = end_of(reader, program);
  if (has_failed) throw std::runtime_error(failure.empty() ? end : failure);
}

}  // namespace raywave
