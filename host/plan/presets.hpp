// SPDX-License-Identifier: Apache-2.0
/// From scene, device figures and goal to what is computed: values that the scene leaves open are
/// chosen, and what to expect is predicted. A pure function, printed by `raywave plan` and followed
/// by `raywave render`. docs/planning.md explains how it decides.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "host/plan/cost.hpp"
#include "host/plan/memory.hpp"
#include "host/plan/picture_model.hpp"

namespace raywave {

/// Points on a scene's curve of truth against time.
enum class Quality { draft, balanced, accurate, reference };

/// "draft", "balanced", "accurate", "reference"
/// throws  InputError for anything else
Quality quality_of(const std::string& name);
const char* name_of(Quality quality);

/// What is wanted. At most one; none: whatever the scene leaves open keeps its default.
struct Goal {
  std::optional<Quality> quality;
  // Time of a picture, from its samples to its levels: the truest that keeps it
  std::optional<double> budget_s;
  std::optional<double> psnr_db;  // mean PSNR of its pictures: the fastest that reaches it

  bool any() const { return quality || budget_s || psnr_db; }
};

struct Prediction {
  StageTimes times;
  std::string rates_of;  // the device that they were measured on, or "default"
  Work work;
  std::uint64_t device_bytes = 0;
  std::optional<PicturePrediction> pictures;  // of aimed sampling
  double resolution_m = 0;                    // detail that they are judged at
  // Relative L2, of cone, padding, oversampling and phases
  double field_error = 0;
};

struct Planned {
  Scene scene;  // with the values chosen
  Plan plan;
  Prediction prediction;
  std::vector<std::string> reasons;  // a line each: which value, why
  // a line each: what the user may not want, and what would change it
  std::vector<std::string> warnings;
};

/// Values of what the scene leaves open, as goals choose them, and what is predicted.
struct Choice {
  double pitch_m = 0, padding = 0;
  int frames = 1;
  std::optional<double> oversampling{};  // empty: all columns and rows, or what the scene gives
  int layers = 1;                        // wrp.layers
  Cone cone{};                           // sampling.cone and sampling.apodization
  double seconds = 0, psnr_db = 0;
};

/// What is tried for sampling.frames and wrp.padding.
inline constexpr std::array frames_tried{1, 2, 3, 4, 6, 8, 12, 16};
inline constexpr std::array paddings_tried{1.0, 1.125, 1.25, 1.5, 2.0};

/// What is tried for sampling.cone and sampling.apodization: all of the wave, nearly all, and a cone that
/// lets go of the hologram's rim, of which pictures have the least speckle.
inline constexpr std::array cones_tried{Cone{1.2, 0.2}, Cone{1.2, 0.3}, Cone{1.1, 0.3}};

/// The largest Cone::field_error that a goal accepts.
double largest_cone_error(const Goal& goal);

/// All that goals choose among, the coarsest pitch first.
///
/// throws  InputError as make_plan, and when nothing can be predicted (sampling.mode "fan")
std::vector<Choice> choices(const Scene& scene, const World& world, const DeviceFigures& device);

/// throws  InputError as make_plan, and for a goal that nothing can be predicted for (sampling.mode
///         "fan")
Planned plan_scene(const Scene& scene, const World& world, const DeviceFigures& device,
                   const Goal& goal = {});

/// The smallest detail of the picture that counts: the coarsest of what the viewer wants or makes
/// out (1 arc minute) and of what the hologram resolves (wavelength z / width), in the scene's
/// middle.
double wanted_resolution_m(const Scene& scene, const Plan& plan);

}  // namespace raywave
