// SPDX-License-Identifier: Apache-2.0
#include "cl/environment.hpp"

#include <cstdlib>

namespace raywave::cl {

std::optional<std::filesystem::path> program_folder() {
  const char* folder = std::getenv("RAYWAVE_PROGRAM_DIR");
  if (!folder || !*folder) return std::nullopt;
  return folder;
}

}  // namespace raywave::cl
