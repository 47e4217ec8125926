// SPDX-License-Identifier: Apache-2.0
/// How true the pictures of a hologram will be, before it is computed. docs/planning.md gives the terms and compares them with
/// measurements.
#pragma once

#include <vector>

#include "host/planning/front_view.hpp"

namespace raywave {

/// One depth that is looked at, as `raywave quality` does, after the blur. Squares are means over the picture, in squares of the brightest
/// point that a lens sees.
struct PictureRow {
  double z_m = 0;
  double light = 0;    // mean square of the lens's picture
  double missing = 0;  // mean square of what hologram and WRPs cannot show: light too steep for the pixels or beyond the planes
  double edges_m = 0;  // length of the edges of front surfaces and textures, times the square of their step, over the picture's area: 1/m
};

/// Share, along one axis, of the hologram's window from which the point at `x_m` in the plane z_m is seen no more steeply than the pixels
/// can show.
double share_within_pixels(const Plan& plan, int axis, double x_m, double z_m);

/// Of these, the share whose light also crosses the planned WRPs.
double share_seen(const Plan& plan, int axis, double x_m, double z_m);

struct PictureModel {
  double resolution_m = 0;  // pictures are blurred by blur_of_resolution of it
  glm::dvec2 spot_m{0, 0};  // the hologram's limit, wavelength z / width, at the scene's middle
  std::vector<PictureRow> rows;
};

/// Standard deviation of the Gaussian that stands for a viewer who resolves no more, as in `raywave quality` at sampling.pitch.
inline constexpr double blur_of_resolution = 0.6;

PictureModel picture_model(const FrontView& view, const Plan& plan, double resolution_m);

/// What a choice of samples, frames and padding makes of it.
struct PicturePrediction {
  std::vector<double> psnr_db;                                        // of each row
  double mean_psnr_db = 0;                                            // of the rows
  double dots = 0, speckle = 0, edges = 0, missing = 0, padding = 0;  // shares of the mean square error of all rows
};

/// padding_error  of the field, relative (host/plane_errors.hpp)
PicturePrediction predict_pictures(const PictureModel& model, double pitch_m, int frames, double padding_error);

}  // namespace raywave
