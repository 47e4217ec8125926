// SPDX-License-Identifier: Apache-2.0
/// Section [scene]: a whole glTF file, seen from one of its cameras.
#pragma once

#include "host/scene/document.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// Reads the section, and adds the file's meshes as one object and its lights to the scene. The
/// hologram's plane stands at the camera and the scene before it: the camera's -z is +z, its y is
/// y, and its x is -x, since the viewer looks from the other side.
///
/// throws  InputError when the file has no camera, or cannot be read
void read_gltf_scene(Section section, Scene& scene);

}  // namespace raywave
