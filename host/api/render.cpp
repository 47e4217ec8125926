// SPDX-License-Identifier: Apache-2.0
#include "host/render.hpp"

#include <algorithm>
#include <array>
#include <mutex>
#include <nlohmann/json.hpp>
#include <utility>

#include "cl/device.hpp"
#include "host/animate/animate.hpp"
#include "host/api/state.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/encode/pictures.hpp"
#include "host/encode/shown.hpp"
#include "host/evaluate/goal_check.hpp"
#include "host/evaluate/report.hpp"
#include "host/forecast/first_call.hpp"
#include "host/forecast/presets.hpp"
#include "host/forecast/tuning.hpp"
#include "host/plan/message_text.hpp"
#include "host/scene/image.hpp"

namespace raywave::v0 {
namespace {

raywave::RenderOptions options_of(const RenderOptions& options, const Opened& opened) {
  raywave::RenderOptions how;
  how.method = options.method;
  if (options.rays_per_axis < 1 || options.rays_per_axis > 1000)
    throw InputError("rays: must be 1 to 1000, got " + std::to_string(options.rays_per_axis));
  how.rays_per_axis = options.rays_per_axis;
  how.fft = opened.fft;
  how.keep_field = options.keep_field;
  how.progress = progress_of(options.progress);
  return how;
}

/// The scenes with what a goal leaves to the planner.
///
/// how    is given what planning has to say
/// plans  of the goal, by laser; none without a goal
std::vector<raywave::Scene> planned(const Scene::State& scene, const World& world,
                                    const RenderOptions& options, const cl::DeviceInfo& device,
                                    raywave::RenderOptions& how, std::vector<Planned>& plans) {
  auto scenes = scene.scenes;
  if (const auto goal = goal_of(options.goal); goal.any()) {
    if (options.method != Method::wrp)
      throw InputError("preset, budget, psnr and rate plan method \"wrp\" alone");
    if (scene.is_planned)
      throw InputError("preset, budget, psnr and rate: the scene of a plan has its values chosen");
    if (const auto progress = progress_of(options.progress)) progress("plan", 0);
    plans = plan_scenes(scenes, world, figures_of(device), goal);
    for (std::size_t i = 0; i < scenes.size(); ++i) scenes[i] = plans[i].scene;
  }
  how.planned = [plans](const auto&... plan) { return render_warnings(plans, plan...); };
  if (const auto warning = colour_warning(scenes, world); !warning.empty())
    how.planned = [warning, of_plan = std::move(how.planned)](const auto&... plan) {
      auto warnings = of_plan ? of_plan(plan...) : std::vector<std::string>();
      warnings.push_back(warning);
      return warnings;
    };
  return scenes;
}

/// Moves the samples of one laser behind those of the lasers before it.
void append(FieldStack& all, FieldStack field) {
  if (all.samples.empty()) {
    all = std::move(field);
    return;
  }
  all.frames += field.frames;
  all.samples.insert(all.samples.end(), field.samples.begin(), field.samples.end());
}

/// A scene with the values that were chosen.
std::shared_ptr<const Scene::State> chosen(const Scene::State& scene,
                                           std::vector<raywave::Scene> scenes,
                                           std::shared_ptr<const Promise> promise = {}) {
  auto state = std::make_shared<Scene::State>(scene);
  state->promise = std::move(promise);
  state->scenes = std::move(scenes);
  state->is_planned = true;
  return state;
}

std::string text_of(const Json& report) { return report.dump(2) + "\n"; }

/// scene  with the values chosen
Hologram hologram_of(std::shared_ptr<const Scene::State> scene, Rendered result,
                     const Opened& opened, const std::optional<GoalCheck>& check = {}) {
  const auto& scenes = scene->scenes;
  auto state = std::make_shared<Hologram::State>();
  state->scene = scene;
  state->powers = result.powers;
  const auto& device = opened.device.info();
  std::vector<LaserFiles> files;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    const auto& laser = result.lasers[i];
    files.push_back(files_of_laser(laser,
                                   laser_suffix(laser.plan.hologram.wavelength_m, scenes.size()),
                                   !laser.field.samples.empty(), false));
    auto report = render_report_json(scenes[i], laser, device, opened.fft);
    if (check && scenes.size() == 1) report["goal"] = json_of(*check);
    state->lasers.push_back({{}, text_of(report)});
  }
  if (scenes.size() > 1) state->colour = scenes.front().colour.value().lasers;
  state->notes = notes_of(result.lasers);
  auto report = report_json(scenes, result, files, device, opened.fft);
  if (check) report["goal"] = json_of(*check);
  state->report = text_of(report);
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    auto& laser = result.lasers[i];
    for (auto& frame : laser.levels) {
      if (state->levels.empty())
        state->levels = std::move(frame);
      else
        state->levels.insert(state->levels.end(), frame.begin(), frame.end());
      frame = {};
    }
    laser.levels.clear();
    append(state->field, std::exchange(laser.field, {}));
    if (laser.refined) {
      if (!state->refined) state->refined.emplace();
      append(*state->refined, std::exchange(laser.refined->phases, {}));
    }
    state->lasers[i].result = std::move(laser);
  }
  return Hologram(std::move(state));
}

}  // namespace

