// SPDX-License-Identifier: Apache-2.0
/// Which depths and views a hologram is refined towards, and at what cost.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "host/plan/plan.hpp"

namespace raywave {

/// Sides of a picture's plane over those of the open part of the hologram, where rays make it.
inline constexpr double refine_padding = 1.25;

/// A depth, and the part of the hologram that looks there.
struct KeyPlace {
  double z_m = 0;
  glm::dvec2 view{0, 0}, aperture{1, 1};
  int times = 1;
  int round = 0;  // places of one round open different parts of the hologram
  // What looks, behind an eyepiece: all of it with the aperture (1, 1), else a part of its plane,
  // in eyeboxes in place of holograms. Empty: the part of the hologram
  std::optional<Pupil> pupil{};

  bool is_whole() const { return aperture == glm::dvec2(1, 1); }
  /// Sizes in the picture over those that the hologram's transform has there.
  double larger() const { return pupil ? 1 + pupil->a * z_m / pupil->b_m : 1; }
};

/// The plane whose parts show pictures: the hologram, or behind an eyepiece that of the pupil, as
/// far as the pupil's places reach.
struct PartPlane {
  std::optional<Pupil> pupil{};
  glm::dvec2 size_m{1, 1};           // of the hologram, or of the eyebox
  glm::dvec2 low{0, 0}, high{1, 1};  // what shows pictures, in its sizes from the bottom left
  // Light of a part spreads by its width over this, for each metre of depth
  double distance_m = 1;

  glm::dvec2 open_m() const { return (high - low) * size_m; }
};

/// viewer  Scene::viewer, RefineSettings::viewer
PartPlane part_plane(const Plan& plan, const ViewerSpec& viewer);

struct KeySpec {
  std::vector<double> depths_m;  // of whole pictures; empty: refine_depths_m
  int views = 0;                 // seen through quarters of the hologram
  std::uint32_t seed = 1;        // of the views' places
};

/// Depths through the scene and beyond: a picture holds what lies within some 2.4 blurs of depth
/// times distance over hologram. At least five.
std::vector<double> refine_depths_m(const Plan& plan, double blur_m);

/// The depths, those amid the scene drawn more often than the outermost, and the views: spread over
/// all places of a quarter and over the depths, one depth each.
std::vector<KeyPlace> key_places(const Plan& plan, double blur_m, const KeySpec& what);

/// Rounds of parts: each opens all of the hologram, part by part, at a depth of its own. Parts are
/// as large as the pupil, or halves of the hologram, where the blur hides what they do not resolve;
/// those of each round begin elsewhere, so that no view falls on edges alone. Behind an eyepiece
/// they are parts of the pupil's plane.
/// Of few iterations each has a depth of its own, and they come from the scene's ends inwards.
///
/// blur_m      > 0
/// iterations  per frame, >= 1
/// depths_m    in place of depths through the scene; may be empty
std::vector<KeyPlace> part_places(const Plan& plan, double blur_m, const ViewerSpec& viewer,
                                  int iterations, std::vector<double> depths_m = {});

/// Parts of the part_plane along each axis.
glm::ivec2 refine_parts(const Plan& plan, double blur_m, const ViewerSpec& viewer);

/// Depth of the scene over what the picture of a part holds.
double depth_over_held(const Plan& plan, double blur_m, const ViewerSpec& viewer);

/// Iterations per frame that so many pictures need.
int refine_iterations(const std::vector<KeyPlace>& places);

/// Iterations from which on rays to a lens are worth their time: pictures made of samples are no
/// better than the samples.
constexpr int most_paced_iterations = 12;

/// Iterations towards pictures made of samples that reach all depths of the scene: with fewer,
/// goals do not take them.
int least_paced_iterations(const Plan& plan, double blur_m, const ViewerSpec& viewer);

/// True where the scene lies beyond the hologram or before it, and not near it.
bool lies_on_one_side(const Plan& plan);

/// True where pictures made of samples show what a lens sees: there are samples, and none is seen
/// in mirrors or through glass.
bool serves_samples(const Plan& plan, const ViewerSpec& viewer);

/// True where a plan's hologram is refined towards pictures made of samples: as the scene says;
/// where it does not, with few iterations or behind an eyepiece, and without views of its own.
bool refines_samples(const Plan& plan);

/// The pictures that Plan::refine asks for.
std::vector<KeyPlace> planned_places(const Plan& plan);

/// Plan::refine's iterations per frame, or as many as its pictures need.
int planned_iterations(const Plan& plan);

/// Size of the pictures: Plan::refine's, or what the WRPs cover.
glm::dvec2 refine_window_m(const Plan& plan);

/// Columns and rows of a picture of this size: whole pixels, so that it ends where the window does.
glm::dvec2 key_pixels(const Plan& plan, glm::dvec2 window_m, double blur_m);

/// Samples of the plane of a picture through a part of a pupil's plane: all that the hologram
/// lights, in pixels that the blur does not pass over.
///
/// plane  samples of the hologram, or of the pupil's plane
glm::ivec2 samples_through_pupil(const KeyPlace& place, glm::ivec2 plane, glm::dvec2 pitch_m,
                                 double blur_m);

/// Points per axis of the lens that looks from a place.
///
/// points  of the whole hologram's
int key_lens_points(const KeyPlace& place, int points);

/// How light goes from a hologram to a picture.
enum class KeyPropagation {
  fresnel,    // one transform, padded; pixels grow with the distance
  corrected,  // the same, after the spectrum's phases have been made those of the exact one
  exact,      // angular spectrum; pixels are the hologram's
};

/// Planes of a propagation over the spectrum of an open part of a hologram: the corrected one, or
/// the exact one, of which `pixels` and `picture` are one.
struct SpectrumPlanes {
  int margin = 0;           // pixels on each side, to which the correction moves light
  glm::ivec2 open{1, 1};    // pixels, with the margins
  glm::ivec2 pixels{1, 1};  // samples of the spectrum
  // Samples between the pixels, of the same extent: so many that light that the pixels cannot show
  // folds beyond the window; and those of the open part
  glm::ivec2 finer{1, 1}, finer_open{1, 1};
  glm::ivec2 picture{1, 1};               // samples
  glm::dvec2 pixel_m{1, 1};               // from one of these to the next
  std::vector<glm::ivec2> transformed{};  // planes on the way to the picture

