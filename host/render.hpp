// SPDX-License-Identifier: Apache-2.0
/// The pipeline: scene -> plan -> trace -> propagate -> encode; where the scene asks for it, phases
/// are refined before they are encoded.
#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cl/device.hpp"
#include "cl/fft.hpp"
#include "host/common/error.hpp"
#include "host/common/npy.hpp"
#include "host/encode/encode.hpp"
#include "host/geometry/world.hpp"
#include "host/plan/plan.hpp"
#include "host/refine/refine_stage.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// What the user should know of a plan: host/forecast/presets.hpp makes it (render_warnings).
using PlanNotes = std::function<std::vector<std::string>(const Scene&, const World&, const Plan&)>;

/// Called with the current step ("trace", "WRP 2 of 4") and the completed share, 0 to 1.
using Progress = std::function<void(const std::string& what, double share)>;

struct RenderOptions {
  Method method = Method::wrp;
  int rays_per_axis = 100;  // for Method::rays only
  cl::FftBackend fft = cl::FftBackend::host;
  bool keep_wrps = false;  // also return the fields on the WRPs
  bool keep_field = true;  // also return the field at the hologram, beside the levels
  // One for each laser, or none: refinement begins with its phases, not with those of the field
  // that is traced, and goes on where an earlier one ended
  std::vector<FieldStack> refine_starts;
  // In scenes that move, one for each laser: all its plans go on from this one
  // (fitting_plan_of_poses), not from that of the picture before. A picture then does not depend on
  // which ones came before it
  std::vector<std::shared_ptr<const Plan>> base_plans;
  // Only this tile of the plan, from which Renderer::set_tile goes on to others: levels and field
  // are as large as it. For Method::wrp, without refinement or slm.band
  std::optional<std::size_t> tile;
  // Has the planes and the hologram, and encodes; rays and samples stay on the device itself. For
  // light over virtual planes, without refinement. Empty: one device does it all
  std::optional<cl::Device> waves_device;
  // RenderResult::clip of all pictures, which then share one scale; empty: each by itself
  std::optional<double> clip;
  Progress progress;
  // Called for each laser before its first picture; comes first in RenderResult::notes
  PlanNotes planned;
};

struct RenderResult {
  Plan plan;
  // Field at the hologram, one plane per frame, if RenderOptions::keep_field
  FieldStack field;
  std::vector<std::vector<std::uint8_t>> levels;  // grey levels of the SLM, per frame
  std::shared_ptr<const Panel> panel;             // what they show (host/encode/shown.hpp)
  // Amplitude that slm.clip asks to show in full, the largest of all frames; 0: the encoding
  // shows none, or all is dark
  double clip = 0;
  // Of each frame, of scenes of several lasers; `shown` is what amplitudes up to `clip` show
  std::vector<ShownLight> light;
  std::optional<Refined> refined;  // where Plan::refine asks for it
  std::vector<FieldStack> wrps;    // one per WRP, if RenderOptions::keep_wrps
  int samples = 0;                 // surface samples (sampling.mode "aimed")
  int hidden_samples = 0;          // samples that need visibility rays
  // Notes on the result for the user, one line each
  std::vector<std::string> notes;
  std::vector<FoundMaterials> found;  // of the objects' meshes
  // Wall time of each stage: meshes, plan, tree, prepare, kernels (what drivers compile, whichever
  // stage waits for it), samples, trace, propagate, refine, encode
  std::map<std::string, double> seconds;
  // Processor time of each stage, over all threads of this process; "prepare" includes the tree
  std::map<std::string, double> processor_seconds;
  std::uint64_t device_peak_bytes = 0;
};

/// Computes the holograms of a scene. For every frame it traces each WRP, propagates the fields to
/// the hologram, adds them there and encodes the phase of the sum. Fields stay on the device until
/// they are encoded. Frames differ only in their random phases.
///
/// The result is bit-identical for equal scene, seed and device.
///
/// throws  InputError for the scene, DeviceError for the device
RenderResult render(const cl::Device& device, const Scene& scene,
                    const RenderOptions& options = {});

/// Renders a world that is already in memory; no file is read.
RenderResult render(const cl::Device& device, const Scene& scene, const World& world,
                    const RenderOptions& options = {});

/// The holograms of a scene, one for each laser, to be shown in turn.
struct Rendered {
  std::vector<RenderResult> lasers;  // in the order of the scenes
  // Irradiance of each field as it is encoded, mean over pixels and frames; of white scenes, all
  // lasers have the same. Empty for one laser
  std::vector<double> energies;
  // Radiant powers that the lasers must have for the colours to be right, all for the same time;
  // their sum is 1. Encodings that show amplitudes share one scale, and take the powers of white
  // and what clipping has taken away. Phases alone show all light whatever the field: see
  // laser_need
  std::vector<double> powers;
};

