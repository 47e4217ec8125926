// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <utility>

#include "host/api/state.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/render.hpp"

namespace raywave::v0 {
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
  set(settings.iterations, options.iterations, "iterations", 1, RefineSettings::most_iterations);
  set(settings.views, options.views, "views", 0, RefineSettings::most_views);
  set(settings.lens_points, options.lens_points, "lens_points", 2,
      RefineSettings::most_lens_points);
  set(settings.brightness, options.brightness, "brightness", RefineSettings::least_brightness,
      RefineSettings::largest_brightness);
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
  for (auto& laser : refined->scenes)
    laser.refine = settings_of(options, laser.refine.value_or(RefineSettings{}));
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
  auto spec =
      refine_spec(settings, {}, hologram.resolution, hologram.pitch_m, hologram.wavelength_m, keys);
  spec.progress = progress_of(options.render.progress);
  const auto opened = open(options.render.on);
  return as_field(raywave::refine(opened.device, opened.fft, field, keys, spec).field);
}

}  // namespace raywave::v0
