// SPDX-License-Identifier: Apache-2.0
#include "host/cli/output_set.hpp"

#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "host/common/cache.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave::cli {

std::string OutputSet::finish(Json report) {
  auto& files = report["files"];
  for (const auto& name : names_) files[name] = digest_of_file(folder_ / name);
  // Names of devices come from drivers, in any encoding
  const auto text = report.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  write_text(folder_ / "report.json", text);
  names_.emplace_back("report.json");
  return text;
}

void OutputSet::print() const {
  for (const auto& name : names_) std::printf("  %s\n", (folder_ / name).c_str());
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
  std::ifstream in(report);
  const auto json = nlohmann::json::parse(in, nullptr, false);
  if (json.is_discarded())
    throw InputError(one_line(report.string()) + ": not a report of raywave");
  require_of_report(report, json, files);
}

}  // namespace raywave::cli
