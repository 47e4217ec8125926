// SPDX-License-Identifier: Apache-2.0
/// The effective scene, the plan and the measurements as JSON (report.json) and text (`raywave
/// plan`).
#pragma once

#include <string>

#include "host/geometry/world.hpp"
#include "host/plan/predict/presets.hpp"
#include "host/render.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// The scene with every default filled in, lengths in metres.
std::string scene_json(const Scene& scene);

/// The report of a render: effective scene, plan, device, versions, seconds of each stage, peak
/// memory.
std::string render_report_json(const Scene& scene, const RenderResult& result,
                               const cl::DeviceInfo& device, cl::FftBackend fft);

/// The report of a plan, for a scene that has not been rendered.
std::string plan_report_json(const Planned& planned, const World& world);
std::string plan_report_text(const Planned& planned, const World& world);

/// Pitch, wavelength and resolution of a hologram from the report.json beside it.
/// file    a picture or field beside a report of three lasers, which tells the laser
/// throws  InputError when the report is missing or damaged
HologramSpec hologram_of_report(const std::filesystem::path& report,
                                const std::filesystem::path& file = {});

/// The viewer of the scene, from the same; reports of earlier versions have no eyepiece.
ViewerSpec viewer_of_report(const std::filesystem::path& report);

}  // namespace raywave
