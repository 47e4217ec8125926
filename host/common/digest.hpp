// SPDX-License-Identifier: Apache-2.0
/// Digests of bytes: they tell files apart that were mixed up or damaged, and withstand no attack.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace raywave {

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

}  // namespace raywave
