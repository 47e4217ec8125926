// SPDX-License-Identifier: Apache-2.0
#include "host/refine/scene_keys.hpp"

#include "host/view/lens.hpp"

namespace raywave {

int refine_iterations(const std::vector<RefineKey>& keys) {
  std::vector<KeyPlace> places;
  for (const auto& key : keys) places.push_back({key.z_m, key.view, key.aperture, key.times});
  return refine_iterations(places);
}

RefineKey lens_key(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
                   const KeyPlace& place, double blur_m, const KeyPictures& how,
                   const std::function<void(double)>& progress) {
  const auto window_m = how.window_m.value_or(refine_window_m(plan));
  const auto count = key_pixels(plan, window_m, blur_m);
  LensSpec lens;
  lens.z_m = place.z_m;
  lens.window_m = window_m;
  if (place.pupil) {
    lens.pupil = place.pupil;
    if (!place.is_whole()) {
      const auto& h = plan.hologram;
      const auto eyebox_m = place.pupil->eyebox_m({h.size, h.pitch_m, h.wavelength_m});
      lens.pupil->centre_m = place.view * eyebox_m / 2.0;
      lens.pupil_part_m = place.aperture * eyebox_m;
    }
  } else {
    lens.view = place.view;
    lens.aperture = place.aperture;
  }
  lens.points = key_lens_points(place, how.lens_points);
  lens.pixel_m = window_m / count;
  lens.area = true;
  RefineKey key{place.z_m, place.view, place.aperture, {}, *lens.pixel_m, place.times, true};
  key.round = place.round;
  key.pupil = place.pupil;
  key.picture = lens_picture(device, plan, scene, lens, progress);
  return key;
}

}  // namespace raywave
