// SPDX-License-Identifier: Apache-2.0
/// The accuracy of a scene's hologram: what the SLM shows at several depths and through several of
/// its parts, compared with the pictures of an ideal lens.
///
/// Levels are judged, as they are sent to the SLM, behind its optics (host/encode/shown.hpp). The
/// complex field, which no SLM shows, stands beside them. Holograms of several lasers are judged by
/// the picture that they show in turn, in sRGB.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/vec2.hpp>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "host/common/json.hpp"
#include "host/forecast/judged_pictures.hpp"
#include "host/render.hpp"
#include "host/view/colour_picture.hpp"

namespace raywave {

struct QualitySpec {
  // Looked at through the whole hologram; empty: quality_depths_m
  std::vector<double> depths_m;
  // Looked at through each of these, at every depth, in place of the whole hologram
  std::vector<Pupil> pupils{};
  // At the first depth also through four quarters of the hologram: left, right, top, bottom; not
  // with pupils
  bool views = true;
  std::optional<PictureWindow> window;  // empty: quality_window
  // Standard deviation of the Gaussian before comparing; empty: 0.6 of sampling.pitch
  std::optional<double> blur_m;
  int border_px = picture_border_px;  // left out on every side after the blur
  // Pictures have pixels of so many of the hologram's, before the blur: faster
  int square_px = 1;
  bool field = true;    // also judge the complex field
  int lens_points = 6;  // per axis, of the lens that rays start from; 12: within 0.1 dB
  // Also compare the first frame's fields with those of Method::points
  bool against_points = false;
  // Called before the first picture with the seconds that all are predicted to take, when given
  std::function<void(double seconds)> begins = {};
  // Called with the number of the lens's pictures that are seen, the share of the one at work
  // included, and that of all, when given
  std::function<void(double seen, double all)> lens_progress = {};
};

/// A part of the hologram: view and aperture of ReconstructSpec. Left and right are the viewer's.
struct QualityView {
  const char* name;
  glm::dvec2 centre, aperture;
  std::optional<Pupil> pupil{};  // it is the whole hologram that is seen through it
};
inline const QualityView whole_view{"whole", {0, 0}, {1, 1}};
inline const std::array<QualityView, 4> side_views{{{"left", {0.5, 0}, {0.5, 0.5}},
                                                    {"right", {-0.5, 0}, {0.5, 0.5}},
                                                    {"top", {0, 0.5}, {0.5, 0.5}},
                                                    {"bottom", {0, -0.5}, {0.5, 0.5}}}};

/// One depth and view. In `figures`, picture A is the lens and picture B the hologram. Pictures are
/// blurred, without the border, and made smaller for the contact sheet; they have one channel, or
/// of several lasers linear red, green and blue.
struct QualityRow {
  std::string view;  // "whole", "left", "right", "top", "bottom" or "pupil"
  std::optional<Pupil> pupil{};
  double z_m = 0;
  // Of the levels, each laser with its power, and of the complex fields. Of one laser, `luminance`
  // is of its intensities, and there are no colours to differ; of several, it is in the domain of
  // sRGB
  ColourComparison figures, field_figures;
  // Share of the light on the SLM that falls into the picture: the rectangle around what the lens
  // sees brighter than a hundredth of its brightest; mean of the lasers
  double light_share = 0;
  // Mean of the hologram where the lens sees less than a thousandth of its brightest, in units of
  // that, of luminances; empty where there are no such pixels
  std::optional<double> haze;
  std::vector<Image> lens, hologram;  // radiance; hologram times scale
  Image difference;                   // hologram less lens, in the domain of the figures
};

/// Pictures of the lens, one for each row and laser, that several holograms of one scene share:
/// filled when empty, otherwise used as given.
using LensPictures = std::vector<std::vector<Image>>;

struct QualityResult {
  Rendered render;
  glm::ivec2 picture_size{0, 0};  // pixels on the hologram's pitch, with the border
  PictureWindow window;
  double blur_px = 0;
  int border_px = 0;
  std::vector<QualityRow> rows;  // depths in the order given, then views
  // Share of the SLM's light in the wave that was wanted: squared correlation of the light behind
  // the SLM with the field, mean of frames and lasers
  double wanted_share = 0;
  std::optional<FieldComparison> against_points;
  std::map<std::string, double> seconds;  // render, reconstruct, lens, points
};

/// Renders the scenes of all lasers, reconstructs what the SLM shows (intensity averaged over
/// frames) and compares it with lens_picture. A common factor of the brightness does not count.
///
/// how     of the rendering; its progress is called for all steps
/// throws  InputError for the scene or impossible pictures, DeviceError for the device
QualityResult assess(const cl::Device& device, const std::vector<Scene>& scenes, const World& world,
                     const RenderOptions& how = {}, const QualitySpec& what = {});

/// Assesses holograms that were rendered before, with their fields, against the scenes that they
/// should show.
QualityResult assess(const cl::Device& device, const std::vector<Scene>& scenes, const World& world,
                     Rendered rendered, const RenderOptions& how, const QualitySpec& what,
                     LensPictures& lens);

/// Assesses the first n frames of the holograms for every n of `frame_counts`, in ascending order.
/// Every frame is reconstructed once. Each result lacks `render`, and its seconds are those spent
/// since the result before it.
std::vector<QualityResult> assess_frames(const cl::Device& device, const std::vector<Scene>& scenes,
                                         const World& world, const Rendered& rendered,
                                         const std::vector<int>& frame_counts,
                                         const RenderOptions& how, const QualitySpec& what,
                                         LensPictures& lens);

/// Compares the first frame's fields of holograms with those of Method::points; means of the
/// lasers.
FieldComparison compare_with_points(const cl::Device& device, const std::vector<Scene>& scenes,
                                    const World& world, const Rendered& rendered,
                                    const RenderOptions& how);

/// Seconds of each stage, wall or processor, of all lasers together.
std::map<std::string, double> sum_of_stages(const std::vector<RenderResult>& lasers,
                                            std::map<std::string, double> RenderResult::*seconds);

/// 8-bit RGB, interleaved.
struct Sheet {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;
};

// Widest cell: larger pictures are averaged over squares of whole pixels
constexpr int sheet_cell_px = 640;
constexpr int sheet_gap_px = 4;  // grey, between cells
constexpr double sheet_full_difference = 0.25;

/// Pictures by row and column, all of one size, with grey between them; sRGB, with one exposure for
/// all: 99.5 % of the pixels stay below white. Pictures wider than `cell_px` are averaged over
/// squares of whole pixels.
///
/// rows          each picture has one channel, or linear red, green and blue, in the hologram's
///               frame; the sheet shows them in `frame`
/// free_columns  left grey, on the right
Sheet picture_sheet(const std::vector<std::vector<std::vector<Image>>>& rows,
                    Frame frame = Frame::eye, int cell_px = sheet_cell_px, int free_columns = 0,
                    double* white = nullptr);

/// Rows as in the result; columns: lens, hologram, difference. One exposure serves all rows: 99.5 %
/// of the pixels of lens and hologram stay below white. The difference is red where the hologram is
/// brighter, blue where it is darker, full at sheet_full_difference of white.
Sheet contact_sheet(const QualityResult& result, Frame frame = Frame::eye);

/// What compared fields and the colours of compared pictures have in all reports.
Json json_of(const FieldComparison& figures);
Json json_of(const PictureWindow& window);
Json json_of(const Pupil& pupil);
/// "4 mm at 1 mm, 0 mm"
std::string pupil_text(const Pupil& pupil, Frame frame);
Json delta_e_json(const ColourComparison& figures);

/// All figures as JSON, with report_json as "render".
Json quality_json(const std::vector<Scene>& scenes, const QualityResult& result,
                  const cl::DeviceInfo& device, const RenderOptions& how, const QualitySpec& what);

}  // namespace raywave
