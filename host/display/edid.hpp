// SPDX-License-Identifier: Apache-2.0
/// What a monitor or SLM says of itself.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace raywave {

struct Edid {
  std::string maker;  // three letters
  unsigned product = 0;
  std::string serial;  // a text where there is one, else a number; empty: none
  std::string name;    // may be empty

  /// "HOL-6013-00123": maker, product in hexadecimal digits and, where there is one, serial.
  std::string id() const;
};

/// Reads the first block of an EDID; whatever is wrong with it, there is none.
///
/// source  VESA E-EDID standard, release A2, section 3
std::optional<Edid> read_edid(std::span<const std::uint8_t> bytes);

}  // namespace raywave
