// SPDX-License-Identifier: Apache-2.0
#include "host/reference/gathering.hpp"

#include <algorithm>
#include <cmath>

#include "host/reference/shading.hpp"

namespace raywave::reference {

Gathering gathering(const Rig& rig, double plane_wave_spots) {
  return {rig.plan,
          rig.lights,
          rig.samples,
          rig.lit,
          rig.arrays.light_words(),
          plane_wave_spots,
          rig.visibility_masks,
          rig.table.visibility_parts};
}

Agreement against_direct_sum(const Rig& rig, std::span<const std::complex<float>> fields,
                             int frames, std::uint32_t seed, glm::dvec3 centre_m, int count,
                             double unit_m) {
  const auto what = gathering(rig);
  Random random(1);
  const auto pixels = static_cast<std::size_t>(rig.plan.hologram.size.x) *
                      static_cast<std::size_t>(rig.plan.hologram.size.y);
  Agreement result;
  double difference = 0, energy = 0;
  for (int n = 0; n < count; ++n) {
    const auto pixel = std::size_t{random()} % pixels;
    std::vector<std::complex<double>> sums(static_cast<std::size_t>(frames));
    bool unsure = false, dark = true;
    for (std::size_t i = 0; i < rig.samples.size() && !unsure; ++i) {
      const auto wave = aimed_ray(what, i, pixel_m(rig.plan, centre_m, pixel));
      unsure |= wave.unsure;
      if (wave.wave == 0.0) continue;
      dark = false;
      for (int f = 0; f < frames; ++f)
        sums[static_cast<std::size_t>(f)] +=
            unit_m * wave.wave * phasor_of(what, i, seed + static_cast<std::uint32_t>(f));
    }
    if (unsure) {
      ++result.unsure;
      continue;
    }
    ++result.pixels;
    for (int f = 0; f < frames; ++f) {
      const std::complex<double> got(fields[static_cast<std::size_t>(f) * pixels + pixel]);
      difference += std::norm(got - sums[static_cast<std::size_t>(f)]);
      energy += std::norm(sums[static_cast<std::size_t>(f)]);
      if (dark) result.dark_error = std::max(result.dark_error, std::abs(got));
    }
  }
  result.error = std::sqrt(difference / energy);
  return result;
}

}  // namespace raywave::reference
