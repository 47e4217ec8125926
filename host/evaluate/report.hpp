// SPDX-License-Identifier: Apache-2.0
/// The plan and the measurements as JSON (report.json) and text (`raywave plan`), and what reports
/// tell when they are read again.
#pragma once

#include <filesystem>
#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <vector>

#include "cl/device.hpp"
#include "host/common/json.hpp"
#include "host/forecast/presets.hpp"
#include "host/geometry/world.hpp"
#include "host/render.hpp"
#include "host/scene/scene.hpp"
#include "host/scene/scene_json.hpp"

namespace raywave {

/// The report of a laser: effective scene, plan, device, versions, seconds of each stage, peak
/// memory.
Json render_report_json(const Scene& scene, const RenderResult& result,
                        const cl::DeviceInfo& device, cl::FftBackend fft);

/// The files of a laser, beside the report.
struct LaserFiles {
  std::vector<std::string> pictures;  // of its frames
  std::string field;                  // empty: none was kept
  std::string refined;                // phases of refined holograms; empty: none were kept
};

/// What reports say of the lasers.
///
/// light  that the picture needs of each laser, relative (laser_powers); empty: not known
Json colour_json(const ColourSpec& colour, const std::vector<double>& light);

/// How much of the powers that colour.power gives is needed for `what`; empty where it gives none.
std::string drive_text(const ColourSpec& colour, const std::vector<double>& light,
                       const std::string& what);

/// "_638nm" in the names of a laser's files; "" where there is but one.
std::string laser_suffix(double wavelength_m, std::size_t lasers);

/// The files that a render writes of a laser, by name.
LaserFiles files_of_laser(const RenderResult& laser, const std::string& suffix, bool keeps_field,
                          bool keeps_refined);

/// The report of a render: that of the one laser, or the lasers, what they need, and the report of
/// each.
///
/// files  of each laser, where there are several
Json report_json(const std::vector<Scene>& scenes, const Rendered& result,
                 const std::vector<LaserFiles>& files, const cl::DeviceInfo& device,
                 cl::FftBackend fft);

/// Parts of the reports.
Json plan_json(const Plan& plan);
Json accuracy_json(const AccuracySpec& accuracy, const Plan& plan);
/// What objects' meshes bring, in place of the scene's materials; `objects` are those of the scene.
void add_found(const std::vector<FoundMaterials>& found, Json& objects);

/// The report of the plans of all lasers, for scenes that have not been rendered.
Json plan_report_json(const std::vector<Planned>& planned, const World& world);
std::string plan_report_text(const std::vector<Planned>& planned, const World& world);

/// What a hologram of this wavelength shows: half sides of the field at a depth that light of all
/// its pixels reaches, >= 0. Beyond it less and less of the hologram shows a point.
glm::dvec2 field_m(const HologramSpec& hologram, double wavelength_m, double z_m);

/// "14.4 x 8.1 mm", of half sides.
std::string sides_text(glm::dvec2 half_m);

/// One line where surfaces lie beyond what a laser reaches, while others show them; else empty.
std::string colour_warning(const std::vector<Scene>& scenes, const World& world);

/// What the report of a render in colour says of its lasers.
struct ReportedLasers {
  LaserSet lasers;
  std::vector<LaserFiles> files;
  std::vector<double> powers;  // as in Rendered
  LaserBench bench;

  /// Factor of the light that a hologram shows, so that it is 1 for all lasers where it is white.
  double gain(std::size_t laser) const { return powers[laser] / lasers.white_powers[laser]; }
};

/// Empty where the report is of one wavelength.
/// throws  InputError when the file is missing or damaged
std::optional<ReportedLasers> lasers_of_report(const std::filesystem::path& report);

/// Pitch, wavelength and resolution of a hologram from the report.json beside it.
/// file    a picture or field beside a report of several lasers, which tells the laser
/// throws  InputError when the report is missing or damaged
HologramSpec hologram_of_report(const std::filesystem::path& report,
                                const std::filesystem::path& file = {});

/// The viewer of the scene, from the same; without a report, and in those of earlier versions,
/// there is no eyepiece.
ViewerSpec viewer_of_report(const std::filesystem::path& report,
                            const std::filesystem::path& file = {});

/// What `raywave plan --json` says of a laser's hologram.
Json json_of(const Prediction& prediction);

// The description of a device in reports.

Json json_of(const cl::WorkShape& shape);
Json json_of(const cl::DeviceInfo& device);

// The SLM in report.json: what the pictures beside it were made for.

/// The SLM of a report.
///
/// file    a picture or field beside a report of several lasers, which tells the laser
/// throws  InputError when the report is missing or damaged, or the flatness picture is gone
SlmSpec slm_of_report(const std::filesystem::path& report, const std::filesystem::path& file = {});

}  // namespace raywave
