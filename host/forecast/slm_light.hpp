// SPDX-License-Identifier: Apache-2.0
/// Where light goes behind the SLM: what of the scene's light its stop passes, and where the light
/// falls that the SLM leaves undiffracted.
#pragma once

#include <vector>

#include "host/common/npy.hpp"
#include "host/plan/front_view.hpp"

namespace raywave {

/// What a source's size and spectrum take from a picture.
struct SourceBlur {
  double disc_m = 0;   // diameter of the disc that a point is spread over
  double smear_m = 0;  // full width at half maximum of what a spectrum moves an edge's light by
  double speckle = 1;  // contrast of speckle over that by a laser
};

/// The blur at a distance of the hologram.
///
/// speckle  by the pictures' mutual coherence, for an even hologram and places near the axis
/// source   Goodman, Speckle Phenomena in Optics, 2nd ed., 5.2 and 5.3
SourceBlur source_blur(const SourceSpread& source, glm::dvec2 window_m, double wavelength_m,
                       double z_m);

struct SlmLight {
  // Share of the light that the pixels can show that passes slm.stop
  double through_stop = 1;
  // A stop around slm.stop_centre that passes all of it, of all lasers, as a share of the band per
  // axis
  glm::dvec2 open_stop{0, 0};
  // The zero order in the plane z_m, the scene's middle: centre and size of where it falls,
  // relative to the picture, whose own place slm.carrier and slm.shift set
  double z_m = 0;
  glm::dvec2 zero_order_m{0, 0}, zero_order_size_m{0, 0};
  bool zero_order_stopped = false;  // slm.stop keeps it away
  double on_picture = 0;            // share of the picture's light that it falls onto
  // Share of the laser's light that slm.carrier and slm.shift make too steep, where most of it is
  double beyond_band = 0;
  // The slm.shift that brings the pictures of all lasers beside the zero order with the least loss,
  // and what each laser's picture loses, which gets too steep for the pixels; zero: some laser's
  // loses more than most_lost_beside
  glm::dvec2 beside_m{0, 0};
  std::vector<double> beside_lost;
  // Of an SLM and light that are not ideal. Share of a Gaussian beam that falls onto the hologram;
  // least light on a pixel, over the mean
  double on_hologram = 1, darkest = 1;
  // Share of the light that pixels of slm.fill send straight on in the picture's order, and of that
  // what they send to the place of the scene that gets least
  double in_order = 1, at_edge = 1;
  SourceBlur source;  // at z_m
};

/// Share of what pixels of slm.fill send in the picture's order that reaches a place of the scene:
/// sinc^2 of its direction, beside the carrier's; 1 without slm.fill.
double fall_off(const Plan& plan, glm::dvec2 at_m, double z_m);

inline constexpr double most_lost_beside = 0.25;

/// wavelengths_m  of all lasers that `open_stop` and `beside_m` serve; the plan's when there are
///                none
SlmLight slm_light(const Plan& plan, const FrontView& view, std::vector<double> wavelengths_m = {});

}  // namespace raywave
