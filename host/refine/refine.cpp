// SPDX-License-Identifier: Apache-2.0
#include "host/refine/refine.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <numeric>
#include <random>
#include <vector>

#include "cl/program.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/common/threads.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/propagate/propagation.hpp"
#include "host/refine/light.hpp"
#include "host/refine/panel_light.hpp"
#include "host/refine/sample_picture.hpp"
#include "kernels/refine/rows_together.h"

namespace raywave {
namespace {

using refinement::Light;
using refinement::PhaseStack;
using refinement::PictureGrid;
using refinement::Propagation;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

void check(std::span<const RefineKey> keys, const RefineSpec& spec) {
  const auto positive = [](double value) { return std::isfinite(value) && value > 0; };
  if (keys.empty()) throw InputError("refinement: at least 1 picture is needed");
  if (!positive(spec.pitch_m.x) || !positive(spec.pitch_m.y) || !positive(spec.wavelength_m))
    throw InputError("refinement: pitch and wavelength must be > 0");
  if (!(std::isfinite(spec.blur_m) && spec.blur_m >= 0))
    throw InputError("refinement: the blur must be >= 0");
  if (spec.iterations < 0) throw InputError("refinement: iterations must be >= 0");
  if (!positive(spec.brightness)) throw InputError("refinement: the brightness must be > 0");
  if (!(spec.padding >= 1 && spec.padding <= 8))
    throw InputError("refinement: the padding must be 1 to 8");
  for (const auto& key : keys) {
    const auto& p = key.picture;
    const auto where = "refinement: the picture at " + length_text(key.z_m);
    if (key.samples) continue;
    if (p.width < 1 || p.height < 1 ||
        p.pixels.size() != static_cast<std::size_t>(p.width) * static_cast<std::size_t>(p.height))
      throw InputError(where + " is empty");
    if (!positive(key.pixel_m.x) || !positive(key.pixel_m.y))
      throw InputError(where + ": pixels must be > 0");
    if (key.pupil.has_value() != keys[0].pupil.has_value())
      throw InputError(where + ": pictures are all through a pupil, or none is");
    if (key.times < 1) throw InputError(where + " must be drawn at least once");
  }
}

Propagation propagation_of(const refinement::Optics& optics, const RefineKey& key,
                           const RefineSpec& spec) {
  if (key.samples || key.pupil) return Propagation::fresnel;
  if (spec.propagation) return *spec.propagation;
  return key_propagation(optics.size, optics.pitch_m, optics.wavelength_m, optics.blur_m, key.z_m,
                         key.window_m());
}

/// Refuses what the device has no memory for, before any is taken.
void require_memory(const cl::Device& device, glm::ivec2 size, glm::ivec2 pupil_plane, int frames,
                    const std::vector<PictureGrid>& grids, bool knows_panel, bool has_host_fft) {
  const std::string advice = "fewer frames, views or depths, or a smaller hologram, need less";
  std::vector<cl::MemoryNeed> needs;
  std::vector<std::uint64_t> planes, wides;  // by slot
  std::uint64_t spectra = 0;
  for (const auto& grid : grids) {
    const auto slot = static_cast<std::size_t>(grid.slot);
    planes.resize(std::max(planes.size(), slot + 1));
    wides.resize(planes.size());
    planes[slot] = std::max(planes[slot], area_of(grid.size));
    wides[slot] = std::max(wides[slot], area_of(grid.wide_size()));
    if (!has_host_fft && grid.propagation != Propagation::fresnel)
      spectra = std::max(spectra, area_of(grid.spectrum.pixels) + area_of(grid.spectrum.finer));
    needs.push_back({"wanted picture", area_of(grid.region_size) * 4, advice});
    if (frames > 1)
      needs.push_back({"intensity of former frames", area_of(grid.region_size) * 4, advice});
  }
  needs.push_back(
      {"phases of the holograms",
       area_of({size.x + 2 * PictureGrid::packet, size.y}) * static_cast<std::uint64_t>(frames) * 8,
       advice});
  if (knows_panel)
    needs.push_back({"light of the panel", area_of(size) * refinement::panel_bytes, advice});
  if (pupil_plane.x > 0)
    needs.push_back({"light in the pupil's plane", area_of(pupil_plane) * 16, advice});
  if (spectra > 0) needs.push_back({"spectrum of the hologram", spectra * 8, advice});
  needs.push_back({"intensity", *std::ranges::max_element(wides) * 4, advice});
  for (std::size_t slot = 0; slot < planes.size(); ++slot) {
    needs.push_back({"light of the pictures", planes[slot] * 8, advice});
    needs.push_back({"blurred intensity", wides[slot] * 4, advice});
  }
  cl::require_memory(device, needs);
}

/// Work-items for rows that are taken ROWS_TOGETHER.
int blocks_of(int rows) { return (rows + ROWS_TOGETHER - 1) / ROWS_TOGETHER; }

/// Keys that an iteration takes together: numbers from first to the one before end.
struct Round {
  std::size_t first = 0, end = 0;
};

std::vector<Round> rounds_of(std::span<const RefineKey> keys) {
  std::vector<Round> rounds;
  for (std::size_t key = 0; key < keys.size(); ++key) {
    const bool has_rounds = keys[key].samples || keys[key].pupil;
    if (key == 0 || !has_rounds || keys[key].round != keys[key - 1].round)
      rounds.push_back({key, key});
    ++rounds.back().end;
  }
  return rounds;
}

/// Draws rounds as often as each asks for, evenly spread over the iterations, so that none has been
/// forgotten when they end. The order differs from frame to frame.
class Draw {
public:
  Draw(std::span<const RefineKey> keys, const std::vector<Round>& rounds, const RefineSpec& spec)
      : random_(spec.seed), in_order_(spec.in_order) {
    for (const auto& round : rounds) times_.push_back(keys[round.first].times);
  }
  /// Begins a frame: rounds have waited for a random part of their periods.
  void begin_frame(int iterations) {
    // In order, the last iteration takes the last round.
    const auto rounds = times_.size(), over = static_cast<std::size_t>(iterations) % rounds;
    turn_ = (rounds - over) % rounds;
    waited_.clear();
    for (const int times : times_)
      waited_.push_back(times * static_cast<double>(random_()) * 0x1p-32);
    all_ = std::accumulate(times_.begin(), times_.end(), 0.0);
  }
  /// The round that has waited longest, in its own periods.
  std::size_t next() {
    if (in_order_) return turn_++ % times_.size();
    for (std::size_t key = 0; key < times_.size(); ++key) waited_[key] += times_[key];
    const auto longest = std::ranges::max_element(waited_);
    *longest -= all_;
    return static_cast<std::size_t>(longest - waited_.begin());
  }

private:
  std::mt19937 random_;
  bool in_order_;
  std::size_t turn_ = 0;
  std::vector<int> times_;
  std::vector<double> waited_;
  double all_ = 0;
};

/// The key that sets the brightness: the largest aperture, and of these the depth nearest to their
/// middle, where most of the light is within the picture.
std::size_t key_of_brightness(const std::vector<PictureGrid>& grids) {
  const auto open = [](const PictureGrid& grid) {
    return 1.0 * grid.open.size.x * grid.open.size.y;
  };
  double largest = 0, near_m = INFINITY, far_m = 0;
  for (const auto& grid : grids) largest = std::max(largest, open(grid));
  for (const auto& grid : grids) {
    if (open(grid) < largest) continue;
    near_m = std::min(near_m, grid.z_m);
    far_m = std::max(far_m, grid.z_m);
  }
  const double middle_m = (near_m + far_m) / 2;
  std::size_t best = 0;
  double least_m = INFINITY;
  for (std::size_t key = 0; key < grids.size(); ++key) {
    const double away_m = std::abs(grids[key].z_m - middle_m);
    if (open(grids[key]) < largest || away_m >= least_m) continue;
    best = key;
    least_m = away_m;
  }
  return best;
}

/// The iterations, with everything on the device.
class Loop {
public:
  Loop(const cl::Device& device, cl::FftBackend backend)
      : device_(device),
        light_(Light::make(device, backend)),
        program_(device, "kernels/refine/refine.cl",
                 {{option::lanes, std::to_string(device.info().float_lanes)}}),
        intensity_(program_.kernel("intensity")),
        blur_rows_(program_.kernel("blur_rows")),
        correct_(program_.kernel("correct")),
        add_picture_(program_.kernel("add_picture")),
        sum_known_(program_.kernel("sum_known")) {}

