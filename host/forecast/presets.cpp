// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/presets.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>
#include <variant>

#include "host/carriers/planning/facts.hpp"
#include "host/carriers/wrps/planning/padding_errors.hpp"
#include "host/common/text.hpp"
#include "host/forecast/first_call.hpp"
#include "host/forecast/panel_rate.hpp"
#include "host/forecast/warnings.hpp"
#include "host/plan/key_places.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/message_text.hpp"
#include "host/plan/precision.hpp"
#include "host/planning/make_plan.hpp"

namespace raywave {
namespace {

/// A preset selects a target PSNR between that of the fastest candidate (0) and that of the most
/// accurate one (1), in decibels.
constexpr std::array shares_of_preset{0.0, 0.5, 0.85, 1.0};

/// A smaller gain is not worth the time to a preset.
constexpr std::array no_gain_db{0.5, 0.5, 0.5, 0.1};

/// The accuracy.phase of the preset reference, where the scene gives none.
constexpr double reference_phase_turns = 0.001;

/// The largest error of a cone that a preset accepts: draft and balanced are for pictures, accurate
/// and reference for the wavefront.
constexpr std::array cone_errors_of_preset{0.25, 0.25, 0.06, 0.0};

/// The fastest of the choices that `serves` holds for; null where there is none.
const Choice* fastest_of(const std::vector<Choice>& all, const auto& serves) {
  const Choice* best = nullptr;
  for (const auto& c : all)
    if (serves(c) && (!best || c.seconds < best->seconds)) best = &c;
  return best;
}

/// The most accurate of the choices that take no longer; the fastest when all take longer.
const Choice& most_accurate_within(const std::vector<Choice>& all, double seconds) {
  const Choice* best = nullptr;
  for (const auto& c : all) {
    if (c.seconds <= seconds && (!best || c.psnr_db > best->psnr_db ||
                                 (c.psnr_db == best->psnr_db && c.seconds < best->seconds)))
      best = &c;
  }
  return best ? *best : *fastest_of(all, [](const Choice&) { return true; });
}

const Choice& most_accurate(const std::vector<Choice>& all) {
  return *std::ranges::max_element(all, {}, &Choice::psnr_db);
}

/// The fastest of the choices that reach this PSNR; the most accurate when none does.
const Choice& fastest_reaching(const std::vector<Choice>& all, double psnr_db) {
  const auto* best = fastest_of(all, [&](const Choice& c) { return c.psnr_db >= psnr_db; });
  return best ? *best : most_accurate(all);
}

/// A PSNR that is asked for may be missed by as much.
constexpr double psnr_tolerance_db = 1;

bool is_sure(const Choice& c, double psnr_db) { return c.sure_db >= psnr_db - psnr_tolerance_db; }

/// The fastest that reaches this PSNR surely; where none does, one near the most accurate.
const Choice& fastest_surely_reaching(const std::vector<Choice>& all, double psnr_db) {
  const auto* best = fastest_of(all, [&](const Choice& c) { return is_sure(c, psnr_db); });
  constexpr double no_gain = 0.5;
  return best ? *best
              : fastest_reaching(all, std::max(psnr_db, most_accurate(all).psnr_db - no_gain));
}

const Choice& chosen(const std::vector<Choice>& all, const Goal& goal) {
  if (goal.budget_s) return most_accurate_within(all, *goal.budget_s);
  if (goal.psnr_db) return fastest_surely_reaching(all, *goal.psnr_db);
  const auto least = most_accurate_within(all, 0).psnr_db;  // of the fastest
  const auto most = most_accurate(all).psnr_db;
  const auto preset = static_cast<std::size_t>(*goal.preset);
  const double wanted = least + shares_of_preset[preset] * (most - least);
  return fastest_reaching(all, wanted - no_gain_db[preset]);
}

/// Without those of more frames, which the panel does not show. Frames that are given stay.
std::vector<Choice> with_frames(std::vector<Choice> all, double most) {
  most = std::max(most, 1.0);
  if (std::ranges::any_of(all, [&](const auto& c) { return c.frames <= most; }))
    std::erase_if(all, [&](const auto& c) { return c.frames > most; });
  return all;
}

std::string decibels_text(double db) { return number_text(std::round(db * 10) / 10) + " dB"; }

std::string why_resolution(const Scene& scene, const Plan& plan, double resolution_m) {
  const std::string text = "resolution " + length_text(std::round(resolution_m * 1e8) / 1e8) + ": ";
  if (scene.viewer.resolution_m == resolution_m) return text + "viewer.resolution";
  if (!scene.viewer.resolution_m && resolution_m == detail_for_eye_m(scene, plan))
    return text + "1 arc minute for an eye " +
           length_text(scene.viewer.eyepiece_m ? scene.viewer.eyepiece_distance_m
                                               : scene.viewer.distance_m) +
           " from the hologram" + (scene.viewer.eyepiece_m ? ", at the eyepiece" : "");
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
    text +=
        (text.empty() ? "" : ", ") + std::to_string(layers) + " takes " + duration_text(seconds);
  return "layers of depth: predicted " + text;
}

/// What lessens the largest part of the error.
std::string advice_on(const PicturePrediction& pictures, const Planned& planned) {
  const auto& scene = planned.scene;
  const auto& plan = planned.plan;
  const bool is_refined = pictures.refined;
  const std::array<std::pair<double, std::string>, 8> parts{{
      {pictures.fall_off,
       "the fall-off of slm.fill: a scene nearer to the axis, or less slm.carrier or slm.shift"},
      {pictures.stop, "what slm.stop cuts off: a wider one, or a scene nearer to the axis"},
      {pictures.missing,
       "light that the pixels cannot show: bring the scene closer to the axis or farther away"},
      {pictures.encoding,
       is_refined ? "what phases leave: more sampling.frames, or a larger viewer.resolution"
       : is_near_hologram(plan)
           ? std::string("brightness that phases do not show near their own plane: ") +
                 (scene.slm.stop ? ""
                                 : "slm.stop = 0.5, if the optics have such an aperture, or ") +
                 "a scene farther from it"
       : shows_amplitude(scene.slm.encoding) || !lies_on_one_side(plan)
           ? "the encoding's haze: another slm.encoding"
           : "the encoding's haze: [refine] lessens it"},
      {pictures.speckle, "speckle: more sampling.frames, or a larger viewer.resolution"},
      {pictures.edges, "cells and edges: a smaller sampling.pitch, or a larger viewer.resolution"},
      {pictures.dots, "the dots of the samples: a smaller sampling.pitch"},
      {pictures.padding, "light that wraps around: a larger wrp.padding"},
  }};
  const auto& [share, text] = *std::ranges::max_element(parts);
  return percent_text(share) + " of the error is " + text;
}

/// Says where the plan does not reach the PSNR that was asked for, or not surely.
void check_psnr(double asked_db, Planned& planned) {
  const auto& pictures = planned.prediction.pictures;
  constexpr double rounding_db = 0.05;
  if (!pictures || pictures->dark ||
      pictures->sure_db() >= asked_db - psnr_tolerance_db - rounding_db)
    return;
  const bool is_likely = pictures->mean_psnr_db >= asked_db - rounding_db;
  const auto asked = decibels_text(asked_db), predicted = decibels_text(pictures->mean_psnr_db);
  planned.warnings.push_back(
      (is_likely ? asked + " may be missed: " + predicted + " are predicted, within " +
                       decibels_text(pictures->margin_db())
                 : "nothing reaches " + asked + ": the most accurate has " + predicted) +
      "; " + advice_on(*pictures, planned));
}

/// Time, pictures and errors of the plan.
Prediction predicted(const Planned& planned, const World& world, const DeviceFigures& device,
                     const Candidates& candidates) {
  const auto& s = planned.scene;
  const auto& plan = planned.plan;
  Prediction prediction;
  prediction.resolution_m = candidates.resolution_m();
  prediction.work =
      count_work(s, world, plan, candidates.view(), footprints_of(plan, candidates.view()));
  prediction.times = predict_times(prediction.work, device.rates);
  prediction.meshes_and_trees_s = meshes_and_trees_s(world);
  prediction.kernels_s = kernels_s(plan, device);
  constexpr double png_of_pixel_s = 35e-9;  // a core of a server processor
  prediction.files_s = png_of_pixel_s * static_cast<double>(plan.hologram.size.x) *
                       plan.hologram.size.y * plan.hologram.frames;
  prediction.device = device.name;
  prediction.rates_of = device.rates.device;
  prediction.are_rates_measured = device.rates.is_measured;
  const double propagation = propagation_error_of(plan);
  const auto* wrps = std::get_if<SpectrumWrps>(&plan.carrier);
  if (auto model = candidates.model_of(plan.most_layers, plan.cone)) {
    set_refinement(*model, plan);
    prediction.pictures =
        predict_pictures(*model, lattice_pattern(*model, s.sampling.pitch_m), s.sampling.frames,
                         wrps ? predicted_padding_errors(plan, {wrps->padded})[0] : propagation);
  }
  prediction.slm_light = slm_light(plan, candidates.view(), wavelengths_m_of(s));
  if (has_pupil(s)) prediction.eye = eye_view(s, plan, candidates.view());
  const double phase_error = 2 * std::numbers::pi * phase_error_turns(plan);
  prediction.field_error = std::hypot(cone_error_of(plan), std::hypot(propagation, phase_error));
  return prediction;
}

/// Predicts the memory of device and host, surface samples included, and warns where it is short.
///
/// lasers  whose results are held
void predict_memory(const World& world, const DeviceFigures& device, const MemoryUse& use,
                    std::size_t lasers, Planned& planned) {
  const auto& plan = planned.plan;
  const auto& limits = device.memory;
  auto& warnings = planned.warnings;
  const auto needs = memory_needs(world, plan, use, limits.largest_buffer_bytes);
  auto& prediction = planned.prediction;
  auto& bytes = prediction.device_bytes;
  bytes = needs.device_bytes() +
          static_cast<std::uint64_t>(bytes_of_samples(plan, prediction.work.samples));
  prediction.device_on_host = limits.device_on_host;
  prediction.host_bytes = host_peak_bytes(
      world, plan, needs, lasers * needs.results_bytes, limits.device_on_host ? bytes : 0,
      device.is_processor && prediction.kernels_s.value_or(0) > 0);

  // What does not fit into the host is planned in one piece: nothing else would be worth a line
  if (auto shortage = results_shortage(plan, needs, use, limits); !shortage.empty())
    return warnings.push_back(std::move(shortage));
  for (const auto& need : needs.device) {
    if (need.bytes > limits.largest_buffer_bytes)
      warnings.push_back(need.name + ": " + format_bytes(need.bytes) + " in one buffer, " +
                         device.name + " allows " + format_bytes(limits.largest_buffer_bytes) +
                         "; " + need.advice);
  }
  if (bytes > limits.device_bytes)
    warnings.push_back("needs " + format_bytes(bytes) + ", " + device.name + " has " +
                       format_bytes(limits.device_bytes) +
                       "; a smaller hologram.resolution or wrp.padding, more hologram.tiles or a "
                       "larger sampling.pitch need less");
  if (auto shortage = host_shortage(plan, needs, limits); !shortage.empty())
    warnings.push_back(std::move(shortage));
}

/// A line for each value: what it is, and whether it was given, chosen or is the default.
///
/// is_chosen  by a goal: what the scene does not give
std::vector<std::string> reasons_of(const Scene& scene, bool is_chosen, const Planned& planned,
                                    const std::string& why_layers) {
  const auto& s = planned.scene;
  const auto& plan = planned.plan;
  const auto fixed = [&](const char* key) {
    return scene.given.contains(key) ? "given" : is_chosen ? "chosen" : "default";
  };
  const std::string gathering =
      !std::holds_alternative<SpectrumWrps>(plan.carrier)
          ? ""
          : ", wrp.padding " + number_text(s.wrp.padding) + " (" + fixed("wrp.padding") +
                "), sampling.cone " + number_text(s.sampling.cone) + " (" + fixed("sampling.cone") +
                "), sampling.apodization " + number_text(s.sampling.apodization) + " (" +
                fixed("sampling.apodization") + ")";
  std::vector<std::string> reasons = {
      why_resolution(s, plan, planned.prediction.resolution_m),
      "sampling.pitch " + length_text(s.sampling.pitch_m) + " (" + fixed("sampling.pitch") +
          "), sampling.frames " + std::to_string(s.sampling.frames) + " (" +
          fixed("sampling.frames") + ")" + gathering + ", wrp.layers " +
          std::to_string(plan.most_layers) + " (" +
          fixed(scene.given.contains("wrp.distance") ? "wrp.distance" : "wrp.layers") + ")"};
  if (!plan.why_carrier.empty())
    reasons.push_back(std::string("wrp.propagation \"") + name_of(propagation_of(plan)) +
                      "\" (auto): " + plan.why_carrier);
  if (!why_layers.empty()) reasons.push_back(why_layers);
  if (!plan.tiling.why.empty())
    reasons.push_back("hologram.tiles " + extent_text(plan.tiling.grid) + ": " + plan.tiling.why);
  return reasons;
}

/// What keeping a time takes away; empty where it is nothing.
///
/// best    of all choices, those of more time included
/// lasers  that share the time
std::string why_less(const Goal& goal, const Choice& best, const Choice& choice,
                     std::size_t lasers) {
  if (best.psnr_db - choice.psnr_db < 0.05) return "";
  return (choice.seconds > *goal.budget_s ? "the fastest"
          : goal.rate_per_s
              ? number_text(*goal.rate_per_s) +
                    (*goal.rate_per_s == 1 ? " picture a second" : " pictures a second")
              : "the budget") +
         ": " + decibels_text(best.psnr_db - choice.psnr_db) +
         " below the most accurate plan, which has " + decibels_text(best.psnr_db) + " in " +
         duration_text(best.seconds * static_cast<double>(lasers)) + ", " +
         std::to_string(best.frames) + (best.frames == 1 ? " frame" : " frames");
}

/// Why a goal has chosen what it has; empty where there is nothing to say.
struct Whys {
  std::string layers, refined, lost;
};

/// Chooses by a goal the values that the scene of a laser leaves open.
class GoalSearch {
public:
  /// candidates  of the scene; refined ones afterwards, where those are chosen
  /// planned     gets the values, and a warning where none reaches the goal
  GoalSearch(const Goal& goal, const World& world, const DeviceFigures& device,
             std::optional<Candidates>& candidates, Planned& planned)
      : goal_(goal),
        world_(world),
        device_(device),
        candidates_(candidates),
        planned_(planned),
        scene_(planned.scene),
        shown_(frames_shown(scene_, goal.rate_per_s.value_or(pictures_per_s(scene_)))),
        shown_of_all_(std::max(shown_, frames_shown(scene_, pictures_per_s(scene_)))) {}

