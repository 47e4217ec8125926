// SPDX-License-Identifier: Apache-2.0
/// Refinement of a hologram for a phase-only SLM: the phases change until the frames, averaged,
/// show what a lens sees.
///
/// Alternating projections in the manner of Gerchberg and Saxton, on blurred intensities. Each
/// iteration draws a key (a depth, and an aperture), or a round of keys whose apertures differ, and
/// propagates the hologram h to it. There
/// the light is multiplied by c, the root of the ratio between the blurred intensity wanted and the
/// one shown. What that adds goes back to the hologram, and h is projected to modulus 1:
/// h <- (h + a A*[(c - 1) A h]) / | |. Steps a fall linearly. Each frame corrects what the sum of
/// the frames before it lacks. docs/refine.md says what this reaches and what it costs.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "cl/fft.hpp"
#include "host/common/npy.hpp"
#include "host/encode/panel.hpp"
#include "host/plan/key_places.hpp"
#include "host/refine/picture_grid.hpp"

namespace raywave {

/// A picture that the hologram should show.
using RefineKey = refinement::Key;

struct RefineSpec {
  glm::dvec2 pitch_m{1, 1};
  double wavelength_m = 1;
  double blur_m = 0;    // pictures are compared after a Gaussian of this standard deviation
  int iterations = 28;  // per frame
  double first_step = 4, last_step = 1;  // linear in between; from 5 on pictures get worse
  // Seconds for all frames, the keys' preparation left out; it decides the iterations
  std::optional<double> budget_s;
  // Light wanted in the pictures, relative to what the start has there
  double brightness = 1;
  double padding = refine_padding;  // padding of the Fresnel propagation
  refinement::Showing showing{};
  // Shows other light than the phases (refinement::panel_to_know); null: their own
  std::shared_ptr<const Panel> panel{};
  std::uint32_t seed = 1;  // seed of the order in which rounds are drawn
  // Rounds are taken one after the other, as they come; in the order of the seed otherwise, each as
  // often as Key::times asks for
  bool in_order = false;
  // Empty: as key_propagation says
  std::optional<refinement::Propagation> propagation;
  // Called with the current step ("frame 2 of 4") and the completed share, 0 to 1
  std::function<void(const std::string& what, double share)> progress;
};

struct RefineFigures {
  int iterations = 0;     // per frame
  double transforms = 0;  // FFTs of planes per frame
  int exact_keys = 0;     // not by the Fresnel propagation alone
  double prepare_s = 0;   // targets, tables and kernels
  double loop_s = 0;      // iterations of all frames
};

struct RefineResult {
  FieldStack field;  // of `refine`: as many frames as the start's, samples of modulus 1
  // Brightness that was asked for: intensity on a plane times the square of its distance, per
  // radiance of the pictures. Holograms of one scene and size compare by it
  double brightness = 1;
  RefineFigures figures;
};

/// Refines the phases of `start`; its amplitudes do not count. A refined field may be refined
/// again.
///
/// keys     pictures in one unit of radiance, before the hologram and beyond it, or all through a
///          pupil; black ones cannot be refined towards
/// throws   InputError for keys and settings that are not possible, DeviceError for the device
/// The result is bit-identical for equal input, seed and device, unless a budget decides the
/// iterations.
RefineResult refine(const cl::Device& device, cl::FftBackend backend, const FieldStack& start,
                    std::span<const RefineKey> keys, const RefineSpec& spec);

namespace refinement {
class PhaseStack;
}

/// Refines holograms that stay on the device. What serves one picture is kept for the next.
class Refiner {
public:
  Refiner(const cl::Device& device, cl::FftBackend backend);
  ~Refiner();
  Refiner(Refiner&&) noexcept;

  /// What `run` starts from, and then its result.
  refinement::PhaseStack& holograms();
  /// As `refine`, but for the field.
  RefineResult run(std::span<const RefineKey> keys, const RefineSpec& spec);

private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Brightness of `raywave refine --brighter`: 0.93 of the light in the window instead of 0.85.
constexpr double brighter = 1.15;

}  // namespace raywave
