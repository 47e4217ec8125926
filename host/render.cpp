// SPDX-License-Identifier: Apache-2.0
#include "host/render.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <optional>
#include <span>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/stage_clock.hpp"
#include "host/common/text.hpp"
#include "host/encode/encode.hpp"
#include "host/encode/encode_stage.hpp"
#include "host/plan/make_plan.hpp"
#include "host/plan/predict/cost.hpp"
#include "host/plan/predict/memory.hpp"
#include "host/plan/predict/warnings.hpp"
#include "host/propagate/propagate_stage.hpp"
#include "host/trace/trace_stage.hpp"
#include "host/trace/tuning.hpp"

namespace raywave {

/// The pipeline. Each stage on the device has three verbs: `prepare` for a plan, `run` for a piece
/// of the picture, `finish` for what is complete.
struct Renderer::State {
  State(const cl::Device& device, Scene scene, RenderOptions options);
  State(const cl::Device& device, Scene scene, World world, RenderOptions options);
  /// Takes the world, the scene on the device and the samples of another laser's state, and frees
  /// the rest of it.
  State(std::unique_ptr<State> other, Scene scene);

  RenderResult render();
  void set_pose(std::size_t object, glm::dvec3 position_m, glm::dvec3 rotation_deg,
                std::optional<double> solid_scale);

  void set_vertices(std::size_t object, std::span<const glm::dvec3> positions_m,
                    std::span<const glm::vec3> normals);

  void load();
  void make_plan();
  void trace(std::size_t wrp, int frame, RenderResult& result);
  void propagate(std::size_t wrp);
  void encode(std::size_t tile, int frame);
  void refine();

  void make_first_plan();
  void prepare();
  void keep_wrp(std::size_t wrp, RenderResult& result) const;
  void finish(RenderResult& result);
  void report(const std::string& what, double share) const;

