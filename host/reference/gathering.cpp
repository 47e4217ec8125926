// SPDX-License-Identifier: Apache-2.0
#include "host/reference/gathering.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "host/reference/shading.hpp"

namespace raywave::reference {

Seen free_way(std::span<const device::Triangle> triangles, glm::dvec3 from, glm::dvec3 off_surface, double bias_m, glm::dvec3 to) {
  const Ray rays[] = {{from + bias_m * off_surface, to - from, 0, 1},
                      {from + 0.5 * bias_m * off_surface, to - from, 0, 1},
                      {from + 1.5 * bias_m * off_surface, to - from, 0, 1}};
  bool unsure = false;
  for (const auto& t : triangles) {
    const bool strict = intersect(t, rays[0]).triangle >= 0;
    if (strict) {
      bool wavers = false;
      for (const auto& ray : rays) wavers |= intersect(t, ray, -1e-6).triangle < 0;
      if (!wavers) return Seen::no;
      unsure = true;
    } else {
      for (const auto& ray : rays) unsure |= intersect(t, ray, 1e-6).triangle >= 0;
    }
  }
  return unsure ? Seen::unsure : Seen::yes;
}

glm::dvec3 pixel_of(const Plan& plan, glm::dvec3 centre_m, std::size_t index) {
  const auto nx = static_cast<std::size_t>(plan.size.x);
  const glm::dvec2 from_middle = glm::dvec2(index % nx, index / nx) - glm::dvec2(plan.size - 1) / 2.0;
  return centre_m + glm::dvec3(from_middle.x * plan.pitch_m.x, -from_middle.y * plan.pitch_m.y, 0);
}

Wave wave_of(const Rig& rig, std::size_t sample, glm::dvec3 pixel) {
  const auto& plan = rig.plan;
  const auto& s = rig.samples[sample];
  const auto p = place(s) + plan.origin_m;
  const double depth = p.z - pixel.z;
  const bool at_hologram = pixel.z <= 0;
  Wave wave;
  double amplitude = s.weight;
  if (!at_hologram) {
    for (int axis = 0; axis < 2; ++axis) {
      // Where the light meets the hologram, in half holograms.
      const double at = std::abs(pixel[axis] - (p[axis] - pixel[axis]) * pixel.z / depth) / (plan.size[axis] * plan.pitch_m[axis] / 2);
      if (plan.edge == 0 && std::abs(at - plan.fan) < 1e-3) wave.unsure = true;
      const double e = plan.edge > 0 ? std::clamp((plan.fan - at) / plan.edge, 0.0, 1.0) : at <= plan.fan;
      amplitude *= e * e * (3 - 2 * e);
    }
    if (amplitude == 0) return wave;
  }
  const auto towards = (pixel - p) / depth;  // towards the hologram, z = -1
  for (int axis = 0; axis < 2; ++axis) {
    // The SLM shows sines up to wavelength / (2 pitch).
    const double sine = std::abs(towards[axis]) / length(towards) / (plan.wavelength_m / (2 * plan.pitch_m[axis]));
    if (std::abs(sine - 1) < 1e-5) wave.unsure = true;
    if (sine > 1) return wave;
  }
  if (s.hidden) {
    std::array<int, 2> part{};
    for (int axis = 0; axis < 2; ++axis) {
      const double window = plan.size[axis] * plan.pitch_m[axis] * std::max(1.0, plan.fan);
      const double at = ((pixel[axis] + towards[axis] * pixel.z) / window + 0.5) * rig.table.view_parts;
      part[static_cast<std::size_t>(axis)] = std::clamp(static_cast<int>(std::floor(at)), 0, rig.table.view_parts - 1);
      wave.unsure |= std::abs(at - std::round(at)) < 1e-4;
    }
    if (!rig.sees(sample, part[0], part[1])) return wave;
  }
  double radiance = s.radiance;
  int number = 0;
  for (const auto& light : rig.scene.lights) {
    if (light.type == LightType::ambient) continue;
    const auto l = light.type == LightType::point ? normalize(light.position_m - p) : -normalize(light.direction);
    if (rig.lit[sample * rig.arrays.light_words() + static_cast<std::size_t>(number / 32)] >> (number % 32) & 1u) {
      const auto mirrored = 2 * dot(normal(s), l) * normal(s) - l;
      radiance += light.intensity * s.specular * power_of_cosine(dot(mirrored, normalize(towards)), s.shininess);
    }
    ++number;
  }
  // Of a surface that is turned away, less is seen.
  amplitude *= std::sqrt(std::clamp(s.tilt_x * towards.x + s.tilt_y * towards.y - s.tilt_z, 0.0, 4.0));
  // Converging light turns by half a period at its focus.
  const double signed_r = std::copysign(length(pixel - p), depth);
  wave.value = std::sqrt(radiance) * amplitude / signed_r *
               std::polar(1.0, 2 * std::numbers::pi * std::remainder(signed_r / plan.wavelength_m, 1.0));
  return wave;
}

Agreement against_direct_sum(const Rig& rig, std::span<const std::complex<float>> fields, int frames, std::uint32_t seed,
                             glm::dvec3 centre_m, int count) {
  Random random(1);
  const auto pixels = static_cast<std::size_t>(rig.plan.size.x) * static_cast<std::size_t>(rig.plan.size.y);
  Agreement result;
  double difference = 0, energy = 0;
  for (int n = 0; n < count; ++n) {
    const auto pixel = std::size_t{random()} % pixels;
    std::vector<std::complex<double>> sums(static_cast<std::size_t>(frames));
    bool unsure = false, dark = true;
    for (std::size_t i = 0; i < rig.samples.size() && !unsure; ++i) {
      const auto wave = wave_of(rig, i, pixel_of(rig.plan, centre_m, pixel));
      unsure |= wave.unsure;
      if (wave.value == 0.0) continue;
      dark = false;
      for (int f = 0; f < frames; ++f)
        sums[static_cast<std::size_t>(f)] +=
            wave.value *
            std::polar(1.0, 2 * std::numbers::pi * phase_turns_of_key(rig.samples[i].key, seed + static_cast<std::uint32_t>(f)));
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
