// SPDX-License-Identifier: Apache-2.0
#include "host/tracer.hpp"

#include <algorithm>
#include <chrono>
#include <glm/geometric.hpp>

namespace raywave {
Tracer::Tracer(const cl::Device& device, const Scene& scene, const Plan& plan, const DeviceScene& arrays)
    : device_(device),
      plan_(plan),
      sampling_pitch_m_(scene.sampling.pitch_m),
      scene_(arrays),
      lanes_(lanes_for(device.info())),
      program_(device, "trace.cl", scene_.options),
      trace_fan_(program_.kernel("trace_fan")) {}

void Tracer::trace(const Wrp& wrp, std::uint32_t seed, cl::ComplexBuffer& field) {
  std::vector<device::FanRay> rays;
  for (const auto& t : wrp.fan) {
    const double length = std::sqrt(1 + t.x * t.x + t.y * t.y);
    const auto [hi, lo] = split(length / plan_.wavelength_m);
    rays.push_back({static_cast<float>(t.x), static_cast<float>(t.y), static_cast<float>(length), hi, lo});
  }
  const cl::Buffer<device::FanRay> fan(device_, std::span<const device::FanRay>(rays), "fan");

  const glm::dvec3 centre = wrp.centre_m - plan_.origin_m;
  device::TracePlane plane{};
  plane.nx = plan_.size.x;
  plane.ny = plan_.size.y;
  plane.left = static_cast<float>(centre.x - (plan_.size.x - 1) / 2.0 * plan_.pitch_m.x);
  plane.top = static_cast<float>(centre.y + (plan_.size.y - 1) / 2.0 * plan_.pitch_m.y);
  plane.z = static_cast<float>(centre.z);
  plane.pitch_x = static_cast<float>(plan_.pitch_m.x);
  plane.pitch_y = static_cast<float>(plan_.pitch_m.y);
  std::tie(plane.turns_hi, plane.turns_lo) = split(1 / plan_.wavelength_m);
  plane.sampling_rate = static_cast<float>(1 / sampling_pitch_m_);
  plane.bias = scene_.bias_m;
  plane.reach = 4 * (scene_.diameter_m + static_cast<float>(plan_.far_m - plan_.distance_m) + static_cast<float>(glm::length(centre)));
  plane.seed = seed;

  const auto packets = static_cast<std::size_t>((plan_.size.x + lanes_ - 1) / lanes_);
  const cl::Range local = lanes_ == 1 ? cl::Range{8, 8} : cl::Range{1, 1};
  trace_fan_.run({packets, static_cast<std::size_t>(plan_.size.y)}, local, scene_.nodes, scene_.triangles, scene_.shading, scene_.materials,
                 scene_.lights, scene_.texels, scene_.ambient_light, fan, static_cast<std::int32_t>(rays.size()), plane, field);
}

}  // namespace raywave
