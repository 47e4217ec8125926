// SPDX-License-Identifier: Apache-2.0
/// The picture that a hologram shows: numerical propagation to any distance and window, as a camera
/// sensor at that depth would see it.
#pragma once

#include <functional>
#include <glm/vec2.hpp>
#include <optional>
#include <vector>

#include "cl/fft.hpp"
#include "host/common/npy.hpp"
#include "host/scene/image.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

struct ReconstructSpec {
  double z_m = 0.1;  // distance of the plane looked at: > 0 beyond the hologram, < 0 before it,
                     // 0 its own
  std::optional<glm::dvec2> window_m;  // size of the picture; empty: the hologram's
  // Centre of the part of the hologram that lets light through, in half holograms: (-1, -1) bottom
  // left to (1, 1) top right
  glm::dvec2 view{0, 0};
  glm::dvec2 aperture{1, 1};  // size of that part in holograms; 1 is all of it
  double padding = 2;
  // Of the light of that part, what enters the pupil of an eye; empty: all
  std::optional<Pupil> pupil{};
  glm::dvec2 centre_m{0, 0};  // of the picture: x and y of the scene
};

/// Standard deviation, in the plane z_m, of the Gaussian that leaves what the viewer makes out.
double eye_blur_m(const ViewerSpec& viewer, double z_m);

/// Samples per side of a picture: the window in whole pitches, rounded to nearest, at least one;
/// the hologram's when empty.
///
/// throws  InputError when a side is not > 0 or there would be more than 1e9 samples, or 1e6 on a
///         side
glm::ivec2 picture_size(const std::optional<glm::dvec2>& window_m, glm::ivec2 hologram_size,
                        glm::dvec2 pitch_m);

/// True when sample i of n, at (2 i + 1) / n - 1 in half holograms, lies in the part that lets
/// light through. Along y, i and `centre` count downwards.
bool lets_through(int i, int n, double centre, double size);

/// A part of the window that one propagation covers. Its size is the hologram's; columns x rows of
/// it lie in the window.
struct WindowTile {
  glm::ivec2 first{0, 0}, used{0, 0};
  glm::dvec2 centre_m{0, 0};
};

/// The tiles that cover a window of so many samples around the axis.
std::vector<WindowTile> tiles_of(glm::ivec2 window, glm::ivec2 size, glm::dvec2 pitch_m);

/// Intensity (|u|^2 averaged over frames) on the hologram's pitch; the window is a whole number of
/// samples. Windows larger than the hologram are put together from tiles, each a shifted
/// propagation of its own; tiles that no light of the hologram reaches stay black. A hologram whose
/// padded plane does not fit into the device's memory is propagated in pieces.
///
/// FieldStack::source adds up what light of other directions and colours shows: the picture is the
/// mean over a disc of the source's size times |z|, and over colours of the spectrum, at most 129.
/// The hologram is the same in all of them.
///
/// progress  called with 0..1 when given
/// throws    InputError when z, window, view or aperture are not possible
Image reconstruct(const cl::Device& device, cl::FftBackend backend, const FieldStack& hologram,
                  const HologramSpec& spec, const ReconstructSpec& what,
                  const std::function<void(double)>& progress = {});

}  // namespace raywave
