// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/bench/bench.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <numeric>

#include "host/carriers/planning/facts.hpp"
#include "host/evaluate/stopwatch.hpp"
#include "host/forecast/cost.hpp"
#include "host/forecast/judged_pictures.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/plan/lattice.hpp"
#include "host/planning/make_plan.hpp"
#include "host/trace/device_scene.hpp"

namespace raywave {
namespace {

constexpr int fewest_frames = 3, most_frames = 101;
// Frames cycle through this number of poses, so that medians do not depend on the number of frames.
constexpr int poses = 16;
constexpr double turn_deg = 0.25;
constexpr double long_s = 4;  // one warm-up frame is enough when it takes longer

std::uint64_t resident_bytes() {
  std::uint64_t pages = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  return resident * static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE));
}

/// Busy and total seconds of all processors since the machine started.
struct MachineTime {
  double busy_s = 0, all_s = 0;
};

MachineTime machine_time() {
  std::ifstream stat("/proc/stat");
  std::string cpu;
  MachineTime time;
  stat >> cpu;
  double ticks = 0;  // user, nice, system, idle, iowait, irq, softirq, steal
  for (int i = 0; i < 8 && stat >> ticks; ++i) {
    const double seconds = ticks / static_cast<double>(sysconf(_SC_CLK_TCK));
    time.all_s += seconds;
    if (i != 3 && i != 4) time.busy_s += seconds;
  }
  return time;
}

/// Share of the machine's processor time since `then` that other processes used; this process used
/// processor_s.
double others_share(const MachineTime& then, double processor_s) {
  const auto now = machine_time();
  if (!(now.all_s > then.all_s)) return 0;
  return std::clamp((now.busy_s - then.busy_s - processor_s) / (now.all_s - then.all_s), 0.0, 1.0);
}

void add_work(const Plan& plan, Method method, cl::FftBackend backend,
              std::map<std::string, StageWork>& work) {
  const double holograms = plan.hologram.frames;
  const double pixels = static_cast<double>(plan.hologram.size.x) * plan.hologram.size.y,
               field = 8 * pixels * holograms;
  const auto wrps = static_cast<double>(plan.wrps.size());
  work["trace"].bytes += wrps * field;
  if (method == Method::wrp) {
    work["propagate"].operations += holograms * transform_operations(plan, backend);
    work["propagate"].bytes += (wrps + 1) * field;
  }
  // Levels are written, read, and written to host memory.
  work["encode"].bytes += field + 3 * holograms * pixels;
}

BenchFrame timed_frame(Renderer& renderer, const std::vector<Scene>& scenes, int number,
                       Rendered& result) {
  const auto& objects = scenes[0].objects;
  BenchFrame frame;
  const Stopwatch watch;
  for (std::size_t i = 0; i < objects.size(); ++i)
    renderer.set_pose(i, objects[i].position_m,
                      objects[i].rotation_deg + glm::dvec3(0, turn_deg * (1 + number % poses), 0));
  result = renderer.render_lasers();
  frame.wall_s = watch.wall_s();
  frame.processor_s = watch.processor_s();
  frame.stages_s = sum_of_stages(result.lasers, &RenderResult::seconds);
  frame.stages_processor_s = sum_of_stages(result.lasers, &RenderResult::processor_seconds);
  const auto sum = [](double s, const auto& stage) { return s + stage.second; };
  frame.stages_s["rest"] =
      frame.wall_s - std::accumulate(frame.stages_s.begin(), frame.stages_s.end(), 0.0, sum);
  return frame;
}

/// The times of a frame, scaled from a strip to all rows of the hologram. Stages whose time does
/// not depend on the rows are unchanged.
BenchFrame scaled(BenchFrame frame, double factor) {
  double more = 0;
  for (const char* stage : {"trace", "propagate", "encode"}) {
    if (!frame.stages_s.contains(stage)) continue;
    more += (factor - 1) * frame.stages_s[stage];
    frame.stages_s[stage] *= factor;
    frame.stages_processor_s[stage] *= factor;
  }
  frame.processor_s *= (frame.wall_s + more) / frame.wall_s;
  frame.wall_s += more;
  return frame;
}

