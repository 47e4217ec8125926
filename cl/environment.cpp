// SPDX-License-Identifier: Apache-2.0
#include "cl/environment.hpp"

#include "host/common/environment.hpp"

namespace raywave::cl {

std::optional<std::filesystem::path> program_folder() {
  const auto folder = environment_variable("RAYWAVE_PROGRAM_DIR");
  if (folder.empty()) return std::nullopt;
  return folder;
}

std::filesystem::path pocl_cache_folder() {
  if (const auto own = environment_variable("POCL_CACHE_DIR"); !own.empty()) return own;
  const auto xdg = environment_variable("XDG_CACHE_HOME"), home = environment_variable("HOME");
  if (xdg.empty() && home.empty()) return {};
  return std::filesystem::path(xdg.empty() ? home + "/.cache" : xdg) / "pocl";
}

}  // namespace raywave::cl
