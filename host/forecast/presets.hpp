// SPDX-License-Identifier: Apache-2.0
/// From scene, device figures and goal to what is computed: values that the scene leaves open are
/// chosen, and what to expect is predicted. A pure function, printed by `raywave plan` and followed
/// by `raywave render`. docs/planning.md explains how it decides.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "host/common/choices.hpp"
#include "host/forecast/candidates.hpp"
#include "host/forecast/eye.hpp"
#include "host/forecast/slm_light.hpp"
#include "host/planning/memory_needs.hpp"

namespace raywave {

/// What the user aims at. At most one; none: whatever the scene leaves open keeps its default.
struct Goal {
  std::optional<Preset> preset;
  // Time of a picture, from its samples to its levels: the most accurate choice that keeps it
  std::optional<double> budget_s;
  std::optional<double> psnr_db;  // mean PSNR of its pictures: the fastest choice that reaches it
  // Pictures a second: the most accurate choice that this device computes, and slm.rate shows, so
  // fast
  std::optional<double> rate_per_s{};

  bool any() const { return preset || budget_s || psnr_db || rate_per_s; }
  int count() const {
    return preset.has_value() + budget_s.has_value() + psnr_db.has_value() + rate_per_s.has_value();
  }
  /// That a picture may take.
  std::optional<double> time_s() const {
    return rate_per_s ? std::optional(1 / *rate_per_s) : budget_s;
  }
};

struct Prediction {
  PredictedTimes times;
  // What the first picture takes besides; kernels_s is empty where nothing is known
  double meshes_and_trees_s = 0;
  std::optional<double> kernels_s{};
  double files_s = 0;               // to write the levels' PNG files
  std::string device;               // that is meant; empty: none is known
  std::string rates_of;             // the device that they were measured on
  bool are_rates_measured = false;  // DeviceRates::is_measured
  Work work;
  // Peaks: on the device; resident in the host's memory, that of the device included where
  // MemoryLimits::device_on_host
  std::uint64_t device_bytes = 0, host_bytes = 0;
  bool device_on_host = true;
  std::optional<PicturePrediction> pictures;  // of aimed sampling
  SlmLight slm_light;
  std::optional<EyeView> eye{};  // has_pupil
  double resolution_m = 0;       // detail that they are judged at
  // Relative L2, of cone, padding and phases
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

/// What the render to come keeps (MemoryUse).
struct KeptResults {
  bool field = true, by_tile = false;
};

/// The largest Cone::field_error that a goal accepts.
double largest_cone_error(const Goal& goal);

/// Number of the laser that goals are planned for: the longest wavelength.
std::size_t planned_laser(const std::vector<Scene>& scenes);

/// Chooses what the scenes of the lasers leave open, as the goal says, and predicts what to expect.
/// What is chosen for the longest wavelength, which shows most, is for the others too; a time is
/// for all of them together. Pictures that the machine cannot hold get a warning and no choice.
///
/// throws  InputError as make_plan, and for a goal that nothing can be predicted for (sampling.mode
///         "fan")
std::vector<Planned> plan_scenes(const std::vector<Scene>& scenes, const World& world,
                                 const DeviceFigures& device, const Goal& goal = {},
                                 KeptResults kept = {});

/// What the user should know before this plan is computed.
///
/// planned  of a goal, by laser; where there is none, warnings_of the plan
std::vector<std::string> render_warnings(const std::vector<Planned>& planned, const Scene& scene,
                                         const World& world, const Plan& plan);

}  // namespace raywave
