// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "host/geometry/world.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// Digest of all that a scene's files have given: meshes with their materials and pictures, lights,
/// textures, the SLM's LUT and flatness. Names of files are no part of it.
///
/// world  of the scene, wherever its objects have moved
std::string digest_of_contents(const Scene& scene, const World& world);

}  // namespace raywave
