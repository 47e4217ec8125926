// SPDX-License-Identifier: Apache-2.0
/// JSON of reports, whose keys stay in the order in which they are written.
#pragma once

#include <nlohmann/json_fwd.hpp>

namespace raywave {

using Json = nlohmann::ordered_json;

}  // namespace raywave