/// Key of a lens picture in the cache; lengths enter in micrometres.
std::string lens_key(const std::vector<Scene>& scenes, glm::ivec2 grid, double z_m,
                     const PictureWindow& window) {
  const auto& scene = scenes[0];
  std::string key = scene.file.string();
  const auto add = [&](double value) { key += ' ' + std::to_string(1e6 * value); };
  add(z_m);
  for (const auto& corner_m : {window.low_m, window.high_m}) {
    add(corner_m.x);
    add(corner_m.y);
  }
  for (const auto& laser : scenes) add(laser.hologram.wavelength_m);
  for (const int n : {scene.hologram.resolution.x, scene.hologram.resolution.y, grid.x, grid.y})
    add(n);
  add(scene.hologram.pitch_m.x);
  for (const auto& o : scene.objects) {
    key += ' ' + o.mesh.string();
    add(o.width_m.value_or(0));
    for (int axis = 0; axis < 3; ++axis) {
      add(o.position_m[axis]);
      add(o.rotation_deg[axis]);
    }
  }
  return key;
}

/// Of what `seconds` says of each frame.
Spread spread_over(const std::vector<BenchFrame>& frames, const auto& seconds) {
  std::vector<double> values;
  for (const auto& f : frames) values.push_back(seconds(f));
  return spread_of(std::move(values));
}

/// The least seconds of `work` in several turns, including the wait for the device: launches return
/// early, and other processes may use the machine.
template <class F>
double least_seconds(const cl::Device& device, int turns, F&& work) {
  double least = std::numeric_limits<double>::infinity();
  for (int turn = 0; turn < turns; ++turn) {
    const Stopwatch watch;
    work();
    device.finish();
    least = std::min(least, watch.wall_s());
  }
  return least;
}

/// Takes half a second or less. `quick` is for tests: smaller buffers, less accurate rates.
DeviceLimits device_limits(const cl::Device& device, bool quick) {
  const int turns = quick ? 2 : 8;
  DeviceLimits rates;
  const auto bytes =
      std::min<std::uint64_t>(quick ? 16 << 20 : 256 << 20, device.info().largest_buffer_bytes / 4);
  {
    cl::Buffer<std::uint8_t> from(device, bytes, "copy bandwidth"),
        to(device, bytes, "copy bandwidth");
    from.fill_zero();
    to.fill_zero();
    rates.bytes_per_s = 2.0 * static_cast<double>(bytes) /
                        least_seconds(device, turns, [&] { to.copy_from(from, 0); });
  }

  const int lanes = lanes_for(device.info());
  const cl::Program program(device, "kernels/instruments/device_limits.cl",
                            {{option::lanes, std::to_string(lanes)}});
  auto multiply_add = program.kernel("multiply_add");
  // GPUs need many work-items; on CPUs, where a work-item holds several lanes, a few per core are
  // enough.
  const std::size_t items = lanes == 1 ? std::size_t{2048} * device.info().compute_units
                                       : std::size_t{16} * device.info().compute_units;
  cl::Buffer<float> sums(device, items * static_cast<std::size_t>(lanes), "sums");
  const auto run = [&](int rounds) {
    multiply_add.run({items}, {lanes == 1 ? std::size_t{64} : std::size_t{1}}, sums, rounds,
                     static_cast<std::int32_t>(items));
  };
  // The number of rounds is doubled until a launch takes 10 ms (1 ms when quick).
  int rounds = 1 << 10;
  while (rounds < 1 << 20 && least_seconds(device, 2, [&] { run(rounds); }) < (quick ? 1e-3 : 1e-2))
    rounds *= 2;
  const double operations = 16.0 * rounds * lanes * static_cast<double>(items);
  rates.operations_per_s = operations / least_seconds(device, turns, [&] { run(rounds); });
  return rates;
}

}  // namespace

Spread BenchRow::wall_s() const {
  return spread_over(frames, [](const BenchFrame& f) { return f.wall_s; });
}

Spread BenchRow::processor_s() const {
  return spread_over(frames, [](const BenchFrame& f) { return f.processor_s; });
}

Spread BenchRow::stage_s(const std::string& stage) const {
  return spread_over(frames, [&](const BenchFrame& f) { return seconds_of(f.stages_s, stage); });
}

Spread BenchRow::stage_processor_s(const std::string& stage) const {
  return spread_over(frames,
                     [&](const BenchFrame& f) { return seconds_of(f.stages_processor_s, stage); });
}

double BenchRow::part_s(const std::string& stage) const {
  const auto all = wall_s();
  double part = 0, whole = 0;
  for (const auto& f : frames) {
    if (f.wall_s < all.low || f.wall_s > all.high) continue;
    part += seconds_of(f.stages_s, stage);
    whole += f.wall_s;
  }
  if (whole > 0) return all.median * part / whole;
  return stage_s(stage).median;  // with two frames, none lies between the quartiles
}

int BenchRow::holograms() const {
  return scenes.empty() ? 1 : static_cast<int>(scenes.size()) * scenes[0].sampling.frames;
}

