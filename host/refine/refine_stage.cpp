// SPDX-License-Identifier: Apache-2.0
#include "host/refine/refine_stage.hpp"

#include <utility>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/message_text.hpp"
#include "host/refine/panel_light.hpp"

namespace raywave {

RefineSpec refine_spec(const RefineSettings& settings, const SlmSpec& slm, glm::ivec2 size,
                       glm::dvec2 pitch_m, double wavelength_m, const std::vector<RefineKey>& keys,
                       std::shared_ptr<const Panel> panel) {
  RefineSpec spec;
  spec.pitch_m = pitch_m;
  spec.wavelength_m = wavelength_m;
  spec.blur_m = settings.blur_m.value();
  spec.brightness = settings.brightness;
  spec.iterations = settings.iterations.value_or(refine_iterations(keys));
  spec.budget_s = settings.budget_s;
  const auto& profile = slm.illumination.profile;
  if (!profile.is_even())
    spec.showing.beam =
        std::make_shared<const std::vector<float>>(amplitudes_of(profile, size, pitch_m));
  spec.showing.fill = slm.fill;
  spec.showing.carrier = carrier_of(slm, pitch_m, wavelength_m);
  spec.showing.source = source_spread(slm, pitch_m, wavelength_m);
  spec.panel =
      panel ? std::move(panel) : refinement::panel_to_know(slm, size, pitch_m, wavelength_m);
  return spec;
}

KeyPictures key_pictures(const RefineSettings& settings) {
  return {settings.window_m, settings.lens_points};
}

RefineStage::RefineStage(const cl::Device& device, cl::FftBackend backend, StageTimes& times,
                         std::function<void(const std::string&, double)> progress)
    : device_(device), backend_(backend), times_(times), progress_(std::move(progress)) {}

void RefineStage::prepare(const Plan& plan, const FieldStack* start) {
  plan_ = &plan;
  if (!plan.refine) return;
  if (start && (start->nx != plan.hologram.size.x || start->ny != plan.hologram.size.y ||
                start->frames != plan.hologram.frames))
    throw InputError("refinement is to begin with " + std::to_string(start->frames) +
                     " frames of " + extent_text({start->nx, start->ny}) +
                     " samples; the scene has " + std::to_string(plan.hologram.frames) + " of " +
                     extent_text(plan.hologram.size));
  if (!refiner_) refiner_.emplace(device_, backend_);
  has_start_ = start != nullptr;
  if (start)
    refiner_->holograms().take(*start);
  else
    refiner_->holograms().resize(plan.hologram.size, plan.hologram.frames);
}

const TileField& RefineStage::take(const TileField& field, std::size_t tile, int frame) {
  if (!plan_->refine || has_start_) return field;
  const StageClock clock(times_, "refine");
  const auto& tiling = plan_->tiling;
  // Near the hologram, the field's amplitude is the picture
  refiner_->holograms().take(*field.samples, tiling.tiles[tile].first, tiling.tile_size, frame,
                             is_near_hologram(*plan_));
  device_.finish();
  return field;
}

void RefineStage::run(const DeviceScene& scene, const SampleTable* table) {
  if (!plan_->refine) return;
  const StageClock clock(times_, "refine");
  const auto& settings = plan_->refine.value();
  const double blur_m = settings.blur_m.value();
  refined_ = {};
  refined_.places = planned_places(*plan_);
  const bool of_samples = refines_samples(*plan_);
  std::shared_ptr<const SampleLight> light;
  if (of_samples)
    light = std::make_shared<SampleLight>(
        sample_light(device_, *plan_, scene, *table, part_plane(*plan_, settings.viewer)));
  for (const auto& place : refined_.places) {
    if (of_samples) {
      RefineKey key{place.z_m, place.view, place.aperture};
      key.round = place.round;
      key.pupil = place.pupil;
      key.samples = light;
      key.sample_window_m = refine_window_m(*plan_);
      refined_.keys.push_back(std::move(key));
      continue;
    }
    if (progress_)
      progress_(
          "lens at " + length_text(place.z_m),
          static_cast<double>(refined_.keys.size()) / static_cast<double>(refined_.places.size()));
    refined_.keys.push_back(
        lens_key(device_, *plan_, scene, place, blur_m, key_pictures(settings)));
  }
  auto spec = refine_spec(settings, plan_->slm, plan_->hologram.size, plan_->hologram.pitch_m,
                          plan_->hologram.wavelength_m, refined_.keys, panel_);
  panel_ = spec.panel;
  spec.progress = progress_;
  if (of_samples || settings.viewer.eyepiece_m) {
    spec.iterations = planned_iterations(*plan_);
    spec.in_order = true;
    spec.first_step = 3;
    spec.padding = 1;
  }
  const auto result = refiner_->run(refined_.keys, spec);
  refined_.figures = result.figures;
  refined_.brightness = result.brightness;
  if (of_samples) {
    // Of light at the hologram, in the field's own units, as over the whole hologram of radiance
    const auto window_m = plan_->window_m();
    refined_.brightness *=
        window_m.x * window_m.y /
        (scene.radiance_unit * amplitude_unit_m(*plan_) * amplitude_unit_m(*plan_));
  }
}

Refined RefineStage::finish(bool keep_phases) {
  if (keep_phases) refined_.phases = refiner_->holograms().read();
  return std::exchange(refined_, {});
}

}  // namespace raywave
