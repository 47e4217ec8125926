// SPDX-License-Identifier: Apache-2.0
/// How true a scene's hologram is: what it shows at several depths and through several of its
/// parts, beside what a lens sees there.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/plan/judged_pictures.hpp"
#include "host/render.hpp"
#include "host/view/compare.hpp"

namespace raywave {

struct QualitySpec {
  // Looked at through the whole hologram; empty: quality_depths_m
  std::vector<double> depths_m;
  // At the first depth also through four quarters of the hologram: left, right, top, bottom
  bool views = true;
  // Size of the pictures around the axis; empty: the hologram's times the grid of WRPs
  std::optional<glm::dvec2> window_m;
  // Standard deviation of the Gaussian before comparing; empty: 0.6 of sampling.pitch
  std::optional<double> blur_m;
  int border_px = picture_border_px;  // left out on every side after the blur
  // Pictures are averaged over squares of so many pixels before the blur: faster
  int square_px = 1;
  int lens_points = 24;  // per axis, of the lens that rays start from
  // Also compare the first frame's field with that of Method::points
  bool against_points = false;
};

/// One depth and view: B of `figures` is the hologram, A the lens. Pictures are blurred, without
/// the border, and made smaller for the contact sheet.
struct QualityRow {
  std::string view;  // "whole", "left", "right", "top" or "bottom"
  double z_m = 0;
  PictureComparison figures;
  Image lens, hologram, difference;  // radiance; hologram times scale; hologram less lens
};

struct QualityResult {
  RenderResult render;
  glm::ivec2 picture_size{0, 0};  // pixels on the hologram's pitch, with the border
  double blur_px = 0;
  int border_px = 0;
  std::vector<QualityRow> rows;  // depths in the order given, then views
  std::optional<FieldComparison> against_points;
  std::map<std::string, double> seconds;  // render, reconstruct, lens, points
};

/// Renders the scene, reconstructs the hologram (intensity averaged over frames) and compares it
/// with lens_picture. A common factor of the brightness does not count.
///
/// how     of the rendering; its progress is called for all steps
/// throws  InputError for the scene or impossible pictures, DeviceError for the device
QualityResult assess(const cl::Device& device, const Scene& scene, const RenderOptions& how,
                     const QualitySpec& what = {});

/// The same for a hologram that was rendered before, with the scene that it should show.
QualityResult assess(const cl::Device& device, const Scene& scene, RenderResult rendered,
                     const RenderOptions& how, const QualitySpec& what = {});

/// The same, of a world that is there already.
///
/// lens  what the lens sees, a picture for each row: filled when empty, else taken as it is, so
///       that several holograms of one scene need it only once
QualityResult assess(const cl::Device& device, const Scene& scene, const World& world,
                     RenderResult rendered, const RenderOptions& how, const QualitySpec& what,
                     std::vector<Image>& lens);

/// The rows of the first n frames of a hologram for every n of `frame_counts`, which ascend: a
/// result for each, without its render, whose seconds are those spent since the one before. No
/// hologram is looked at twice.
std::vector<QualityResult> assess_frames(const cl::Device& device, const Scene& scene,
                                         const World& world, const FieldStack& field,
                                         const std::vector<int>& frame_counts,
                                         const RenderOptions& how, const QualitySpec& what,
                                         std::vector<Image>& lens);

/// The first frame's field of a hologram, rendered as `how` says, with that of Method::points.
FieldComparison compare_with_points(const cl::Device& device, const Scene& scene,
                                    const World& world, const FieldStack& field,
                                    const RenderOptions& how);

/// Means over squares of `side` whole pixels, or what is left of them at the right and below.
Image averaged(const Image& image, int side);

/// 8-bit RGB, interleaved.
struct ColourPicture {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

// Widest cell: larger pictures are averaged over squares of whole pixels
constexpr int sheet_cell_px = 640;
constexpr int sheet_gap_px = 4;  // grey, between cells
constexpr double sheet_full_difference = 0.25;

/// Cells by row and column, all of one size, with grey between them; sRGB, with one exposure for
/// all: 99.5 % of the pixels stay below white. Pictures wider than `cell_px` are averaged over
/// squares of whole pixels.
ColourPicture grey_sheet(const std::vector<std::vector<Image>>& rows, int cell_px = sheet_cell_px,
                         double* white = nullptr);

/// Rows as in the result; columns: lens, hologram, difference. One exposure serves all rows: 99.5 %
/// of the pixels of lens and hologram stay below white. The difference is red where the hologram is
/// brighter, blue where it is darker, full at sheet_full_difference of white.
ColourPicture contact_sheet(const QualityResult& result);

/// All figures, and render_report_json as "render".
std::string quality_json(const Scene& scene, const QualityResult& result,
                         const cl::DeviceInfo& device, const RenderOptions& how,
                         const QualitySpec& what);

}  // namespace raywave