  cl::Device device_;
  Scene scene_;
  RenderOptions options_;
  World world_;
  Plan plan_;
  std::vector<std::string> cautions_;  // notes
  StageTimes times_;
  TraceStage tracer_;
  PropagateStage propagator_;
  RefineStage refiner_;
  EncodeStage encoder_;
  std::optional<WrpField> on_wrp_;  // traced last
  bool changed_ = false;            // the scene, since it was planned
};

/// Computes a picture. Fields stay on the device from the first ray to the last grey level. Tiles
/// come one after another, so that memory for one is enough. Frames differ in their random phases
/// only.
RenderResult Renderer::State::render() {
  propagator_.drop();
  if (changed_) {
    load();
    make_plan();
  }
  RenderResult result;
  result.wrps.resize(options_.keep_wrps ? plan_.wrps.size() : 0);
  if (plan_.refine) refiner_.prepare(plan_, options_.refine_start);
  const double unit = std::sqrt(tracer_.radiance_unit());
  encoder_.prepare(plan_, options_.clip ? std::optional(*options_.clip / unit) : std::nullopt);
  for (std::size_t tile = 0; tile < plan_.tiles.size(); ++tile) {
    const auto [first, end] = plan_.wrps_of(tile);
    for (int frame = 0; frame < plan_.frames; ++frame) {
      for (auto wrp = first; wrp < end; ++wrp) {
        trace(wrp, frame, result);
        propagate(wrp);
      }
      encode(tile, frame);
    }
  }
  if (plan_.refine) refine();
  finish(result);
  return result;
}

void Renderer::State::set_pose(std::size_t object, glm::dvec3 position_m, glm::dvec3 rotation_deg,
                               std::optional<double> solid_scale) {
  auto moved = scene_.objects.at(object);
  moved.position_m = position_m;
  moved.rotation_deg = rotation_deg;
  moved.solid_scale = solid_scale;
  require_pose(world_, object, moved);
  scene_.objects[object] = std::move(moved);
  changed_ = true;
}

void Renderer::State::set_vertices(std::size_t object, std::span<const glm::dvec3> positions_m,
                                   std::span<const glm::vec3> normals) {
  raywave::set_vertices(world_, object, positions_m, normals);
  scene_.objects.at(object).shape.reset();
  changed_ = true;
}

/// Moves the objects of the world to where the scene has them now.
void Renderer::State::load() {
  const StageClock clock(times_, "meshes");
  move_objects(scene_, world_);
}

/// Plans the scene anew, in the same tiles.
void Renderer::State::make_plan() {
  {
    const StageClock clock(times_, "plan");
    plan_ = raywave::make_plan(scene_, world_, options_.method, options_.rays_per_axis,
                               device_.info().fp64,
                               options_.base_plan ? options_.base_plan.get() : &plan_);
  }
  prepare();
  changed_ = false;
}

/// Rays and surface samples: the field on a WRP.
void Renderer::State::trace(std::size_t wrp, int frame, RenderResult& result) {
  const auto [first, end] = plan_.wrps_of(plan_.wrps[wrp].tile);
  const auto frames = static_cast<std::size_t>(plan_.frames),
             done = frames * first + static_cast<std::size_t>(frame) * (end - first) + wrp - first;
  report("WRP " + std::to_string(wrp + 1) + " of " + std::to_string(plan_.wrps.size()) +
             (frames > 1 ? ", frame " + std::to_string(frame + 1) : ""),
         static_cast<double>(done) / static_cast<double>(frames * plan_.wrps.size()));
  const bool is_whole = options_.keep_wrps || options_.fft != cl::FftBackend::host;
  on_wrp_.emplace(tracer_.run(wrp, frame, is_whole));
  if (options_.keep_wrps) keep_wrp(wrp, result);
}

/// Shifted angular spectrum: from the WRP to the hologram, where the fields add up.
void Renderer::State::propagate(std::size_t wrp) {
  propagator_.run(wrp, on_wrp_->stack, on_wrp_->plane, on_wrp_->lit);
}

/// The phase of the sum as grey levels.
void Renderer::State::encode(std::size_t tile, int frame) {
  encoder_.run(propagator_.finish(), tile, frame);
}

/// Phases whose pictures are what a lens sees, of all frames together.
void Renderer::State::refine() {
  const auto& start = options_.refine_start;
  refiner_.run(start ? *start : encoder_.field, tracer_.scene());
}

namespace {

/// Refuses what the device or the host has no memory for, before any is taken. The surface samples
/// are not known yet.
///
/// throws  DeviceError or InputError with the bytes asked and allowed
void require_memory(const cl::Device& device, const Plan& plan, const MemoryNeeds& needs,
                    const MemoryUse& use, const MemoryLimits& limits) {
  const auto refuse = [&](const std::string& shortage) {
    if (!shortage.empty()) throw InputError(plan.scene_name + ": " + shortage);
  };
  refuse(results_shortage(plan, needs, use, limits));
  cl::require_memory(device, needs.device);
  refuse(host_shortage(plan, needs, limits));
}

/// What of the meshes' materials is approximated or ignored: the first of many.
void add_material_notes(const std::vector<std::string>& all, std::vector<std::string>& notes) {
  constexpr std::size_t most = 4;
  for (std::size_t i = 0; i < std::min(all.size(), most); ++i) notes.push_back(all[i]);
  if (all.size() > most)
    notes.push_back("and " + std::to_string(all.size() - most) +
                    " more notes about materials, which report.json and raywave plan list");
}

}  // namespace

Renderer::State::State(const cl::Device& device, Scene scene, RenderOptions options)
    : device_(device),
      scene_(std::move(scene)),
      options_(std::move(options)),
      tracer_(device, times_),
      propagator_(device, options_.fft, times_),
      refiner_(device, options_.fft, times_, options_.progress),
      encoder_(device, options_.keep_field, times_) {
  report("meshes", 0);
  {
    const StageClock clock(times_, "meshes");
    world_ = build_world(scene_);
  }
  make_first_plan();
}

Renderer::State::State(const cl::Device& device, Scene scene, World world, RenderOptions options)
    : device_(device),
      scene_(std::move(scene)),
      options_(std::move(options)),
      world_(std::move(world)),
      tracer_(device, times_),
      propagator_(device, options_.fft, times_),
      refiner_(device, options_.fft, times_, options_.progress),
      encoder_(device, options_.keep_field, times_) {
  make_first_plan();
}

Renderer::State::State(std::unique_ptr<State> other, Scene scene)
    : device_(other->device_),
      scene_(std::move(scene)),
      options_(other->options_),
      world_(std::move(other->world_)),
      tracer_(device_, times_),
      propagator_(device_, options_.fft, times_),
      refiner_(device_, options_.fft, times_, options_.progress),
      encoder_(device_, options_.keep_field, times_) {
  tracer_.take_over(other->tracer_);
  other = nullptr;
  make_first_plan();
}

/// Plans the scene in as few tiles as memory allows.
void Renderer::State::make_first_plan() {
  const auto limits = limits_of(device_.info()).for_one_of(options_.sharing);
  const MemoryUse use{options_.method, options_.fft, options_.keep_field};
  plan_ =
      options_.base_plan
          ? raywave::make_plan(scene_, world_, options_.method, options_.rays_per_axis,
                               device_.info().fp64, options_.base_plan.get())
          : fitting_plan(scene_, world_, limits, use, options_.rays_per_axis, device_.info().fp64);
  require_memory(device_, plan_, memory_needs(world_, plan_, use, limits.largest_buffer_bytes), use,
                 limits);
  cautions_ = cut_warnings(scene_, world_, plan_);
  for (auto& warning : thin_object_warnings(scene_, world_, plan_))
    cautions_.push_back(std::move(warning));
  constexpr double long_s = 60;
  if (options_.takes_long) {
    const double seconds = predicted_s(scene_, world_, plan_, options_.rates);
    if (seconds > long_s) options_.takes_long(seconds);
  }
  report("tree and kernels", 0);
  prepare();
}

/// Makes kernels and memory fit the plan. Propagation comes first: it refuses at once what it
/// cannot do, while tracing compiles kernels.
void Renderer::State::prepare() {
  propagator_.prepare(plan_, options_.method, options_.keep_field);
  tracer_.prepare(world_, plan_);
}

void Renderer::State::keep_wrp(std::size_t wrp, RenderResult& result) const {
  const auto size = plan_.compact ? plan_.compact->size : plan_.tile_size;
  const auto width = static_cast<std::size_t>(size.x), rows = static_cast<std::size_t>(size.y),
             stride = plan_.compact ? static_cast<std::size_t>(plan_.compact->row_stride()) : width;
  std::vector<std::complex<float>> samples(stride * rows);
  on_wrp_->stack.read(samples, static_cast<std::size_t>(on_wrp_->plane) * samples.size());
  for (std::size_t row = 1; row < rows && stride > width; ++row)
    std::copy_n(&samples[row * stride], width, &samples[row * width]);
  samples.resize(width * rows);
  brighten(samples, tracer_.radiance_unit(), plan_);
  auto& kept = result.wrps[wrp];
  kept.nx = size.x;
  kept.ny = size.y;
  kept.frames = plan_.frames;
  kept.samples.insert(kept.samples.end(), samples.begin(), samples.end());
}

/// Completes a picture, with what the user should know of it.
void Renderer::State::finish(RenderResult& result) {
  propagator_.add_notes(result.notes);
  if (plan_.refine) result.refined = refiner_.finish();
  encoder_.finish(tracer_.radiance_unit(), result.refined ? &result.refined->phases : nullptr);
  result.notes.insert(result.notes.end(), cautions_.begin(), cautions_.end());
  add_material_notes(material_notes(scene_, world_), result.notes);
  result.found = world_.found;
  if (plan_.aimed && tracer_.samples() == 0)
    result.notes.emplace_back(
        "the hologram is dark: no ray of the lattice meets a surface; objects are thinner than "
        "sampling.pitch, or lie where the pixels cannot show them");
  else if (encoder_.is_dark())
    result.notes.emplace_back(
        "the hologram is dark: no light comes from the scene at angles that its pixels can show");
  result.plan = plan_;
  result.levels = std::move(encoder_.levels);
  result.panel = encoder_.panel();
  result.clip = encoder_.own_clip() * std::sqrt(tracer_.radiance_unit());
  result.field = std::move(encoder_.field);
  result.samples = tracer_.samples();
  result.hidden_samples = tracer_.hidden_samples();
  report("done", 1);
  result.device_peak_bytes = device_.peak_bytes();
  auto times = std::exchange(times_, {});
  result.seconds = std::move(times.wall_s);
  result.processor_seconds = std::move(times.processor_s);
}

void Renderer::State::report(const std::string& what, double share) const {
  if (options_.progress) options_.progress(what, share);
}

Renderer::Renderer(const cl::Device& device, Scene scene, RenderOptions options)
    : state_(std::make_unique<State>(device, std::move(scene), std::move(options))) {}
Renderer::Renderer(const cl::Device& device, Scene scene, const Meshes& meshes,
                   RenderOptions options)
    : state_(std::make_unique<State>(
          device, scene, place_objects(scene, meshes, load_textures(scene)), std::move(options))) {}
Renderer::Renderer(const cl::Device& device, Scene scene, const SceneFiles& files,
                   RenderOptions options)
    : state_(std::make_unique<State>(
          device, scene, place_objects(scene, files.meshes, files.textures), std::move(options))) {}
Renderer::Renderer(const cl::Device& device, Scene scene, World world, RenderOptions options)
    : state_(std::make_unique<State>(device, std::move(scene), std::move(world),
                                     std::move(options))) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

const Scene& Renderer::scene() const { return state_->scene_; }

void Renderer::set_pose(std::size_t object, glm::dvec3 position_m, glm::dvec3 rotation_deg) {
  state_->set_pose(object, position_m, rotation_deg, {});
}

void Renderer::set_solid_pose(std::size_t object, glm::dvec3 position_m, glm::dvec3 rotation_deg,
                              double scale) {
  state_->set_pose(object, position_m, rotation_deg, scale);
}

void Renderer::set_shape(std::size_t object, double place) {
  auto& o = state_->scene_.objects.at(object);
  if (o.shapes.empty())
    throw InputError("object " + std::to_string(object) + ": it has no meshes to become");
  o.shape = place;
  state_->changed_ = true;
}

void Renderer::set_vertices(std::size_t object, std::span<const glm::dvec3> positions_m,
                            std::span<const glm::vec3> normals) {
  state_->set_vertices(object, positions_m, normals);
}

void Renderer::set_light(std::size_t light, const Light& value) {
  auto& l = state_->scene_.lights.at(light);
  const auto is_plain = [](const Light& one) {
    return (one.type == LightType::directional || one.type == LightType::point) && !one.falls_off &&
           one.highlights;
  };
  if (!(is_plain(l) && is_plain(value)) &&
      (l.type != value.type || l.falls_off != value.falls_off || l.highlights != value.highlights ||
       l.samples != value.samples || l.picture != value.picture))
    throw InputError("light " + std::to_string(light) +
                     ": its type, falloff, highlights, samples and picture must stay as they are");
  l = value;
  state_->changed_ = true;
}

void Renderer::set_seed(std::uint32_t seed) {
  state_->scene_.sampling.seed = seed;
  state_->plan_.seed = seed;
}

void Renderer::set_clip(std::optional<double> clip) { state_->options_.clip = clip; }

RenderResult Renderer::render() {
  try {
    return state_->render();
  } catch (...) {
    state_->times_ = {};
    throw;
  }
}

Renderer::Renderer(std::unique_ptr<State> state) : state_(std::move(state)) {}

RenderResult render(const cl::Device& device, const Scene& scene, const RenderOptions& options) {
  return Renderer(device, scene, options).render();
}

RenderResult render(const cl::Device& device, const Scene& scene, const World& world,
                    const RenderOptions& options) {
  return Renderer(std::make_unique<Renderer::State>(device, scene, world, options)).render();
}

double mean_light_of(const FieldStack& field, std::optional<int> frames) {
  if (field.samples.empty()) return 0;
  const auto count = field.samples.size() / static_cast<std::size_t>(field.frames) *
                     static_cast<std::size_t>(frames.value_or(field.frames));
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) sum += std::norm(std::complex<double>(field.samples[i]));
  return sum / static_cast<double>(count);
}

