// SPDX-License-Identifier: Apache-2.0
#include "cl/environment.hpp"

#include "host/common/environment.hpp"

namespace raywave::cl {

std::optional<std::filesystem::path> program_folder() {
  const auto folder = environment_variable("RAYWAVE_PROGRAM_DIR");
  if (folder.empty()) return std::nullopt;
  return folder;
}

}  // namespace raywave::cl