std::vector<Device> list_devices() {
  std::vector<Device> devices;
  for (const auto& d : cl::list_devices())
    devices.push_back({d.index, d.platform, d.name, d.driver, d.kind, d.memory_bytes, d.fp64});
  return devices;
}

Plan::Plan(std::shared_ptr<const State> state) : state_(std::move(state)) {}
std::string Plan::text() const { return state_->text; }
std::string Plan::json() const { return state_->json; }
std::vector<std::string> Plan::warnings() const { return state_->warnings; }

double Plan::seconds() const {
  double sum = 0;
  for (const auto& laser : state_->planned) sum += laser.prediction.times.total_s();
  return sum;
}

std::optional<double> Plan::psnr_db() const {
  double sum = 0;
  for (const auto& laser : state_->planned) {
    if (!laser.prediction.pictures) return std::nullopt;
    sum += laser.prediction.pictures->mean_psnr_db;
  }
  return sum / static_cast<double>(state_->planned.size());
}

std::uint64_t Plan::device_bytes() const {
  std::uint64_t most = 0;  // the lasers come one after another
  for (const auto& laser : state_->planned) most = std::max(most, laser.prediction.device_bytes);
  return most;
}

Scene Plan::scene() const { return state_->scene; }

Plan plan(const Scene& scene, const Goal& goal, const std::string& device) {
  const auto wanted = goal_of(goal);
  if (wanted.any() && scene.state().is_planned)
    throw InputError("preset, budget, psnr and rate: the scene of a plan has its values chosen");
  DeviceFigures figures;
  if (!device.empty() || !cl::list_devices().empty()) figures = figures_of(device_info(device));
  const auto world = scene.state().world();
  auto planned = plan_scenes(scene.state().scenes, world, figures, wanted);
  std::vector<raywave::Scene> scenes;
  for (const auto& laser : planned) scenes.push_back(laser.scene);
  auto text = plan_report_text(planned, world), json = text_of(plan_report_json(planned, world));
  std::vector<std::pair<double, std::vector<std::string>>> by_laser;
  for (const auto& laser : planned)
    by_laser.emplace_back(laser.plan.hologram.wavelength_m, laser.warnings);
  auto warnings = lines_of_lasers(by_laser);
  if (auto warning = colour_warning(scenes, world); !warning.empty())
    warnings.push_back(std::move(warning));
  std::shared_ptr<const Promise> promise;
  if (wanted.any()) promise = std::make_shared<Promise>(Promise{wanted, planned});
  return Plan(std::make_shared<Plan::State>(
      Plan::State{std::move(planned), std::move(text), std::move(json), std::move(warnings),
                  Scene(chosen(scene.state(), scenes, std::move(promise)))}));
}

Hologram::Hologram(std::shared_ptr<const State> state)
    : state_(std::move(state)), lasers_(state_->lasers.size()) {}