double laser_need(const RenderResult& result, std::optional<int> frames) {
  if (result.refined) return 1 / result.refined->brightness;
  return result.plan.slm.encoding == Encoding::phase ? mean_light_of(result.field, frames) : 1;
}

std::vector<double> laser_powers(const LaserSet& lasers, const std::vector<double>& needs) {
  std::vector<double> powers;
  double sum = 0;
  for (std::size_t i = 0; i < needs.size(); ++i) {
    powers.push_back(lasers.white_powers[i] * needs[i]);
    sum += powers.back();
  }
  for (double& power : powers) power = sum > 0 ? power / sum : 0;
  return powers;
}

namespace {

/// Encodes fields that show amplitudes up to the same one.
void share_scale(const cl::Device& device, std::vector<RenderResult>& lasers) {
  double clip = 0;
  for (const auto& laser : lasers) clip = std::max(clip, laser.clip);
  for (auto& laser : lasers) {
    if (laser.plan.slm.encoding == Encoding::phase || laser.clip == clip) continue;
    Encoder encoder(device, laser.panel);
    encoder.show_up_to(clip * amplitude_unit_m(laser.plan));
    laser.levels = encode(device, encoder, laser.field);
    laser.clip = clip;
  }
}

}  // namespace

ColourResult colour_result(const cl::Device& device, const std::vector<Scene>& scenes,
                           std::vector<RenderResult> lasers, bool keep_field) {
  ColourResult result;
  result.lasers = std::move(lasers);
  share_scale(device, result.lasers);
  std::vector<double> needs;
  for (auto& laser : result.lasers) {
    result.energies.push_back(mean_light_of(laser.field));
    needs.push_back(laser_need(laser));
    if (!keep_field) laser.field = {};
  }
  result.powers = laser_powers(scenes.at(0).colour.value().lasers, needs);
  return result;
}

ColourResult render_colours(const cl::Device& device, const std::vector<Scene>& scenes,
                            const World& world, const RenderOptions& options) {
  std::vector<RenderResult> lasers;
  auto how = options;
  how.keep_field = true;
  std::size_t laser = 0;
  if (options.progress) {
    how.progress = [&](const std::string& what, double share) {
      options.progress(length_text(scenes[laser].hologram.wavelength_m) + ": " + what,
                       (static_cast<double>(laser) + share) / static_cast<double>(scenes.size()));
    };
  }
  // Of each laser while the next is computed: what they share goes on
  std::unique_ptr<Renderer::State> state;
  for (; laser < scenes.size(); ++laser) {
    if (!state) {
      state = std::make_unique<Renderer::State>(device, scenes[laser], world, how);
    } else {
      state->options_.takes_long = nullptr;  // it was said
      state = std::make_unique<Renderer::State>(std::move(state), scenes[laser]);
    }
    lasers.push_back(state->render());
  }
  return colour_result(device, scenes, std::move(lasers), options.keep_field);
}

}  // namespace raywave