  /// lasers  that share the time
  Whys choose_values(std::size_t lasers) {
    if (scene_.refine) {
      refine();
      candidates_.emplace(scene_, world_, device_);
    }
    all_ = choices_of(*candidates_);
    Whys whys;
    if (may_gain_by_refinement()) whys.refined = try_refinement();
    const auto& choice = chosen(all_, goal_);
    whys.layers = why_so_many_layers(all_, choice);
    take(choice);
    if (goal_.budget_s) {
      warn_of_budget(choice, lasers);
      whys.lost = why_less(goal_, best_, choice, lasers);
    }
    return whys;
  }

private:
  /// Refines towards the pictures that are judged, whatever the lattice.
  void refine() {
    if (!scene_.refine) scene_.refine.emplace();
    const double blur_m = blur_of_resolution * candidates_->resolution_m();
    if (!scene_.refine->blur_m) scene_.refine->blur_m = blur_m;
    if (!scene_.refine->window_m)
      scene_.refine->window_m =
          quality_window(candidates_->plan(), candidates_->view(), blur_m).centred_size_m();
  }

  /// Takes the values of a choice over into the planned scene.
  void take(const Choice& choice) {
    scene_.sampling.pitch_m = choice.pitch_m;
    scene_.sampling.frames = choice.frames;
    scene_.wrp.layers = choice.layers;
    if (choice.iterations > 0) {
      refine();
      scene_.refine.value().iterations = choice.iterations;
    }
    if (choice.propagation == WrpPropagation::spectrum) {
      scene_.wrp.padding = choice.padding;
      scene_.sampling.cone = choice.cone.half_width;
      scene_.sampling.apodization = choice.cone.apodization;
    }
  }

