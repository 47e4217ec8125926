// SPDX-License-Identifier: Apache-2.0
#include "host/plan/planner.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <numbers>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/geometry/shared_types.hpp"
#include "host/plan/propagation_errors.hpp"
#include "host/plan/rates.hpp"
#include "host/plan/warnings.hpp"
#include "host/propagate/propagator.hpp"
#include "host/trace/interpolator.hpp"

namespace raywave {
namespace {

constexpr double arc_minute = std::numbers::pi / 180 / 60;

/// What is tried. Coarser lattices than the resolution show their dots.
constexpr std::array pitches_of_resolution{1.0, 0.85, 0.7, 0.6, 0.5, 0.42, 0.35, 0.3, 0.25};

/// How far up from the fastest to the truest choice a quality lies, in decibels; and what is no
/// gain worth waiting for, but to reference.
constexpr std::array shares_of_quality{0.0, 0.5, 0.85, 1.0};
constexpr double no_gain_db = 0.5;

/// The least accuracy.phase of a quality, where the scene gives none.
constexpr double reference_phase_turns = 0.001;

/// What is tried beside all columns and rows, but for reference: one or two per cent of the field
/// (docs/accuracy.md) for half of the gathering.
constexpr double planned_oversampling = 1.5;

/// The largest error of a cone that a quality accepts: draft and balanced are for pictures,
/// accurate and reference for the wavefront.
constexpr std::array cone_errors_of_quality{0.25, 0.25, 0.06, 0.0};

constexpr int most_layers_tried = 8;

/// Predictions are no better: what saves less is not tried.
constexpr double least_saving = 0.1;

/// Fields that are more wrong than this show ghosts beside bright objects.
constexpr double worst_padding_error = 0.15;

/// A plan without pitch, padding and frames.
struct Gathering {
  Plan plan;
  Footprints footprints;
};

/// A number of layers and a cone, and what is known of them whatever the pitch, the frames and the
/// padding.
struct Layout {
  int layers = 1;
  Gathering all_pixels;  // as the scene has them
  // planned_oversampling, where that is open and saves any
  std::optional<Gathering> few_pixels;
  std::optional<PictureModel> model;                  // of aimed sampling
  std::vector<std::pair<double, double>> paddings{};  // what is tried, and its error
};

/// Everything about the scene that the choice of layers, cone, pitch, padding and frames does not
/// change.
class Planner {
public:
  Planner(const Scene& scene, const World& world, const DeviceFigures& device)
      : scene_(scene),
        world_(world),
        device_(device),
        plan_(make_plan(scene, world, Method::wrp, 100, device.has_doubles)),
        resolution_m_(wanted_resolution_m(scene, plan_)),
        view_(front_view(scene, world, load_textures(scene), plan_)) {
    add(layout(scene.wrp.layers, plan_));
  }

  double resolution_m() const { return resolution_m_; }
  const FrontView& view() const { return view_; }
  const std::optional<PictureModel>& model_of(int layers, const Cone& cone) const {
    const auto found = std::find_if(layouts_.begin(), layouts_.end(), [&](const Layout& l) {
      return l.layers == layers && l.all_pixels.plan.cone() == cone;
    });
    return found->model;
  }

