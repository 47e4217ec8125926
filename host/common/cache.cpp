// SPDX-License-Identifier: Apache-2.0
#include "host/common/cache.hpp"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

namespace raywave {
namespace fs = std::filesystem;

namespace {
constexpr std::size_t digest_size = 32;  // each file starts with hash_name of the rest
}

fs::path cache_folder() {
  const auto variable = [](const char* name) -> std::string {
    const char* value = std::getenv(name);
    return value ? value : "";
  };
  if (const auto own = variable("RAYWAVE_CACHE_DIR"); !own.empty()) return own;
  if (const auto xdg = variable("XDG_CACHE_HOME"); !xdg.empty()) return fs::path(xdg) / "raywave";
  if (const auto home = variable("HOME"); !home.empty())
    return fs::path(home) / ".cache" / "raywave";
  return fs::temp_directory_path() / "raywave-cache";
}

std::optional<std::vector<unsigned char>> load_cached(const std::string& name) {
  std::ifstream in(cache_folder() / name, std::ios::binary);
  if (!in) return std::nullopt;
  const std::string text(std::istreambuf_iterator<char>(in), {});
  // Drivers need not survive a damaged binary (PoCL 3.1 aborts), so none reaches them.
  const auto contents = std::string_view(text).substr(std::min(digest_size, text.size()));
  if (!text.starts_with(hash_name(contents))) return std::nullopt;
  return std::vector<unsigned char>(contents.begin(), contents.end());
}

void store_cached(const std::string& name, const void* data, std::size_t bytes) {
  std::error_code ignored;
  fs::create_directories(cache_folder(), ignored);
  const auto file = cache_folder() / name;
  const auto temporary = cache_folder() / (name + "." + std::to_string(getpid()) + ".tmp");
  {
    std::ofstream out(temporary, std::ios::binary);
    const std::string_view contents(static_cast<const char*>(data), bytes);
    out << hash_name(contents) << contents;
    if (!out.flush()) {
      fs::remove(temporary, ignored);
      return;
    }
  }
  fs::rename(temporary, file, ignored);
}

std::string hash_name(std::string_view text) {
  // Two FNV-1a hashes of different offset; names need to differ, not to withstand an attack.
  std::uint64_t a = 0xcbf29ce484222325u, b = 0x84222325cbf29ce4u;
  for (const unsigned char c : text) {
    a = (a ^ c) * 0x100000001b3u;
    b = (b ^ c ^ 0x55u) * 0x100000001b3u;
  }
  std::array<char, 33> hex;
  std::snprintf(hex.data(), hex.size(), "%016llx%016llx", static_cast<unsigned long long>(a),
                static_cast<unsigned long long>(b));
  return hex.data();
}

}  // namespace raywave