  /// Takes other keys. Memory that suffices is kept.
  void fit(const refinement::Optics& optics, std::span<const RefineKey> keys,
           const std::vector<PictureGrid>& grids, bool feeds_back) {
    light_->fit(optics, grids);
    scale_ = 1;
    // Intensities are in this unit, so that they are near 1.
    unit_ = keys.front().samples ? 1 : grids.front().distance_m * grids.front().distance_m;
    std::size_t wide = 1, region = 1, rows = 1;
    std::vector<std::size_t> blurred;  // by slot
    for (const auto& grid : grids) {
      blurred.resize(std::max(blurred.size(), static_cast<std::size_t>(grid.slot) + 1));
      auto& of_slot = blurred[static_cast<std::size_t>(grid.slot)];
      of_slot = std::max(of_slot, area_of({grid.region_size.x, grid.wide_size().y}));
      wide = std::max(wide, area_of(grid.wide_size()));
      region = std::max(region, area_of(grid.region_size));
      rows = std::max(rows, static_cast<std::size_t>(grid.region_size.y));
    }
    make_room(device_, wide_, wide, "intensity");
    blurred_.resize(std::max(blurred_.size(), blurred.size()));
    for (std::size_t slot = 0; slot < blurred.size(); ++slot)
      make_room(device_, blurred_[slot], blurred[slot], "blurred intensity");
    make_room(device_, shown_, region, "picture");
    make_room(device_, row_sums_, rows, "light of rows");
    pictures_.resize(keys.size());

    auto& threads = cl::Threads::shared();
    std::vector<std::vector<float>> targets(keys.size());
    threads.for_each(threads.count(), keys.size(), 1, [&](std::size_t, std::size_t key) {
      targets[key] = keys[key].samples
                         ? refinement::sample_picture(optics, grids[key], *keys[key].samples)
                         : refinement::blurred_target(optics, keys[key], grids[key]);
    });
    for (std::size_t key = 0; key < keys.size(); ++key) {
      const auto& grid = grids[key];
      const glm::ivec2 margin =
          keys[key].samples ? glm::ivec2(grid.margin_x(), grid.radius_y()) : glm::ivec2(0);
      refinement::ask_for_more(optics, grid, grid.region_first - margin,
                               grid.region_size + 2 * margin, targets[key]);
      const auto on_device = [&](const std::vector<float>& values) {
        return cl::Buffer<float>(device_, std::span<const float>(values), "blur");
      };
      auto& picture = pictures_[key];
      make_room(device_, picture.target, area_of(grid.region_size), "target");
      if (keys[key].samples) {
        picture.weights_x = on_device(grid.sample_weights_x);
        picture.weights_y = on_device(grid.sample_weights_y);
        wide_.write(targets[key]);
        blur_rows(grid, picture);
        add_picture(grid, picture, picture.target, false);
      } else {
        picture.target.write(targets[key]);
      }
      targets[key] = {};
      picture.weights_x = on_device(grid.weights_x);
      picture.weights_y = on_device(grid.weights_y);
      picture.light = known_light(grid, picture.target, picture.target);
      if (!(picture.light > 0) && !keys[key].samples)
        throw InputError("refinement: the picture at " + length_text(grid.z_m) + " is black");
      if (feeds_back) {
        make_room(device_, picture.former, area_of(grid.region_size), "intensity of former frames");
        picture.former.fill_zero();
      }
    }
  }