  /// most_cone_error  of the cones that are tried, besides the scene's own
  /// throws           InputError when nothing can be predicted
  std::vector<Choice> choices(double most_cone_error) {
    if (!plan_.aimed)
      throw InputError(one_line(scene_.file.string()) +
                       ": pictures of sampling.mode \"fan\" cannot be predicted; give "
                       "sampling.pitch, sampling.frames and wrp.padding "
                       "instead of a goal, or sampling.mode \"aimed\"");
    const double finest =
        std::max(plan_.wavelength_m * plan_.lattice.full_z_m / (plan_.size.x * plan_.pitch_m.x),
                 plan_.wavelength_m * plan_.lattice.full_z_m / (plan_.size.y * plan_.pitch_m.y));
    std::vector<double> pitches;
    if (scene_.given.contains("sampling.pitch")) {
      pitches = {scene_.sampling.pitch_m};
    } else {
      for (const double share : pitches_of_resolution) {
        if (const double p = round_pitch(share * resolution_m_); pitches.empty() || p >= finest)
          pitches.push_back(p);
      }
    }
    const auto counts = scene_.given.contains("sampling.frames")
                            ? std::vector{scene_.sampling.frames}
                            : std::vector(frames_tried.begin(), frames_tried.end());
    add_layers(pitches.back(), counts);
    add_cones(most_cone_error);
    for (auto& layout : layouts_) predict_errors(layout);

    std::vector<Choice> all;
    for (const double pitch_m : pitches) {
      for (std::size_t first = 0; first < layouts_.size();) {
        const auto cone = layouts_[first].all_pixels.plan.cone();
        auto end = first;
        while (end < layouts_.size() && layouts_[end].all_pixels.plan.cone() == cone) ++end;
        const auto pattern = lattice_pattern(*layouts_[first].model, pitch_m);
        for (const int frames : counts) {
          double least_s = std::numeric_limits<double>::infinity();
          for (auto i = first; i < end; ++i) {
            const auto& layout = layouts_[i];
            const Choice c{.pitch_m = pitch_m,
                           .padding = 1,
                           .frames = frames,
                           .layers = layout.layers,
                           .cone = cone};
            const double seconds = seconds_of(c, fastest_of(layout));
            if (!(seconds < (1 - least_saving) * least_s)) continue;
            least_s = seconds;
            add_paddings(c, layout, layout.all_pixels, pattern, all);
            if (!layout.few_pixels) continue;
            auto few = c;
            few.oversampling = planned_oversampling;
            add_paddings(few, layout, *layout.few_pixels, pattern, all);
          }
        }
        first = end;
      }
    }
    return all;
  }

private:
  /// To two digits: as a person would write it.
  static double round_pitch(double p) {
    const double digit = std::pow(10, std::floor(std::log10(p)) - 1);
    return std::floor(p / digit + 1e-9) * digit;
  }

  /// Without predictions of errors and pictures.
  Layout layout(int layers, const Plan& plan) const {
    Layout l{layers, gathering_of(plan), {}, {}};
    if (scene_.given.contains("wrp.oversampling") || !plan.aimed || plan.bounces > 0) return l;
    auto few = plan;
    bool any = false;
    for (auto& layer : few.layers) {
      layer.axes = axes_for_band(few, layer, planned_oversampling);
      any |= layer.interpolates();
    }
    if (any) l.few_pixels = gathering_of(few);
    return l;
  }

  Gathering gathering_of(const Plan& plan) const { return {plan, footprints_of(plan, view_)}; }

  void add(Layout layout) {
    if (plan_.aimed) {
      auto seen = layout.all_pixels.plan;
      seen.grid = plan_.grid;  // pictures of one size are compared
      layout.model = picture_model(view_, seen, resolution_m_);
    }
    layouts_.push_back(std::move(layout));
  }

  /// More and more layers, as long as they save time on the finest lattice, with the fewest frames
  /// or the most, and there are surfaces in them.
  void add_layers(double finest_pitch_m, const std::vector<int>& counts) {
    if (scene_.given.contains("wrp.layers") || scene_.given.contains("wrp.distance") ||
        plan_.bounces > 0)
      return;
    for (int layers = layouts_.back().layers + 1; layers <= most_layers_tried; ++layers) {
      auto scene = scene_;
      scene.wrp.layers = layers;
      auto more = layout(layers, make_plan(scene, world_, Method::wrp, 100, device_.has_doubles));
      if (more.all_pixels.plan.layers.size() == layouts_.back().all_pixels.plan.layers.size())
        return;
      const auto saves = [&](int frames) {
        const Choice c{.pitch_m = finest_pitch_m, .padding = 1, .frames = frames};
        return seconds_of(c, fastest_of(more)) <
               (1 - least_saving) * seconds_of(c, fastest_of(layouts_.back()));
      };
      if (!saves(counts.front()) && !saves(counts.back())) return;
      add(std::move(more));
    }
  }

  /// The same layers with other cones, which change neither planes nor lattice enough to count.
  void add_cones(double most_error) {
    const auto layers = layouts_.size();
    auto tried = std::vector{plan_.cone()};
    for (auto cone : cones_tried) {
      if (scene_.given.contains("sampling.cone")) cone.half_width = plan_.cone_half_width;
      if (scene_.given.contains("sampling.apodization")) cone.apodization = plan_.apodization;
      if (cone.apodization > cone.half_width || cone.field_error() > most_error ||
          std::find(tried.begin(), tried.end(), cone) != tried.end())
        continue;
      tried.push_back(cone);
      for (std::size_t i = 0; i < layers; ++i) {
        auto plan = layouts_[i].all_pixels.plan;
        plan.cone_half_width = cone.half_width;
        plan.apodization = cone.apodization;
        plan.cone_error = cone.field_error();
        divide(plan, plan.tile_grid, scene_.wrp.padding);  // tiles have cones of their own
        add(layout(layouts_[i].layers, plan));
      }
    }
  }

