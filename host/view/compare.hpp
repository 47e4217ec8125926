// SPDX-License-Identifier: Apache-2.0
/// Comparison of two fields or two pictures. A is the reference, B is judged against it; all sums
/// are taken in double precision. docs/quality.md gives every formula.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "host/common/choices.hpp"
#include "host/common/npy.hpp"
#include "host/scene/image.hpp"

namespace raywave {

/// Figures of each pair of frames, averaged over the frames.
struct FieldComparison {
  // |<a,b>| / (|a| |b|): 1 when B is A times a number, 0 when they have nothing in common
  double correlation = 0;
  double error = 0;         // |b - a| / |a|
  double error_scaled = 0;  // |c b - a| / |a| with the complex number c that makes it smallest
  double energy_ratio = 0;  // |b|^2 / |a|^2
  Image difference;         // |c b - a| of each sample, rms over frames
};

/// throws  InputError when the sizes or numbers of frames differ, or a frame is zero everywhere
FieldComparison compare_fields(const FieldStack& a, const FieldStack& b);

/// A rectangle of pixels; (0, 0) is the top left one.
struct Region {
  int x = 0, y = 0, width = 0, height = 0;
};

struct PictureOptions {
  // Standard deviation of the Gaussian that both pictures are blurred with first
  double blur_px = 0;
  int border_px = 0;  // left out on every side after the blur
  // Where the speckle contrast is taken, in the whole picture; empty: all within the border
  std::optional<Region> region;
  Domain domain = Domain::intensity;  // domain of PSNR, SSIM, scale and difference
  bool flip = true;                   // FLIP, too
};

struct PictureComparison {
  // 10 log10(max(a)^2 / mean((scale b - a)^2)); infinite when B is A times a number
  double psnr_db = 0;
  // Mean structural similarity of a and scale b, 1 when they are equal
  double ssim = 0;
  // Mean FLIP of a and scale b as intensities on a screen, max(a) as white; of pictures in colour,
  // of their colours, the brightest luminance of a as white
  double flip = 0;
  double scale = 0;  // least-squares scale of B to A
  // Speckle contrast, of intensities: standard deviation over mean, 1 for fully developed speckle,
  // 1 / sqrt(n) for the sum of n independent such patterns
  double contrast_a = 0, contrast_b = 0;
  Image difference;  // scale b - a, without the border
};

/// Compares pictures of linear values (intensities) after the blur; a common factor of the
/// brightness does not count. For sRGB, whose curve is no power, B is first scaled to A as
/// intensities; what is then brighter than max(a) is white.
///
/// throws  InputError when the sizes differ, a picture or the region is black, nothing lies within
///         the border, the region reaches beyond the picture, or the blur is not possible
/// source  SSIM: Wang et al., IEEE Trans. Image Process. 13, 600 (2004): Gaussian window of 11 x
///         11, sigma 1.5, K1 = 0.01, K2 = 0.03, here with max(a) as the dynamic range
PictureComparison compare_pictures(const Image& a, const Image& b,
                                   const PictureOptions& options = {});

inline constexpr double most_blur_px = 1000;

/// Weights of a Gaussian at 0, 1, ..., radius; those of both sides sum to 1.
std::vector<double> gaussian_weights(double sigma_px, int radius);

/// Gaussian blur, cut off at 4 sigma and summing to 1; borders are mirrored with the edge pixel
/// repeated, as SciPy's 'reflect'.
///
/// sigma_px  0 to most_blur_px; below 0.125 the picture stays as it is
/// throws    InputError for any other sigma
Image blurred(const Image& image, double sigma_px);

/// Signed values as 8-bit RGB: white at 0, red at +full, blue at -full and beyond.
///
/// full  > 0, or 0 for white everywhere
std::vector<std::uint8_t> diverging_colours(const Image& values, double full);

/// The part of a picture that a region within it holds.
Image cropped(const Image& image, const Region& part);

/// The largest |value|: a `full` for which no colour is cut off.
double largest_magnitude(const Image& values);

/// A pixel for each square of `side` x `side` pixels: a mean whose weights fall off linearly to 0
/// at the middles of the next squares. A plain mean would let single bright dots, of a lattice as
/// wide as some squares, beat with them.
Image averaged(const Image& image, int side);

/// Light of the hologram's picture in the rectangle around what the lens sees brighter than a
/// hundredth of its brightest.
double light_in_picture(const Image& lens, const Image& hologram);

}  // namespace raywave