Hologram::Hologram(std::shared_ptr<const State> state, std::size_t first, std::size_t lasers)
    : state_(std::move(state)), first_(first), lasers_(lasers) {}
int Hologram::nx() const { return state_->lasers[first_].result.plan.hologram.size.x; }
int Hologram::ny() const { return state_->lasers[first_].result.plan.hologram.size.y; }
int Hologram::frames() const { return state_->lasers[first_].result.plan.hologram.frames; }
Pixels Hologram::pixels() const {
  const auto& plan = state_->lasers[first_].result.plan;
  return {{plan.hologram.pitch_m.x, plan.hologram.pitch_m.y},
          lasers_ > 1 ? 0 : plan.hologram.wavelength_m};
}

int Hologram::lasers() const { return static_cast<int>(lasers_); }

std::vector<double> Hologram::wavelengths_m() const {
  std::vector<double> all;
  for (std::size_t i = 0; i < lasers_; ++i)
    all.push_back(state_->lasers[first_ + i].result.plan.hologram.wavelength_m);
  return all;
}

std::vector<double> Hologram::powers() const {
  if (lasers_ == 1) return {1};
  return state_->powers;
}

Hologram Hologram::laser(int number) const {
  require_one_of("laser", number, lasers());
  return {state_, first_ + static_cast<std::size_t>(number), 1};
}

std::span<const std::uint8_t> Hologram::levels() const {
  const auto size = state_->size();
  return std::span(state_->levels).subspan(first_ * size, lasers_ * size);
}

Levels Hologram::for_slm(int frame) const {
  if (lasers_ > 1)
    throw InputError(
        "for_slm: of several lasers, ask the hologram of one for the picture it needs");
  require_one_of("frame", frame, frames());
  const auto& plan = state_->lasers[first_].result.plan;
  const auto size = static_cast<std::size_t>(nx()) * static_cast<std::size_t>(ny());
  const auto all = levels().subspan(size * static_cast<std::size_t>(frame), size);
  LevelPicture picture{plan.hologram.size, {all.begin(), all.end()}};
  picture = raywave::for_slm(std::move(picture), plan.slm);
  return {picture.size_px.x, picture.size_px.y, 1, 8, std::move(picture.levels), {}};
}

void Hologram::save(const std::filesystem::path& file, std::optional<int> frame, bool rgb) const {
  if (extension_of(file) != ".png")
    throw InputError("path must end with .png, the format written, got " +
                     in_quotes(file.string()));
  if (rgb && lasers() != 3)
    throw InputError("rgb: packs the holograms of three lasers, and this has " +
                     std::to_string(lasers()));
  const auto wavelengths = wavelengths_m();
  for (int n = 0; n < (frame ? 1 : frames()); ++n) {
    const auto suffix = n == 0 ? "" : "_" + std::to_string(n + 1);
    const auto named = [&](const std::string& laser) {
      auto name = file;
      return name.replace_filename(file.stem().string() + laser + suffix +
                                   file.extension().string());
    };
    std::array<LevelPicture, 3> pictures;
    for (std::size_t i = 0; i < lasers_; ++i) {
      auto sent = laser(static_cast<int>(i)).for_slm(frame.value_or(n));
      if (rgb)
        pictures[i] = {{sent.nx, sent.ny}, std::move(sent.values)};
      else
        save_picture(named(laser_suffix(wavelengths[i], lasers_)), sent.nx, sent.ny,
                     std::span<const std::uint8_t>(sent.values));
    }
    if (rgb)
      save_picture(named(""), pictures[0].size_px.x, pictures[0].size_px.y,
                   packed_rgb(pictures, {wavelengths[0], wavelengths[1], wavelengths[2]}));
  }
}

namespace {

/// Some lasers of a field of all.
FieldView part_of(const FieldStack& field, const Hologram& hologram, std::size_t first) {
  if (field.samples.empty()) return {};
  const int frames = hologram.lasers() * hologram.frames();
  const auto size = static_cast<std::size_t>(field.nx) * static_cast<std::size_t>(field.ny) *
                    static_cast<std::size_t>(hologram.frames());
  return {field.nx, field.ny, frames, field.samples.data() + first * size};
}

}  // namespace

