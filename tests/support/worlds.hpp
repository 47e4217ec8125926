// SPDX-License-Identifier: Apache-2.0
/// Worlds built in test code, without mesh files, and their sample tables.
#pragma once

#include <cmath>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "host/reference/gathering.hpp"
#include "host/reference/stage.hpp"
#include "host/reference/surfaces.hpp"
#include "host/trace/gatherer.hpp"

namespace raywave::test {

using reference::box;
using reference::flipped;
using reference::free_path;
using reference::grid;
using reference::normal;
using reference::place;
using reference::Random;
using reference::rectangle;
using reference::Rig;
using reference::Seen;
using reference::sphere;
using reference::Stage;
using reference::Surface;
using reference::uniform;

}  // namespace raywave::test