  static const Gathering& fastest_of(const Layout& layout) {
    return layout.few_pixels ? *layout.few_pixels : layout.all_pixels;
  }

  /// Errors of few pixels, and of the paddings that are tried.
  void predict_errors(Layout& layout) const {
    if (layout.few_pixels)
      layout.few_pixels->plan.oversampling_error =
          predicted_oversampling_error(layout.few_pixels->plan);
    const auto given = scene_.given.contains("wrp.padding");
    const auto tried = given ? std::vector{scene_.wrp.padding}
                             : std::vector(paddings_tried.begin(), paddings_tried.end());
    std::vector<glm::ivec2> sizes;
    for (const double padding : tried) sizes.push_back(padded_size(plan_.tile_size, padding));
    const auto errors = predicted_padding_errors(layout.all_pixels.plan, sizes);
    for (std::size_t i = 0; i < tried.size(); ++i) {
      if (errors[i] <= worst_padding_error || i + 1 == tried.size())
        layout.paddings.emplace_back(tried[i], errors[i]);
    }
  }

  /// Appends a choice with each padding that is tried.
  void add_paddings(const Choice& without, const Layout& layout, const Gathering& gathering,
                    const LatticePattern& pattern, std::vector<Choice>& all) const {
    auto plan = with_pitch(gathering.plan, without.pitch_m);
    auto work = work_of(without, plan, gathering);
    for (const auto& [padding, error] : layout.paddings) {
      auto c = without;
      c.padding = padding;
      plan.padded = padded_size(plan.tile_size, padding);
      work.butterflies = count_butterflies(plan, c.frames);
      c.seconds = predict_times(work, device_.rates).total_s();
      c.psnr_db = predict_pictures(*layout.model, pattern, c.frames,
                                   std::hypot(error, plan.oversampling_error))
                      .mean_psnr_db;
      all.push_back(c);
    }
  }

  static Plan with_pitch(Plan plan, double pitch_m) {
    const double finer = plan.lattice.step * plan.lattice.full_z_m / pitch_m;
    plan.lattice.step /= finer;
    plan.lattice.size = glm::ivec2(glm::ceil(glm::dvec2(plan.lattice.size) * finer));
    return plan;
  }

  Work work_of(const Choice& c, const Plan& plan, const Gathering& gathering) const {
    auto scene = scene_;
    scene.sampling.frames = c.frames;
    return count_work(scene, world_, plan, view_, gathering.footprints);
  }

  double seconds_of(const Choice& c, const Gathering& gathering) const {
    auto plan = with_pitch(gathering.plan, c.pitch_m);
    plan.padded = padded_size(plan.tile_size, c.padding);
    return predict_times(work_of(c, plan, gathering), device_.rates).total_s();
  }

  const Scene& scene_;
  const World& world_;
  const DeviceFigures& device_;
  Plan plan_;
  double resolution_m_;
  FrontView view_;
  std::vector<Layout> layouts_;  // cone by cone, fewest layers first
};

/// The truest of those that take no longer; the fastest when all do.
const Choice& truest_within(const std::vector<Choice>& all, double seconds) {
  const Choice* best = nullptr;
  for (const auto& c : all) {
    if (c.seconds <= seconds && (!best || c.psnr_db > best->psnr_db ||
                                 (c.psnr_db == best->psnr_db && c.seconds < best->seconds)))
      best = &c;
  }
  return best ? *best : *std::min_element(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return a.seconds < b.seconds;
  });
}

/// The fastest of those that are as true; the truest when none is.
const Choice& fastest_reaching(const std::vector<Choice>& all, double psnr_db) {
  const Choice* best = nullptr;
  for (const auto& c : all) {
    if (c.psnr_db >= psnr_db && (!best || c.seconds < best->seconds)) best = &c;
  }
  return best ? *best : *std::max_element(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return a.psnr_db < b.psnr_db;
  });
}

const Choice& chosen(const std::vector<Choice>& all, const Goal& goal) {
  if (goal.budget_s) return truest_within(all, *goal.budget_s);
  if (goal.psnr_db) return fastest_reaching(all, *goal.psnr_db);
  const auto least = truest_within(all, 0).psnr_db;  // of the fastest
  const auto most = fastest_reaching(all, std::numeric_limits<double>::infinity()).psnr_db;
  const double wanted =
      least + shares_of_quality[static_cast<std::size_t>(*goal.quality)] * (most - least);
  return fastest_reaching(all, wanted - (goal.quality == Quality::reference ? 1e-9 : no_gain_db));
}

