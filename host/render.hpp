// SPDX-License-Identifier: Apache-2.0
/// The pipeline: scene -> plan -> trace -> propagate -> encode.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "cl/device.hpp"
#include "cl/fft.hpp"
#include "host/common/npy.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// Called with what is going on ("trace", "WRP 2 of 4") and the share done, 0 to 1.
using Progress = std::function<void(const std::string& what, double share)>;

struct RenderOptions {
  Method method = Method::wrp;
  int rays_per_axis = 100;  // of Method::rays
  cl::FftBackend fft = cl::FftBackend::host;
  bool keep_wrps = false;  // also return the fields on the WRPs
  bool keep_field = true;  // also return the field at the hologram, not the levels alone
  Progress progress;
};

struct RenderResult {
  Plan plan;
  // At the hologram, one per frame, when asked for
  FieldStack field;
  std::vector<std::vector<std::uint8_t>> levels;  // of the SLM, one per frame
  std::vector<FieldStack> wrps;                   // one per WRP, when asked for
  int samples = 0;                                // surface samples (sampling.mode "aimed")
  int hidden_samples = 0;                         // those that need visibility rays
  // What the user should know of the result, a line each
  std::vector<std::string> notes;
  // Of each stage: meshes, plan, tree, prepare, samples, trace, propagate, encode
  std::map<std::string, double> seconds;
  // The same by the clock of all threads of this process; the tree counts as prepare
  std::map<std::string, double> processor_seconds;
  std::uint64_t device_peak_bytes = 0;
};

/// Computes the holograms of a scene: for every frame, traces each WRP, carries it to the hologram
/// and adds it there, and encodes the phase of the sum. Fields stay on the device from the first
/// ray to the last level. Frames differ in their random phases only.
///
/// Bit-identical for the same scene, seed and device.
/// throws  InputError for the scene, DeviceError for the device
RenderResult render(const cl::Device& device, const Scene& scene,
                    const RenderOptions& options = {});

/// The same of a world that is there already; no file is read.
RenderResult render(const cl::Device& device, const Scene& scene, const World& world,
                    const RenderOptions& options = {});

/// The same for scenes that move: meshes, kernels, plans and memory stay from one picture to the
/// next, and only what has changed is computed and uploaded. Rays are turned to what has moved
/// (host/trace/instances.hpp); a field may therefore differ from render()'s as rays that pass an
/// edge within rounding may (1e-4, up to 6e-3 where samples hang on one).
///
///     Renderer renderer(device, load_scene("scene.toml"));
///     for (double angle_deg = 0; angle_deg < 360; angle_deg += 5) {
///       renderer.set_pose(0, position_m, {0, angle_deg, 0});
///       show(renderer.render().levels[0]);
///     }
class Renderer {
public:
  /// throws  InputError for the scene, DeviceError for the device
  Renderer(const cl::Device& device, Scene scene, RenderOptions options = {});
  /// The same of meshes that are there already, as finish_mesh makes them; only textures are read.
  Renderer(const cl::Device& device, Scene scene, const Meshes& meshes, RenderOptions options = {});
  /// The same of files that are there already; no file is read.
  Renderer(const cl::Device& device, Scene scene, const SceneFiles& files,
           RenderOptions options = {});
  ~Renderer();
  Renderer(Renderer&&) noexcept;

  const Scene& scene() const;

  /// Centre of an object's bounding box, and its turns about x, then y, then z.
  void set_pose(std::size_t object, glm::dvec3 position_m, glm::dvec3 rotation_deg);

  /// throws  std::out_of_range; InputError when the light becomes ambient, or was: that is another
  ///         scene
  void set_light(std::size_t light, const Light& value);

  /// Random phases of the next frames.
  void set_seed(std::uint32_t seed);

  /// seconds, in the result, count from this call on; the first call's include what the constructor
  /// took.
  ///
  /// throws  InputError when an object touches the hologram plane, or needs what cannot be
  ///         computed; the renderer stays usable
  RenderResult render();

private:
  struct State;
  explicit Renderer(std::unique_ptr<State> state);
  friend RenderResult render(const cl::Device& device, const Scene& scene, const World& world,
                             const RenderOptions& options);
  std::unique_ptr<State> state_;
};

}  // namespace raywave
