// SPDX-License-Identifier: Apache-2.0
/// What reports and `raywave plan` say of scenes in colour (docs/colour.md).
#pragma once

#include <array>
#include <filesystem>
#include <glm/vec2.hpp>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/forecast/presets.hpp"
#include "host/geometry/world.hpp"
#include "host/render.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// What a hologram of this wavelength shows: half sides of the field at a depth that light of all
/// its pixels reaches, >= 0. Beyond it less and less of the hologram shows a point.
glm::dvec2 field_m(const HologramSpec& hologram, double wavelength_m, double z_m);

/// The files of a laser, beside the report.
struct LaserFiles {
  std::vector<std::string> pictures;  // of its frames
  std::string field;                  // empty: none was kept
  std::string refined;                // phases of refined holograms; empty: none were kept
};

/// What reports say of the lasers.
nlohmann::ordered_json colour_json(const ColourSpec& colour);

/// "_638nm" in the names of a laser's files; "" where there is but one.
std::string laser_suffix(double wavelength_m, std::size_t lasers);

/// The files that a render writes of a laser, by name.
LaserFiles files_of_laser(const RenderResult& laser, const std::string& suffix, bool keeps_field,
                          bool keeps_refined);

/// The report of a render: that of the one laser, or the lasers, what they need, and the report of
/// each.
///
/// files  of each laser, where there are several
nlohmann::ordered_json report_json(const std::vector<Scene>& scenes, const Rendered& result,
                                   const std::vector<LaserFiles>& files,
                                   const cl::DeviceInfo& device, cl::FftBackend fft);

/// What the report of a render in colour says of its lasers.
struct ReportedLasers {
  LaserSet lasers;
  std::array<LaserFiles, 3> files;
  std::array<double, 3> powers{};  // as in Rendered

  /// Factor of the light that a hologram shows, so that it is 1 for all lasers where it is white.
  double gain(std::size_t laser) const { return powers[laser] / lasers.white_powers[laser]; }
};

/// Empty where the report is of one wavelength.
/// throws  InputError when the file is missing or damaged
std::optional<ReportedLasers> lasers_of_report(const std::filesystem::path& report);

/// The head of `raywave plan` of several lasers: what each shows, and what all need.
std::string lasers_text(const std::vector<Planned>& planned, const World& world);

/// One line where surfaces lie beyond what a laser reaches, while others show them; else empty.
std::string colour_warning(const std::vector<Scene>& scenes, const World& world);

}  // namespace raywave
