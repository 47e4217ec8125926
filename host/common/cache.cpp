// SPDX-License-Identifier: Apache-2.0
#include "host/common/cache.hpp"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "host/common/environment.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"

namespace raywave {
namespace fs = std::filesystem;

namespace {
/// Each file starts with these characters. They also hold its name: a file that was copied to
/// another's place holds another kernel.
std::string digest_of(const std::string& name, std::string_view contents) {
  Digest digest;
  digest.add(name);
  digest.add(contents);
  return digest.text();
}
constexpr std::size_t digest_size = 32;

}  // namespace

fs::path cache_folder() {
  if (const auto own = environment_variable("RAYWAVE_CACHE_DIR"); !own.empty()) return own;
  const auto xdg = environment_variable("XDG_CACHE_HOME"), home = environment_variable("HOME");
  const auto usual =
      xdg.empty() ? fs::path(home) / ".cache" / "raywave" : fs::path(xdg) / "raywave";
  return (!xdg.empty() || !home.empty()) && is_writable_folder(usual) ? usual
                                                                      : temporary_cache_folder();
}

fs::path temporary_cache_folder() {
  std::error_code error;
  auto folder = fs::temp_directory_path(error) / ("raywave-cache-" + std::to_string(geteuid()));
  if (error) return {};
  mkdir(folder.c_str(), 0700);
  // Others may have made it first: what lies there would then run in our name.
  struct stat found {};
  const bool is_ours = lstat(folder.c_str(), &found) == 0 && S_ISDIR(found.st_mode) &&
                       found.st_uid == geteuid() && (found.st_mode & 077) == 0;
  return is_ours ? folder : fs::path();
}

bool is_writable_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  return access(folder.c_str(), W_OK | X_OK) == 0;
}

std::optional<std::vector<unsigned char>> load_cached(const std::string& name) {
  const auto file = cache_folder() / name;
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return std::nullopt;  // to open a pipe may never end
  std::ifstream in(file, std::ios::binary);
  if (!in) return std::nullopt;
  const std::string text(std::istreambuf_iterator<char>(in), {});
  // Drivers need not survive a damaged binary (PoCL 3.1 aborts), so damaged files are not passed
  // on.
  const auto contents = std::string_view(text).substr(std::min(digest_size, text.size()));
  if (!text.starts_with(digest_of(name, contents))) return std::nullopt;
  return std::vector<unsigned char>(contents.begin(), contents.end());
}

void store_cached(const std::string& name, const void* data, std::size_t bytes) {
  const auto folder = cache_folder();
  if (folder.empty() || !is_writable_folder(folder)) return;
  const std::string_view contents(static_cast<const char*>(data), bytes);
  try {
    write_whole(folder / name, [&](OutputFile& out) {
      out.write(digest_of(name, contents));
      out.write(contents);
    });
  } catch (const InputError&) {  // a full disk, or a folder in the file's place
  }
}

}  // namespace raywave
