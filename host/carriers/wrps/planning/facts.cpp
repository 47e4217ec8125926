// SPDX-License-Identifier: Apache-2.0
#include "host/carriers/wrps/planning/facts.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/carriers/wrps/planning/padding_errors.hpp"
#include "host/common/text.hpp"
#include "host/geometry/shared_types.hpp"
#include "host/plan/footprint.hpp"
#include "host/plan/message_text.hpp"

namespace raywave {
namespace {

/// Rows of padded planes that the host's transforms keep (host/propagate/propagator_host.cpp), at
/// most: those of a tile's WRPs, which come back in their place. What is more than two padded
/// planes waits as a sum.
std::uint64_t host_transform_bytes(const SpectrumWrps& wrps, const Plan& plan) {
  std::uint64_t most = 0;
  for (std::size_t tile = 0; tile < plan.tiling.tiles.size(); ++tile) {
    const auto [first, end] = plan.wrps_of(tile);
    std::uint64_t rows = 0;
    for (auto wrp = first; wrp < end; ++wrp)
      rows += static_cast<std::uint64_t>(rows_kept(wrps, plan, plan.wrps[wrp]).count());
    const auto waiting = rows * static_cast<std::uint64_t>(plan.tiling.tile_size.x),
               padded = area_of(wrps.padded);
    most = std::max(most, waiting > 2 * padded ? 4 * padded : waiting);
  }
  return 8 * most;
}

double operations_of(double samples) { return 5 * samples * std::log2(samples); }

}  // namespace

glm::ivec2 transformed_size(const SpectrumWrps& wrps, const Plan&) { return wrps.padded; }

/// The host transforms only the columns of the window and the rows of the band; devices transform
/// whole planes.
double transform_operations(const SpectrumWrps& wrps, const Plan& plan, FftBackend fft) {
  const double nx = wrps.padded.x, ny = wrps.padded.y;
  if (fft != FftBackend::host)
    return (static_cast<double>(plan.wrps.size()) + 1) * operations_of(nx * ny);
  const double columns = plan.tiling.tile_size.x * operations_of(ny);
  Band back;
  double operations = 0;
  for (const auto& wrp : plan.wrps) {
    const auto rows = rows_kept(wrps, plan, wrp);
    operations += columns + rows.count() * operations_of(nx);
    back = back.joined(rows);
  }
  return operations + back.count() * operations_of(nx) + columns;
}

double propagation_error_of(const SpectrumWrps& wrps, const Plan& plan) {
  return plan.samples.aimed ? predicted_wave_error(plan, wrps.padded)
                            : predicted_padding_errors(plan, {wrps.padded})[0];
}

void add_transform_memory(const SpectrumWrps& wrps, const Plan& plan, FftBackend fft,
                          MemoryNeeds& needs) {
  if (fft == FftBackend::host)
    needs.host_bytes += host_transform_bytes(wrps, plan);
  else
    for (const auto* name : {"padded plane", "sum of spectra"})
      needs.device.push_back({name, 8 * area_of(wrps.padded), advice_for_planes});
  if (fft == FftBackend::clfft)
    needs.device.push_back(
        {"work space of the transform", 8 * area_of(wrps.padded), advice_for_planes});
}

/// Projections, and the profiles of plane-wave samples: as wide as the widest footprint.
double gathering_bytes(const SpectrumWrps&, const Plan& plan, double samples) {
  double profiles = 0;
  for (const auto& layer : plan.layers) {
    for (const double z_m : {plan.extent.near_m, plan.extent.far_m}) {
      double pixels = 0;
      bool is_near = false;
      for (int axis = 0; axis < 2; ++axis) {
        const auto footprint = footprint_of(plan, axis, layer.distance_m, z_m);
        pixels += 2 * footprint.reach_m() / plan.hologram.pitch_m[axis] + 5;
        is_near |= footprint.is_near();
      }
      if (is_near) profiles = std::max(profiles, 8 * pixels);
    }
  }
  return samples * (sizeof(device::ProjectedSample) + 16) +
         std::min(samples * profiles, double{most_profile_bytes});
}

std::vector<std::pair<std::string, std::string>> report_rows(const SpectrumWrps& wrps,
                                                             const Plan& plan) {
  return {{"transform", extent_text(wrps.padded) + " (padding " + number_text(wrps.padding) +
                            "), propagation error predicted " +
                            percent_text(propagation_error_of(wrps, plan))}};
}

nlohmann::ordered_json report_json(const SpectrumWrps&) { return {}; }

std::vector<std::string> warnings_of(const SpectrumWrps& wrps, const Plan& plan) {
  constexpr double largest_error = 0.25;
  const double error = propagation_error_of(wrps, plan);
  if (error <= largest_error) return {};
  return {"WRPs bring an error of " + percent_text(error) +
          " of the field: a wider sampling.cone with more sampling.apodization and wrp.padding "
          "brings less, or wrp.propagation \"compact\""};
}

Band rows_kept(const SpectrumWrps& wrps, const Plan& plan, const Wrp& wrp) {
  const Axis axis{wrps.padded.y, plan.hologram.pitch_m.y, plan.tiling.tile_size.y};
  return axis.sampled(
      // Rows count downwards
      band_m(plan.hologram.wavelength_m, wrp.centre_m.z,
             wrp.centre_m.y - plan.tile_of(wrp).centre_m.y, axis.reach_m()));
}

}  // namespace raywave
