// SPDX-License-Identifier: Apache-2.0
#include "host/scene/scene.hpp"

#include <cstddef>

namespace raywave {

const char* name_of(WrpPropagation propagation) {
  constexpr const char* names[] = {"auto", "spectrum", "compact"};
  return names[static_cast<std::size_t>(propagation)];
}

const char* name_of(Bounces bounces) {
  constexpr const char* names[] = {"auto", "points", "paths"};
  return names[static_cast<std::size_t>(bounces)];
}

const char* name_of(RefineTargets targets) {
  constexpr const char* names[] = {"auto", "samples", "lens"};
  return names[static_cast<std::size_t>(targets)];
}

}  // namespace raywave
