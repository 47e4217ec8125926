// SPDX-License-Identifier: Apache-2.0
#include "host/trace/fan_tracer.hpp"

#include <algorithm>
#include <chrono>
#include <glm/geometric.hpp>

#include "host/geometry/kernel_options.hpp"
#include "host/trace/precision_option.hpp"

namespace raywave {

FanTracer::FanTracer(const cl::Device& device, const Plan& plan, const DeviceScene& arrays)
    : device_(device),
      plan_(plan),
      scene_(arrays),
      lanes_(lanes_for(device.info())),
      program_(device, "kernels/gather/fan.cl",
               cl::with(arrays.options,
                        {{option::precision, precision_option(device.info(), plan.precision)}})),
      trace_fan_(program_.kernel("trace_fan")) {}

void FanTracer::trace(const Wrp& wrp, std::uint32_t seed, cl::ComplexBuffer& field) {
  // Ray directions as tangents
  std::vector<std::complex<float>> tangents;
  for (const auto& t : wrp.fan)
    tangents.emplace_back(static_cast<float>(t.x), static_cast<float>(t.y));
  const cl::ComplexBuffer fan(device_, std::span<const std::complex<float>>(tangents), "fan");

  // The WRP in the scene frame, lengths as pairs of floats
  const glm::dvec3 centre = wrp.centre_m - plan_.extent.origin_m;
  device::TracePlane plane{};
  plane.nx = plan_.tiling.tile_size.x;
  plane.ny = plan_.tiling.tile_size.y;
  std::tie(plane.left, plane.left_low) =
      split(centre.x - (plan_.tiling.tile_size.x - 1) / 2.0 * plan_.hologram.pitch_m.x);
  std::tie(plane.top, plane.top_low) =
      split(centre.y + (plan_.tiling.tile_size.y - 1) / 2.0 * plan_.hologram.pitch_m.y);
  std::tie(plane.z, plane.z_low) = split(centre.z);
  std::tie(plane.pitch_x, plane.pitch_x_low) = split(plan_.hologram.pitch_m.x);
  std::tie(plane.pitch_y, plane.pitch_y_low) = split(plan_.hologram.pitch_m.y);
  std::tie(plane.turns_hi, plane.turns_lo) = split(1 / plan_.hologram.wavelength_m);
  plane.sine_limit_x = static_cast<float>(plan_.hologram.largest_sine.x);
  plane.sine_limit_y = static_cast<float>(plan_.hologram.largest_sine.y);
  plane.sampling_rate = static_cast<float>(1 / plan_.samples.pitch_m);
  plane.bias = scene_.bias_m;
  plane.reach = 4 * (scene_.diameter_m + static_cast<float>(plan_.extent.far_m - wrp.centre_m.z) +
                     static_cast<float>(glm::length(centre)));
  plane.seed = seed;

  // One work-item per packet of `lanes_` pixels of a row
  const auto packets = static_cast<std::size_t>((plan_.tiling.tile_size.x + lanes_ - 1) / lanes_);
  const cl::Range local = lanes_ == 1 ? cl::Range{8, 8} : cl::Range{1, 1};
  trace_fan_.run({packets, static_cast<std::size_t>(plan_.tiling.tile_size.y)}, local,
                 scene_.arguments(), fan, static_cast<std::int32_t>(tangents.size()), plane, field);
}

}  // namespace raywave
