// SPDX-License-Identifier: Apache-2.0
/// Writing of files that appear complete or not at all.
#pragma once

#include <filesystem>
#include <functional>
#include <string>

namespace raywave {

/// Calls `write` with a temporary name beside `file` (same extension), then renames it to `file`.
/// When `write` throws, the temporary file is removed and `file` stays as it was. Creates the
/// parent folder.
///
/// throws  InputError when the folder or file cannot be written
void write_whole(const std::filesystem::path& file,
                 const std::function<void(const std::filesystem::path& temporary)>& write);

/// write_whole of a text.
void write_text(const std::filesystem::path& file, const std::string& text);

}  // namespace raywave