std::string seconds_text(double seconds) {
  return seconds < 1 ? number_text(std::round(seconds * 1e4) / 10) + " ms"
                     : number_text(std::round(seconds * 100) / 100) + " s";
}
std::string decibels_text(double db) { return number_text(std::round(db * 10) / 10) + " dB"; }

std::string why_resolution(const Scene& scene, const Plan& plan, double resolution_m) {
  const std::string text = "resolution " + length_text(std::round(resolution_m * 1e8) / 1e8) + ": ";
  if (scene.viewer.resolution_m == resolution_m) return text + "viewer.resolution";
  if (!scene.viewer.resolution_m &&
      resolution_m == arc_minute * (scene.viewer.distance_m + plan.lattice.full_z_m))
    return text + "1 arc minute for an eye " + length_text(scene.viewer.distance_m) +
           " from the hologram";
  return text + "the hologram's own limit, wavelength z / width";
}

/// Predicted times of the choice with other numbers of layers, where any was tried.
std::string why_so_many_layers(const std::vector<Choice>& all, const Choice& choice) {
  std::vector<std::pair<int, double>> least;
  for (const auto& c : all) {
    if (c.pitch_m != choice.pitch_m || c.padding != choice.padding || c.frames != choice.frames ||
        c.cone != choice.cone)
      continue;
    if (least.empty() || least.back().first != c.layers) least.emplace_back(c.layers, c.seconds);
    least.back().second = std::min(least.back().second, c.seconds);
  }
  if (least.size() < 2) return "";
  std::string text;
  for (const auto& [layers, seconds] : least)
    text += (text.empty() ? "" : ", ") + std::to_string(layers) + " takes " + seconds_text(seconds);
  return "layers of depth: predicted " + text;
}

}  // namespace

Quality quality_of(const std::string& name) {
  for (const auto quality :
       {Quality::draft, Quality::balanced, Quality::accurate, Quality::reference}) {
    if (name == name_of(quality)) return quality;
  }
  throw InputError("--preset " + name +
                   ": unknown; there are draft, balanced, accurate and reference");
}

const char* name_of(Quality quality) {
  constexpr const char* names[] = {"draft", "balanced", "accurate", "reference"};
  return names[static_cast<std::size_t>(quality)];
}

DeviceFigures figures_of(const cl::DeviceInfo& device) {
  DeviceFigures figures{device.name, device.fp64, limits_of(device), cl::default_backend(device),
                        default_rates()};
  if (const auto tuning = load_tuning(device)) figures.rates = tuning->rates;
  return figures;
}

double largest_cone_error(const Goal& goal) {
  return cone_errors_of_quality[static_cast<std::size_t>(goal.quality.value_or(Quality::balanced))];
}

double wanted_resolution_m(const Scene& scene, const Plan& plan) {
  double limit = 0;
  for (int axis = 0; axis < 2; ++axis)
    limit = std::max(
        limit, plan.wavelength_m * plan.lattice.full_z_m / (plan.size[axis] * plan.pitch_m[axis]));
  return std::max(limit, scene.viewer.resolution_m.value_or(
                             arc_minute * (scene.viewer.distance_m + plan.lattice.full_z_m)));
}

std::vector<Choice> choices(const Scene& scene, const World& world, const DeviceFigures& device) {
  return Planner(scene, world, device).choices(std::numeric_limits<double>::infinity());
}

