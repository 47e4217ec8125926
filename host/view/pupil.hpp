// SPDX-License-Identifier: Apache-2.0
/// The part of a hologram's light that enters the pupil of an eye (Pupil in host/scene/scene.hpp).
#pragma once

#include <complex>
#include <glm/vec2.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "host/scene/scene.hpp"
#include "host/view/colour_picture.hpp"

namespace raywave {

/// What a hologram would show if it sent out nothing but what enters the pupil. By Fresnel's
/// integral, the field in the pupil's plane at p is, but for a phase, the Fourier transform of
///   h(x) exp(i pi a x^2 / (lambda b))
/// at p / (lambda b). Light of the SLM's own order is kept, and its replicas are left out.
class PupilFilter {
public:
  /// throws  InputError where light to the pupil is too steep for Fresnel's integral, and where the
  ///         pupil is so small that it blurs points over more than memory holds
  PupilFilter(const HologramSpec& hologram, const Pupil& pupil);
  ~PupilFilter();

  /// Samples of the filtered field, on the hologram's pitch and around its middle: the hologram and
  /// what diffraction at the pupil spreads around it.
  glm::ivec2 size() const;
  /// field  of the hologram's size
  std::vector<std::complex<float>> operator()(const std::vector<std::complex<float>>& field);

private:
  struct Work;
  std::unique_ptr<Work> work_;
};

/// Share of a sample of the pupil's plane that the pupil covers; its edge counts as straight there.
///
/// at_m    the sample's place, right of the axis and above it
/// step_m  from a sample to the next; of any sign
double open_share(const Pupil& pupil, glm::dvec2 at_m, glm::dvec2 step_m);

/// What to look through, one after another; {empty}: the whole hologram. Where nothing is given,
/// the viewer's pupils behind an eyepiece, unless a part of the hologram is looked through.
///
/// given   "scene", "none", "3mm", "3mm@1mm,0" or "scene@1mm,0"
/// frame   that places in them count in
/// what    names them in messages, "--pupil"
/// throws  InputError where one cannot be understood
std::vector<std::optional<Pupil>> pupils_asked(const std::vector<std::string>& given,
                                               const ViewerSpec& viewer, Frame frame, bool is_part,
                                               const std::string& what);

}  // namespace raywave
