// SPDX-License-Identifier: Apache-2.0
#include "host/common/cache.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cinttypes>
#include <cstring>
#include <fstream>
#include <iterator>
#include <utility>

#include "host/common/environment.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"

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

/// Each step is one to one in the word and in what was before: words that differ in one place
/// never have the same hash.
void Digest::mix(std::uint64_t word) {
  a_ = (a_ ^ word) * 0x9e3779b97f4a7c15u;
  a_ ^= a_ >> 32;
  b_ = (b_ + word) * 0xd6e8feb86659fd93u;
  b_ ^= b_ >> 29;
}

void Digest::add(std::string_view bytes) {
  while (!bytes.empty()) {
    const auto place = size_ % word_bytes;
    if (place == 0 && bytes.size() >= word_bytes) {
      std::uint64_t word = 0;
      std::memcpy(&word, bytes.data(), word_bytes);
      mix(word);
      bytes.remove_prefix(word_bytes);
      size_ += word_bytes;
      continue;
    }
    std::memcpy(reinterpret_cast<char*>(&begun_) + place, bytes.data(), 1);
    bytes.remove_prefix(1);
    if (++size_ % word_bytes == 0) mix(std::exchange(begun_, 0));
  }
}

std::string Digest::text() const {
  auto whole = *this;
  whole.mix(begun_);
  whole.mix(size_);
  return format("%016" PRIx64 "%016" PRIx64, whole.a_, whole.b_);
}

std::string hash_name(std::string_view text) {
  Digest digest;
  digest.add(text);
  return digest.text();
}

std::string digest_of_file(const std::filesystem::path& file) {
  std::error_code error;
  std::ifstream in(file, std::ios::binary);
  if (!in || !std::filesystem::is_regular_file(file, error)) return "";
  Digest digest;
  std::vector<char> part(std::size_t{1} << 20);
  while (in.read(part.data(), static_cast<std::streamsize>(part.size())) || in.gcount() > 0)
    digest.add({part.data(), static_cast<std::size_t>(in.gcount())});
  return in.bad() ? "" : digest.text();
}

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

CacheLock::CacheLock()
    : folder_(::open(cache_folder().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
  if (folder_ >= 0) ::flock(folder_, LOCK_EX);
}

CacheLock::~CacheLock() {
  if (folder_ >= 0) ::close(folder_);
}

}  // namespace raywave
