// SPDX-License-Identifier: Apache-2.0
/// The structs of kernels/common/shared.h on the host, named for the launch checks.
#pragma once

#include <glm/vec2.hpp>
#include <glm/vec4.hpp>

#include "cl/program.hpp"

namespace raywave::device {
using uint = std::uint32_t;
#include "kernels/common/shared.h"
#include "kernels/scene/normal_cones.h"
}  // namespace raywave::device

RAYWAVE_CL_TYPE(raywave::device::BvhNode, "BvhNode");
RAYWAVE_CL_TYPE(raywave::device::Triangle, "Triangle");
RAYWAVE_CL_TYPE(raywave::device::Instance, "Instance");
RAYWAVE_CL_TYPE(raywave::device::Material, "Material");
RAYWAVE_CL_TYPE(raywave::device::Light, "Light");
RAYWAVE_CL_TYPE(raywave::device::SceneLight, "SceneLight");
RAYWAVE_CL_TYPE(raywave::device::TracePlane, "TracePlane");
RAYWAVE_CL_TYPE(raywave::device::Sample, "Sample");
RAYWAVE_CL_TYPE(raywave::device::SamplePath, "SamplePath");
RAYWAVE_CL_TYPE(raywave::device::Lattice, "Lattice");
RAYWAVE_CL_TYPE(raywave::device::ProjectedSample, "ProjectedSample");
RAYWAVE_CL_TYPE(raywave::device::GatherPlane, "GatherPlane");
RAYWAVE_CL_TYPE(raywave::device::CompactPlane, "CompactPlane");
RAYWAVE_CL_TYPE(raywave::device::CompactFootprint, "CompactFootprint");
RAYWAVE_CL_TYPE(raywave::device::Lookout, "Lookout");
RAYWAVE_CL_TYPE(raywave::device::LensPlane, "LensPlane");
RAYWAVE_CL_TYPE(glm::ivec2, "int2");
RAYWAVE_CL_TYPE(glm::ivec4, "int4");
