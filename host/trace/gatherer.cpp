// SPDX-License-Identifier: Apache-2.0
#include "host/trace/gatherer.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "host/geometry/kernel_options.hpp"
#include "host/plan/lattice.hpp"
#include "host/plan/memory.hpp"
#include "host/trace/gather_options.hpp"
#include "host/trace/work_shape.hpp"

namespace raywave {
namespace {

/// Memory for the profiles of plane-wave samples: 128 MiB, less on small devices.
std::uint64_t profile_bytes(const cl::DeviceInfo& device) {
  return std::min({most_profile_bytes, device.largest_buffer_bytes / 2, device.memory_bytes / 16});
}

/// At the hologram hidden parts are smoothed as over virtual planes, which are compared with it.
cl::Options options_of(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
                       const SampleTable& table, int frames, int tile_rows) {
  auto options = gather_options(device, plan, scene, table, frames, tile_rows);
  options[option::smooth_parts] = plan.is_at_hologram() ? "1" : "0";
  options[option::near_hologram] = is_near_hologram(plan) ? "1" : "0";
  return options;
}

/// Size and pitch of a plane, light, and the steepest of it.
template <class Plane>
void set_sampling(const Plan& plan, Plane& plane) {
  plane.nx = plan.tiling.tile_size.x;
  plane.ny = plan.tiling.tile_size.y;
  std::tie(plane.pitch_x, plane.pitch_x_low) = split(plan.hologram.pitch_m.x);
  std::tie(plane.pitch_y, plane.pitch_y_low) = split(plan.hologram.pitch_m.y);
  std::tie(plane.turns_hi, plane.turns_lo) = split(1 / plan.hologram.wavelength_m);
  put(plan.hologram.largest_sine, plane.sine_limit_x, plane.sine_limit_y);
}

}  // namespace

Gatherer::Gatherer(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
                   const SampleTable& table, int frames, double plane_wave_spots)
    : plan_(plan),
      scene_(scene),
      table_(table),
      frames_(frames),
      lanes_(lanes_for(device.info())),
      tile_rows_(rows_of_tile(work_shape(device.info()), frames)),
      strip_tiles_(work_shape(device.info()).strip_tiles),
      plane_wave_spots_(plane_wave_spots),
      program_(device, "kernels/gather/gather.cl",
               options_of(device, plan, scene, table, frames, tile_rows_)),
      project_samples_(program_.kernel("project_samples")),
      draw_phases_(program_.kernel("draw_phases")),
      profile_(program_.kernel("profile")),
      gather_(program_.kernel("gather")),
      device_(device) {}

void Gatherer::draw_phases(std::uint32_t seed) {
  const auto room = table_.samples.size();
  if (projected_.size() < room) {
    projected_ = {device_, room, "projected samples"};
    // Kernels read whole vectors: the buffer has one vector of padding at its end.
    const std::vector<std::int32_t> none(4 * (room + static_cast<std::size_t>(lanes_)));
    footprints_ = {device_, std::span<const std::int32_t>(none), "footprints of samples"};
    phasors_ = {device_, room * static_cast<std::size_t>(frames_), "phases"};
  }
  if (table_.count > 0)
    draw_phases_.run({static_cast<std::size_t>(table_.count)}, group_of_samples(device_.info()),
                     table_.samples, table_.count, frames_, seed,
                     static_cast<float>(-plan_.extent.origin_m.z), phasors_);
}

/// Floats of one axis of the profiles of plane-wave samples, in whole packets.
std::int32_t Gatherer::profile_room(int pixels) const {
  return (pixels + lanes_ - 1) / lanes_ * lanes_ + 2 * lanes_;
}

/// The plane in the scene frame, lengths as pairs of floats.
device::GatherPlane Gatherer::plane_of(const Wrp& wrp) const {
  const auto& layer = plan_.layer_of(wrp);
  const auto centre_m = wrp.centre_m;
  const glm::ivec2 size = plan_.tiling.tile_size;
  const glm::dvec2 pitch = plan_.hologram.pitch_m, half_window = plan_.tile_window_m() / 2.0;
  const auto tile_m = plan_.tile_of(wrp).centre_m;
  // Centre of pixel (0, 0), world
  const glm::dvec2 corner =
      glm::dvec2(centre_m) + glm::dvec2(-1, 1) * glm::dvec2(size - 1) * pitch / 2.0;

  device::GatherPlane plane{};
  set_sampling(plan_, plane);
  std::tie(plane.left, plane.left_low) = split(corner.x - plan_.extent.origin_m.x);
  std::tie(plane.top, plane.top_low) = split(corner.y - plan_.extent.origin_m.y);
  std::tie(plane.z, plane.z_low) = split(centre_m.z - plan_.extent.origin_m.z);
  std::tie(plane.hologram_x, plane.hologram_x_low) = split(tile_m.x - plan_.extent.origin_m.x);
  std::tie(plane.hologram_y, plane.hologram_y_low) = split(tile_m.y - plan_.extent.origin_m.y);
  std::tie(plane.hologram_z, plane.hologram_z_low) = split(-plan_.extent.origin_m.z);
  std::tie(plane.begin_z, plane.end_z) = layer_bounds(plan_, layer);

  // The cone of each sample. A plane at the hologram has no cone to apodize: every pixel receives
  // every sample.
  const bool at_hologram = centre_m.z == 0;
  const auto fan = at_hologram ? glm::dvec2(1) : plan_.tiling.cone,
             edge = at_hologram ? glm::dvec2(0) : plan_.tiling.apodization;
  put(fan, plane.cone_x, plane.cone_y);
  plane.apodization_rate_x = edge.x > 0 ? static_cast<float>(1 / edge.x) : 0.0f;
  plane.apodization_rate_y = edge.y > 0 ? static_cast<float>(1 / edge.y) : 0.0f;
  put(plan_.slm.illumination.sine_at(tile_m), plane.reference_x, plane.reference_y);
  put(plan_.slm.illumination.curvature_per_m() * half_window, plane.reference_fall_x,
      plane.reference_fall_y);
  put(half_window, plane.half_window_x, plane.half_window_y);

  // Visibility masks divide the window of the whole hologram, enlarged by the cone: scale and shift
  // map positions in the tile's window to it.
  const auto visibility_half = std::max(1.0, plan_.cone.half_width) * plan_.window_m() / 2.0;
  put(half_window / visibility_half, plane.visibility_scale_x, plane.visibility_scale_y);
  put(tile_m / visibility_half, plane.visibility_shift_x, plane.visibility_shift_y);
  return plane;
}

/// Footprints on a plane at the hologram.
void Gatherer::add_footprints_at_hologram(device::GatherPlane& plane) const {
  plane.window_x = plane.window_y = 1e6f;
  if (!is_near_hologram(plan_)) return;
  // Masks divide directions
  put(1.0 / steepest_of_masks(plan_), plane.visibility_scale_x, plane.visibility_scale_y);
  plane.plane_wave_spots = static_cast<float>(plane_wave_spots_);
  plane.plane_wave_tail = static_cast<float>(near_hologram_tail);
  const auto room = [this](int axis, int pixels) {
    const double spot_px =
        std::max(spot_at_hologram_m(plan_, axis) / plan_.hologram.pitch_m[axis], 1.0);
    return profile_room(static_cast<int>(
        std::min(std::ceil(2 * (PLANE_WAVE_WIDEST + 2) * spot_px) + 5, double(pixels))));
  };
  plane.room_x = room(0, plane.nx);
  plane.room_y = room(1, plane.ny);
}

/// Footprints on a WRP off the hologram.
void Gatherer::add_footprints(const Wrp& wrp, device::GatherPlane& plane) const {
  const auto& layer = plan_.layer_of(wrp);
  const auto centre_m = wrp.centre_m;
  const double near_m = layer.min_m.z, far_m = layer.max_m.z, farthest_m = layer.farthest_m();
  const glm::ivec2 size = plan_.tiling.tile_size;
  const glm::dvec2 pitch = plan_.hologram.pitch_m, half_window = plan_.tile_window_m() / 2.0,
                   fan = plan_.tiling.cone;
  const auto tile_m = plan_.tile_of(wrp).centre_m;
  const glm::dvec2 corner =
      glm::dvec2(centre_m) + glm::dvec2(-1, 1) * glm::dvec2(size - 1) * pitch / 2.0;
  // The widest footprint of a sample: its half width over half the window and the plane's depth
  const auto widest = fan * std::max(narrowing(centre_m.z, near_m), narrowing(centre_m.z, far_m)) /
                      std::abs(centre_m.z);
  // The ray from a sample to the tile's centre crosses the plane at x when the sample's tangent
  // in the lattice is (x - centre) / distance + centre / z.
  const auto turned = tile_m * (1 / near_m + 1 / far_m) / 2.0,
             spread = glm::abs(tile_m) * std::abs(1 / near_m - 1 / far_m) / 2.0;
  put((corner - tile_m) / centre_m.z + turned, plane.tangent_x, plane.tangent_y);
  put(pitch / centre_m.z, plane.tangent_step_x, plane.tangent_step_y);
  // Samples whose footprint is narrow are gathered as plane waves, with diffraction tails.
  const glm::dvec2 spot(spot_of(plan_.hologram.wavelength_m, farthest_m, fan.x, 2 * half_window.x),
                        spot_of(plan_.hologram.wavelength_m, farthest_m, fan.y, 2 * half_window.y));
  const double nearest = std::max({0.0, near_m - centre_m.z, centre_m.z - far_m});
  const auto narrowest = fan * half_window * (nearest / farthest_m);
  const bool any_near =
      narrowest.x < plane_wave_spots_ * spot.x || narrowest.y < plane_wave_spots_ * spot.y;
  const auto tail = (any_near ? plane_wave_tail : 0.0) * spot / std::abs(centre_m.z);
  plane.plane_wave_spots = static_cast<float>(plane_wave_spots_);
  plane.plane_wave_tail = static_cast<float>(plane_wave_tail);
  put(widest * half_window + tail + spread, plane.window_x, plane.window_y);
  // Pixels that the profile of one plane-wave sample covers, in whole packets
  if (any_near) {
    const auto room = [&](int axis) {
      const double half = std::min(
          widest_plane_wave_sample * spot[axis],
          widest[axis] * std::abs(centre_m.z) * half_window[axis] + plane_wave_tail * spot[axis]);
      const int pixels =
          static_cast<int>(std::min(2 * half / pitch[axis] + 5, static_cast<double>(size[axis])));
      return profile_room(pixels);
    };
    plane.room_x = room(0);
    plane.room_y = room(1);
  }
}

void Gatherer::gather(const Wrp& wrp, cl::ComplexBuffer& field) {
  auto plane = plane_of(wrp);
  if (wrp.centre_m.z == 0)
    add_footprints_at_hologram(plane);
  else
    add_footprints(wrp, plane);

  // Positions and footprints of all samples on the plane
  auto lattice = table_.lattice;
  lattice.half_width = plane.half_window_x;
  lattice.half_height = plane.half_window_y;
  const cl::Range group = group_of_samples(device_.info()),
                  local = lanes_ == 1 ? cl::Range{8, 8, 1} : cl::Range{1, 1, 1};
  const auto stride = static_cast<std::int32_t>(footprints_.size() / 4);
  if (table_.count > 0)
    project_samples_.run({static_cast<std::size_t>(table_.count)}, group, table_.samples,
                         table_.count, lattice, plane, projected_, stride, footprints_);

  // Each pass gathers as many rows of the lattice as have profiles that fit the memory for them,
  // at least one row.
  const auto profile_floats = 2 * static_cast<std::size_t>(plane.room_x + plane.room_y);
  const auto at_once = static_cast<std::int64_t>(profile_bytes(device_.info()) /
                                                 (4 * std::max<std::size_t>(profile_floats, 1)));
  const auto first_of = [&](int row) { return table_.first_of_row[static_cast<std::size_t>(row)]; };
  const auto first_profile_of = [&](int row) {
    return table_.first_profile_of_row[static_cast<std::size_t>(row)];
  };
  for (int row = 0; row == 0 || row < lattice.ny;) {
    int end = row + 1;
    while (end < lattice.ny && first_profile_of(end + 1) - first_profile_of(row) <= at_once) ++end;
    const auto count = first_of(end) - first_of(row);
    const auto first_profile = static_cast<std::int32_t>(first_profile_of(row));
    const auto room = std::max<std::size_t>(
        static_cast<std::size_t>(first_profile_of(end) - first_profile_of(row)) * profile_floats,
        1);
    make_room(device_, profiles_, room, "profiles of samples");
    if (count > 0 && profile_floats > 0)
      profile_.run({static_cast<std::size_t>(count)}, group, scene_.lights, table_.samples,
                   table_.lit, projected_, first_of(row), first_profile, count, plane, profiles_);
    const auto tiles = [](int n, int side) {
      return static_cast<std::size_t>((n + side - 1) / side);
    };
    const auto across = tiles(plane.nx, lanes_),
               strip = strip_tiles_ == 0 ? across
                                         : std::min(across, static_cast<std::size_t>(strip_tiles_));
    gather_.run({strip, tiles(plane.ny, tile_rows_), (across + strip - 1) / strip}, local,
                scene_.lights, table_.samples, table_.visibility_masks, table_.lit, table_.paths,
                projected_, stride, footprints_, profiles_, first_profile, phasors_,
                table_.first_of_cell, table_.count, row, end - 1, std::int32_t{row > 0}, lattice,
                plane, field);
    row = end;
  }
}

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
  set_sampling(plan_, plane);
  std::tie(plane.left, plane.left_low) =
      split(centre.x - (plan_.tiling.tile_size.x - 1) / 2.0 * plan_.hologram.pitch_m.x);
  std::tie(plane.top, plane.top_low) =
      split(centre.y + (plan_.tiling.tile_size.y - 1) / 2.0 * plan_.hologram.pitch_m.y);
  std::tie(plane.z, plane.z_low) = split(centre.z);
  plane.sampling_rate = static_cast<float>(1 / plan_.samples.pitch_m);
  plane.bias = scene_.bias_m;
  plane.reach = 4 * (scene_.diameter_m + static_cast<float>(plan_.extent.far_m - wrp.centre_m.z) +
                     static_cast<float>(glm::length(centre)));
  if (plan_.extent.near_m <= 0)
    plane.ahead = std::min(
        0.0f, static_cast<float>(plan_.extent.near_m - wrp.centre_m.z) - 0.01f * scene_.diameter_m);
  plane.seed = seed;

  // One work-item per packet of `lanes_` pixels of a row
  const auto packets = static_cast<std::size_t>((plan_.tiling.tile_size.x + lanes_ - 1) / lanes_);
  const cl::Range local = lanes_ == 1 ? cl::Range{8, 8} : cl::Range{1, 1};
  trace_fan_.run({packets, static_cast<std::size_t>(plan_.tiling.tile_size.y)}, local,
                 scene_.arguments(), fan, static_cast<std::int32_t>(tangents.size()), plane, field);
}

}  // namespace raywave
