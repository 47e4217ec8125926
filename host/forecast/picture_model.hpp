// SPDX-License-Identifier: Apache-2.0
/// How accurate the pictures of a hologram will be, before it is computed. docs/planning.md
/// gives the terms and compares them with measurements.
#pragma once

#include <vector>

#include "host/forecast/judged_pictures.hpp"
#include "host/plan/front_view.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

/// The surfaces at one depth, in a picture that is focused elsewhere.
struct PictureLayer {
  glm::dvec2 defocus{0, 0};  // width of a point's light there, in spots
  // Share of the picture's mean square, products with other layers included
  double share = 0;
};

/// One depth that is looked at, as `raywave quality` does, after the blur. Squares are means over
/// the picture, in squares of the brightest point that a lens sees.
struct PictureRow {
  double z_m = 0;
  double mean = 0;   // of the lens's picture, in units of its brightest point
  double light = 0;  // mean square of the lens's picture
  double sharp = 0;  // the same before the blur
  // Mean square of what hologram and WRPs cannot show: light too steep for the pixels or beyond the
  // planes
  double missing = 0;
  double uneven = 0;   // mean square of what is too bright or dark where phases alone are shown
  double fallen = 0;   // mean square of what pixels of slm.fill leave uneven
  double unshown = 0;  // share of the SLM's light, of even brightness, that lies over the picture
  double copies = 0;   // mean square of copies of the picture around the corners of the SLM's band
  double copies_on_picture = 0;  // mean of copies times the picture
  double haze = 0;  // mean square of what double phase throws over the picture, over `light`
  // Length of the edges of front surfaces and textures, times the square of their step, over the
  // picture's area: 1/m
  double edges_m = 0;
  glm::dvec2 spot_m{0, 0};  // the hologram's limit there
  double pitch = 1;         // of the samples there, over that at the scene's middle
  std::vector<PictureLayer> layers{};
};

/// Refinement at the pace of frames (docs/refine.md).
struct Pace {
  int iterations = 0;  // towards pictures made of samples; 0: there are none
  int parts = 1;       // of the hologram
  double depth = 0;    // of the scene, over what a part's picture holds
};
struct PictureModel {
  double resolution_m = 0;  // pictures are blurred by blur_of_resolution of it
  Cone cone;
  glm::dvec2 spot_m{0, 0};  // the hologram's limit at the scene's middle
  Encoding encoding = Encoding::double_phase;
  double pupil_reach = 0;   // how far pupils look beside the axis, in bands
  double pupil_radius = 0;  // of the largest, in bands; 0 where the scene is far from the hologram
  bool sees_band = false;   // all of the band is seen, of a pupil with its corners
  bool has_detail = false;  // highlights or textures, which may be smaller than cells
  bool is_even = false;     // near the hologram, phases show their even brightness
  double copies = 1;        // what the copies of rows count, where a part of the hologram is lit
  double stopped = 0;       // share of the light that slm.stop cuts off
  int refined_depths = 0;   // whole pictures that phases are refined towards; 0: they are not
  Pace pace;
  double refined_rounds = 1;  // iterations, over refine_iterations of these pictures; at most 1
  PictureWindow window;
  std::vector<PictureRow> rows;
};

/// Sets what pupils behind an eyepiece see of the SLM's band beside the picture's light.
void look_through(const std::vector<Pupil>& pupils, const Plan& plan, PictureModel& model);

/// Takes over how the plan's hologram is refined, if it is.
void set_refinement(PictureModel& model, const Plan& plan);

/// Model of the pictures that a plan's hologram shows.
PictureModel picture_model(const FrontView& view, const Plan& plan, double resolution_m);

/// Errors that the lattice of samples brings to the pictures, by row: mean squares over that of the
/// picture.
struct LatticePattern {
  double pitch_m = 0;
  std::vector<double> speckle;  // of one frame: samples interfere
  // Speckle as if every sample's wave were cut off hard at the hologram's edge
  std::vector<double> cut;
  std::vector<double> dots;  // what the blur leaves of the lattice
};
LatticePattern lattice_pattern(const PictureModel& model, double pitch_m);

/// Predicted PSNR of the pictures, and where their errors come from.
struct PicturePrediction {
  std::vector<double> psnr_db;  // of the levels, of each row
  double mean_psnr_db = 0;      // of the rows
  double field_psnr_db = 0;     // mean of the rows, of the complex field
  PictureWindow window;         // that they are of
  bool refined = false;
  bool through_pupil = false;  // behind an eyepiece
  double left_out = 0;  // mean square that is not predicted, at most: detail smaller than cells
  bool dark = false;    // no light is seen: nothing can be said of the pictures
  // Shares of the mean square error of all rows, of levels. Where phases are refined, `encoding`
  // is what they leave of the light
  double dots = 0, speckle = 0, edges = 0, missing = 0, padding = 0, encoding = 0, stop = 0,
         fall_off = 0;

  /// Pictures are hardly ever measured below this.
  double sure_db() const;
  double margin_db() const { return mean_psnr_db - sure_db(); }
};

/// padding_error  of the field, relative (host/carriers/wrps/planning/padding_errors.hpp)
PicturePrediction predict_pictures(const PictureModel& model, const LatticePattern& pattern,
                                   int frames, double padding_error);

}  // namespace raywave