  void look(const PhaseStack& holograms, int frame, const Round& round) {
    light_->enter_pupil(holograms, frame);
    for (auto key = round.first; key < round.end; ++key) look(holograms, frame, key);
  }
  void correct(PhaseStack& holograms, int frame, const Round& round, int number, double step) {
    for (auto key = round.first; key < round.end; ++key)
      correct(holograms, frame, key, number, step);
    light_->leave_pupil(holograms, frame, step);
  }

  /// The key's intensity, blurred along x.
  void look(const PhaseStack& holograms, int frame, std::size_t key) {
    const auto& grid = light_->grid(key);
    light_->show(holograms, frame, key);
    const auto wide = grid.wide_size();
    run_rows(device_, intensity_, wide.x, wide.y, light_->plane(key), grid.size.x, grid.size.y,
             wide_, grid.region_first.x, grid.region_first.y, grid.region_size.x,
             grid.region_size.y, grid.margin_x(), grid.radius_y(),
             static_cast<float>(grid.unit / unit_));
    blur_rows(grid, pictures_[key]);
  }

  /// Sets the scale of the brightness, by a round that was looked at: what the frames so far and
  /// this one have there is what is wanted. False where no light is wanted: objects may be beyond
  /// the window of all parts, which then gets dark whatever the scale.
  bool keep_brightness(const Round& round, int number, double brightness) {
    double sum = 0, light = 0;
    for (auto key = round.first; key < round.end; ++key) {
      const auto& grid = light_->grid(key);
      const auto& picture = pictures_[key];
      add_picture(grid, picture, shown_, false);
      sum += known_light(grid, shown_, picture.target);
      if (number > 1) sum += known_light(grid, picture.former, picture.target);
      light += picture.light;
    }
    if (!(light > 0)) return false;
    if (!(sum > 0))
      throw InputError("refinement: no light of the hologram reaches the picture at " +
                       length_text(light_->grid(round.first).z_m));
    scale_ = number * light / sum / brightness;
    return true;
  }