  void warn_of_budget(const Choice& choice, std::size_t lasers) {
    if (choice.seconds <= *goal_.budget_s) return;
    planned_.warnings.push_back(
        "nothing keeps " + duration_text(*goal_.budget_s * static_cast<double>(lasers)) +
        ": the fastest takes " + duration_text(choice.seconds * static_cast<double>(lasers)) +
        (scene_.given.contains("sampling.pitch")
             ? "; --set sampling.pitch=auto lets the goal choose the given sampling.pitch, too"
         : candidates_->plan().grid == glm::ivec2(1)
             ? "; a smaller hologram.resolution needs less"
             : "; a smaller hologram.resolution or wrp.grid needs less"));
  }

  /// Choices that the panel shows in the goal's time; best_ knows those of more time, too.
  std::vector<Choice> choices_of(Candidates& candidates) {
    auto all = with_frames(candidates.choices(largest_cone_error(goal_)), shown_of_all_);
    if (const auto& most = most_accurate(all); most.psnr_db > best_.psnr_db) best_ = most;
    return with_frames(std::move(all), shown_);
  }

  /// Refined towards a lens, one frame may do what many refined towards samples take longer for.
  bool is_reached() const { return goal_.psnr_db && is_sure(unrefined_, *goal_.psnr_db); }

