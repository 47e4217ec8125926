// SPDX-License-Identifier: Apache-2.0
#include "host/render.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <numeric>
#include <utility>

#include "host/carriers/at_hologram/carrier.hpp"
#include "host/carriers/virtual_planes/carrier.hpp"
#include "host/carriers/wrps/carrier.hpp"
#include "host/common/error.hpp"
#include "host/common/stage_clock.hpp"
#include "host/common/text.hpp"
#include "host/common/threads.hpp"
#include "host/encode/encode.hpp"
#include "host/encode/encode_stage.hpp"
#include "host/plan/message_text.hpp"
#include "host/planning/cautions.hpp"
#include "host/planning/make_plan.hpp"
#include "host/planning/memory_needs.hpp"
#include "host/trace/traced_world.hpp"
#include "host/trace/work_shape.hpp"

namespace raywave {

namespace {

/// The one place that chooses how light travels.
std::unique_ptr<Carrier> make_carrier(const cl::Device& device, const cl::Device& waves_device,
                                      const Plan& plan, CarrierOptions options, StageTimes& times) {
  if (plan.virtual_planes())
    return std::make_unique<VirtualPlaneCarrier>(device, waves_device, std::move(options), times);
  if (plan.is_at_hologram())
    return std::make_unique<HologramCarrier>(device, device, std::move(options), times);
  return std::make_unique<WrpCarrier>(device, device, std::move(options), times);
}

/// throws  InputError for a plan that two devices do not share
void require_shared(const Plan& plan) {
  if (!plan.virtual_planes() || plan.refine)
    throw InputError(one_line(plan.scene_name) + ": two devices (--waves-on, --target) " +
                     (plan.refine ? "do not refine; set refine.iterations = 0"
                                  : "need virtual planes, and its light travels otherwise, as "
                                    "raywave plan says") +
                     ", or let one device compute it");
}

}  // namespace

/// The pipeline. Each stage on the device has three verbs: `prepare` for a plan, `run` (of carriers
/// `carry`) for a piece of the picture, `finish` for what is complete. Lasers come one after
/// another.
struct Renderer::State {
  struct Stages {
    std::unique_ptr<Carrier> carrier;  // null before it is prepared
    RefineStage refiner;
    EncodeStage encoder;
    std::vector<FieldStack> kept_planes;  // RenderResult::wrps
  };
  /// What a laser does not share with the others.
  struct Laser {
    Scene scene;
    Plan plan;
    std::vector<std::string> cautions;   // notes
    std::unique_ptr<Stages> stages;      // null before the first plan
    std::optional<std::uint64_t> as_of;  // State::changes_ that the plan knows
    double radiance_unit = 1;            // of the last picture (DeviceScene)
  };

  /// world           null: is built
  /// one_at_a_time   each laser is rendered once, and leaves its memory to the next
  State(const cl::Device& device, std::vector<Scene> scenes, std::optional<World> world,
        RenderOptions options, bool one_at_a_time = false);

  Rendered render_lasers();
  RenderResult render(Laser& laser);
  /// All but the last of its encoding.
  RenderResult compute(Laser& laser);
  /// Takes the levels, which show amplitudes up to RenderResult::clip.
  void complete(Laser& laser, RenderResult& result);
  /// Of the scene of each laser.
  void change(const std::function<void(Scene&)>& change_scene);
  void set_pose(std::size_t object, glm::dvec3 position_m, glm::dvec3 rotation_deg,
                std::optional<double> solid_scale);

  void prepare(Laser& laser);
  void make_plan(Laser& laser);
  void make_first_plan(Laser& laser);
  CarrierOptions carrier_options(Laser& laser);
  void keep_plane(Laser& laser, std::size_t wrp, const cl::ComplexBuffer& stack, int plane);
  RenderResult result_of(Laser& laser);

  std::size_t number_of(const Laser& laser) const {
    return static_cast<std::size_t>(&laser - lasers_.data());
  }
  const Plan* base_plan(const Laser& laser) const;
  const FieldStack* refine_start(const Laser& laser) const;
  void report(const Laser& laser, const std::string& what, double share) const;

  /// Has the planes and the hologram.
  const cl::Device& waves_device() const {
    return options_.waves_device ? *options_.waves_device : device_;
  }
  MemoryLimits limits() const;
  /// Lasers that share one scale may have to be encoded anew when the brightest is known.
  bool holds_fields(Encoding encoding, int frames) const {
    return options_.keep_field ||
           (lasers_.size() > 1 && encoding != Encoding::phase && (one_at_a_time_ || frames > 1));
  }

