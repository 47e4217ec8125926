// SPDX-License-Identifier: Apache-2.0
#include "host/cli/helpers.hpp"

#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstddef>
#include <cstdio>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/common/child_program.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/plan/message_text.hpp"

namespace raywave::cli {

std::vector<std::string> words_of(const char* command, const SceneArguments& options) {
  const auto& goal = options.goal;
  std::vector<std::string> words{"raywave", command, options.scene.file};
  const auto add = [&](const char* name, const std::string& value) {
    if (value.empty()) return;
    words.push_back(name);
    words.push_back(value);
  };
  for (const auto& set : options.scene.set) add("--set", set);
  add("--preset", goal.preset);
  add("--budget", goal.budget);
  if (goal.psnr_db) add("--psnr", format("%.17g", *goal.psnr_db));
  if (goal.rate_per_s) add("--rate", format("%.17g", *goal.rate_per_s));
  add("--fft", options.device.fft);
  return words;
}

std::string devices_text(const cl::DeviceInfo& first, const AnimateResult& made) {
  std::string counts;
  for (const auto& [index, pictures] : made.by_device)
    counts += (counts.empty() ? "" : ", ") + index + ": " + std::to_string(pictures);
  if (counts.empty()) return first.name;
  return std::to_string(made.by_device.size()) + " x " + first.name + " (" + counts + ")";
}

void end_with_parent() { prctl(PR_SET_PDEATHSIG, SIGTERM); }

namespace {

struct Helper {
  cl::DeviceInfo device;
  ChildProgram program;
  std::string text{};  // of its lines, that has come
};

/// Waits for what a helper says, and calls `take` with each whole line. False at its end.
bool listen(Helper& helper, const std::function<void(const std::string&)>& take) {
  const bool goes_on = helper.program.receive(helper.text);
  for (auto end = helper.text.find('\n'); end != std::string::npos; end = helper.text.find('\n')) {
    const auto line = helper.text.substr(0, end);
    helper.text.erase(0, end + 1);
    take(line);
  }
  return goes_on;
}

/// throws  where a helper has not come to its end, with its last words
void require_end(Helper& helper) {
  const int status = helper.program.end();
  if (status == 0) return;
  auto said = helper.program.said();
  said.erase(said.find_last_not_of('\n') + 1);
  said.erase(0, said.rfind('\n') + 1);
  constexpr std::string_view name = "raywave: ";
  if (said.starts_with(name))
    said.erase(0, name.size());
  else
    said = WIFSIGNALED(status)
               ? "its process was ended by signal " + std::to_string(WTERMSIG(status))
               : "its process ended with exit code " + std::to_string(WEXITSTATUS(status));
  constexpr int of_input = 2;  // host/cli/main.cpp
  if (WIFEXITED(status) && WEXITSTATUS(status) == of_input) throw InputError(said);
  throw DeviceError(said);
}

/// A file of numbers, to be read from its beginning.
std::unique_ptr<std::FILE, int (*)(std::FILE*)> queue_of(const std::vector<int>& pictures) {
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), std::fclose);
  if (!file ||
      std::fwrite(pictures.data(), sizeof(int), pictures.size(), file.get()) != pictures.size() ||
      std::fflush(file.get()) != 0 || ::lseek(fileno(file.get()), 0, SEEK_SET) != 0)
    refuse_to_write("a temporary file");
  return file;
}

}  // namespace

AnimateResult make_on(const std::vector<cl::DeviceInfo>& devices,
                      const std::vector<std::string>& words, FrameFiles& files,
                      const Progress& progress) {
  AnimateResult made;
  const auto& missing = files.missing();
  const auto queue = queue_of(missing);
  std::vector<std::unique_ptr<Helper>> helpers;
  for (std::size_t i = 0; i < devices.size() && i < missing.size(); ++i) {
    std::vector<std::string> arguments(words.begin() + 1, words.end());
    arguments.insert(arguments.end(), {from_queue, "--quiet", "--device", devices[i].index});
    helpers.emplace_back(new Helper{
        devices[i],
        {"/proc/self/exe", arguments, ".", ChildProgram::Held::output, fileno(queue.get())}});
    made.by_device[devices[i].index] = 0;
  }
  const auto stop = [&] {
    for (const auto& helper : helpers) helper->program.stop();
  };
  const auto is_done = [&] { return made.pictures == static_cast<int>(missing.size()); };
  std::optional<Stopwatch> since_first;
  const auto take = [&](const Helper& helper, const std::string& text) {
    const auto line = files.add_line(text);
    const auto holograms = static_cast<int>(line.at("holograms").size());
    made.holograms += holograms;
    if (since_first)
      made.timed_holograms += holograms;
    else
      since_first.emplace();
    if (const auto times = line.find(FrameFiles::times_key); times != line.end())
      for (const auto& [stage, s] : times->get<std::map<std::string, double>>())
        made.processor_seconds[stage] += s;
    if (line.contains("notes"))
      add_lines(made.notes, line["notes"].get<std::vector<std::string>>());
    ++made.by_device[helper.device.index];
    ++made.pictures;
    progress(std::to_string(made.pictures) + " of " + std::to_string(missing.size()) + " " +
                 files.word() + "s",
             static_cast<double>(made.pictures) / static_cast<double>(missing.size()));
    if (is_done()) stop();  // some may not have begun
  };
  std::exception_ptr failure;
  for (auto running = helpers.size(); running > 0;) {
    std::vector<pollfd> streams;
    for (const auto& helper : helpers) streams.push_back({helper->program.stream(), POLLIN, 0});
    poll(streams.data(), streams.size(), -1);
    for (std::size_t i = 0; i < helpers.size(); ++i) {
      if (streams[i].revents == 0) continue;
      auto& helper = *helpers[i];
      try {
        if (listen(helper, [&](const std::string& line) { take(helper, line); })) continue;
        --running;
        require_end(helper);
      } catch (const std::exception& error) {
        if (failure || is_done()) continue;  // it was stopped
        const auto text = "device " + helper.device.index + " " + helper.device.name + ": " +
                          error.what() + "; what was made stays, and the same command goes on";
        failure = dynamic_cast<const InputError*>(&error)
                      ? std::make_exception_ptr(InputError(text))
                      : std::make_exception_ptr(DeviceError(text));
        stop();
      }
    }
  }
  if (failure) std::rethrow_exception(failure);
  if (!is_done())
    throw DeviceError("some " + std::string(files.word()) +
                      "s are missing; the same command goes on");
  if (since_first) made.seconds = since_first->wall_s();
  files.finish();
  return made;
}

}  // namespace raywave::cli