/// The notes of all lasers, each once; what not all of them have comes after the wavelength.
std::vector<std::string> notes_of(const std::vector<RenderResult>& lasers);

/// Mean |u|^2 of all pixels and frames.
double mean_light_of(const FieldStack& field);

/// Power that a laser needs, relative to white's, to show fields: their light where phases alone
/// are shown, and what clipping takes away where amplitudes are.
///
/// light   of each frame
/// pixels  of a frame
double laser_need(std::span<const ShownLight> light, std::size_t pixels, Encoding encoding);

/// The same for the first frames of a scene of several lasers; where they are refined, what makes
/// pictures as bright as they were asked for.
double laser_need(const RenderResult& result, std::optional<int> frames = {});

/// Rendered::powers.
///
/// needs  laser_need of each laser
std::vector<double> laser_powers(const LaserSet& lasers, const std::vector<double>& needs);

/// Renders the scenes of load_scenes, which share the world. Each laser's field is bit-identical
/// to that of its scene rendered alone. So are its levels, but that encodings of amplitudes share
/// one scale: that of the brightest laser (RenderResult::clip).
///
/// throws  InputError for the scene, DeviceError for the device
Rendered render(const cl::Device& device, const std::vector<Scene>& scenes, World world,
                const RenderOptions& options = {});

/// Renders scenes that move, also of several lasers, which share the world and its samples. Meshes,
/// kernels, plans and memory are kept from one picture to the
/// next; only changed data is computed and uploaded. Rays are transformed into the frame of a moved
/// object (host/trace/instances.hpp). A ray that meets an edge within rounding errors may therefore
/// have another hit than in render(): fields differ by 1e-4 (relative L2), by up to 6e-3 when many
/// samples lie on one edge.
///
///     Renderer renderer(device, load_scenes("scene.toml").front());
///     for (double angle_deg = 0; angle_deg < 360; angle_deg += 5) {
///       renderer.set_pose(0, position_m, {0, angle_deg, 0});
///       show(renderer.render().levels[0]);
///     }
class Renderer {
public:
  /// throws  InputError for the scene, DeviceError for the device
  Renderer(const cl::Device& device, Scene scene, RenderOptions options = {});
  /// Takes a world that place_objects has made; no file is read.
  Renderer(const cl::Device& device, Scene scene, World world, RenderOptions options = {});
  /// The same of several lasers. Each has planes and fields of its own, and may take its share of
  /// the memory that there is.
  ///
  /// scenes  of load_scenes
  Renderer(const cl::Device& device, std::vector<Scene> scenes, World world,
           RenderOptions options = {});
  ~Renderer();
  Renderer(Renderer&&) noexcept;

  /// As it is now.
  const Scene& scene(std::size_t laser = 0) const;

  /// Sets the place of an object's anchor (the centre of its bounding box unless the scene says
  /// otherwise) and its rotation about x, then y, then z.
  ///
  /// throws  std::out_of_range; InputError when the object would lie nearer than its cut, or
  ///         moves though a part of it is cut away: the object stays
  void set_pose(std::size_t object, glm::dvec3 position_m, glm::dvec3 rotation_deg);

  /// Moves an object as a solid (Object::solid_scale): it keeps its size, whatever its `width`
  /// would make of the turned mesh, and turns about its anchor (the middle of the box that it was
  /// placed with unless the scene says otherwise).
  ///
  /// throws  as set_pose
  void set_solid_pose(std::size_t object, glm::dvec3 position_m, glm::dvec3 rotation_deg,
                      double scale = 1);

  /// Gives an object a shape among the meshes of Object::shapes, or, where a glTF file deforms it,
  /// that of a time in seconds (Object::shape).
  ///
  /// throws  std::out_of_range; InputError for an object without any
  void set_shape(std::size_t object, double place);

  /// Kernels are compiled for the lights: type, falloff, highlights, samples and picture of a light
  /// stay. But a directional light and a point may become each other, where both have highlights
  /// and no falloff.
  ///
  /// throws  std::out_of_range; InputError when one of these changes
  void set_light(std::size_t light, const Light& value);

  /// Sets the seed of the random phases of the next frames.
  void set_seed(std::uint32_t seed);

  /// Sets RenderOptions::clip of the next pictures.
  void set_clip(std::optional<double> clip);

  /// Sets RenderOptions::tile of the next pictures, where it was given at first.
  void set_tile(std::size_t tile);

  /// Renders the current scene, for the first laser. RenderResult::seconds covers this call; in the
  /// first result it includes the time of the constructor.
  ///
  /// throws  InputError when the scene cannot be computed; the renderer stays usable
  RenderResult render();
  /// Renders the current scene for each laser, as the function `render` does.
  Rendered render_lasers();

private:
  struct State;
  friend Rendered raywave::render(const cl::Device& device, const std::vector<Scene>& scenes,
                                  World world, const RenderOptions& options);
  std::unique_ptr<State> state_;
};

}  // namespace raywave