  /// Moves the phases towards the key that was looked at.
  void correct(PhaseStack& holograms, int frame, std::size_t key, int number, double step) {
    const auto& grid = light_->grid(key);
    const auto& picture = pictures_[key];
    const auto part = light_->read_back(key);
    const bool has_former = number > 1;
    run_rows(device_, correct_, part.size.x, blocks_of(part.size.y), light_->plane(key),
             grid.size.x, blurred_of(grid), picture.weights_y, grid.radius_y(), picture.target,
             has_former ? picture.former : picture.target, static_cast<std::int32_t>(has_former),
             static_cast<float>(number / scale_), grid.region_first.x, grid.region_first.y,
             grid.region_size.x, grid.region_size.y, grid.radius_y(), part.first.x, part.size.x,
             part.first.y, part.size.y);
    light_->step(holograms, frame, key, step);
  }

  /// Adds a finished frame to what the next ones build on.
  void add_frame(const PhaseStack& holograms, int frame) {
    light_->enter_pupil(holograms, frame);
    for (std::size_t key = 0; key < pictures_.size(); ++key) {
      look(holograms, frame, key);
      add_picture(light_->grid(key), pictures_[key], pictures_[key].former, true);
    }
  }

  const Light& light() const { return *light_; }
  /// RefineResult::brightness
  double brightness() const { return unit_ / scale_; }

private:
  struct Picture {
    cl::Buffer<float> target, former, weights_x, weights_y;
    double light = 0;  // sum of the target
  };

  cl::Buffer<float>& blurred_of(const PictureGrid& grid) {
    return blurred_[static_cast<std::size_t>(grid.slot)];
  }

