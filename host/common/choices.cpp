// SPDX-License-Identifier: Apache-2.0
#include "host/common/choices.hpp"

#include "host/common/error.hpp"
#include "host/common/text.hpp"

namespace raywave {

std::size_t place_of(std::string_view name, std::span<const char* const> names,
                     std::string_view what) {
  std::string all;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (name == names[i]) return i;
    all += (i == 0 ? "" : i + 1 == names.size() ? " and " : ", ") + std::string(names[i]);
  }
  throw InputError(std::string(what) + " " + in_quotes(name) + ": unknown; there are " + all);
}

}  // namespace raywave