  bool may_gain_by_refinement() {
    unrefined_ = chosen(all_, goal_);
    const auto& plan = candidates_->plan();
    const bool knows_refinement =
        scene_.viewer.eyepiece_m ||
        (lies_on_one_side(plan) && propagation_error_of(plan) <= hopeless_error);
    return knows_refinement && !(is_reached() && unrefined_.iterations == 0) &&
           (goal_.budget_s || goal_.psnr_db || goal_.preset == Preset::reference) &&
           !scene_.refine && may_refine(scene_);
  }

  /// Refines where that is better. Views through parts of the hologram take time, and gain 2 to
  /// 3 dB there: without them where whole pictures gain more in the time that there is.
  ///
  /// returns  why it is refined
  std::string try_refinement() {
    constexpr double gain_of_views_db = 3;
    std::string why;
    std::optional<RefineSettings> taken;
    auto so_far = unrefined_;
    for (const bool has_views : {true, false}) {
      if (!has_views && !goal_.budget_s) break;
      refine();
      if (!has_views) scene_.refine->views = 0;
      Candidates refined(scene_, world_, device_);
      auto all_refined = choices_of(refined);
      const auto with = chosen(all_refined, goal_);
      const bool is_better =
          is_reached()    ? is_sure(with, *goal_.psnr_db) && with.seconds < so_far.seconds
          : goal_.psnr_db ? with.sure_db > so_far.sure_db
                          : with.psnr_db > so_far.psnr_db + (taken ? gain_of_views_db : 0);
      if (!is_better || with.seconds > goal_.budget_s.value_or(with.seconds)) continue;
      if (!is_reached()) why = why_refined();
      if (!has_views)
        why += "; refine.views 0: " + (taken ? "24 would leave " + decibels_text(so_far.psnr_db)
                                             : std::string("24 would take longer"));
      taken = scene_.refine;
      so_far = with;
      all_ = std::move(all_refined);
      candidates_.emplace(std::move(refined));
    }
    scene_.refine = taken;
    return why;
  }

