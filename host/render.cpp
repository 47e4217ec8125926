// SPDX-License-Identifier: Apache-2.0
#include "host/render.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <ctime>
#include <memory>
#include <numbers>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/encode/encode.hpp"
#include "host/plan/memory.hpp"
#include "host/propagate/propagator.hpp"
#include "host/trace/fan_tracer.hpp"
#include "host/trace/gatherer.hpp"
#include "host/trace/interpolator.hpp"

namespace raywave {
namespace {

/// Of all threads of this process.
double processor_seconds_now() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Adds the seconds between its birth and its end to a stage, by the wall's clock and by the
/// processor's.
class StageClock {
public:
  StageClock(const cl::Device& device, double& seconds, double& processor_seconds)
      : device_(device), seconds_(seconds), processor_seconds_(processor_seconds) {}
  ~StageClock() {
    seconds_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    processor_seconds_ += processor_seconds_now() - processor_start_;
  }
  StageClock(const StageClock&) = delete;
  StageClock& operator=(const StageClock&) = delete;

  /// Launches return before their work is done.
  void wait() const { device_.finish(); }

private:
  const cl::Device& device_;
  double &seconds_, &processor_seconds_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double processor_start_ = processor_seconds_now();
};

/// The fields on the WRPs, by aimed samples or by fans of rays.
class FieldSource {
public:
  FieldSource(const cl::Device& device, const Scene& scene, const Plan& plan,
              const DeviceScene& arrays, int frames) {
    const bool snapped = scene.sampling.source == FanSource::surface;
    if (plan.aimed || snapped)
      table_ = std::make_unique<SampleTable>(device, plan, arrays, !plan.aimed);
    if (plan.aimed) gatherer_ = std::make_unique<Gatherer>(device, plan, arrays, *table_, frames);
    if (plan.aimed && plan.bounces > 0)
      tracer_ = std::make_unique<Tracer>(device, scene, plan, arrays, HitSource::bounced);
    if (!plan.aimed)
      tracer_ = std::make_unique<Tracer>(
          device, scene, plan, arrays, snapped ? HitSource::surface : HitSource::hit, table_.get());
  }

  int samples() const { return table_ ? table_->count : 0; }
  int hidden_samples() const { return table_ ? table_->hidden : 0; }

  /// After the scene has moved.
  void find_samples(const Plan& plan, const DeviceScene& arrays) {
    if (table_) table_->find(plan, arrays);
  }

  /// Begins the frames seed, seed + 1, ...
  void start(std::uint32_t seed) {
    seed_ = seed;
    if (gatherer_) gatherer_->draw_phases(seed);
  }

  void fill(const Wrp& wrp, cl::ComplexBuffer& stack) {
    if (gatherer_) gatherer_->gather(wrp, stack);
    if (tracer_) tracer_->trace(wrp, seed_, stack);
  }

private:
  std::unique_ptr<SampleTable> table_;
  std::unique_ptr<Gatherer> gatherer_;
  std::unique_ptr<Tracer> tracer_;
  std::uint32_t seed_ = 0;
};

/// Fields in the scene's own brightness.
void brighten(std::span<std::complex<float>> field, double radiance_unit, const Scene& scene) {
  if (radiance_unit == 1) return;
  const double factor = std::sqrt(radiance_unit);
  for (auto& sample : field) {
    sample = std::complex<float>(std::complex<double>(sample) * factor);
    if (!std::isfinite(sample.real()) || !std::isfinite(sample.imag()))
      throw InputError(
          scene.file.string() +
          ": the hologram's field is brighter than a float holds; give a smaller light.intensity");
  }
}

void require_rays(const Scene& scene, const Plan& plan) {
  if (plan.aimed || std::any_of(plan.wrps.begin(), plan.wrps.end(),
                                [](const Wrp& wrp) { return !wrp.fan.empty(); }))
    return;
  const auto degrees = [](double sine) {
    return number_text(std::asin(sine) * 180 / std::numbers::pi) + " degrees";
  };
  throw InputError(scene.file.string() +
                   ": no ray of the fan is as flat as the hologram's pixels can show, " +
                   degrees(plan.largest_sine.x) + " x " + degrees(plan.largest_sine.y) +
                   " off the axis; give a smaller sampling.pitch or hologram.pitch, or bring the "
                   "scene to the axis");
}

/// Refuses what device or host have no memory for before any is taken. Surface samples are not
/// known yet.
void require_memory(const cl::Device& device, const Scene& scene, const MemoryNeeds& needs,
                    const MemoryLimits& limits) {
  cl::require_memory(device, needs.device);
  if (const auto bytes = needs.host_bytes + (limits.device_on_host ? needs.device_bytes() : 0);
      bytes > limits.host_bytes) {
    const auto& size = scene.hologram.resolution;
    throw InputError(
        scene.file.string() + ": " + std::to_string(scene.sampling.frames) + " frames of " +
        std::to_string(size.x) + " x " + std::to_string(size.y) + " pixels need " +
        cl::format_bytes(bytes) + " of memory, there are " + cl::format_bytes(limits.host_bytes) +
        "; give fewer sampling.frames, a smaller hologram.resolution or more hologram.tiles");
  }
}

/// What the kernels of a FieldSource are built for.
bool same_kernels(const Plan& a, const Plan& b) {
  return a.aimed == b.aimed && a.bounces == b.bounces && a.antialias == b.antialias &&
         a.visibility_parts == b.visibility_parts && a.beyond_diffraction == b.beyond_diffraction &&
         a.precision == b.precision;
}

}  // namespace

struct Renderer::State {
  State(const cl::Device& the_device, Scene the_scene, RenderOptions the_options)
      : device(the_device),
        scene(std::move(the_scene)),
        options(std::move(the_options)),
        encode(device) {
    report("meshes", 0);
    {
      const auto clock = stage("meshes");
      world = build_world(scene);
    }
    prepare();
  }

