// SPDX-License-Identifier: Apache-2.0
/// What was understood and what was done, as JSON (report.json) and as text (`raywave plan`).
#pragma once

#include <string>

#include "host/geometry/world.hpp"
#include "host/plan/presets.hpp"
#include "host/render.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// The scene with every default filled in, lengths in metres.
std::string scene_json(const Scene& scene);

/// Everything that made a result: effective scene, plan, device, versions, seconds of each stage,
/// peak memory.
std::string render_report_json(const Scene& scene, const RenderResult& result,
                               const cl::DeviceInfo& device, cl::FftBackend fft);

/// The same for a scene that has not been rendered.
std::string plan_report_json(const Planned& planned, const World& world);
std::string plan_report_text(const Planned& planned, const World& world);

/// Pitch, wavelength and resolution of a hologram from the report.json beside it.
/// throws  InputError when the file is missing or damaged
HologramSpec hologram_of_report(const std::filesystem::path& report);

}  // namespace raywave