double BenchRow::per_second() const { return frames.empty() ? 0 : holograms() / wall_s().median; }

Bench::Bench(const cl::DeviceInfo& device, BenchOptions options)
    : device_(device),
      options_(options),
      limits_(device_limits(cl::Device(device), options.quick)) {}

BenchRow Bench::run(const BenchCase& what) {
  BenchRow row;
  static_cast<BenchCase&>(row) = what;
  try {
    measure(row);
  } catch (const std::exception& error) {
    row.note = error.what();
    row.frames.clear();
  }
  return row;
}

void Bench::measure(BenchRow& row) {
  // A case may measure only a strip of the hologram's rows; times are scaled by `factor`.
  auto scenes = row.scenes;
  const int all_rows = scenes.at(0).hologram.resolution.y, rows = std::max(1, all_rows / row.share);
  const double factor = static_cast<double>(all_rows) / rows;
  for (auto& scene : scenes) scene.hologram.resolution.y = rows;
  const auto world_of = [&](const Scene& scene) {
    return row.meshes ? place_objects(scene, *row.meshes, load_textures(scene))
                      : build_world(scene);
  };
  RenderOptions how;
  how.method = row.method;
  how.rays_per_axis = row.rays_per_axis;
  how.fft = options_.fft;
  how.keep_field = false;
  if (options_.waves) how.waves_device.emplace(*options_.waves);

  Rendered result;
  {
    // Each case has its own cl::Device, whose memory peak is that of the case.
    const cl::Device device(device_);
    const Stopwatch first;
    Renderer renderer(device, scenes, world_of(scenes[0]), how);
    const auto frame = [&](int number) { return timed_frame(renderer, scenes, number, result); };
    for (int warm_up = 0; warm_up < 2; ++warm_up) {
      const bool is_long = frame(poses - 1 - warm_up).wall_s > long_s;
      if (warm_up == 0) row.first_frame_s = first.wall_s();
      if (is_long) break;
    }

    // Measured frames
    const auto then = machine_time();
    const Stopwatch watch;
    const auto wanted = [&](int done) {
      if (options_.frames > 0) return done < options_.frames;
      return done < fewest_frames || (done < most_frames && watch.wall_s() < options_.seconds);
    };
    for (int number = 0; wanted(number); ++number)
      row.frames.push_back(scaled(frame(number), factor));
    row.others_share = others_share(then, watch.processor_s());
    row.device_peak_bytes = result.lasers.back().device_peak_bytes;
    row.resident_bytes = resident_bytes();
  }

  // Counts of the last frame
  for (const auto& laser : result.lasers) {
    row.samples += laser.samples;
    row.hidden_samples += laser.hidden_samples;
    if (!laser.plan.samples.aimed)
      row.rays += static_cast<std::uint64_t>(
          std::llround(static_cast<double>(primary_rays(laser.plan)) * factor));
    // Rates are those of one device
    if (row.share == 1 && !options_.waves) add_work(laser.plan, row.method, options_.fft, row.work);
  }
  const auto& plan = result.lasers[0].plan;
  row.grid = plan.grid;
  row.padded = transformed_size(plan);

  // The quality of the whole holograms, which are rendered again with their fields
  const auto world = world_of(row.scenes[0]);
  row.triangles = world.triangles.size();
  if (!options_.quality || row.share != 1) return;
  how.keep_field = true;
  row.quality = quality_of(row.scenes, world, render(cl::Device(device_), row.scenes, world, how));
}

BenchQuality Bench::quality_of(const std::vector<Scene>& scenes, const World& world,
                               Rendered rendered) {
  QualitySpec spec;
  spec.depths_m = {(world.min_m.z + world.max_m.z) / 2};
  spec.views = false;
  spec.lens_points = options_.lens_points;
  RenderOptions how;
  how.fft = options_.fft;
  const auto plan = make_plan(scenes[0], world);
  // Figures are compared between scenes whatever their viewer
  spec.blur_m = blur_of_resolution * scenes[0].sampling.pitch_m;
  spec.window = quality_window(plan, front_view(scenes[0], world, plan), *spec.blur_m);
  auto& lens = seen_by_lens_[lens_key(scenes, plan.grid, spec.depths_m[0], *spec.window)];
  const auto result =
      assess(cl::Device(device_), scenes, world, std::move(rendered), how, spec, lens);
  const auto& figures = result.rows.at(0).figures.luminance;
  return {figures.psnr_db, figures.ssim, spec.depths_m[0],
          result.blur_px * scenes[0].hologram.pitch_m.x};
}

}  // namespace raywave
