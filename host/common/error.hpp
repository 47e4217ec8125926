// SPDX-License-Identifier: Apache-2.0
/// The two kinds of errors that a user sees.
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

/// The device, its driver or the host's memory cannot do what was asked. The message says what was
/// asked, what is allowed and what may help. The command line ends with exit code 3.
struct DeviceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace raywave
