// SPDX-License-Identifier: Apache-2.0
#include "host/forecast/candidates.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>

#include "host/carriers/planning/facts.hpp"
#include "host/carriers/wrps/planning/padding_errors.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/plan/key_places.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/padded_plane.hpp"
#include "host/planning/make_plan.hpp"
#include "host/planning/tiles.hpp"
#include "host/scene/scene.hpp"

namespace raywave {
namespace {

/// Sampling pitches tried, over the resolution. Coarser lattices show their dots.
constexpr std::array pitches_of_resolution{1.0, 0.85, 0.7, 0.6, 0.5, 0.42, 0.35, 0.3, 0.25};

constexpr int most_layers_tried = 8;

/// Predictions are no better: what saves less time is not tried.
constexpr double least_saving = 0.1;

/// Fields that are more wrong than this show ghosts beside bright objects.
constexpr double worst_padding_error = 0.15;

/// To two digits: as a person would write it.
double round_pitch(double p) {
  const double digit = std::pow(10, std::floor(std::log10(p)) - 1);
  return std::floor(p / digit + 1e-9) * digit;
}

Plan with_pitch(Plan plan, double pitch_m) {
  const double finer = plan.lattice.step * plan.lattice.full_z_m / pitch_m;
  plan.lattice.step /= finer;
  plan.lattice.size = glm::ivec2(glm::ceil(glm::dvec2(plan.lattice.size) * finer));
  return plan;
}

}  // namespace

double detail_for_eye_m(const Scene& scene, const Plan& plan) {
  return detail_for_eye_m(scene.viewer, (plan.extent.near_m + plan.extent.far_m) / 2);
}

double wanted_resolution_m(const Scene& scene, const Plan& plan) {
  const auto limit = limit_m(plan, middle_m(plan));
  return std::max(
      {limit.x, limit.y, scene.viewer.resolution_m.value_or(detail_for_eye_m(scene, plan))});
}

bool may_refine(const Scene& scene) {
  const bool keeps_encoding =
      scene.given.contains("slm.encoding") && scene.slm.encoding == Encoding::double_phase;
  return !shows_amplitude(scene.slm.encoding) && !keeps_encoding &&
         !scene.given.contains("refine.iterations");
}

std::vector<Choice> choices(const Scene& scene, const World& world, const DeviceFigures& device) {
  return Candidates(scene, world, device).choices(std::numeric_limits<double>::infinity());
}

Candidates::Candidates(const Scene& scene, const World& world, const DeviceFigures& device)
    : scene_(scene),
      world_(world),
      device_(device),
      plan_(make_plan(scene, world, Method::wrp, 100, device.has_doubles)),
      resolution_m_(wanted_resolution_m(scene, plan_)),
      view_(front_view(scene, world, plan_)) {
  add(layout(plan_.most_layers, plan_));
}

const std::optional<PictureModel>& Candidates::model_of(int layers, const Cone& cone) const {
  const auto found = std::ranges::find_if(layouts_, [&](const Layout& l) {
    return l.layers == layers && l.gathering.plan.cone == cone;
  });
  return found->model;
}

std::vector<Choice> Candidates::choices(double most_cone_error) {
  if (!plan_.samples.aimed)
    throw InputError(one_line(scene_.file.string()) +
                     ": pictures of sampling.mode \"fan\" cannot be predicted; give "
                     "sampling.pitch, sampling.frames and wrp.padding "
                     "instead of a goal, or sampling.mode \"aimed\"");
  const auto pitches_m = pitches();
  const auto counts = scene_.given.contains("sampling.frames")
                          ? std::vector{scene_.sampling.frames}
                          : std::vector(frames_tried.begin(), frames_tried.end());

  // Layouts first: their planes, footprints and errors hold for all pitches and frames.
  add_layers(pitches_m.back(), counts);
  add_cones(most_cone_error);
  for (auto& layout : layouts_) predict_errors(layout);

  std::vector<Choice> all;
  for (const double pitch_m : pitches_m) add_choices(pitch_m, counts, all);
  return all;
}

/// Sampling pitches to try, the coarsest first: the scene's own, or what lies between the detail
/// that counts and the hologram's limit.
std::vector<double> Candidates::pitches() const {
  if (scene_.given.contains("sampling.pitch")) return {scene_.sampling.pitch_m};
  const auto limit = limit_m(plan_, middle_m(plan_));
  std::vector<double> pitches_m;
  for (const double share : pitches_of_resolution) {
    if (const double p = round_pitch(share * resolution_m_);
        pitches_m.empty() || p >= std::max(limit.x, limit.y))
      pitches_m.push_back(p);
  }
  return pitches_m;
}

/// Appends the choices of one pitch: cone by cone, all numbers of frames, layouts with more layers
/// only where they save time, and each with all paddings.
void Candidates::add_choices(double pitch_m, const std::vector<int>& counts,
                             std::vector<Choice>& all) const {
  for (std::size_t first = 0; first < layouts_.size();) {
    const auto cone = layouts_[first].gathering.plan.cone;
    auto end = first;
    while (end < layouts_.size() && layouts_[end].gathering.plan.cone == cone) ++end;
    const auto pattern = lattice_pattern(*layouts_[first].model, pitch_m);
    for (const int frames : counts) {
      double least_s = std::numeric_limits<double>::infinity();
      for (auto i = first; i < end; ++i) {
        const auto& layout = layouts_[i];
        const Choice c{.pitch_m = pitch_m,
                       .padding = 1,
                       .frames = frames,
                       .layers = layout.layers,
                       .propagation = propagation_of(layout.gathering.plan),
                       .cone = cone};
        const double seconds = seconds_of(c, layout.gathering);
        if (!(seconds < (1 - least_saving) * least_s)) continue;
        least_s = seconds;
        add_paddings(c, layout, pattern, all);
      }
    }
    first = end;
  }
}

void Candidates::add(Layout layout) {
  if (plan_.samples.aimed) {
    auto seen = layout.gathering.plan;
    seen.grid = plan_.grid;  // pictures of one size are compared
    std::vector<Pupil> pupils;
    if (scene_.viewer.eyepiece_m && is_near_hologram(seen)) {
      // Of the band that is gathered, the pupil sees a part, and the encoding's haze lies beyond
      auto& h = seen.hologram;
      const auto filled = glm::min(2.0 * h.largest_sine * h.pitch_m / h.wavelength_m, 1.0);
      h.band_filled = std::sqrt(filled.x * filled.y);
      pupils = pupils_of(scene_.viewer);
      const auto& first = pupils.front();
      h.largest_sine = glm::min(h.largest_sine, first.diameter_m / 2 / std::abs(first.b_m));
    }
    layout.model = picture_model(view_, seen, resolution_m_);
    look_through(pupils, seen, *layout.model);
  }
  layouts_.push_back(std::move(layout));
}

/// Adds more and more layers, as long as they save time on the finest lattice, with the fewest
/// frames or the most, and there are surfaces in them.
void Candidates::add_layers(double finest_pitch_m, const std::vector<int>& counts) {
  if (scene_.given.contains("wrp.layers") || scene_.given.contains("wrp.distance") ||
      !plan_.samples.aimed || is_near_hologram(plan_))
    return;
  for (int layers = layouts_.back().layers + 1; layers <= most_layers_tried; ++layers) {
    auto scene = scene_;
    scene.wrp.layers = layers;
    scene.wrp.propagation = propagation_of(plan_);
    scene.hologram.tiles = plan_.tiling.grid;
    auto more = layout(layers, make_plan(scene, world_, Method::wrp, 100, device_.has_doubles));
    if (more.gathering.plan.layers.size() == layouts_.back().gathering.plan.layers.size()) return;
    const auto saves = [&](int frames) {
      const Choice c{.pitch_m = finest_pitch_m, .padding = 1, .frames = frames};
      return seconds_of(c, more.gathering) <
             (1 - least_saving) * seconds_of(c, layouts_.back().gathering);
    };
    if (!saves(counts.front()) && !saves(counts.back())) return;
    add(std::move(more));
  }
}

/// Adds the same layers with other cones, which change neither planes nor lattice enough to count.
void Candidates::add_cones(double most_error) {
  const auto layers = layouts_.size();
  auto tried = std::vector{plan_.cone};
  for (auto cone : cones_tried) {
    if (scene_.given.contains("sampling.cone")) cone.half_width = plan_.cone.half_width;
    if (scene_.given.contains("sampling.apodization")) cone.apodization = plan_.cone.apodization;
    if (cone.apodization > cone.half_width || cone.field_error() > most_error ||
        std::ranges::find(tried, cone) != tried.end())
      continue;
    tried.push_back(cone);
    for (std::size_t i = 0; i < layers; ++i) {
      if (!std::holds_alternative<SpectrumWrps>(layouts_[i].gathering.plan.carrier))
        continue;  // all light of the hologram
      auto plan = layouts_[i].gathering.plan;
      plan.cone = cone;
      divide(plan, plan.tiling.grid, scene_.wrp.padding);  // tiles have cones of their own
      add(layout(layouts_[i].layers, plan));
    }
  }
}

/// Errors of the paddings that are tried; paddings with ghosts are left out.
void Candidates::predict_errors(Layout& layout) const {
  if (!std::holds_alternative<SpectrumWrps>(layout.gathering.plan.carrier)) {  // nothing is padded
    layout.paddings.emplace_back(scene_.wrp.padding, propagation_error_of(layout.gathering.plan));
    return;
  }
  const auto given = scene_.given.contains("wrp.padding");
  const auto tried = given ? std::vector{scene_.wrp.padding}
                           : std::vector(paddings_tried.begin(), paddings_tried.end());
  std::vector<glm::ivec2> sizes;
  for (const double padding : tried) sizes.push_back(padded_size(plan_.tiling.tile_size, padding));
  const auto errors = predicted_padding_errors(layout.gathering.plan, sizes);
  for (std::size_t i = 0; i < tried.size(); ++i) {
    if (errors[i] <= worst_padding_error || i + 1 == tried.size())
      layout.paddings.emplace_back(tried[i], errors[i]);
  }
}

/// Appends a choice with each padding that is tried.
void Candidates::add_paddings(const Choice& without, const Layout& layout,
                              const LatticePattern& pattern, std::vector<Choice>& all) const {
  auto plan = with_pitch(layout.gathering.plan, without.pitch_m);
  auto work = work_of(without, plan, layout.gathering);
  for (const auto& [padding, error] : layout.paddings) {
    auto c = without;
    c.padding = padding;
    set_padding(plan, padding);
    work.butterflies = count_butterflies(plan, c.frames);
    const auto predict = [&, of_padding = error](const PictureModel& model) {
      const auto pictures = predict_pictures(model, pattern, c.frames, of_padding);
      c.psnr_db = pictures.mean_psnr_db;
      c.sure_db = pictures.sure_db();
      all.push_back(c);
    };
    c.seconds = predict_times(work, device_.rates).total_s();
    predict(*layout.model);
    if (scene_.refine || !serves_samples(plan, scene_.viewer) || !may_refine(scene_)) continue;
    auto paced = plan;
    paced.refine.emplace().blur_m = blur_of_resolution * resolution_m_;
    paced.refine->viewer = scene_.viewer;
    const int least = least_paced_iterations(plan, *paced.refine->blur_m, scene_.viewer);
    for (const int iterations : paced_tried) {
      if (iterations < least) continue;
      paced.refine->iterations = iterations;
      auto with = work;
      add_refinement(paced, c.frames, with);
      c.iterations = iterations;
      c.seconds = predict_times(with, device_.rates).total_s();
      auto model = *layout.model;
      set_refinement(model, paced);
      predict(model);
    }
  }
}

Work Candidates::work_of(const Choice& c, const Plan& plan, const Gathering& gathering) const {
  auto scene = scene_;
  scene.sampling.frames = c.frames;
  return count_work(scene, world_, plan, view_, gathering.footprints);
}

double Candidates::seconds_of(const Choice& c, const Gathering& gathering) const {
  auto plan = with_pitch(gathering.plan, c.pitch_m);
  set_padding(plan, c.padding);
  return predict_times(work_of(c, plan, gathering), device_.rates).total_s();
}

}  // namespace raywave
