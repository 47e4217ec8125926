// SPDX-License-Identifier: Apache-2.0
#include "host/common/digest.hpp"

#include <array>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <utility>
#include <vector>

namespace raywave {

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
  std::array<char, 33> hex;
  std::snprintf(hex.data(), hex.size(), "%016llx%016llx", static_cast<unsigned long long>(whole.a_),
                static_cast<unsigned long long>(whole.b_));
  return hex.data();
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

}  // namespace raywave