  /// Finer samples for each pixel.
  glm::dvec2 fine() const { return glm::dvec2(finer) / glm::dvec2(pixels); }
};

/// first, open  pixels of the hologram that are open
/// padding      sides of the picture's plane over those of the open part
SpectrumPlanes corrected_planes(glm::ivec2 size, glm::ivec2 first, glm::ivec2 open,
                                glm::dvec2 pitch_m, double wavelength_m, double z_m,
                                glm::dvec2 window_m, double padding = refine_padding);
/// Light that wraps around misses the window.
SpectrumPlanes exact_planes(glm::ivec2 size, glm::dvec2 pitch_m, double wavelength_m, double z_m,
                            glm::dvec2 window_m);
/// Those of what a place opens, to within a pixel.
///
/// propagation  corrected or exact
SpectrumPlanes spectrum_planes(KeyPropagation propagation, const KeyPlace& place, glm::ivec2 size,
                               glm::dvec2 pitch_m, double wavelength_m, glm::dvec2 window_m);

/// Cost of a look at such a picture: its transforms, and the blur of its pixels in the window.
/// Within 1.7 of the time of 17 propagations from three holograms, 6 to 105 mm away, with FFTs on
/// the host; of two ways to one picture, the cheaper one was the faster in all seven pairs.
double butterflies_of_look(const SpectrumPlanes& planes, glm::dvec2 window_m, double blur_m);

/// The fastest propagation to pictures at z_m that is good enough.
///
/// size    pixels of the hologram
/// blur_m  standard deviation after which pictures are compared
KeyPropagation key_propagation(glm::ivec2 size, glm::dvec2 pitch_m, double wavelength_m,
                               double blur_m, double z_m, glm::dvec2 window_m);

}  // namespace raywave
