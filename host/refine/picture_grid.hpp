// SPDX-License-Identifier: Apache-2.0
/// Where the pictures of a refinement have their pixels, and how they are blurred: everything about
/// a key (a depth and an aperture) that needs no device.
#pragma once

#include <complex>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "host/common/npy.hpp"
#include "host/plan/key_places.hpp"
#include "host/scene/read_data.hpp"
#include "host/trace/sample_light.hpp"

namespace raywave::refinement {

using Propagation = KeyPropagation;

/// How the SLM shows what is refined; by default as it is.
struct Showing {
  std::shared_ptr<const std::vector<float>> beam{};  // amplitudes_of; null: even
  std::optional<glm::dvec2> fill{};                  // SlmSpec::fill
  glm::dvec2 carrier{0, 0};                          // cycles per pixel
  SourceSpread source{};
};

/// The hologram that is refined, and how its light is propagated.
struct Optics {
  glm::ivec2 size{1, 1};  // pixels
  glm::dvec2 pitch_m{1, 1};
  double wavelength_m = 1;
  double blur_m = 0;  // standard deviation of the Gaussian that pictures are compared after
  double padding =
      refine_padding;  // sides of pictures over those of the open part; the exact ones need none
  Showing showing{};
  glm::ivec2 pupil_plane{0, 0};  // samples of the pupil's plane, for keys with a pupil
};

/// A picture that the hologram should show: radiance around the axis, as lens_picture makes it, or
/// light of samples. Keys of one round follow each other and open different parts of the hologram;
/// an iteration takes a round.
struct Key {
  double z_m = 0.1;           // plane in focus: > 0 beyond the hologram, < 0 before it
  glm::dvec2 view{0, 0};      // centre of the open part of the hologram, in half holograms
  glm::dvec2 aperture{1, 1};  // its size in holograms
  Image picture{};            // nothing is known beyond its edges
  glm::dvec2 pixel_m{1, 1};   // pixel of the picture
  int times = 1;              // how often it is drawn in each round
  // Pixels are means over their area (LensSpec::area), which blurs by itself; else they are samples
  bool area = false;
  int round = 0;
  // Instead of a picture: the samples, whose light is asked for in a window
  std::shared_ptr<const SampleLight> samples{};
  glm::dvec2 sample_window_m{0, 0};
  std::optional<Pupil> pupil{};  // KeyPlace::pupil
  bool is_disc = false;          // the pupil's own, in the part; refinement takes all of a part

  glm::dvec2 window_m() const {
    return samples ? sample_window_m : glm::dvec2(picture.width, picture.height) * pixel_m;
  }
};

/// The rectangle of hologram pixels that an aperture leaves open.
struct OpenPart {
  glm::ivec2 first{0, 0}, size{0, 0};
};

/// The same pixels as in reconstruct. Size 0 where the aperture misses the hologram.
OpenPart open_part(glm::ivec2 hologram, glm::dvec2 view, glm::dvec2 aperture);

/// Samples of the plane that a key's picture is computed on, and the part of it that is compared.
struct PictureGrid {
  Propagation propagation = Propagation::fresnel;
  double z_m = 0.1;  // from the hologram on; with a pupil as of Key
  float side = 1;    // -1: before the hologram, where its conjugate's light is as beyond it
  OpenPart open;     // of the hologram, or of the pupil's plane
  std::optional<Pupil> pupil{};
  bool is_disc = false;
  double distance_m = 0.1;    // light of the open part is as steep as its width over this
  SpectrumPlanes spectrum{};  // where it is propagated over one
  int slot = 0;               // the key's number in its round: its plane in memory
  glm::ivec2 size{1, 1};      // samples of the plane; x is a multiple of packet
  glm::dvec2 pixel_m{1, 1};
  glm::dvec2 middle_m{0, 0};  // of the plane, right of the axis and above it
  // Pixels that the picture covers, widened to whole packets in x
  glm::ivec2 region_first{0, 0}, region_size{0, 0};
  glm::ivec2 known_first{0, 0}, known_size{0, 0};  // the same, not widened
  // Weights of the blur at 0, 1, ..., per axis, widened by the source's; both sides sum to 1
  std::vector<float> weights_x, weights_y;
  // The same for light of samples, which blurs away their dots as well
  std::vector<float> sample_weights_x, sample_weights_y;
  // Intensity on the plane per radiance, up to a factor that all keys share: times |transform|^2
  // it gives numbers that are proportional to the key's picture
  double unit = 1;

  int radius_x() const { return static_cast<int>(weights_x.size()) - 1; }
  int radius_y() const { return static_cast<int>(weights_y.size()) - 1; }
  int margin_x() const { return (radius_x() + packet - 1) / packet * packet; }
  glm::ivec2 wide_size() const { return region_size + 2 * glm::ivec2(margin_x(), radius_y()); }
  /// Place of a pixel right of, and above, the axis.
  double x_m(int column) const { return middle_m.x + (column - (size.x - 1) / 2.0) * pixel_m.x; }
  double y_m(int row) const { return middle_m.y + ((size.y - 1) / 2.0 - row) * pixel_m.y; }

  static constexpr int packet = 16;  // samples: whole vectors on every device
};

inline std::size_t count_of(int n) { return static_cast<std::size_t>(n); }
inline int whole_packets(int n) {
  return (n + PictureGrid::packet - 1) / PictureGrid::packet * PictureGrid::packet;
}

/// Samples of the pupil's plane: the hologram's Fourier transform, wide enough that light of no
/// part wraps around in the keys' pictures. 0 where no key has a pupil.
glm::ivec2 pupil_plane_size(const Optics& optics, std::span<const Key> keys);

/// throws  InputError when z, the aperture or the window is not possible
PictureGrid picture_grid(const Optics& optics, const Key& key, Propagation propagation);

/// Part of a line of `all` samples, of which `count` from number `first` on are open, `step` of a
/// sample apart.
struct OpenLine {
  int all;
  double first;
  int count;
  double step = 1;
};

/// The chirp before a transform: `curve` turns times the square of a sample's place, counted from
/// the line's middle, and `slope` turns from sample to sample, which put the axis in the middle of
/// the transform; zeros follow up to whole packets. Only these few numbers need more than a float's
/// digits.
std::vector<std::complex<float>> chirp(const OpenLine& line, double curve, double slope,
                                       double factor = 1);

/// Turns from sample to sample that put the middle of a transform of n at its frequency zero.
double to_middle(int n);

/// The chirp of a key along one axis: of a Fresnel propagation from a plane z away to the hologram,
/// conjugated, or of the hologram's transform to that plane.
std::vector<std::complex<float>> chirp_of(const Optics& optics, const PictureGrid& grid, int axis);

/// The key's picture at the pixels of the region, blurred in the same step; negative where it is
/// not known. Row by row from the top.
std::vector<float> blurred_target(const Optics& optics, const Key& key, const PictureGrid& grid);

/// Divides a picture by what pixels that are no points leave of its light, so that it asks for
/// more where they show less. The light's angle is taken as spread evenly over the open part.
///
/// first, size  the pixels of the plane that it has, row by row
void ask_for_more(const Optics& optics, const PictureGrid& grid, glm::ivec2 first, glm::ivec2 size,
                  std::vector<float>& picture);

/// The key's picture, blurred, on other pixels around the axis.
Image blurred_picture(const Key& key, double blur_m, glm::ivec2 size, glm::dvec2 pixel_m);

}  // namespace raywave::refinement