  /// From wide_, along x.
  void blur_rows(const PictureGrid& grid, const Picture& picture) {
    const int rows = grid.wide_size().y;
    run_rows(device_, blur_rows_, grid.region_size.x, rows, wide_, picture.weights_x,
             static_cast<std::int32_t>(picture.weights_x.size()) - 1, blurred_of(grid),
             grid.region_size.x, grid.margin_x(), rows);
  }

  /// Adds the intensity that is blurred along x to a sum of such, blurred along y too.
  void add_picture(const PictureGrid& grid, const Picture& picture, cl::Buffer<float>& sum,
                   bool accumulate) {
    run_rows(device_, add_picture_, grid.region_size.x, blocks_of(grid.region_size.y),
             blurred_of(grid), picture.weights_y,
             static_cast<std::int32_t>(picture.weights_y.size()) - 1, sum,
             static_cast<std::int32_t>(accumulate), grid.region_size.x, grid.region_size.y,
             grid.radius_y());
  }

  /// Sum of the values whose target is known. Rows are added on the host: devices need not have
  /// doubles.
  double known_light(const PictureGrid& grid, const cl::Buffer<float>& values,
                     const cl::Buffer<float>& target) {
    const auto rows = static_cast<std::size_t>(grid.region_size.y);
    const bool cpu = device_.info().kind == cl::DeviceKind::cpu;
    sum_known_.run({rows}, {cpu ? 1u : 64u}, values, target, row_sums_, grid.region_size.x,
                   grid.region_size.y);
    std::vector<float> sums(rows);
    row_sums_.read(sums);
    return std::accumulate(sums.begin(), sums.end(), 0.0);
  }

