// SPDX-License-Identifier: Apache-2.0
/// The errors that raywave throws; all are std::runtime_error.
#pragma once

#include <raywave/export.h>

#include <stdexcept>
#include <string>

namespace raywave {

/// Wrong input that the user can correct: a scene, a mesh, an option, an array. The message is one
/// line that says what is wrong, where (file and line, option or argument) and what would be right.
/// The command line tool then ends with exit code 2.
struct RAYWAVE_API InputError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The device, its driver or the host's memory cannot do what was asked. The message says what was
/// asked, what is allowed and what may help. The command line ends with exit code 3.
struct RAYWAVE_API DeviceError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Memory of the device or the host is out. The message gives the sizes asked and allowed; a caller
/// that knows what takes the memory adds what needs less.
struct RAYWAVE_API MemoryError : DeviceError {
  using DeviceError::DeviceError;
};

/// A progress callback has asked to stop. What was computed so far is dropped; scene and renderer
/// stay usable.
struct RAYWAVE_API Cancelled : std::runtime_error {
  using std::runtime_error::runtime_error;
};

}  // namespace raywave
