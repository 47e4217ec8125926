// SPDX-License-Identifier: Apache-2.0
/// The pipeline: scene -> plan -> trace -> propagate -> encode.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "host/npy.hpp"
#include "host/plan.hpp"
#include "host/scene.hpp"

namespace raywave {

/// Called with what is going on ("trace", "WRP 2 of 4") and the share done, 0 to 1.
using Progress = std::function<void(const std::string& what, double share)>;

struct RenderOptions {
  Method method = Method::wrp;
  int rays_per_axis = 100;  // of Method::rays
  cl::FftBackend fft = cl::FftBackend::host;
  bool keep_wrps = false;  // also return the fields on the WRPs
  Progress progress;
};

struct RenderResult {
  Plan plan;
  FieldStack field;                               // at the hologram, one per frame
  std::vector<std::vector<std::uint8_t>> levels;  // of the SLM, one per frame
  std::vector<FieldStack> wrps;                   // one per WRP, when asked for
  int samples = 0;                                // surface samples (sampling.mode "aimed")
  int hidden_samples = 0;                         // those that need visibility rays
  std::vector<std::string> notes;                 // what the user should know of the result, a line each
  std::map<std::string, double> seconds;          // of each stage: meshes, tree, prepare, samples, trace, propagate, encode
  std::uint64_t device_peak_bytes = 0;
};

/// Computes the holograms of a scene: for every frame, traces each WRP, carries it to the hologram and adds it there, and encodes the phase
/// of the sum. Fields stay on the device from the first ray to the last level. Frames differ in their random phases only.
///
/// Bit-identical for the same scene, seed and device.
/// throws  InputError for the scene, DeviceError for the device
RenderResult render(const cl::Device& device, const Scene& scene, const RenderOptions& options = {});

}  // namespace raywave
