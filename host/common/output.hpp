// SPDX-License-Identifier: Apache-2.0
/// Writing of files that appear complete or not at all.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace raywave {

/// Append bytes to a file that is open, and wait until the disk has all of them, which pipes and
/// some file systems cannot.
///
/// name    for messages
/// throws  InputError with the system's reason ("No space left on device")
void append(int descriptor, std::string_view bytes, const std::string& name);
void sync(int descriptor, const std::string& name);
[[noreturn]] void refuse_to_write(const std::string& name);

/// A file under construction, of which every byte is known to be written.
class OutputFile {
public:
  /// place  opened and emptied
  /// name   for messages
  /// throws InputError when it cannot be made
  OutputFile(const std::filesystem::path& place, const std::filesystem::path& name);
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  ~OutputFile();

  /// As the function `append`.
  void write(const void* data, std::size_t bytes) {
    write({static_cast<const char*>(data), bytes});
  }
  void write(std::string_view text) { append(descriptor_, text, name_); }

  /// Waits until the disk has all bytes.
  ///
  /// throws  InputError as `write` does
  void close();

private:
  std::string name_;
  int descriptor_;
};

/// A folder that one program writes a set of files into, or several that share it, of which each
/// writes other files.
class HeldFolder {
public:
  /// Makes the folder and those above it.
  ///
  /// throws  InputError when it cannot be made, or another program holds it
  explicit HeldFolder(const std::filesystem::path& folder, bool is_shared = false);
  HeldFolder(const HeldFolder&) = delete;
  HeldFolder& operator=(const HeldFolder&) = delete;
  /// Removes what it made and nothing was put into.
  ~HeldFolder();

private:
  std::filesystem::path folder_;
  std::size_t made_ = 0;  // it, and folders above it
  int descriptor_;
};

/// Removes the temporary files of this program when SIGINT, SIGTERM or SIGHUP ends it, and says so.
void remove_temporaries_at_signals();

/// What they say, too, from now on. `text` lives as long as the program.
void add_to_end_at_signals(const char* text);

/// Calls `write` with a temporary file beside `file`, then renames it to `file`. When `write`
/// throws, or a byte cannot be written, the temporary file is removed and `file` stays as it was.
/// Creates the parent folder, and removes temporary files that killed programs have left there.
///
/// throws  InputError when the folder or file cannot be written
void write_whole(const std::filesystem::path& file, const std::function<void(OutputFile&)>& write);

/// The same for libraries that take a name only: `write` gets the temporary one (same extension),
/// and must know itself that all is written.
void write_whole_by_name(const std::filesystem::path& file,
                         const std::function<void(const std::filesystem::path& temporary)>& write);

/// write_whole of a text.
void write_text(const std::filesystem::path& file, const std::string& text);

}  // namespace raywave
