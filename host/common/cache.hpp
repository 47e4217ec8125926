// SPDX-License-Identifier: Apache-2.0
/// The folder where compiled kernels and FFT plans stay between runs. Losing it costs time, never a
/// result.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace raywave {

// Digests of bytes: they tell files apart that were mixed up or damaged, and withstand no attack.

/// Two hashes of 64 bits, a word of 8 bytes at a time. Bytes may come in parts of any length.
class Digest {
public:
  void add(std::string_view bytes);
  /// 32 hexadecimal digits
  std::string text() const;

private:
  static constexpr std::size_t word_bytes = sizeof(std::uint64_t);

  void mix(std::uint64_t word);

  std::uint64_t a_ = 0xcbf29ce484222325u, b_ = 0x84222325cbf29ce4u;
  std::uint64_t begun_ = 0;  // bytes of a word that is not whole yet
  std::uint64_t size_ = 0;   // number of all bytes
};

/// 32 hexadecimal digits that stand for `text` in a file name.
std::string hash_name(std::string_view text);

/// Digest of a file's bytes; empty where it cannot be read.
std::string digest_of_file(const std::filesystem::path& file);

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

/// Waits until no other process holds it: for what one measures and all take from the cache.
class CacheLock {
public:
  CacheLock();
  ~CacheLock();
  CacheLock(const CacheLock&) = delete;
  CacheLock& operator=(const CacheLock&) = delete;

private:
  int folder_;
};

}  // namespace raywave
