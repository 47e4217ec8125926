// SPDX-License-Identifier: Apache-2.0
#include "host/render.hpp"

#include <algorithm>
#include <cstring>
#include <mutex>
#include <nlohmann/json.hpp>
#include <utility>

#include "host/api/state.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/encode/shown.hpp"
#include "host/evaluate/report.hpp"
#include "host/plan/predict/presets.hpp"
#include "host/trace/tuning.hpp"

namespace raywave::v0 {
namespace {

const char* name_of(cl::DeviceKind kind) {
  switch (kind) {
    case cl::DeviceKind::gpu:
      return "gpu";
    case cl::DeviceKind::accelerator:
      return "accelerator";
    case cl::DeviceKind::cpu:
      return "cpu";
    case cl::DeviceKind::other:
      break;
  }
  return "other";
}

Method method_of(const std::string& name) {
  if (name == "wrp") return Method::wrp;
  if (name == "points") return Method::points;
  if (name == "rays") return Method::rays;
  throw InputError("method " + in_quotes(name) + ": unknown; there are wrp, points and rays");
}

raywave::RenderOptions options_of(const RenderOptions& options, const Opened& opened) {
  raywave::RenderOptions how;
  how.method = method_of(options.method);
  if (options.rays_per_axis < 1 || options.rays_per_axis > 1000)
    throw InputError("rays: must be 1 to 1000, got " + std::to_string(options.rays_per_axis));
  how.rays_per_axis = options.rays_per_axis;
  how.fft = opened.fft;
  how.keep_field = options.keep_field;
  how.progress = progress_of(options.progress);
  how.rates = figures_of(opened.device.info()).rates;
  return how;
}

/// The scene with what a goal leaves to the planner, and notes for the user.
raywave::Scene planned(const Scene::State& scene, const World& world, const RenderOptions& options,
                       const cl::DeviceInfo& device, std::vector<std::string>& warnings) {
  const auto goal = goal_of(options.goal);
  if (!goal.any()) return scene.scene;
  if (method_of(options.method) != Method::wrp)
    throw InputError("preset, budget and psnr plan method \"wrp\" alone");
  if (scene.is_planned)
    throw InputError("preset, budget and psnr: the scene of a plan has its values chosen");
  auto result = plan_scene(scene.scene, world, figures_of(device), goal);
  warnings = std::move(result.warnings);
  return std::move(result.scene);
}

Hologram hologram_of(const raywave::Scene& scene, RenderResult result, const Opened& opened,
                     const std::vector<std::string>& warnings) {
  auto state = std::make_shared<Hologram::State>();
  state->scene = scene;
  state->report = render_report_json(scene, result, opened.device.info(), opened.fft);
  auto& levels = result.levels;
  if (levels.size() == 1)
    state->levels = std::move(levels[0]);
  else
    for (const auto& frame : levels)
      state->levels.insert(state->levels.end(), frame.begin(), frame.end());
  levels.clear();
  state->result = std::move(result);
  auto& notes = state->result.notes;
  for (const auto& warning : warnings)
    if (std::find(notes.begin(), notes.end(), warning) == notes.end()) notes.push_back(warning);
  return Hologram(std::move(state));
}

}  // namespace

std::vector<Device> list_devices() {
  std::vector<Device> devices;
  for (const auto& d : cl::list_devices())
    devices.push_back(
        {d.index, d.platform, d.name, d.driver, name_of(d.kind), d.memory_bytes, d.fp64});
  return devices;
}

Plan::Plan(std::shared_ptr<const State> state) : state_(std::move(state)) {}
std::string Plan::text() const { return state_->text; }
std::string Plan::json() const { return state_->json; }
std::vector<std::string> Plan::warnings() const { return state_->planned.warnings; }
double Plan::seconds() const { return state_->planned.prediction.times.total_s(); }
std::optional<double> Plan::psnr_db() const {
  const auto& pictures = state_->planned.prediction.pictures;
  if (!pictures) return std::nullopt;
  return pictures->mean_psnr_db;
}
std::uint64_t Plan::device_bytes() const { return state_->planned.prediction.device_bytes; }
Scene Plan::scene() const { return state_->scene; }

Plan plan(const Scene& scene, const Goal& goal, const std::string& device) {
  const auto wanted = goal_of(goal);
  if (wanted.any() && scene.state().is_planned)
    throw InputError("preset, budget and psnr: the scene of a plan has its values chosen");
  DeviceFigures figures;
  if (!device.empty() || !cl::list_devices().empty()) figures = figures_of(device_info(device));
  const auto world = scene.state().world();
  auto planned = plan_scene(scene.state().scene, world, figures, wanted);
  auto chosen = std::make_shared<Scene::State>(scene.state());
  chosen->scene = planned.scene;
  chosen->is_planned = true;
  auto text = plan_report_text(planned, world), json = plan_report_json(planned, world);
  return Plan(std::make_shared<Plan::State>(
      Plan::State{std::move(planned), std::move(text), std::move(json), Scene(std::move(chosen))}));
}

Hologram::Hologram(std::shared_ptr<const State> state) : state_(std::move(state)) {}
int Hologram::nx() const { return state_->result.plan.size.x; }
int Hologram::ny() const { return state_->result.plan.size.y; }
int Hologram::frames() const { return state_->result.plan.frames; }
Pixels Hologram::pixels() const {
  const auto& plan = state_->result.plan;
  return {{plan.pitch_m.x, plan.pitch_m.y}, plan.wavelength_m};
}
std::span<const std::uint8_t> Hologram::levels() const { return state_->levels; }

Levels Hologram::for_slm(int frame) const {
  if (frame < 0 || frame >= frames())
    throw InputError("frame " + std::to_string(frame) + ": there are " + std::to_string(frames()) +
                     ", counted from 0");
  const auto size = static_cast<std::size_t>(nx()) * static_cast<std::size_t>(ny());
  const auto first = state_->levels.begin() + static_cast<std::ptrdiff_t>(size) * frame;
  LevelPicture picture{state_->result.plan.size,
                       {first, first + static_cast<std::ptrdiff_t>(size)}};
  picture = raywave::for_slm(std::move(picture), state_->result.plan.slm);
  return {picture.size_px.x, picture.size_px.y, 1, 8, std::move(picture.levels), {}};
}

FieldView Hologram::field() const {
  const auto& field = state_->result.field;
  return field.samples.empty() ? FieldView{} : view_of(field);
}

std::optional<FieldView> Hologram::refined() const {
  if (!state_->result.refined) return std::nullopt;
  return view_of(state_->result.refined->phases);
}

Field Hologram::shown() const {
  const auto size = static_cast<std::ptrdiff_t>(nx()) * ny();
  std::vector<std::vector<std::uint8_t>> frames_of_levels;
  for (auto at = state_->levels.begin(); at != state_->levels.end(); at += size)
    frames_of_levels.emplace_back(at, at + size);
  return as_field(shown_field(*state_->result.panel, frames_of_levels));
}

std::string Hologram::report() const { return state_->report; }
std::vector<std::string> Hologram::notes() const { return state_->result.notes; }

Hologram render(const Scene& scene, const RenderOptions& options) {
  return Renderer(scene, options).render();
}

struct Renderer::State {
  State(const Scene& scene, const RenderOptions& options)
      : opened(open(options.on)), renderer(make(scene.state(), options)) {}

