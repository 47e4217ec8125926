// SPDX-License-Identifier: Apache-2.0
#include "host/scene/slm.hpp"

#include <array>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave {
namespace {

constexpr std::array<std::pair<const char*, Encoding>, 5> encodings{
    {{"phase", Encoding::phase},
     {"double-phase", Encoding::double_phase},
     {"off-axis", Encoding::off_axis},
     {"burckhardt", Encoding::burckhardt},
     {"lee", Encoding::lee}}};

}  // namespace

std::string name_of(Encoding encoding) {
  for (const auto& [name, value] : encodings)
    if (value == encoding) return name;
  return "";
}

Encoding encoding_of(const std::string& name) {
  std::string names;
  for (const auto& [known, value] : encodings) {
    if (name == known) return value;
    names += (names.empty() ? "" : " or ") + in_quotes(known);
  }
  throw InputError(names);
}

}  // namespace raywave