Planned plan_scene(const Scene& scene, const World& world, const DeviceFigures& device,
                   const Goal& goal) {
  Planned planned;
  planned.scene = scene;
  auto& s = planned.scene;
  if (goal.quality == Quality::reference && !scene.given.contains("accuracy.phase"))
    s.accuracy.phase_turns = reference_phase_turns;
  Planner planner(s, world, device);
  std::string why_layers;
  if (goal.any()) {
    const auto all = planner.choices(largest_cone_error(goal));
    const auto& c = chosen(all, goal);
    why_layers = why_so_many_layers(all, c);
    s.sampling.pitch_m = c.pitch_m;
    s.sampling.frames = c.frames;
    s.wrp.padding = c.padding;
    s.wrp.layers = c.layers;
    s.sampling.cone = c.cone.half_width;
    s.sampling.apodization = c.cone.apodization;
    if (c.oversampling) s.wrp.oversampling = c.oversampling;
    if (goal.budget_s && c.seconds > *goal.budget_s)
      planned.warnings.push_back("nothing keeps " + seconds_text(*goal.budget_s) +
                                 ": the fastest takes " + seconds_text(c.seconds) +
                                 "; a smaller hologram.resolution or wrp.grid needs less");
    if (goal.psnr_db && c.psnr_db < *goal.psnr_db)
      planned.warnings.push_back("nothing reaches " + decibels_text(*goal.psnr_db) +
                                 ": the truest has " + decibels_text(c.psnr_db) +
                                 "; a larger viewer.resolution asks for less detail");
  }
  planned.plan =
      fitting_plan(s, world, device.memory, {Method::wrp, device.fft}, 100, device.has_doubles);
  const auto& plan = planned.plan;

  auto& prediction = planned.prediction;
  prediction.resolution_m = planner.resolution_m();
  prediction.work = count_work(s, world, plan, planner.view(), footprints_of(plan, planner.view()));
  prediction.times = predict_times(prediction.work, device.rates);
  prediction.rates_of = device.rates.device;
  if (const auto& model = planner.model_of(s.wrp.layers, plan.cone()))
    prediction.pictures =
        predict_pictures(*model, lattice_pattern(*model, s.sampling.pitch_m), s.sampling.frames,
                         std::hypot(plan.padding_error, plan.oversampling_error));
  const double phase_error =
      2 * std::numbers::pi *
      plan.phase_errors[static_cast<std::size_t>(plan.precision)].total_turns();
  prediction.field_error = std::hypot(
      plan.cone_error, std::hypot(plan.padding_error, plan.oversampling_error, phase_error));
  const auto largest = device.memory.largest_buffer_bytes;
  const auto needs = memory_needs(world, plan, {Method::wrp, device.fft}, largest);
  prediction.device_bytes = needs.device_bytes();
  for (const auto& need : needs.device) {
    if (need.bytes > largest)
      planned.warnings.push_back(need.name + ": " + cl::format_bytes(need.bytes) +
                                 " in one buffer, " + device.name + " allows " +
                                 cl::format_bytes(largest) + "; " + need.advice);
  }
  prediction.device_bytes += static_cast<std::uint64_t>(
      prediction.work.samples *
      (sizeof(device::Sample) + sizeof(device::Aim) + 16 + 8 * s.sampling.frames));
  if (prediction.device_bytes > device.memory.device_bytes)
    planned.warnings.push_back("needs " + cl::format_bytes(prediction.device_bytes) + ", " +
                               device.name + " has " +
                               cl::format_bytes(device.memory.device_bytes) +
                               "; a smaller hologram.resolution or wrp.padding, more "
                               "hologram.tiles or a larger sampling.pitch need less");

  const auto fixed = [&](const char* key) {
    return scene.given.contains(key) ? "given" : goal.any() ? "chosen" : "default";
  };
  planned.reasons = {
      why_resolution(s, plan, planner.resolution_m()),
      "sampling.pitch " + length_text(s.sampling.pitch_m) + " (" + fixed("sampling.pitch") +
          "), sampling.frames " + std::to_string(s.sampling.frames) + " (" +
          fixed("sampling.frames") + "), wrp.padding " + number_text(s.wrp.padding) + " (" +
          fixed("wrp.padding") + "), wrp.oversampling " +
          (s.wrp.oversampling ? number_text(*s.wrp.oversampling) : "full") + " (" +
          fixed("wrp.oversampling") + "), sampling.cone " + number_text(s.sampling.cone) + " (" +
          fixed("sampling.cone") + "), sampling.apodization " +
          number_text(s.sampling.apodization) + " (" + fixed("sampling.apodization") +
          "), wrp.layers " + std::to_string(s.wrp.layers) + " (" +
          fixed(scene.given.contains("wrp.distance") ? "wrp.distance" : "wrp.layers") + ")"};
  if (!why_layers.empty()) planned.reasons.push_back(why_layers);
  if (!plan.why_tiles.empty())
    planned.reasons.push_back("hologram.tiles " + std::to_string(plan.tile_grid.x) + " x " +
                              std::to_string(plan.tile_grid.y) + ": " + plan.why_tiles);
  for (auto& warning : warnings_of(s, world, plan, planner.view(), planner.resolution_m()))
    planned.warnings.push_back(std::move(warning));
  return planned;
}

}  // namespace raywave