  State(const cl::Device& the_device, Scene the_scene, const Meshes& meshes,
        RenderOptions the_options)
      : State(the_device, the_scene, place_objects(the_scene, meshes), std::move(the_options)) {}

  State(const cl::Device& the_device, Scene the_scene, World the_world, RenderOptions the_options)
      : device(the_device),
        scene(std::move(the_scene)),
        options(std::move(the_options)),
        world(std::move(the_world)),
        encode(device) {
    prepare();
  }

  void prepare() {
    const auto limits = limits_of(device.info());
    const MemoryUse use{options.method, options.fft, options.keep_field};
    plan = fitting_plan(scene, world, limits, use, options.rays_per_axis, device.info().fp64);
    scene.hologram.tiles = plan.tile_grid;  // when the scene moves, too
    require_rays(scene, plan);
    together = frames_together(scene, plan, device.info().largest_buffer_bytes);
    require_memory(device, scene,
                   memory_needs(scene, world, plan, use, limits.largest_buffer_bytes), limits);
    if (options.method == Method::wrp) {
      const auto clock = stage("prepare");
      propagator = std::make_unique<Propagator>(
          device, PropagatorSpec{plan.tile_size, plan.pitch_m, plan.wavelength_m, scene.wrp.padding,
                                 options.fft});
      require_reach();
    }
    report("tree and kernels", 0);
    {
      const auto clock = stage("prepare");
      arrays = std::make_unique<DeviceScene>(device, scene, world, plan);
    }
    seconds["tree"] = arrays->tree_seconds;
    seconds["prepare"] -= arrays->tree_seconds;
    build_source();
    field = {device, tile_pixels(), "field at the hologram"};
  }

  /// throws  InputError when no light of a WRP arrives at the hologram
  void require_reach() const {
    for (const auto& wrp : plan.wrps) {
      try {
        propagator->require_reach(target_of(wrp));
      } catch (const InputError& error) {
        throw InputError(scene.file.string() + ": WRPs " + std::to_string(plan.grid.x) + " x " +
                         std::to_string(plan.grid.y) + ": " + error.what());
      }
    }
  }

  StageClock stage(const char* name) {
    return StageClock(device, seconds[name], processor_seconds[name]);
  }

  void report(const std::string& what, double share) const {
    if (options.progress) options.progress(what, share);
  }

  std::size_t pixels() const {
    return static_cast<std::size_t>(plan.size.x) * static_cast<std::size_t>(plan.size.y);
  }
  std::size_t tile_pixels() const {
    return static_cast<std::size_t>(plan.tile_size.x) * static_cast<std::size_t>(plan.tile_size.y);
  }

  /// The tile, seen from a WRP.
  Target target_of(const Wrp& wrp) const {
    return {plan.tile_of(wrp).centre_m - glm::dvec2(wrp.centre_m), wrp.centre_m.z};
  }

  /// Begins to copy the pixels of a tile into those of the hologram.
  template <class T>
  cl::Copy start_reading_tile(const cl::Buffer<T>& from, const Tile& tile,
                              std::span<T> hologram) const {
    const auto at = static_cast<std::size_t>(tile.first.y) * static_cast<std::size_t>(plan.size.x) +
                    static_cast<std::size_t>(tile.first.x);
    return from.start_reading_rows(hologram.data() + at, static_cast<std::size_t>(plan.tile_size.x),
                                   static_cast<std::size_t>(plan.size.x));
  }