  cl::Device device_;
  RenderOptions options_;
  bool one_at_a_time_;
  StageTimes times_;
  World world_;
  TracedWorld traced_;
  std::vector<Laser> lasers_;  // as many as at first
  // Changes of the scenes so far; those that the world has, and those that the device has
  std::uint64_t changes_ = 0, changes_of_world_ = 0;
  std::optional<std::uint64_t> changes_of_device_;
  const Laser* ready_ = nullptr;  // whose samples and kernels the device has
};

/// Computes a picture. Fields stay on the device from the first ray to the last grey level. Tiles
/// come one after another, so that memory for one is enough. Frames differ in their random phases
/// only.
RenderResult Renderer::State::compute(Laser& laser) {
  prepare(laser);
  const auto& plan = laser.plan;
  auto& [carrier, refiner, encoder, kept] = *laser.stages;
  refiner.prepare(plan, refine_start(laser));
  laser.radiance_unit = traced_.scene().radiance_unit;
  const double unit = std::sqrt(laser.radiance_unit);
  encoder.prepare(plan, options_.clip ? std::optional(*options_.clip / unit) : std::nullopt,
                  options_.tile);
  kept.assign(options_.keep_wrps ? plan.wrps.size() : 0, {});
  const std::size_t first = options_.tile.value_or(0),
                    end = options_.tile ? first + 1 : plan.tiling.tiles.size();
  for (std::size_t tile = first; tile < end; ++tile)
    for (int frame = 0; frame < plan.hologram.frames; ++frame)
      encoder.run(refiner.take(carrier->carry(tile, frame), tile, frame), tile, frame);
  refiner.run(traced_.scene(), traced_.table().get());
  for (int frame = 0; plan.refine && frame < plan.hologram.frames; ++frame)
    encoder.run_whole(refiner.phases(frame), frame);
  encoder.run_waiting();
  return result_of(laser);
}

void Renderer::State::complete(Laser& laser, RenderResult& result) {
  auto& encoder = laser.stages->encoder;
  const double unit = std::sqrt(laser.radiance_unit);
  // Frames have clips of their own
  const bool has_own = lasers_.size() == 1 || (result.plan.hologram.frames == 1 &&
                                               result.clip == encoder.own_clip() * unit);
  if (!options_.clip && !has_own) encoder.show_up_to(result.clip, laser.radiance_unit);
  encoder.finish(laser.radiance_unit);
  const bool has_samples = !result.plan.samples.aimed || result.samples > 0;
  if (encoder.is_dark() && has_samples && !options_.tile)  // others may have light
    result.notes.emplace_back(
        "the hologram is dark: no light comes from the scene at angles that its pixels can show");
  result.levels = std::move(encoder.levels);
  result.light = std::move(encoder.light);
  result.field = std::move(encoder.field);
  report(laser, "done", 1);
  const auto times = std::exchange(times_, {});
  for (const auto& [stage, s] : times.wall_s) result.seconds[stage] += s;
  for (const auto& [stage, s] : times.processor_s) result.processor_seconds[stage] += s;
}

RenderResult Renderer::State::render(Laser& laser) {
  auto result = compute(laser);
  complete(laser, result);
  return result;
}

Rendered Renderer::State::render_lasers() {
  Rendered all;
  double clip = 0;
  for (auto& laser : lasers_) {
    all.lasers.push_back(compute(laser));
    clip = std::max(clip, all.lasers.back().clip);
    if (!one_at_a_time_) continue;
    ready_ = nullptr;
    laser.stages->carrier = nullptr;
    laser.stages->refiner.release();
    laser.stages->encoder.release();
  }
  std::vector<double> needs;
  for (auto& laser : lasers_) {
    auto& result = all.lasers[number_of(laser)];
    if (result.clip > 0) result.clip = clip;
    complete(laser, result);
    if (lasers_.size() == 1) continue;
    all.energies.push_back(
        laser_need(result.light, area_of(result.plan.hologram.size), Encoding::phase));
    needs.push_back(laser_need(result));
  }
  all.powers = lasers_.size() == 1 ? std::vector<double>{1}
                                   : laser_powers(lasers_[0].scene.colour.value().lasers, needs);
  return all;
}

void Renderer::State::change(const std::function<void(Scene&)>& change_scene) {
  ++changes_;
  for (auto& laser : lasers_) change_scene(laser.scene);
}

void Renderer::State::set_pose(std::size_t object, glm::dvec3 position_m, glm::dvec3 rotation_deg,
                               std::optional<double> solid_scale) {
  auto moved = lasers_[0].scene.objects.at(object);
  moved.position_m = position_m;
  moved.rotation_deg = rotation_deg;
  moved.solid_scale = solid_scale;
  require_pose(world_, object, moved);
  change([&](Scene& scene) { scene.objects[object] = moved; });
}

/// Makes world, plan, kernels and memory fit where the objects are now, and the laser. Propagation
/// comes before the samples: it refuses at once what it cannot do.
void Renderer::State::prepare(Laser& laser) {
  if (ready_ == &laser && laser.as_of == changes_) return;
  ready_ = nullptr;
  if (changes_of_world_ != changes_) {
    const StageClock clock(times_, "meshes");
    move_objects(laser.scene, world_);
    changes_of_world_ = changes_;
  }
  if (!laser.stages)
    make_first_plan(laser);
  else if (laser.as_of != changes_)
    make_plan(laser);
  auto& carrier = laser.stages->carrier;
  if (options_.waves_device) require_shared(laser.plan);
  if (!carrier)
    carrier = make_carrier(device_, waves_device(), laser.plan, carrier_options(laser), times_);
  carrier->fit(laser.plan);
  const bool has_stayed = std::exchange(changes_of_device_, {}) == changes_;
  traced_.prepare(world_, laser.plan, has_stayed, [&] { carrier->release(); });
  changes_of_device_ = changes_;
  carrier->prepare(traced_.scene(), traced_.table());
  laser.as_of = changes_;
  ready_ = &laser;
}

/// Plans the scene anew, in the same tiles.
void Renderer::State::make_plan(Laser& laser) {
  const StageClock clock(times_, "plan");
  const auto* from = base_plan(laser) ? base_plan(laser) : &laser.plan;
  auto plan = raywave::make_plan(laser.scene, world_, options_.method, options_.rays_per_axis,
                                 device_.info().fp64, from);
  if (plan.carrier.index() != laser.plan.carrier.index()) laser.stages->carrier = nullptr;
  laser.plan = std::move(plan);
}

CarrierOptions Renderer::State::carrier_options(Laser& laser) {
  CarrierOptions options{
      options_.fft, holds_fields(laser.plan.slm.encoding, laser.plan.hologram.frames), {}, {}};
  options.filling = [this, &laser](std::size_t wrp, int frame) {
    const auto& plan = laser.plan;
    const auto [first, end] = plan.wrps_of(plan.wrps[wrp].tile);
    const auto frames = static_cast<std::size_t>(plan.hologram.frames),
               done =
                   frames * first + static_cast<std::size_t>(frame) * (end - first) + wrp - first;
    report(laser,
           "WRP " + std::to_string(wrp + 1) + " of " + std::to_string(plan.wrps.size()) +
               (frames > 1 ? ", frame " + std::to_string(frame + 1) : ""),
           static_cast<double>(done) / static_cast<double>(frames * plan.wrps.size()));
  };
  if (options_.keep_wrps)
    options.filled = [this, &laser](std::size_t wrp, const cl::ComplexBuffer& stack, int plane) {
      keep_plane(laser, wrp, stack, plane);
    };
  return options;
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

Renderer::State::State(const cl::Device& device, std::vector<Scene> scenes,
                       std::optional<World> world, RenderOptions options, bool one_at_a_time)
    : device_(device),
      options_(std::move(options)),
      one_at_a_time_(one_at_a_time),
      traced_(device, times_),
      lasers_(scenes.size()) {
  for (std::size_t i = 0; i < scenes.size(); ++i) lasers_[i].scene = std::move(scenes[i]);
  if (world) {
    world_ = std::move(*world);
  } else {
    report(lasers_.at(0), "meshes", 0);
    const StageClock clock(times_, "meshes");
    world_ = build_world(lasers_.at(0).scene);
  }
  for (auto& laser : std::span(lasers_).first(one_at_a_time_ ? 1 : lasers_.size())) prepare(laser);
}

const Plan* Renderer::State::base_plan(const Laser& laser) const {
  return options_.base_plans.empty() ? nullptr : options_.base_plans.at(number_of(laser)).get();
}

const FieldStack* Renderer::State::refine_start(const Laser& laser) const {
  return options_.refine_starts.empty() ? nullptr : &options_.refine_starts.at(number_of(laser));
}

/// What both devices have where there are two.
MemoryLimits Renderer::State::limits() const {
  return limits_of(device_.info()).least(limits_of(waves_device().info()));
}

/// Plans the scene in as few tiles as memory allows.
void Renderer::State::make_first_plan(Laser& laser) {
  auto& [scene, plan, cautions, stages, as_of, radiance_unit] = laser;
  const auto limits =
      this->limits().for_one_of(one_at_a_time_ ? 1 : static_cast<int>(lasers_.size()));
  const MemoryUse use{options_.method, options_.fft,
                      holds_fields(scene.slm.encoding, scene.sampling.frames),
                      options_.tile.has_value()};
  const auto* from = base_plan(laser);
  plan =
      from ? raywave::make_plan(scene, world_, options_.method, options_.rays_per_axis,
                                device_.info().fp64, from)
           : fitting_plan(scene, world_, limits, use, options_.rays_per_axis, device_.info().fp64);
  require_memory(device_, plan, memory_needs(world_, plan, use, limits.largest_buffer_bytes), use,
                 limits);
  cautions.clear();
  if (options_.planned) cautions = options_.planned(scene, world_, plan);
  add_lines(cautions, cut_warnings(scene, world_, plan));
  add_lines(cautions, thin_object_warnings(scene, world_, plan));
  report(laser, "tree and kernels", 0);
  auto progress = [this, &laser](const std::string& what, double share) {
    report(laser, what, share);
  };
  stages.reset(new Stages{nullptr,
                          {device_, options_.fft, times_, std::move(progress)},
                          {waves_device(),
                           {.keep_field = options_.keep_field,
                            .count_light = scene.colour.has_value(),
                            .share_clip = lasers_.size() > 1,
                            .field_stays = !one_at_a_time_},
                           times_},
                          {}});
}

void Renderer::State::keep_plane(Laser& laser, std::size_t wrp, const cl::ComplexBuffer& stack,
                                 int plane) {
  const auto& plan = laser.plan;
  const auto size = plan.gathered_size();
  const auto width = static_cast<std::size_t>(size.x), rows = static_cast<std::size_t>(size.y),
             stride = plan.gathered_pixels() / rows;
  std::vector<std::complex<float>> samples(stride * rows);
  stack.read(samples, static_cast<std::size_t>(plane) * samples.size());
  for (std::size_t row = 1; row < rows && stride > width; ++row)
    std::copy_n(&samples[row * stride], width, &samples[row * width]);
  samples.resize(width * rows);
  brighten(samples, traced_.scene().radiance_unit, plan);
  auto& kept = laser.stages->kept_planes[wrp];
  kept.nx = size.x;
  kept.ny = size.y;
  kept.frames = plan.hologram.frames;
  kept.samples.insert(kept.samples.end(), samples.begin(), samples.end());
}

/// What the user should know of a picture.
RenderResult Renderer::State::result_of(Laser& laser) {
  const auto& plan = laser.plan;
  auto& [carrier, refiner, encoder, kept] = *laser.stages;
  const double radiance_unit = traced_.scene().radiance_unit;
  const auto table = traced_.table();
  RenderResult result;
  result.wrps = std::move(kept);
  result.notes = laser.cautions;
  std::vector<std::string> of_carrier;
  carrier->add_notes(of_carrier);
  add_lines(result.notes, of_carrier);
  if (plan.refine) result.refined = refiner.finish(options_.keep_field);
  add_material_notes(material_notes(laser.scene, world_), result.notes);
  result.found = world_.found;
  if (table && table->count == 0)
    result.notes.emplace_back(
        "the hologram is dark: no ray of the lattice meets a surface; objects are thinner than "
        "sampling.pitch, or lie where the pixels cannot show them");
  result.plan = plan;
  result.panel = encoder.panel();
  result.clip = encoder.own_clip() * std::sqrt(radiance_unit);
  result.samples = table ? table->count : 0;
  result.hidden_samples = table ? table->hidden : 0;
  result.device_peak_bytes =
      device_.peak_bytes() + (options_.waves_device ? options_.waves_device->peak_bytes() : 0);
  auto times = std::exchange(times_, {});
  result.seconds = std::move(times.wall_s);
  result.processor_seconds = std::move(times.processor_s);
  return result;
}

void Renderer::State::report(const Laser& laser, const std::string& what, double share) const {
  if (!options_.progress) return;
  if (lasers_.size() == 1) return options_.progress(what, share);
  options_.progress(
      length_text(laser.scene.hologram.wavelength_m) + ": " + what,
      (static_cast<double>(number_of(laser)) + share) / static_cast<double>(lasers_.size()));
}

Renderer::Renderer(const cl::Device& device, Scene scene, RenderOptions options)
    : state_(std::make_unique<State>(device, std::vector{std::move(scene)}, std::nullopt,
                                     std::move(options))) {}
Renderer::Renderer(const cl::Device& device, Scene scene, World world, RenderOptions options)
    : Renderer(device, std::vector{std::move(scene)}, std::move(world), std::move(options)) {}
Renderer::Renderer(const cl::Device& device, std::vector<Scene> scenes, World world,
                   RenderOptions options)
    : state_(std::make_unique<State>(device, std::move(scenes), std::move(world),
                                     std::move(options))) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

const Scene& Renderer::scene(std::size_t laser) const { return state_->lasers_.at(laser).scene; }

void Renderer::set_pose(std::size_t object, glm::dvec3 position_m, glm::dvec3 rotation_deg) {
  state_->set_pose(object, position_m, rotation_deg, {});
}

void Renderer::set_solid_pose(std::size_t object, glm::dvec3 position_m, glm::dvec3 rotation_deg,
                              double scale) {
  state_->set_pose(object, position_m, rotation_deg, scale);
}

void Renderer::set_shape(std::size_t object, double place) {
  const auto& o = scene().objects.at(object);
  if (o.shapes.empty() && !o.deforms)
    throw InputError("object " + std::to_string(object) + ": it has no meshes to become");
  state_->change([&](Scene& one) { one.objects[object].shape = place; });
}

void Renderer::set_light(std::size_t light, const Light& value) {
  const auto& l = scene().lights.at(light);
  const auto is_plain = [](const Light& one) {
    return (one.type == LightType::directional || one.type == LightType::point) && !one.falls_off &&
           one.highlights;
  };
  if (!(is_plain(l) && is_plain(value)) &&
      (l.type != value.type || l.falls_off != value.falls_off || l.highlights != value.highlights ||
       l.samples != value.samples || l.picture != value.picture))
    throw InputError("light " + std::to_string(light) +
                     ": its type, falloff, highlights, samples and picture must stay as they are");
  state_->change([&](Scene& one) { one.lights[light] = value; });
}

void Renderer::set_seed(std::uint32_t seed) {
  for (auto& laser : state_->lasers_) laser.scene.sampling.seed = laser.plan.hologram.seed = seed;
}

void Renderer::set_tile(std::size_t tile) { state_->options_.tile = tile; }

void Renderer::set_clip(std::optional<double> clip) { state_->options_.clip = clip; }

RenderResult Renderer::render() {
  try {
    return state_->render(state_->lasers_[0]);
  } catch (...) {
    state_->times_ = {};
    throw;
  }
}

Rendered Renderer::render_lasers() {
  try {
    return state_->render_lasers();
  } catch (...) {
    state_->times_ = {};
    throw;
  }
}

RenderResult render(const cl::Device& device, const Scene& scene, const RenderOptions& options) {
  return Renderer(device, scene, options).render();
}

RenderResult render(const cl::Device& device, const Scene& scene, const World& world,
                    const RenderOptions& options) {
  return Renderer(device, scene, world, options).render();
}

double mean_light_of(const FieldStack& field) {
  const auto& all = field.samples;
  return std::transform_reduce(all.begin(), all.end(), 0.0, std::plus<>(),
                               [](std::complex<double> u) { return std::norm(u); }) /
         static_cast<double>(std::max<std::size_t>(1, all.size()));
}

std::vector<std::string> notes_of(const std::vector<RenderResult>& lasers) {
  std::vector<std::pair<double, std::vector<std::string>>> notes;
  for (const auto& laser : lasers)
    notes.emplace_back(laser.plan.hologram.wavelength_m, laser.notes);
  return lines_of_lasers(notes);
}

double laser_need(std::span<const ShownLight> light, std::size_t pixels, Encoding encoding) {
  ShownLight sum;
  for (const auto& frame : light) sum += frame;
  if (encoding == Encoding::phase) return sum.all / static_cast<double>(light.size() * pixels);
  return sum.shown > 0 ? sum.all / sum.shown : 1;
}

double laser_need(const RenderResult& result, std::optional<int> frames) {
  if (result.refined) return 1 / result.refined->brightness;
  const auto& light = result.light;
  return laser_need(std::span(light).first(
                        static_cast<std::size_t>(frames.value_or(static_cast<int>(light.size())))),
                    area_of(result.plan.hologram.size), result.plan.slm.encoding);
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

Rendered render(const cl::Device& device, const std::vector<Scene>& scenes, World world,
                const RenderOptions& options) {
  constexpr bool one_at_a_time = true;
  return Renderer::State(device, scenes, std::move(world), options, one_at_a_time).render_lasers();
}

}  // namespace raywave
