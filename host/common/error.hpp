// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <string>

namespace raywave {

/// Wrong input that the user can correct: a scene, a mesh, an option. The message is one line that
/// says what is wrong, where (file and line, or option) and what would be right. The command line
/// tool then ends with exit code 2.
struct InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace raywave
