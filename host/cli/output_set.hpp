// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "host/common/json.hpp"
#include "host/common/output.hpp"

namespace raywave::cli {

struct ReportOptions;

/// The files that one run writes into a folder, which no other run writes into meanwhile. The
/// report comes last and names a digest of each: it tells whole sets from mixed ones.
class OutputSet {
public:
  /// throws  InputError when the folder cannot be made, or another run holds it
  explicit OutputSet(const std::filesystem::path& folder) : held_(folder), folder_(folder) {}

  const std::filesystem::path& folder() const { return folder_; }
  /// Notes a file that was written into the folder.
  void add(std::string name) { names_.push_back(std::move(name)); }
  /// Writes report.json with `files`: name and digest of each. Then removes the holograms of the
  /// report before that this set replaces, and says so. Returns its text.
  std::string finish(Json report, const ReportOptions& says);
  /// Prints the files, a line each.
  void print() const;

private:
  std::string remove_replaced(const Json& before) const;

  HeldFolder held_;
  std::filesystem::path folder_;
  std::vector<std::string> names_;
};

/// A report; discarded where there is none.
Json read_report(const std::filesystem::path& file);

/// Checks files against the digests of the report beside them; a report without any passes.
///
/// throws  InputError that names the file that is another's
void require_of_report(const std::filesystem::path& report, const nlohmann::json& json,
                       const std::vector<std::filesystem::path>& files);
/// The same of a report that is read for it.
void require_of_report(const std::filesystem::path& report,
                       const std::vector<std::filesystem::path>& files);

}  // namespace raywave::cli