  std::string why_refined() const {
    return goal_.psnr_db ? "refine: without it, no more than " + decibels_text(unrefined_.sure_db) +
                               " are sure"
                         : "refine: without it, at most " + decibels_text(unrefined_.psnr_db) +
                               " are expected" + (goal_.budget_s ? " in that time" : "");
  }

  const Goal& goal_;
  const World& world_;
  const DeviceFigures& device_;
  std::optional<Candidates>& candidates_;
  Planned& planned_;
  Scene& scene_;
  // Frames of a picture that the panel shows: in the goal's time, in any
  double shown_, shown_of_all_;
  std::vector<Choice> all_;
  Choice best_{.psnr_db = -std::numeric_limits<double>::infinity()};  // of all choices
  Choice unrefined_;
};

/// As plan_scenes, of one laser.
///
/// goal    its budget is that of the laser, of a rate too
/// lasers  that share the time
/// given   the scene in which a goal has chosen the values for all lasers; null: this one
Planned plan_laser(const Scene& scene, const World& world, const DeviceFigures& device,
                   const Goal& goal, KeptResults kept, std::size_t lasers,
                   const Scene* given = nullptr) {
  const bool holds_field = kept.field || (lasers > 1 && scene.slm.encoding != Encoding::phase);
  const MemoryUse use{Method::wrp, device.fft, holds_field, kept.by_tile};
  // Values that the scene leaves open keep their defaults, or are chosen as the goal says.
  Planned planned;
  planned.scene = scene;
  auto& s = planned.scene;
  if (goal.preset == Preset::reference && !scene.given.contains("accuracy.phase"))
    s.accuracy.phase_turns = reference_phase_turns;
  if ((goal.preset == Preset::accurate || goal.preset == Preset::reference) &&
      s.trace.bounces == Bounces::automatic)
    s.trace.bounces = Bounces::paths;
  std::optional<Candidates> candidates(std::in_place, s, world, device);
  // Nothing is chosen for pictures that the machine cannot hold: a line says so at once
  const bool fits = [&, &plan = candidates->plan()] {
    const auto needs = memory_needs(world, plan, use, device.memory.largest_buffer_bytes);
    return results_shortage(plan, needs, use, device.memory).empty();
  }();
  Whys whys;
  if (goal.any() && fits)
    whys = GoalSearch(goal, world, device, candidates, planned).choose_values(lasers);

  // The plan with these values, in as few tiles as the device's memory allows
  planned.plan = fitting_plan(s, world, device.memory, use, 100, device.has_doubles);

  // What to expect of it, and why it is as it is
  planned.prediction = predicted(planned, world, device, *candidates);
  if (goal.psnr_db && fits) check_psnr(*goal.psnr_db, planned);
  predict_memory(world, device, use, lasers, planned);
  planned.reasons =
      reasons_of(given ? *given : scene, given || (goal.any() && fits), planned, whys.layers);
  for (const auto& why : {whys.refined, whys.lost})
    if (!why.empty()) planned.reasons.push_back(why);
  for (auto& warning :
       warnings_of(s, world, planned.plan, candidates->view(), planned.prediction.slm_light,
                   !goal.any() && !given && is_default_pitch(scene)))
    planned.warnings.push_back(std::move(warning));
  return planned;
}

}  // namespace

double largest_cone_error(const Goal& goal) {
  return cone_errors_of_preset[static_cast<std::size_t>(goal.preset.value_or(Preset::balanced))];
}

std::size_t planned_laser(const std::vector<Scene>& scenes) {
  const auto longest = std::ranges::max_element(
      scenes, {}, [](const Scene& scene) { return scene.hologram.wavelength_m; });
  return static_cast<std::size_t>(longest - scenes.begin());
}

std::vector<Planned> plan_scenes(const std::vector<Scene>& scenes, const World& world,
                                 const DeviceFigures& device, const Goal& goal, KeptResults kept) {
  auto for_each = goal;
  if (const auto time_s = goal.time_s())
    for_each.budget_s = *time_s / static_cast<double>(scenes.size());
  const auto& longest = scenes[planned_laser(scenes)];
  const auto chosen = plan_laser(longest, world, device, for_each, kept, scenes.size());
  std::vector<Planned> all;
  for (const auto& scene : scenes) {
    if (&scene == &longest) {
      all.push_back(chosen);
      continue;
    }
    auto same = scene;
    same.hologram.tiles = chosen.scene.hologram.tiles;
    same.slm.encoding = chosen.scene.slm.encoding;
    same.wrp = chosen.scene.wrp;
    same.sampling = chosen.scene.sampling;
    same.trace = chosen.scene.trace;
    same.accuracy = chosen.scene.accuracy;
    same.refine = chosen.scene.refine;
    all.push_back(
        plan_laser(same, world, device, {}, kept, scenes.size(), goal.any() ? &scene : nullptr));
  }
  const double rate_per_s = goal.rate_per_s.value_or(pictures_per_s(scenes[0]));
  for (auto& laser : all) {
    if (auto why = why_frames_shown(laser.scene, rate_per_s); !why.empty())
      laser.reasons.push_back(std::move(why));
    if (auto warning = panel_warning(laser.scene, rate_per_s); !warning.empty())
      laser.warnings.push_back(std::move(warning));
  }
  return all;
}

std::vector<std::string> render_warnings(const std::vector<Planned>& planned, const Scene& scene,
                                         const World& world, const Plan& plan) {
  for (const auto& laser : planned)
    if (laser.scene.hologram.wavelength_m == scene.hologram.wavelength_m) return laser.warnings;
  return warnings_of(scene, world, plan);
}

}  // namespace raywave
