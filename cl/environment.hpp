// SPDX-License-Identifier: Apache-2.0
/// Folders that the environment names.
#pragma once

#include <filesystem>
#include <optional>

namespace raywave::cl {

/// RAYWAVE_PROGRAM_DIR, where it is set. Nothing is compiled then: programs come from this folder,
/// and the FFT runs on the host.
std::optional<std::filesystem::path> program_folder();

/// Where PoCL keeps the kernels that it has compiled; empty: a temporary folder of its own.
std::filesystem::path pocl_cache_folder();

}  // namespace raywave::cl
