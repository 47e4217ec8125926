// SPDX-License-Identifier: Apache-2.0
#include "cl/cache.hpp"

#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>

namespace raywave::cl {
namespace fs = std::filesystem;

fs::path cache_folder() {
  const auto variable = [](const char* name) -> std::string {
    const char* value = std::getenv(name);
    return value ? value : "";
  };
  if (const auto own = variable("RAYWAVE_CACHE_DIR"); !own.empty()) return own;
  if (const auto xdg = variable("XDG_CACHE_HOME"); !xdg.empty()) return fs::path(xdg) / "raywave";
  if (const auto home = variable("HOME"); !home.empty()) return fs::path(home) / ".cache" / "raywave";
  return fs::temp_directory_path() / "raywave-cache";
}

std::optional<std::vector<unsigned char>> load_cached(const std::string& name) {
  std::ifstream in(cache_folder() / name, std::ios::binary);
  if (!in) return std::nullopt;
  return std::vector<unsigned char>(std::istreambuf_iterator<char>(in), {});
}

void store_cached(const std::string& name, const void* data, std::size_t bytes) {
  std::error_code ignored;
  fs::create_directories(cache_folder(), ignored);
  const auto file = cache_folder() / name;
  const auto temporary = cache_folder() / (name + "." + std::to_string(getpid()) + ".tmp");
  {
    std::ofstream out(temporary, std::ios::binary);
    out.write(static_cast<const char*>(data), static_cast<std::streamsize>(bytes));
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
  std::snprintf(hex.data(), hex.size(), "%016llx%016llx", static_cast<unsigned long long>(a), static_cast<unsigned long long>(b));
  return hex.data();
}

}  // namespace raywave::cl
