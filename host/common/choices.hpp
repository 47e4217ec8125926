// SPDX-License-Identifier: Apache-2.0
/// What users choose by name, as the installed headers declare it.
#pragma once

#include <cstddef>
#include <span>
#include <string_view>

#include "host/include/raywave/choices.hpp"

namespace raywave {

/// The place of a name among all. `what` it is of begins the message.
///
/// throws  InputError that lists the names when it is none of them
std::size_t place_of(std::string_view name, std::span<const char* const> names,
                     std::string_view what);

/// The value of this name: choice_of<Method>("rays", "method").
///
/// throws  InputError that lists the names when it is none of them
template <Named Value>
Value choice_of(std::string_view name, std::string_view what) {
  return static_cast<Value>(place_of(name, names_of(Value{}), what));
}

}  // namespace raywave
