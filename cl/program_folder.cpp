// SPDX-License-Identifier: Apache-2.0
#include "cl/program_folder.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <utility>

#include "host/common/cache.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"

namespace raywave::cl {
namespace fs = std::filesystem;

namespace {

constexpr const char* manifest_name = "manifest.tsv";

ProgramRecorder* recorder = nullptr;

std::optional<std::string> read_file(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(in), {});
}

/// NAME to the rest of its line.
std::map<std::string, std::string> read_manifest(const fs::path& folder) {
  std::map<std::string, std::string> entries;
  std::istringstream in(read_file(folder / manifest_name).value_or(""));
  for (std::string line; std::getline(in, line);) {
    const auto tab = line.find('\t');
    if (tab != std::string::npos) entries[line.substr(0, tab)] = line.substr(tab + 1);
  }
  return entries;
}

}  // namespace

std::string ProgramSource::name() const {
  return fs::path(file).stem().string() + "-" + hash_name(text + '\n' + flags);
}

std::vector<unsigned char> load_program(const fs::path& folder, const ProgramSource& source,
                                        const DeviceInfo& device) {
  const auto name = source.name();
  const auto file = folder / (name + ".bin");
  const auto remedy =
      device.kind == DeviceKind::accelerator
          ? "; raywave kernels SCENE -o FOLDER --target aoc, and its Makefile, build what renders "
            "with --no-field need; where the device compiles, --waves-on " +
                device.index + " in place of --target"
          : "; raywave kernels -o " + folder.string() + " --device " + device.index +
                " SCENE, with its --preset and --set, builds what a scene needs, where "
                "RAYWAVE_PROGRAM_DIR is not set";
  const auto binary = read_file(file);
  if (!binary || binary->empty())
    throw DeviceError(file.string() + " is missing: " + source.file + " with " + source.flags +
                      ", and RAYWAVE_PROGRAM_DIR forbids compiling" + remedy);
  // Drivers need not survive a damaged binary (PoCL 3.1 aborts), so none from this folder reaches
  // them.
  const auto entries = read_manifest(folder);
  if (const auto it = entries.find(name); it != entries.end()) {
    const auto digest = it->second.substr(0, it->second.find('\t'));
    if (digest != hash_name(*binary))
      throw DeviceError(file.string() + " is not what " + manifest_name +
                        " beside it lists: damaged, or from elsewhere" + remedy);
  }
  return {binary->begin(), binary->end()};
}

ProgramRecorder::ProgramRecorder(std::optional<fs::path> folder) : folder_(std::move(folder)) {
  if (recorder) throw DeviceError("programs are being recorded already");
  std::error_code error;
  if (folder_) fs::create_directories(*folder_, error);
  if (folder_ && !fs::is_directory(*folder_, error))
    throw InputError(one_line(folder_->string()) + ": no such folder, and it cannot be made");
  recorder = this;
}

ProgramRecorder::~ProgramRecorder() { recorder = nullptr; }

bool is_recording() { return recorder; }

void record_program(const ProgramSource& source,
                    const std::function<std::vector<unsigned char>()>& binary) {
  if (!recorder) return;
  const auto name = source.name();
  auto& programs = recorder->programs_;
  if (std::any_of(programs.begin(), programs.end(),
                  [&](const ProgramSource& other) { return other.name() == name; }))
    return;
  programs.push_back(source);
  if (!recorder->folder_) return;
  const auto& folder = *recorder->folder_;
  const auto made = binary();
  const std::string bytes(made.begin(), made.end());
  write_text(folder / (name + ".bin"), bytes);
  auto entries = read_manifest(folder);
  entries[name] = hash_name(bytes) + '\t' + source.file + '\t' + source.flags;
  std::string manifest;
  for (const auto& [entry, rest] : entries) manifest += entry + '\t' + rest + '\n';
  write_text(folder / manifest_name, manifest);
}

}  // namespace raywave::cl
