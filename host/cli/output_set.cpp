// SPDX-License-Identifier: Apache-2.0
#include "host/cli/output_set.hpp"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>

#include "host/cli/options.hpp"
#include "host/common/cache.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave::cli {

/// Removes what the report before lists and nobody has changed since. Fields stay: they may be
/// what these holograms are made of, and take long to make again. Returns the names.
std::string OutputSet::remove_replaced(const Json& before) const {
  const auto is_replaced = [&](const std::string& name) {
    return std::ranges::find(names_, name) == names_.end() &&
           std::ranges::any_of(names_, [&](const std::string& made) {
             return made.starts_with("hologram") && extension_of(made) == extension_of(name);
           });
  };
  std::string removed;
  const auto listed = before.find("files");
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder_, error)) {
    const auto name = entry.path().filename().string();
    if (!name.starts_with("hologram") || listed == before.end() || !is_replaced(name)) continue;
    const auto digest = listed->find(name);
    if (digest == listed->end() || *digest != digest_of_file(entry.path()) ||
        entry.symlink_status(error).type() != std::filesystem::file_type::regular)
      continue;
    if (std::filesystem::remove(entry.path(), error))
      removed += (removed.empty() ? "" : ", ") + name;
  }
  return removed;
}

std::string OutputSet::finish(Json report, const ReportOptions& says) {
  const auto before = read_report(folder_ / "report.json");
  auto& files = report["files"];
  for (const auto& name : names_) files[name] = digest_of_file(folder_ / name);
  // Names of devices come from drivers, in any encoding
  const auto text = report.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  write_text(folder_ / "report.json", text);
  if (const auto removed = remove_replaced(before); !removed.empty())
    says.note(one_line(folder_.string()) +
              ": removed what the run before had written: " + one_line(removed));
  names_.emplace_back("report.json");
  return text;
}

void OutputSet::print() const {
  for (const auto& name : names_) std::printf("  %s\n", (folder_ / name).c_str());
}

Json read_report(const std::filesystem::path& file) {
  std::ifstream in(file);
  return Json::parse(in, nullptr, false);
}

void require_of_report(const std::filesystem::path& report, const nlohmann::json& json,
                       const std::vector<std::filesystem::path>& files) {
  const auto digests = json.find("files");
  if (digests == json.end()) return;
  for (const auto& file : files) {
    const auto digest = digests->find(file.filename().string());
    if (digest == digests->end() || *digest == digest_of_file(file)) continue;
    throw InputError(one_line(file.string()) + ": is not the picture that " +
                     one_line(report.string()) +
                     " was written with: a run was stopped before its report, or the picture was "
                     "changed; run it again, or give the picture itself");
  }
}

void require_of_report(const std::filesystem::path& report,
                       const std::vector<std::filesystem::path>& files) {
  const auto json = read_report(report);
  if (json.is_discarded())
    throw InputError(one_line(report.string()) + ": not a report of raywave");
  require_of_report(report, json, files);
}

}  // namespace raywave::cli
