// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/trade/knobs.hpp"

#include <algorithm>
#include <limits>

#include "host/carriers/planning/facts.hpp"
#include "host/carriers/virtual_planes/planning/planes.hpp"
#include "host/common/text.hpp"
#include "host/forecast/tuning.hpp"
#include "host/plan/key_places.hpp"

namespace raywave {
namespace {

template <class T>
TradeKnob plain(const char* key, T TradeKnobs::*member) {
  return {key, [member](const TradeKnobs& k) { return Json(k.*member); },
          [member](TradeKnobs& k, const Json& j) { k.*member = j.template get<T>(); }};
}

/// A knob whose values are those of an enumeration.
template <Named T>
TradeKnob named(const char* key, T TradeKnobs::*member) {
  return {key, [member](const TradeKnobs& k) { return Json(name_of(k.*member)); },
          [key, member](TradeKnobs& k, const Json& j) {
            k.*member = choice_of<T>(j.template get<std::string>(), key);
          }};
}

/// A list of configurations without duplicates, in the order of their first addition.
class Rows {
public:
  explicit Rows(std::vector<TradeRow>& rows) : rows_(rows) {}

  std::size_t add(const TradeKnobs& knobs, bool thorough) {
    const auto found = std::ranges::find(rows_, knobs, &TradeRow::knobs);
    if (found != rows_.end()) return static_cast<std::size_t>(found - rows_.begin());
    rows_.emplace_back();
    rows_.back().knobs = knobs;
    rows_.back().thorough = thorough;
    return rows_.size() - 1;
  }

private:
  std::vector<TradeRow>& rows_;
};

/// The Pareto frontier of predicted time and PSNR, fastest choice first.
std::vector<Choice> predicted_frontier(std::vector<Choice> all) {
  std::ranges::stable_sort(all, {}, &Choice::seconds);
  std::vector<Choice> best;
  for (const auto& c : all) {
    if (best.empty() || c.psnr_db > best.back().psnr_db) best.push_back(c);
  }
  return best;
}

/// Choices that may lie on the frontier, given the known error of predictions, fastest first: no
/// other choice of at least equal PSNR is predicted to take less than 1 / margin of the time.
///
/// about_s  choices with a much longer predicted time are left out
std::vector<Choice> near_frontier(std::vector<Choice> all, double about_s) {
  constexpr double margin = 1.3;
  std::ranges::stable_sort(all, {}, &Choice::seconds);
  const auto best = predicted_frontier(all);
  std::erase_if(all, [&](const Choice& c) {
    return c.seconds > margin * about_s || std::ranges::any_of(best, [&](const Choice& b) {
             return b.psnr_db >= c.psnr_db && b.seconds * margin < c.seconds;
           });
  });
  return all;
}

/// Knobs whose effect is not predicted.
struct Finish {
  int antialias, visibility;
  bool operator==(const Finish&) const = default;
};

/// The values of these knobs that are tried with each choice of the other knobs.
std::vector<Finish> finishes_of(const Scene& scene, const TradeKnobs& base, const TradeSpec& spec) {
  std::vector<Finish> finishes{{4, 8}, {2, 8}, {0, 8}};
  if (spec.exhaustive && spec.quick) finishes = {{4, 8}, {0, 8}, {4, 4}};
  if (spec.exhaustive && !spec.quick) finishes.insert(finishes.end(), {{4, 4}, {2, 4}, {0, 4}});
  std::vector<Finish> some;
  for (auto finish : finishes) {
    if (scene.given.contains("sampling.antialias")) finish.antialias = base.antialias;
    if (scene.given.contains("sampling.visibility")) finish.visibility = base.visibility;
    if (std::ranges::find(some, finish) == some.end()) some.push_back(finish);
  }
  return some;
}

/// Adds, for each knob that the scene leaves open, a row for every value; other knobs keep the base
/// value.
void add_steps(Trade& trade, const World& world, Rows& rows, const std::vector<double>& pitches_m,
               const TradeSpec& spec) {
  const auto base = trade.rows[trade.base].knobs;
  const auto step = [&](const std::string& knob, const std::string& value,
                        const TradeKnobs& knobs) {
    if (!(knobs == base)) trade.steps.push_back({knob, value, rows.add(knobs, true)});
  };
  const auto vary = [&](const char* key, const std::vector<Json>& values,
                        std::size_t quick_values) {
    const auto& all = trade_knobs();
    const auto knob = std::ranges::find(all, std::string(key), &TradeKnob::key);
    if (trade.scenes[0].given.contains(key)) return;
    for (const auto& value : spec.quick ? thinned(values, quick_values) : values) {
      auto knobs = base;
      knob->set(knobs, value);
      if (knobs.apodization > knobs.cone) continue;
      const std::string text =
          value.is_string() ? value.get<std::string>() : number_text(value.get<double>());
      step(key, key == std::string("sampling.pitch") ? length_text(value.get<double>()) : text,
           knobs);
    }
  };
  vary("sampling.pitch", {pitches_m.begin(), pitches_m.end()}, 3);
  vary("sampling.frames", {frames_tried.begin(), frames_tried.end()}, 3);
  if (trade.scenes[0].wrp.propagation == WrpPropagation::automatic &&
      why_not_virtual_planes(trade.scenes[0]).empty())
    vary("wrp.propagation", {"spectrum", "compact"}, 2);
  const bool has_wrps = base.propagation == WrpPropagation::spectrum;
  if (has_wrps) vary("wrp.padding", {paddings_tried.begin(), paddings_tried.end()}, 3);
  if (!trade.scenes[0].given.contains("wrp.distance")) vary("wrp.layers", {1, 2, 3, 4}, 2);
  vary("sampling.antialias", {0, 2, 4}, 3);
  vary("sampling.visibility", {0, 4, 8, 16}, 2);
  if (has_wrps) vary("sampling.cone", {1.0, 1.1, 1.2, 1.4}, 2);
  if (has_wrps) vary("sampling.apodization", {0.0, 0.1, 0.2, 0.3, 0.4}, 2);
  if (base.blur_m > 0) vary("refine.iterations", {0, 1, 2, 3, 4, 6, 8, 12, 28}, 3);
  if (base.propagation == WrpPropagation::compact) {
    vary("wrp.lines", {1, 2, 4, 8}, 2);
    vary("wrp.margin", {0.0, 2.0, 4.0, 8.0}, 2);
  }
  const auto& scene = trade.scenes[0];
  if (std::ranges::any_of(scene.lights, [](const Light& light) { return light.samples > 1; }))
    vary("light.samples", {0.25, 0.5, 2.0}, 2);
  if (std::ranges::any_of(world.materials,
                          [](const Material& material) { return material.is_specular(); }))
    vary("trace.bounces", {"points", "paths"}, 2);
  vary("accuracy.precision", {"float"}, 2);
  if (trade.device.fp64) vary("accuracy.precision", {"double"}, 1);
  if (!spec.fft) {
    for (const auto backend : cl::all_backends) {
      if (cl::serves(backend, trade.device)) vary("fft", {std::string(cl::name_of(backend))}, 1);
    }
  }
  auto knobs = base;
  knobs.iterations = 0;  // refined pictures have an encoding of their own
  if (!scene.given.contains("slm.encoding") && !shows_amplitude(scene.slm.encoding)) {
    for (const auto encoding : {Encoding::phase, Encoding::double_phase}) {
      knobs.encoding = encoding;
      step("slm.encoding", name_of(encoding), knobs);
    }
  }
  if (scene.given.contains("sampling.mode")) return;
  knobs = base;
  knobs.mode = SamplingMode::fan;
  knobs.propagation = WrpPropagation::spectrum;
  knobs.layers = 1;  // rays of a fan cross all layers
  step("sampling.mode", "fan", knobs);
}

}  // namespace

std::vector<Scene> with_knobs(std::vector<Scene> scenes, const TradeKnobs& knobs) {
  for (auto& scene : scenes) {
    auto& s = scene.sampling;
    s.pitch_m = knobs.pitch_m;
    s.frames = knobs.frames;
    s.antialias = knobs.antialias;
    s.visibility = knobs.visibility;
    s.mode = knobs.mode;
    s.cone = knobs.cone;
    s.apodization = knobs.apodization;
    scene.wrp.propagation = knobs.propagation;
    scene.wrp.padding = knobs.padding;
    scene.wrp.layers = knobs.layers;
    scene.accuracy.precision = knobs.precision;
    scene.slm.encoding = knobs.encoding;
    scene.trace.bounces = knobs.bounces;
    if (knobs.lines > 0) scene.wrp.lines = knobs.lines;
    if (knobs.margin_px >= 0) scene.wrp.margin_px = knobs.margin_px;
    for (auto& light : scene.lights)
      light.samples =
          std::clamp(static_cast<int>(knobs.light_samples * light.samples), 1, most_lights);
    if (knobs.iterations == 0) {
      scene.refine.reset();
      continue;
    }
    if (!scene.refine) scene.refine.emplace();
    scene.refine->iterations = knobs.iterations;
    scene.refine->blur_m = knobs.blur_m;
  }
  return scenes;
}

TradeKnobs knobs_of(const Scene& scene, const Plan& plan, cl::FftBackend fft) {
  const auto& s = scene.sampling;
  const auto& w = scene.wrp;
  const auto propagation = propagation_of(plan);
  const bool is_refined = plan.refine.has_value();
  return {s.pitch_m,
          s.frames,
          propagation,
          w.padding,
          w.layers,
          s.antialias,
          s.visibility,
          s.mode,
          s.cone,
          s.apodization,
          plan.precision,
          fft,
          is_refined ? planned_iterations(plan) : 0,
          is_refined ? plan.refine->blur_m.value() : 0,
          plan.slm.encoding,
          scene.trace.bounces,
          w.lines.value_or(0),
          w.margin_px.value_or(-1)};
}

const std::vector<TradeKnob>& trade_knobs() {
  static const std::vector<TradeKnob> knobs{
      plain("sampling.pitch", &TradeKnobs::pitch_m),
      plain("sampling.frames", &TradeKnobs::frames),
      named("wrp.propagation", &TradeKnobs::propagation),
      plain("wrp.padding", &TradeKnobs::padding),
      plain("wrp.layers", &TradeKnobs::layers),
      plain("sampling.antialias", &TradeKnobs::antialias),
      plain("sampling.visibility", &TradeKnobs::visibility),
      named("sampling.mode", &TradeKnobs::mode),
      plain("sampling.cone", &TradeKnobs::cone),
      plain("sampling.apodization", &TradeKnobs::apodization),
      named("accuracy.precision", &TradeKnobs::precision),
      named("fft", &TradeKnobs::fft),
      plain("refine.iterations", &TradeKnobs::iterations),
      plain("refine.blur", &TradeKnobs::blur_m),
      named("slm.encoding", &TradeKnobs::encoding),
      named("trace.bounces", &TradeKnobs::bounces),
      plain("wrp.lines", &TradeKnobs::lines),
      plain("wrp.margin", &TradeKnobs::margin_px),
      plain("light.samples", &TradeKnobs::light_samples),
  };
  return knobs;
}

Json json_of(const TradeKnobs& knobs) {
  Json json;
  for (const auto& knob : trade_knobs()) json[knob.key] = knob.get(knobs);
  return json;
}

TradeKnobs knobs_of(const Json& json) {
  TradeKnobs knobs;
  for (const auto& knob : trade_knobs()) knob.set(knobs, json.at(knob.key));
  return knobs;
}

void plan_rows(Trade& trade, const World& world, const TradeSpec& spec) {
  // A row for each preset; "balanced" is the base.
  const auto figures = figures_of(trade.device);
  const auto fft = spec.fft.value_or(cl::default_backend(trade.device));
  Rows rows(trade.rows);
  double resolution_m = 0, balanced_s = 0;
  for (const auto preset : {Preset::draft, Preset::balanced, Preset::accurate, Preset::reference}) {
    const auto planned = plan_scenes(trade.scenes, world, figures, {preset, {}, {}});
    const auto row = rows.add(knobs_of(planned[0].scene, planned[0].plan, fft), true);
    trade.presets.push_back({preset, row});
    if (preset == Preset::balanced) {
      trade.base = row;
      balanced_s = planned[0].prediction.times.total_s();
    }
    resolution_m = planned[0].prediction.resolution_m;
  }

  // Rows that differ from the base in one knob
  if (spec.presets) return;
  // Choices of the longest wavelength are made for all, as by plan_scenes.
  const auto all = choices(trade.scenes[planned_laser(trade.scenes)], world, figures);
  std::vector<double> pitches_m;
  for (const auto& c : all) {
    if (std::ranges::find(pitches_m, c.pitch_m) == pitches_m.end()) pitches_m.push_back(c.pitch_m);
  }
  add_steps(trade, world, rows, pitches_m, spec);

  // Rows of choices at or near the predicted frontier, in which several knobs vary together
  const auto base = trade.rows[trade.base].knobs;
  const double blur_m = blur_of_resolution * resolution_m;
  const auto best = !spec.exhaustive ? predicted_frontier(all)
                    : spec.quick     ? near_frontier(all, balanced_s)
                                     : near_frontier(all, std::numeric_limits<double>::infinity());
  const std::size_t most = !spec.exhaustive ? (spec.quick ? 3 : 8) : spec.quick ? 12 : best.size();
  for (const auto& c : thinned(best, most)) {
    for (const auto& [antialias, visibility] : finishes_of(trade.scenes[0], base, spec)) {
      auto knobs = base;
      knobs.pitch_m = c.pitch_m;
      knobs.propagation = c.propagation;
      knobs.padding = c.padding;
      knobs.frames = c.frames;
      knobs.layers = c.layers;
      if (c.propagation == WrpPropagation::spectrum) {
        knobs.cone = c.cone.half_width;
        knobs.apodization = c.cone.apodization;
      }
      knobs.antialias = antialias;
      knobs.visibility = visibility;
      knobs.encoding = c.iterations > 0 ? Encoding::phase : trade.scenes[0].slm.encoding;
      knobs.iterations = c.iterations;
      if (c.iterations > 0) knobs.blur_m = blur_m;
      trade.together.push_back(rows.add(knobs, false));
    }
  }
}

}  // namespace raywave
