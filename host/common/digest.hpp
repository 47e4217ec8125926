// SPDX-License-Identifier: Apache-2.0
/// Digests of bytes: they tell files apart that were mixed up or damaged, and withstand no attack.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace raywave {

/// Two FNV-1a hashes of 64 bits with different offsets.
class Digest {
public:
  void add(std::string_view bytes);
  /// 32 hexadecimal digits
  std::string text() const;

private:
  std::uint64_t a_ = 0xcbf29ce484222325u, b_ = 0x84222325cbf29ce4u;
};

/// 32 hexadecimal digits that stand for `text` in a file name.
std::string hash_name(std::string_view text);

/// Digest of a file's bytes; empty where it cannot be read.
std::string digest_of_file(const std::filesystem::path& file);

}  // namespace raywave