  raywave::Renderer make(const Scene::State& scene, const RenderOptions& options) {
    auto how = options_of(options, opened);
    if (how.progress) how.progress("meshes", 0);
    const auto& files = scene.read_files();
    if (!goal_of(options.goal).any()) return {opened.device, scene.scene, files, std::move(how)};
    if (how.progress) how.progress("plan", 0);
    auto chosen = planned(scene, scene.world(), options, opened.device.info(), warnings);
    return {opened.device, std::move(chosen), files, std::move(how)};
  }

  std::recursive_mutex mutex;  // a callback's own call finds it locked, and is told so
  bool is_busy = false;
  Opened opened;
  std::vector<std::string> warnings;
  raywave::Renderer renderer;
};

namespace {

/// The turn of one call.
class Turn {
public:
  Turn(std::recursive_mutex& mutex, bool& is_busy) : lock_(mutex), is_busy_(is_busy) {
    if (is_busy)
      throw InputError("the renderer is at work: its progress callback must not call it");
    is_busy = true;
  }
  ~Turn() { is_busy_ = false; }
  Turn(const Turn&) = delete;
  Turn& operator=(const Turn&) = delete;

private:
  std::lock_guard<std::recursive_mutex> lock_;
  bool& is_busy_;
};

}  // namespace

Renderer::Renderer(const Scene& scene, const RenderOptions& options)
    : state_(std::make_unique<State>(scene, options)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

int Renderer::nx() const { return state_->renderer.scene().hologram.resolution.x; }
int Renderer::ny() const { return state_->renderer.scene().hologram.resolution.y; }
int Renderer::frames() const { return state_->renderer.scene().sampling.frames; }
std::size_t Renderer::objects() const { return state_->renderer.scene().objects.size(); }

void Renderer::set_pose(std::size_t object, const Vec3& position_m, const Vec3& rotation_deg) {
  const Turn turn(state_->mutex, state_->is_busy);
  require_pose(object, objects(), position_m, rotation_deg);
  state_->renderer.set_pose(object, vector_of(position_m), vector_of(rotation_deg));
}

void Renderer::set_seed(std::uint32_t seed) {
  const Turn turn(state_->mutex, state_->is_busy);
  state_->renderer.set_seed(seed);
}

Hologram Renderer::render() {
  const Turn turn(state_->mutex, state_->is_busy);
  auto result = state_->renderer.render();
  return hologram_of(state_->renderer.scene(), std::move(result), state_->opened, state_->warnings);
}

void Renderer::render(const RenderTarget& target) {
  const Turn turn(state_->mutex, state_->is_busy);
  const auto result = state_->renderer.render();
  if (target.field && result.field.samples.empty())
    throw InputError("field: this renderer keeps none (RenderOptions::keep_field)");
  auto* to = target.levels;
  for (const auto& frame : result.levels) {
    if (!to) break;
    std::memcpy(to, frame.data(), frame.size());
    to += frame.size();
  }
  if (target.field)
    std::copy(result.field.samples.begin(), result.field.samples.end(), target.field);
}

namespace {

/// The scene's settings, or the defaults, with what the options change.
RefineSettings settings_of(const RefineOptions& options, RefineSettings settings) {
  const auto set = [](auto& setting, const auto& value, const char* name, double least,
                      double most) {
    if (!value) return;
    if (!(*value >= least && *value <= most))
      throw InputError(std::string(name) + ": must be " + number_text(least) + " to " +
                       number_text(most) + ", got " + number_text(static_cast<double>(*value)));
    setting = *value;
  };
  if (options.iterations && options.budget_s)
    throw InputError("iterations and refine_budget: at most 1 of them can be given");
  set(settings.iterations, options.iterations, "iterations", 1, 1e6);
  set(settings.views, options.views, "views", 0, 1000);
  set(settings.lens_points, options.lens_points, "lens_points", 2, 100);
  set(settings.brightness, options.brightness, "brightness", 0.01, 100);
  set(settings.blur_m, options.blur_m, "blur", 1e-9, 1);
  set(settings.budget_s, options.budget_s, "refine_budget", 1e-6, 1e9);
  for (std::size_t i = 0; i < options.depths_m.size(); ++i) {
    const double depth_m = options.depths_m[i];
    if (!(depth_m >= 1e-9 && depth_m <= 1e4) || (i > 0 && !(depth_m > options.depths_m[i - 1])))
      throw InputError("depths: must be > 0 and ascending, got " + number_text(depth_m));
  }
  if (!options.depths_m.empty()) settings.depths_m = options.depths_m;
  return settings;
}

}  // namespace

Hologram refine(const Scene& scene, const RefineOptions& options) {
  auto refined = std::make_shared<Scene::State>(scene.state());
  auto& settings = refined->scene.refine;
  settings = settings_of(options, settings.value_or(RefineSettings{}));
  return render(Scene(std::move(refined)), options.render);
}

Field refine(const FieldView& start, const Pixels& pixels, std::span<const Target> targets,
             const RefineOptions& options) {
  const auto field = field_of(start, "field");
  const auto hologram = hologram_spec(pixels, {field.nx, field.ny});
  if (targets.empty()) throw InputError("targets: there are none");
  std::vector<RefineKey> keys;
  for (const auto& target : targets) {
    RefineKey key;
    if (!(target.z_m >= 1e-9 && target.z_m <= 1e4))
      throw InputError("targets: a depth must be > 0, got " + number_text(target.z_m));
    key.z_m = target.z_m;
    key.view = vector_of(target.view);
    key.aperture = vector_of(target.aperture);
    key.picture = image_of(target.picture, "targets");
    key.pixel_m = hologram.pitch_m;
    keys.push_back(std::move(key));
  }
  auto settings = settings_of(options, {});
  if (!settings.blur_m) settings.blur_m = 4 * hologram.pitch_m.x;
  auto spec = refine_spec(settings, hologram.pitch_m, hologram.wavelength_m, keys);
  spec.progress = progress_of(options.render.progress);
  const auto opened = open(options.render.on);
  return as_field(raywave::refine(opened.device, opened.fft, field, keys, spec).field);
}

}  // namespace raywave::v0
