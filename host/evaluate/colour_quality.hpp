// SPDX-License-Identifier: Apache-2.0
/// The accuracy of the holograms of three lasers: what the SLM shows in turn, in sRGB, compared
/// with the pictures of an ideal lens (host/evaluate/quality.hpp is for one wavelength).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "host/evaluate/quality.hpp"
#include "host/render.hpp"
#include "host/view/colour_picture.hpp"

namespace raywave {

/// One depth and view. Picture A is the lens, picture B the holograms. Figures of luminances are in
/// the domain of sRGB.
struct ColourQualityRow {
  std::string view;  // as of QualityRow
  double z_m = 0;
  ColourComparison figures;        // of the levels, each laser with its power
  ColourComparison field_figures;  // of the complex fields
  RgbPicture lens, hologram;       // blurred, without the border; hologram times scale
};

struct ColourQualityResult {
  Rendered render;
  glm::ivec2 picture_size{0, 0};  // pixels on the hologram's pitch, with the border
  double blur_px = 0;
  int border_px = 0;
  std::vector<ColourQualityRow> rows;     // as of QualityResult
  std::map<std::string, double> seconds;  // render, reconstruct, lens
};

/// Renders the scenes of load_scenes, and compares what the SLM shows with lens_picture. A common
/// factor of the brightness does not count, one of a colour does.
///
/// how     of the rendering; its progress is called for all steps
/// throws  InputError for the scene or impossible pictures, and for QualitySpec::against_points;
///         DeviceError for the device
ColourQualityResult assess_colours(const cl::Device& device, const std::vector<Scene>& scenes,
                                   const World& world, const RenderOptions& how,
                                   const QualitySpec& what = {});

/// Rows as in the result; columns: lens, hologram, difference of the luminances. As contact_sheet.
ColourPicture contact_sheet(const ColourQualityResult& result);

/// All figures as JSON, with report_json as "render".
nlohmann::ordered_json colour_quality_json(const std::vector<Scene>& scenes,
                                           const ColourQualityResult& result,
                                           const cl::DeviceInfo& device, const RenderOptions& how,
                                           const QualitySpec& what);

}  // namespace raywave