  void build_source() {
    const auto clock = stage("samples");
    together = frames_together(scene, plan, device.info().largest_buffer_bytes);
    source = nullptr;  // before the new one asks for memory
    source = std::make_unique<FieldSource>(device, scene, plan, *arrays, together);
    clock.wait();
  }

  /// Everything that depends on where objects and lights are.
  void place() {
    {
      const auto clock = stage("meshes");
      move_objects(scene, world);
    }
    const auto before = plan;
    {
      const auto clock = stage("plan");
      plan = make_plan(scene, world, options.method, options.rays_per_axis, device.info().fp64,
                       &before);
    }
    require_rays(scene, plan);
    if (propagator) require_reach();
    const auto options_before = arrays->options;
    {
      const auto clock = stage("tree");
      arrays->place(scene, world, plan);
    }
    if (same_kernels(before, plan) && arrays->options == options_before &&
        frames_together(scene, plan, device.info().largest_buffer_bytes) == together) {
      const auto clock = stage("samples");
      source->find_samples(plan, *arrays);
      clock.wait();
    } else {
      build_source();
    }
  }

  RenderResult render();
  void prepare_planes();
  void add_wrps(std::size_t first, std::size_t end, std::size_t frame, RenderResult& result);

  cl::Device device;
  Scene scene;
  RenderOptions options;
  World world;
  Plan plan;
  std::map<std::string, double> seconds, processor_seconds;
  std::unique_ptr<DeviceScene> arrays;
  std::unique_ptr<FieldSource> source;  // refers to plan and arrays
  std::unique_ptr<Propagator> propagator;
  PhaseEncoder encode;
  int together = 1;                       // frames gathered at once
  std::vector<cl::ComplexBuffer> stacks;  // as gathered
  std::unique_ptr<Interpolator> interpolator;
  cl::ComplexBuffer interpolated;  // one frame of a WRP
  cl::ComplexBuffer field;
  bool moved = false;
};

RenderResult Renderer::State::render() {
  if (moved) place();
  moved = false;
  prepare_planes();

  RenderResult result;
  result.plan = plan;
  if (const double farthest_m = plan.layers.back().distance_m;
      propagator && farthest_m > propagator->farthest_m())
    result.notes.push_back(
        "from " + length_text(farthest_m) +
        " away light gets lost: a padded plane this small samples enough directions up to " +
        length_text(propagator->farthest_m()) + "; --method points has no such limit");
  result.samples = source->samples();
  result.hidden_samples = source->hidden_samples();
  const auto frames = static_cast<std::size_t>(scene.sampling.frames);
  result.levels.assign(frames, std::vector<std::uint8_t>(pixels()));
  if (options.keep_field)
    result.field = {plan.size.x, plan.size.y, scene.sampling.frames,
                    std::vector<std::complex<float>>(frames * pixels())};
  if (options.keep_wrps)
    result.wrps.assign(plan.wrps.size(),
                       {plan.tile_size.x, plan.tile_size.y, scene.sampling.frames, {}});

  // The levels of a frame come to the host while the next one is computed. They write into the
  // result, so they go before it.
  std::array<cl::Copy, PhaseEncoder::buffers> copies;
  std::size_t encoded = 0, first_wrp = 0;
  for (std::size_t i = 0; i < plan.tiles.size(); ++i) {
    auto end = first_wrp;
    while (end < plan.wrps.size() && plan.wrps[end].tile == i) ++end;
    for (std::size_t frame = 0; frame < frames; ++frame) {
      add_wrps(first_wrp, end, frame, result);
      if (propagator) {
        const auto clock = stage("propagate");
        propagator->collect(field);
        clock.wait();
      }
      {
        const auto clock = stage("encode");
        const auto buffer = encoded++ % copies.size();
        copies[buffer].wait();
        copies[buffer] = start_reading_tile(encode.levels_of(field, buffer), plan.tiles[i],
                                            std::span(result.levels[frame]));
        clock.wait();
      }
      if (options.keep_field)
        start_reading_tile(field, plan.tiles[i],
                           std::span(result.field.samples).subspan(frame * pixels(), pixels()))
            .wait();
    }
    first_wrp = end;
  }
  {
    const auto clock = stage("encode");
    for (auto& copy : copies) copy.wait();
  }
  brighten(result.field.samples, arrays->radiance_unit, scene);
  if (const auto& samples = result.field.samples;
      options.keep_field && std::all_of(samples.begin(), samples.end(),
                                        [](const auto& z) { return z == std::complex<float>(); }))
    result.notes.emplace_back(
        "the hologram is dark: no light comes from the scene at angles that its pixels can show");
  report("done", 1);
  result.device_peak_bytes = device.peak_bytes();
  result.seconds = std::exchange(seconds, {});
  result.processor_seconds = std::exchange(processor_seconds, {});
  return result;
}

/// Memory for the fields on WRPs.
void Renderer::State::prepare_planes() {
  // Frames gathered together wait for each other's WRPs; one frame alone needs one field at a time.
  const std::size_t stack_size = static_cast<std::size_t>(together) * plan.gathered_pixels();
  stacks.resize(together > 1 ? plan.most_wrps_of_a_tile() : 1);
  for (auto& stack : stacks) {
    if (stack.size() >= stack_size) continue;
    stack = {};  // before the new one is asked for
    stack = {device, stack_size, "fields of a WRP"};
  }
  if (!interpolator && std::any_of(plan.layers.begin(), plan.layers.end(),
                                   [](const DepthLayer& layer) { return layer.interpolates(); })) {
    interpolator = std::make_unique<Interpolator>(device);
    interpolated = {device, tile_pixels(), "field of a WRP"};
  }
}

/// Traces a tile's WRPs, numbers `first` to before `end`, and loads them into the propagator;
/// without one, the only one into `field`.
void Renderer::State::add_wrps(std::size_t first, std::size_t end, std::size_t frame,
                               RenderResult& result) {
  const auto frames = static_cast<std::size_t>(scene.sampling.frames);
  const int within = static_cast<int>(frame) % together;
  if (within == 0) source->start(scene.sampling.seed + static_cast<std::uint32_t>(frame));
  for (std::size_t i = first; i < end; ++i) {
    const auto& wrp = plan.wrps[i];
    auto& stack = stacks[together > 1 ? i - first : 0];
    report("WRP " + std::to_string(i + 1) + " of " + std::to_string(plan.wrps.size()) +
               (frames > 1 ? ", frame " + std::to_string(frame + 1) : ""),
           static_cast<double>(frames * first + frame * (end - first) + (i - first)) /
               static_cast<double>(frames * plan.wrps.size()));
    if (within == 0) {
      const auto clock = stage("trace");
      source->fill(wrp, stack);
      clock.wait();
    }
    const bool interpolates = plan.layer_of(wrp).interpolates();
    if (interpolates) {
      const auto clock = stage("trace");
      interpolator->interpolate(plan, wrp, stack, within, interpolated);
      clock.wait();
    }
    const auto& on_wrp = interpolates ? interpolated : stack;
    const int place = interpolates ? 0 : within;
    if (options.keep_wrps) {
      std::vector<std::complex<float>> samples(tile_pixels());
      on_wrp.read(samples, static_cast<std::size_t>(place) * tile_pixels());
      brighten(samples, arrays->radiance_unit, scene);
      result.wrps[i].samples.insert(result.wrps[i].samples.end(), samples.begin(), samples.end());
    }
    if (!propagator) {
      field.copy_from(on_wrp, static_cast<std::size_t>(place) * tile_pixels());
      continue;
    }
    const auto clock = stage("propagate");
    const auto tile = target_of(wrp);
    propagator->load(on_wrp, place, {&tile, 1});
    propagator->add(tile);
    clock.wait();
  }
}

Renderer::Renderer(const cl::Device& device, Scene scene, RenderOptions options)
    : state_(std::make_unique<State>(device, std::move(scene), std::move(options))) {}
Renderer::Renderer(const cl::Device& device, Scene scene, const Meshes& meshes,
                   RenderOptions options)
    : state_(std::make_unique<State>(device, std::move(scene), meshes, std::move(options))) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;

const Scene& Renderer::scene() const { return state_->scene; }

void Renderer::set_pose(std::size_t object, glm::dvec3 position_m, glm::dvec3 rotation_deg) {
  auto& o = state_->scene.objects.at(object);
  o.position_m = position_m;
  o.rotation_deg = rotation_deg;
  state_->moved = true;
}

void Renderer::set_light(std::size_t light, const Light& value) {
  auto& l = state_->scene.lights.at(light);
  if ((l.type == LightType::ambient) != (value.type == LightType::ambient))
    throw InputError("light " + std::to_string(light) +
                     ": an ambient light cannot become another kind, nor another kind ambient");
  l = value;
  state_->moved = true;
}

void Renderer::set_seed(std::uint32_t seed) { state_->scene.sampling.seed = seed; }

RenderResult Renderer::render() { return state_->render(); }

Renderer::Renderer(std::unique_ptr<State> state) : state_(std::move(state)) {}

RenderResult render(const cl::Device& device, const Scene& scene, const RenderOptions& options) {
  return Renderer(device, scene, options).render();
}

RenderResult render(const cl::Device& device, const Scene& scene, const World& world,
                    const RenderOptions& options) {
  return Renderer(std::make_unique<Renderer::State>(device, scene, world, options)).render();
}

}  // namespace raywave