FieldView Hologram::field() const { return part_of(state_->field, *this, first_); }

std::optional<FieldView> Hologram::refined() const {
  if (!state_->refined) return std::nullopt;
  return part_of(*state_->refined, *this, first_);
}

Field Hologram::shown() const {
  const auto size = static_cast<std::ptrdiff_t>(nx()) * ny();
  FieldStack all;
  for (std::size_t laser = first_; laser < first_ + lasers_; ++laser) {
    const auto levels = this->laser(static_cast<int>(laser - first_)).levels();
    std::vector<std::vector<std::uint8_t>> frames_of_levels;
    for (auto at = levels.begin(); at != levels.end(); at += size)
      frames_of_levels.emplace_back(at, at + size);
    append(all, shown_field(*state_->lasers[laser].result.panel, frames_of_levels));
  }
  return as_field(std::move(all));
}

Scene Hologram::scene() const {
  if (lasers_ == state_->lasers.size()) return Scene(state_->scene);
  auto scenes = state_->scene->scenes;
  scenes.erase(scenes.begin() + static_cast<std::ptrdiff_t>(first_ + lasers_), scenes.end());
  scenes.erase(scenes.begin(), scenes.begin() + static_cast<std::ptrdiff_t>(first_));
  return Scene(chosen(*state_->scene, std::move(scenes)));
}

Rendered rendered_of(const Hologram& hologram) {
  Rendered all;
  const auto field = hologram.field();
  const auto levels = hologram.levels();
  const auto size = static_cast<std::ptrdiff_t>(hologram.nx()) * hologram.ny();
  for (int i = 0; i < hologram.lasers(); ++i) {
    auto laser =
        hologram.state().lasers[hologram.first_laser() + static_cast<std::size_t>(i)].result;
    laser.field = {field.nx, field.ny, hologram.frames(), {}};
    for (int frame = i * hologram.frames(); frame < (i + 1) * hologram.frames(); ++frame) {
      const auto* samples = field.values + frame * size;
      laser.field.samples.insert(laser.field.samples.end(), samples, samples + size);
      const auto* shown = levels.data() + frame * size;
      laser.levels.emplace_back(shown, shown + size);
    }
    all.lasers.push_back(std::move(laser));
  }
  all.powers = hologram.powers();
  return all;
}

std::string Hologram::report() const {
  return lasers_ == state_->lasers.size() ? state_->report : state_->lasers[first_].report;
}

std::vector<std::string> Hologram::notes() const {
  return lasers_ == state_->lasers.size() ? state_->notes : state_->lasers[first_].result.notes;
}

Hologram render(const Scene& scene, const RenderOptions& options) {
  const auto opened = open(options.on);
  auto how = options_of(options, opened);
  if (how.progress) how.progress("meshes", 0);
  auto world = scene.state().world();
  std::vector<Planned> plans;
  const auto scenes = planned(scene.state(), world, options, opened.device.info(), how, plans);
  const auto& promise = scene.state().promise;
  if (promise) plans = promise->planned;
  const auto goal = promise ? promise->goal : goal_of(options.goal);
  const auto judged = goal.psnr_db ? world : World();
  auto rendered = raywave::render(opened.device, scenes, std::move(world), how);
  for (const auto& laser : rendered.lasers)
    if (opened.device.info().online_compiler)
      remember_kernels(laser.plan, figures_of(opened.device.info()), laser.seconds,
                       laser.processor_seconds);
  const auto check = check_goal(opened.device, goal, plans, judged, rendered, how);
  return hologram_of(chosen(scene.state(), scenes), std::move(rendered), opened, check);
}

