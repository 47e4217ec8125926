// SPDX-License-Identifier: Apache-2.0
/// The cost of a plan: operations, counted from the scene, and how long a device needs for them.
/// `raywave tune` measures its rates.
#pragma once

#include <string>

#include "host/carriers/virtual_planes/planning/cost.hpp"
#include "host/common/fft_backend.hpp"
#include "host/plan/memory.hpp"

namespace raywave {

// How long a device needs for each operation that planning counts (host/forecast/cost.hpp).

/// Seconds per operation, all compute units of the device together.
struct DeviceRates {
  std::string device;        // that they were measured on
  bool is_measured = false;  // on the device at hand, by `raywave tune`
  double ray_s = 0, shadow_ray_s = 0, node_s = 0, pair_s = 0, pixel_s = 0, butterfly_s = 0,
         level_s = 0;
  // Of pictures that the host makes of samples: two cores of a server processor, or the device's
  double host_butterfly_s = 0.062e-9;
};

/// Rates of PoCL on two cores of a server processor.
inline DeviceRates default_rates() {
  return {"two processor cores", false, 1e-9, 3.2e-9, 3e-9, 1.55e-9, 1.24e-9, 0.062e-9, 0.95e-9};
}

/// Rates of an NVIDIA H100 (27 November 2026).
inline DeviceRates gpu_rates() {
  return {"an H100", false, 1.8e-10, 6.9e-10, 6e-10, 1.1e-10, 8.9e-11, 1.6e-12, 8.2e-11};
}

/// Operations of one picture: all frames of a scene that has been read, from its samples to its
/// levels.
struct Work {
  double samples = 0;  // surface samples that the hologram sees
  // What finds the samples, in rays times the depth of the tree; without rays to lights
  double rays = 0;
  double shadow_rays = 0;  // to lights, times the depth of the tree
  // On virtual planes: nodes of all samples' profiles; the rest in units of these
  double nodes = 0;
  // On WRPs: pairs of a pixel and a sample far from it, or rays of fans; the rest of the gathering
  // in units of these
  double pairs = 0;
  double pixels = 0;  // of all WRPs and frames
  // In all transforms: points times the binary logarithm of their lines, as far as window and band
  // need them
  double butterflies = 0;
  double levels = 0;  // pixels of all holograms
  // Of the refinement: rays of the lens's pictures, times the depth of the tree, and butterflies of
  // its iterations
  double lens_rays = 0, refine_butterflies = 0;
  double picture_butterflies = 0;  // of the pictures that the host makes of samples
};

/// Pixels of WRPs that the front view's cells light, one sample in each. They depend neither on the
/// sampling pitch nor on the frames. Widths are rounded up to those of the gathering's tiles.
struct Footprints {
  // Pixels of plane-wave samples, and their widths and heights together
  double near_pixels = 0, near_sides = 0;
  double far_pixels = 0, far_widths = 0;      // of the others
  double shiny_pixels = 0, shiny_widths = 0;  // of these, where highlights are shaded
  Nodes on_virtual_planes;
};
Footprints footprints_of(const Plan& plan, const FrontView& view);

/// Counts the operations of all frames.
///
/// footprints  of this plan, or of one with another lattice
Work count_work(const Scene& scene, const World& world, const Plan& plan, const FrontView& view,
                const Footprints& footprints);

/// Work::butterflies, all that the padding changes.
double count_butterflies(const Plan& plan, int frames);

struct PredictedTimes {
  double samples_s = 0, trace_s = 0, propagate_s = 0, refine_s = 0, encode_s = 0;
  double total_s() const { return samples_s + trace_s + propagate_s + refine_s + encode_s; }
};

/// Time of all frames, from a coarse view: for a warning, in some milliseconds.
double predicted_s(const Scene& scene, const World& world, const Plan& plan,
                   const DeviceRates& rates);

PredictedTimes predict_times(const Work& work, const DeviceRates& rates);

// What forecasts need to know of a device. Plain values, so that they need no OpenCL;
// host/forecast/tuning.hpp fills them in.

struct DeviceFigures {
  std::string name;  // empty: none is known
  bool has_doubles = false;
  MemoryLimits memory;  // without limits where nothing is known of it
  FftBackend fft = FftBackend::host;
  DeviceRates rates = default_rates();
  std::string key;  // of platform, device and driver
  bool is_processor = false;
};

/// What pictures of an ideal lens cost.
///
/// window_m  of each picture
/// rays      of all pictures
Work lens_work(const World& world, const Plan& plan, const FrontView& view, glm::dvec2 window_m,
               double rays);

/// Adds what the iterations of Plan::refine cost.
///
/// work    whose samples are known, where pictures are made of them
/// frames  of a picture
void add_refinement(const Plan& plan, int frames, Work& work);

}  // namespace raywave
