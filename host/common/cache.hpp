// SPDX-License-Identifier: Apache-2.0
/// The folder where compiled kernels and FFT plans stay between runs. Losing it costs time, never a
/// result.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host/common/digest.hpp"

namespace raywave {

/// RAYWAVE_CACHE_DIR, else raywave/ in XDG_CACHE_HOME, else in ~/.cache. Where that cannot be
/// written, in temporary_cache_folder.
std::filesystem::path cache_folder();

/// A folder for caches that belongs to this user alone, within the system's temporary folder; empty
/// where there is none.
std::filesystem::path temporary_cache_folder();

/// True when files can be made in a folder, which is made where it is missing.
bool is_writable_folder(const std::filesystem::path& folder);

/// The bytes stored under `name`, if any and undamaged.
std::optional<std::vector<unsigned char>> load_cached(const std::string& name);

/// Stores bytes under `name` (temporary name, then rename, so readers never see half). A folder
/// that cannot be written is no error.
void store_cached(const std::string& name, const void* data, std::size_t bytes);

}  // namespace raywave