struct Animation::State {
  State(const Scene& scene, const RenderOptions& options)
      : opened(open(options.on)), rate_per_s(checked(scene.state()).animation->rate_per_s) {
    auto how = options_of(options, opened);
    if (how.progress) how.progress("plan of all pictures", 0);
    std::vector<Planned> plans;
    const auto scenes =
        planned(scene.state(), scene.state().world(), options, opened.device.info(), how, plans);
    animator.emplace(opened.device, scenes, opened.fft);
    notes = animator->notes(how.planned);
    progress = how.progress;
  }

  static const raywave::Scene& checked(const Scene::State& state) {
    const auto& scene = state.scene();
    if (!scene.animation)
      throw InputError(
          "scene: nothing moves: add [animation] with frames = 240 and [[animation.track]], or use "
          "render");
    for (std::size_t i = 0; i < state.meshes.size(); ++i)
      if (state.meshes[i])
        throw InputError("object " + std::to_string(i) +
                         ": an animation reads meshes from files, and this lies in memory: save "
                         "it, or use a Renderer");
    return scene;
  }

  std::recursive_mutex mutex;
  bool is_busy = false;
  Opened opened;
  double rate_per_s;
  std::optional<Animator> animator;
  std::vector<std::string> notes;
  raywave::Progress progress;
  std::optional<Animator::Pictures> pictures;  // from the first that is asked for
};

struct Renderer::State {
  State(const Scene& scene, const RenderOptions& options)
      : of(scene), opened(open(options.on)), how(options_of(options, opened)) {
    if (how.progress) how.progress("meshes", 0);
    auto world = of.state().world();
    std::vector<Planned> plans;
    scenes = planned(of.state(), world, options, opened.device.info(), how, plans);
    renderer.emplace(opened.device, scenes, std::move(world), how);
  }

  /// Begins anew with another mesh, everything else as it is now.
  void set_mesh(std::size_t object, const MeshView& mesh) {
    auto with_mesh = of;
    with_mesh.set_mesh(object, mesh);
    auto now = scenes_now();
    for (auto& scene : now) scene.objects[object].mesh = in_memory;
    const auto& files = with_mesh.state().read_files();
    auto world = place_objects(now.front(), files.meshes, files.textures);
    renderer.emplace(opened.device, now, std::move(world), how);
    scenes = std::move(now);
    of = std::move(with_mesh);
  }

  void set_light(std::size_t light, const std::vector<std::string>& values) {
    require_one_of("light", light, scenes[0].lights.size());
    auto changes = of_lights;
    for (const auto& value : values)
      changes.push_back("light." + std::to_string(light) + "." + value);
    auto overrides = of.overrides();
    overrides.insert(overrides.end(), changes.begin(), changes.end());
    renderer->set_light(light, parse_scenes(of.state().text, overrides).front().lights[light]);
    of_lights = std::move(changes);
  }

  std::vector<raywave::Scene> scenes_now() const {
    std::vector<raywave::Scene> now;
    for (std::size_t i = 0; i < scenes.size(); ++i) now.push_back(renderer->scene(i));
    return now;
  }

  Rendered render() {
    auto rendered = renderer->render_lasers();
    notes = notes_of(rendered.lasers);
    return rendered;
  }