  cl::Device device_;
  std::unique_ptr<Light> light_;
  cl::Program program_;
  cl::Kernel intensity_, blur_rows_, correct_, add_picture_, sum_known_;
  std::vector<Picture> pictures_;
  std::vector<cl::Buffer<float>> blurred_;  // by slot
  cl::Buffer<float> wide_, shown_, row_sums_;
  double scale_ = 1, unit_ = 1;
};

}  // namespace

struct Refiner::State {
  State(const cl::Device& its_device, cl::FftBackend its_backend)
      : device(its_device),
        backend(its_backend),
        holograms(its_device),
        loop(its_device, its_backend) {}
  cl::Device device;
  cl::FftBackend backend;
  PhaseStack holograms;
  Loop loop;
  std::optional<refinement::PanelLight> panel;  // RefineSpec::panel's
};

Refiner::Refiner(const cl::Device& device, cl::FftBackend backend)
    : state_(std::make_unique<State>(device, backend)) {}
Refiner::~Refiner() = default;
Refiner::Refiner(Refiner&&) noexcept = default;
refinement::PhaseStack& Refiner::holograms() { return state_->holograms; }

RefineResult refine(const cl::Device& device, cl::FftBackend backend, const FieldStack& start,
                    std::span<const RefineKey> keys, const RefineSpec& spec) {
  if (start.nx < 1 || start.ny < 1 || start.frames < 1)
    throw InputError("refinement: the hologram has no pixels");
  Refiner refiner(device, backend);
  refiner.holograms().take(start);
  auto result = refiner.run(keys, spec);
  result.field = refiner.holograms().read();
  return result;
}

RefineResult Refiner::run(std::span<const RefineKey> keys, const RefineSpec& spec) {
  check(keys, spec);
  // Not bound together: clang 14 does not capture such names
  const auto& device = state_->device;
  auto& holograms = state_->holograms;
  auto& loop = state_->loop;
  auto& panel = state_->panel;
  const auto prepared = Clock::now();
  const auto report = [&](const std::string& what, double share) {
    if (spec.progress) spec.progress(what, share);
  };
  report("targets and kernels", 0);
  refinement::Optics optics{holograms.size(), spec.pitch_m, spec.wavelength_m,
                            spec.blur_m,      spec.padding, spec.showing};
  optics.pupil_plane = refinement::pupil_plane_size(optics, keys);
  RefineResult result;
  std::vector<PictureGrid> grids;
  for (const auto& key : keys) {
    const auto propagation = propagation_of(optics, key, spec);
    result.figures.exact_keys += propagation != Propagation::fresnel;
    grids.push_back(picture_grid(optics, key, propagation));
  }
  const auto look = [&](int frame, const Round& round) {
    if (panel) panel->show(holograms, frame);
    panel ? loop.look(panel->light(), 0, round) : loop.look(holograms, frame, round);
  };
  const auto correct = [&](int frame, const Round& round, double step) {
    if (!panel) return loop.correct(holograms, frame, round, frame + 1, step);
    loop.correct(panel->modulated(), 0, round, frame + 1, step);
    panel->turn(holograms, frame);
  };
  const auto rounds = rounds_of(keys);
  for (const auto& round : rounds) {
    for (auto key = round.first; key < round.end; ++key)
      grids[key].slot = static_cast<int>(key - round.first);
  }
  const int frames = holograms.frames();
  require_memory(device, holograms.size(), optics.pupil_plane, frames, grids, spec.panel != nullptr,
                 state_->backend == cl::FftBackend::host);
  if (!spec.panel)
    panel.reset();
  else if (!panel || panel->panel() != spec.panel)
    panel.emplace(device, spec.panel);
  const auto bright_key = key_of_brightness(grids);
  const auto bright_round = static_cast<std::size_t>(
      std::ranges::find_if(rounds, [&](const Round& round) { return bright_key < round.end; }) -
      rounds.begin());
  loop.fit(optics, keys, grids, frames > 1);
  device.finish();
  result.figures.prepare_s = seconds_since(prepared);

  const auto began = Clock::now();
  Draw draw(keys, rounds, spec);
  int iterations = spec.iterations;
  if (spec.budget_s) {
    // Steps of zero leave the hologram as it is. The first iteration is slower than the others.
    double each_s = 0;
    const int trials = 1 + static_cast<int>(std::min<std::size_t>(3, rounds.size()));
    for (int trial = 0; trial < trials; ++trial) {
      const auto trial_began = Clock::now();
      const auto& round = rounds[static_cast<std::size_t>(trial) * (rounds.size() - 1) /
                                 static_cast<std::size_t>(trials - 1)];
      look(0, round);
      correct(0, round, 0);
      device.finish();
      if (trial > 0) each_s += seconds_since(trial_began) / (trials - 1);
    }
    const double for_sums_s = 0.5 * each_s * static_cast<double>(rounds.size()) * (frames - 1),
                 left_s = *spec.budget_s - seconds_since(began) - for_sums_s;
    iterations = std::clamp(static_cast<int>(left_s / (each_s * frames)), 1, 100000);
  }
  result.figures.iterations = iterations;
  for (int frame = 0; frame < frames; ++frame) {
    const auto name = frames > 1
                          ? "frame " + std::to_string(frame + 1) + " of " + std::to_string(frames)
                          : std::string("refine");
    draw.begin_frame(iterations);
    bool has_scale = false;
    for (int t = 0; t < iterations; ++t) {
      const auto& round = rounds[t == 0 && !spec.in_order ? bright_round : draw.next()];
      look(frame, round);
      if (!has_scale) has_scale = loop.keep_brightness(round, frame + 1, spec.brightness);
      correct(frame, round, spec.first_step + (spec.last_step - spec.first_step) * t / iterations);
      report(name, (frame + (t + 1.0) / iterations) / frames);
    }
    if (frame + 1 == frames) break;
    if (panel) panel->show(holograms, frame);
    panel ? loop.add_frame(panel->light(), 0) : loop.add_frame(holograms, frame);
  }
  device.finish();
  result.figures.loop_s = seconds_since(began);
  result.figures.transforms = static_cast<double>(loop.light().transforms()) / frames;
  result.brightness = loop.brightness();
  return result;
}

}  // namespace raywave
