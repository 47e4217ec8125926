// SPDX-License-Identifier: Apache-2.0
/// The plan and the measurements as JSON (report.json) and text (`raywave plan`).
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "host/forecast/presets.hpp"
#include "host/geometry/world.hpp"
#include "host/render.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// The report of a laser: effective scene, plan, device, versions, seconds of each stage, peak
/// memory.
nlohmann::ordered_json render_report_json(const Scene& scene, const RenderResult& result,
                                          const cl::DeviceInfo& device, cl::FftBackend fft);

/// Parts of the reports.
nlohmann::ordered_json plan_json(const Plan& plan);
nlohmann::ordered_json accuracy_json(const AccuracySpec& accuracy, const Plan& plan);
/// What objects' meshes bring, in place of the scene's materials; `objects` are those of the scene.
void add_found(const std::vector<FoundMaterials>& found, nlohmann::ordered_json& objects);

/// The report of the plans of all lasers, for scenes that have not been rendered.
nlohmann::ordered_json plan_report_json(const std::vector<Planned>& planned, const World& world);
std::string plan_report_text(const std::vector<Planned>& planned, const World& world);

/// Pitch, wavelength and resolution of a hologram from the report.json beside it.
/// file    a picture or field beside a report of three lasers, which tells the laser
/// throws  InputError when the report is missing or damaged
HologramSpec hologram_of_report(const std::filesystem::path& report,
                                const std::filesystem::path& file = {});

/// The viewer of the scene, from the same; without a report, and in those of earlier versions,
/// there is no eyepiece.
ViewerSpec viewer_of_report(const std::filesystem::path& report,
                            const std::filesystem::path& file = {});

}  // namespace raywave
