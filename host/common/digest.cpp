// SPDX-License-Identifier: Apache-2.0
#include "host/common/digest.hpp"

#include <array>
#include <cstdio>
#include <fstream>
#include <vector>

namespace raywave {

void Digest::add(std::string_view bytes) {
  for (const unsigned char c : bytes) {
    a_ = (a_ ^ c) * 0x100000001b3u;
    b_ = (b_ ^ c ^ 0x55u) * 0x100000001b3u;
  }
}

std::string Digest::text() const {
  std::array<char, 33> hex;
  std::snprintf(hex.data(), hex.size(), "%016llx%016llx", static_cast<unsigned long long>(a_),
                static_cast<unsigned long long>(b_));
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