  std::recursive_mutex mutex;  // a callback's own call finds it locked, and is told so
  bool is_busy = false;
  Scene of;
  Opened opened;
  raywave::RenderOptions how;
  std::vector<raywave::Scene> scenes;         // of each laser
  std::vector<std::string> of_lights;         // overrides since
  std::vector<std::string> notes;             // of the last picture
  std::optional<raywave::Renderer> renderer;  // of all lasers
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

Animation::Animation(const Scene& scene, const RenderOptions& options)
    : state_(std::make_unique<State>(scene, options)) {}
Animation::~Animation() = default;
Animation::Animation(Animation&&) noexcept = default;
Animation& Animation::operator=(Animation&&) noexcept = default;

int Animation::pictures() const { return state_->animator->schedule().pictures(); }
double Animation::rate_per_s() const { return state_->rate_per_s; }
double Animation::slm_rate_per_s() const { return state_->animator->schedule().slm_rate_per_s(); }
std::vector<std::string> Animation::notes() const { return state_->notes; }

std::vector<double> Animation::wavelengths_m() const {
  std::vector<double> all;
  for (std::size_t i = 0; i < state_->animator->lasers(); ++i)
    all.push_back(state_->animator->plan(i).hologram.wavelength_m);
  return all;
}

AnimationPicture Animation::render(int picture) {
  const Turn turn(state_->mutex, state_->is_busy);
  require_one_of("picture", picture, pictures());
  const auto& animator = *state_->animator;
  if (!state_->pictures) state_->pictures.emplace(animator, state_->progress);
  auto made = state_->pictures->make(picture);
  animator.turn(made.levels);
  AnimationPicture result;
  result.time_s = picture / rate_per_s();
  const auto size = animator.stored_size();
  result.levels = {size.x, size.y, static_cast<int>(made.levels.size()), 8, {}, {}};
  const auto lasers = animator.lasers();
  result.holograms = static_cast<int>(made.levels.size() / lasers);
  for (std::size_t laser = 0; laser < lasers; ++laser)
    for (auto at = laser; at < made.levels.size(); at += lasers)
      result.levels.values.insert(result.levels.values.end(), made.levels[at].begin(),
                                  made.levels[at].end());
  result.powers = std::move(made.powers);
  result.notes = std::move(made.notes);
  return result;
}

Renderer::Renderer(const Scene& scene, const RenderOptions& options)
    : state_(std::make_unique<State>(scene, options)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

int Renderer::nx() const { return state_->scenes[0].hologram.resolution.x; }
int Renderer::ny() const { return state_->scenes[0].hologram.resolution.y; }
int Renderer::frames() const { return state_->scenes[0].sampling.frames; }
std::size_t Renderer::objects() const { return state_->scenes[0].objects.size(); }

std::vector<std::string> Renderer::notes() const { return state_->notes; }

std::vector<double> Renderer::wavelengths_m() const {
  std::vector<double> all;
  for (const auto& scene : state_->scenes) all.push_back(scene.hologram.wavelength_m);
  return all;
}

void Renderer::set_pose(std::size_t object, const Vec3& position_m, const Vec3& rotation_deg,
                        bool is_solid) {
  const Turn turn(state_->mutex, state_->is_busy);
  require_pose(object, objects(), position_m, rotation_deg);
  const auto place_m = vector_of(position_m), turned_deg = vector_of(rotation_deg);
  is_solid ? state_->renderer->set_solid_pose(object, place_m, turned_deg)
           : state_->renderer->set_pose(object, place_m, turned_deg);
}

void Renderer::set_mesh(std::size_t object, const MeshView& mesh) {
  const Turn turn(state_->mutex, state_->is_busy);
  state_->set_mesh(object, mesh);
}

void Renderer::set_light(std::size_t light, const std::vector<std::string>& values) {
  const Turn turn(state_->mutex, state_->is_busy);
  state_->set_light(light, values);
}

void Renderer::set_seed(std::uint32_t seed) {
  const Turn turn(state_->mutex, state_->is_busy);
  state_->renderer->set_seed(seed);
}

Hologram Renderer::render() {
  const Turn turn(state_->mutex, state_->is_busy);
  auto result = state_->render();
  return hologram_of(chosen(state_->of.state(), state_->scenes_now()), std::move(result),
                     state_->opened);
}

std::vector<double> Renderer::render(const RenderTarget& target) {
  const Turn turn(state_->mutex, state_->is_busy);
  if (target.field && !state_->how.keep_field)
    throw InputError("field: this renderer keeps none (RenderOptions::keep_field)");
  const auto result = state_->render();
  auto* levels = target.levels;
  auto* field = target.field;
  for (const auto& laser : result.lasers) {
    for (const auto& frame : laser.levels)
      if (levels) levels = std::copy(frame.begin(), frame.end(), levels);
    if (field) field = std::copy(laser.field.samples.begin(), laser.field.samples.end(), field);
  }
  return result.powers;
}

}  // namespace raywave::v0
