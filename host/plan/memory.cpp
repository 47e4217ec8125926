// SPDX-License-Identifier: Apache-2.0
#include "host/plan/memory.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/geometry/shared_types.hpp"
#include "host/plan/make_plan.hpp"
#include "host/plan/tiles.hpp"

namespace raywave {
namespace {

/// Share of the memory that a plan may take before its surface samples are known.
constexpr double share_without_samples = 7.0 / 8;

std::uint64_t size(auto n) { return static_cast<std::uint64_t>(n); }
std::uint64_t area(glm::ivec2 sides) { return size(sides.x) * size(sides.y); }

/// Rows of padded planes that the host's transforms keep (host/propagate/propagator_host.cpp), at
/// most: those of the WRPs up to two padded planes, what comes back, and the sum of what is more.
std::uint64_t host_transform_bytes(const Plan& plan) {
  const auto padded = area(plan.padded), rows = size(plan.tile_size.x) * size(plan.padded.y);
  const auto waiting = rows * size(plan.most_wrps_of_a_tile());
  return 8 * (std::min(waiting, 2 * padded) + rows + (waiting > 2 * padded ? padded : 0));
}

/// What more tiles do not make less: the scene's triangles and samples, what is returned, and
/// phases that are refined.
MemoryNeeds undivided_needs(const World& world, const Plan& plan, const MemoryUse& use) {
  const std::string mesh = "fewer triangles need less";
  MemoryNeeds all;
  auto& needs = all.device;
  if (plan.aimed) {
    const std::string pitch = "a larger sampling.pitch needs less";
    needs.push_back({"sample lattice", 4 * (area(plan.lattice.size) + 1), pitch});
    needs.push_back({"breaks of surfaces", 4 * area(plan.lattice.size + 8), pitch});
    needs.push_back({"neighbours of triangles", 16 * world.triangles.size(), mesh});
  }
  needs.push_back({"triangles", sizeof(device::Triangle) * world.triangles.size(), mesh});
  // Leaves hold two triangles and more
  needs.push_back({"trees", sizeof(device::BvhNode) * (world.triangles.size() / 3 + 1), mesh});
  needs.push_back({"vertices", 8 * sizeof(float) * world.positions.size(), mesh});
  const auto all_pixels = area(plan.size), pictures = size(plan.frames) * all_pixels;
  if (plan.refine) {
    const std::string advice = "fewer sampling.frames or a smaller hologram.resolution needs less";
    needs.push_back({"phases of the holograms", 8 * pictures, advice});
    // A plane padded 1.25, its intensity and what is blurred of it
    needs.push_back({"light of the pictures", 25 * all_pixels, advice});
    all.results_bytes += 8 * pictures;
  }
  all.results_bytes += (use.keep_field || encodes_whole(plan) ? 9 : 1) * pictures;
  all.host_bytes = all.results_bytes;
  return all;
}

std::uint64_t bytes_on_host(const MemoryNeeds& needs, const MemoryLimits& limits) {
  return needs.host_bytes + (limits.device_on_host ? needs.device_bytes() : 0);
}

std::string frames_text(const Plan& plan) {
  return std::to_string(plan.frames) + (plan.frames == 1 ? " frame of " : " frames of ") +
         std::to_string(plan.size.x) + " x " + std::to_string(plan.size.y) + " pixels: ";
}

bool leaves_room(std::uint64_t bytes, std::uint64_t limit) {
  return static_cast<double>(bytes) <= share_without_samples * static_cast<double>(limit);
}

/// A line that tells what the device lacks; empty when the plan fits there.
std::string missing_on_device(const MemoryNeeds& needs, const MemoryLimits& limits) {
  for (const auto& need : needs.device) {
    if (need.bytes > limits.largest_buffer_bytes)
      return need.name + " " + format_bytes(need.bytes) + " in one buffer, the device allows " +
             format_bytes(limits.largest_buffer_bytes);
  }
  if (const auto bytes = needs.device_bytes(); !leaves_room(bytes, limits.device_bytes))
    return format_bytes(bytes) + " and surface samples, the device has " +
           format_bytes(limits.device_bytes);
  return "";
}

/// A line that tells which memory is short; empty when the plan fits.
std::string missing(const MemoryNeeds& needs, const MemoryLimits& limits) {
  auto text = missing_on_device(needs, limits);
  const auto bytes = bytes_on_host(needs, limits);
  if (text.empty() && !leaves_room(bytes, limits.host_bytes))
    text = format_bytes(bytes) + " and surface samples, the machine has " +
           format_bytes(limits.host_bytes);
  return text;
}

}  // namespace

int frames_together(const Plan& plan, std::uint64_t largest_buffer_bytes) {
  if (!plan.aimed) return 1;
  const double plane = 8.0 * static_cast<double>(plan.gathered_pixels()),
               half_a_gigabyte = 512.0 * 1024 * 1024;
  const double fitting = std::min(
      half_a_gigabyte /
          (plane * static_cast<double>(std::max<std::size_t>(plan.most_wrps_of_a_tile(), 1))),
      static_cast<double>(largest_buffer_bytes) / plane);
  return static_cast<int>(
      std::clamp(fitting, 1.0, static_cast<double>(std::min(plan.frames, most_frames_together))));
}

std::uint64_t MemoryNeeds::device_bytes() const {
  return std::accumulate(device.begin(), device.end(), std::uint64_t{0},
                         [](auto sum, const auto& need) { return sum + need.bytes; });
}

MemoryNeeds memory_needs(const World& world, const Plan& plan, const MemoryUse& use,
                         std::uint64_t largest_buffer_bytes) {
  const int together = frames_together(plan, largest_buffer_bytes);
  const std::string planes =
      "a smaller hologram.resolution or wrp.padding, or more hologram.tiles, needs less";
  const auto pixels = area(plan.tile_size), padded = area(plan.padded);
  auto all = undivided_needs(world, plan, use);
  auto& needs = all.device;
  if (plan.compact) {
    const auto plane = area(plan.compact->size);
    if (use.fft != FftBackend::host) needs.push_back({"virtual plane", 8 * plane, planes});
    if (use.fft == FftBackend::clfft)
      needs.push_back({"work space of the transform", 8 * plane, planes});
  } else if (use.method == Method::wrp && !plan.is_at_hologram()) {
    if (use.fft == FftBackend::host)
      all.host_bytes += host_transform_bytes(plan);
    else
      for (const auto* name : {"padded plane", "sum of spectra"})
        needs.push_back({name, 8 * padded, planes});
    if (use.fft == FftBackend::clfft)
      needs.push_back({"work space of the transform", 8 * padded, planes});
  }
  for (std::size_t i = 0; i < (together > 1 ? plan.most_wrps_of_a_tile() : 1); ++i)
    needs.push_back({"fields of a WRP", 8 * size(together) * size(plan.gathered_pixels()), planes});
  if (!encodes_transforms(plan, use.keep_field))
    needs.push_back({"field at the hologram", 8 * pixels, planes});
  const auto pictures = size(plan.frames) * plan.tiles.size();
  for (std::uint64_t i = 0; i < std::min<std::uint64_t>(pictures, level_buffers); ++i)
    needs.push_back({"hologram levels", pixels, planes});
  needs.push_back({"added phases", 2 * pixels, planes});
  return all;
}

std::string results_shortage(const Plan& plan, const MemoryNeeds& needs, const MemoryUse& use,
                             const MemoryLimits& limits) {
  // Amplitudes are scaled over all tiles, which keeps the field until all are there
  const bool scales_tiles = plan.slm.encoding != Encoding::phase &&
                            (plan.tiles.size() > 1 || !missing_on_device(needs, limits).empty());
  auto bytes = needs.results_bytes;
  if (scales_tiles && !use.keep_field && !encodes_whole(plan))
    bytes += 8 * size(plan.frames) * area(plan.size);
  if (bytes <= limits.host_bytes) return "";
  std::string without_field;
  if (plan.refine || plan.slm.band != glm::dvec2(1))
    without_field = "";  // made of the whole field
  else if (scales_tiles)
    without_field = ", or slm.encoding = \"phase\" and no field (--no-field)";
  else if (use.keep_field)
    without_field = ", or keep no field (--no-field)";
  return frames_text(plan) + format_bytes(bytes) + " of memory needed for them alone, there are " +
         format_bytes(limits.host_bytes) +
         "; give fewer sampling.frames or a smaller hologram.resolution" + without_field;
}

std::string host_shortage(const Plan& plan, const MemoryNeeds& needs, const MemoryLimits& limits) {
  const auto bytes = bytes_on_host(needs, limits);
  if (bytes <= limits.host_bytes) return "";
  return frames_text(plan) + format_bytes(bytes) + " of memory needed, there are " +
         format_bytes(limits.host_bytes) +
         "; give fewer sampling.frames, a smaller hologram.resolution or more hologram.tiles";
}

namespace {

/// Divides a plan of a scene further until it fits into memory, or as far as that helps.
Plan divided_to_fit(Scene scene, const World& world, Plan plan, const MemoryLimits& limits,
                    const MemoryUse& use, int rays_per_axis, bool has_doubles) {
  std::string why = plan.why_tiles;
  const auto tiles_help = [&] {
    return why_in_one_piece(plan, use.method).empty() &&
           missing(undivided_needs(world, plan, use), limits).empty();
  };
  while (tiles_help()) {
    const auto lacking =
        missing(memory_needs(world, plan, use, limits.largest_buffer_bytes), limits);
    if (lacking.empty()) break;
    if (why.empty()) why = "in one piece " + lacking;
    // However light is gathered, a tile's field lies in one buffer
    auto tiles = plan.tile_grid, finer = with_more_tiles(plan.size, tiles);
    while (finer != tiles) {
      tiles = std::exchange(finer, with_more_tiles(plan.size, finer));
      if (8 * area(tile_size_of(plan.size, tiles)) <= limits.largest_buffer_bytes) break;
    }
    if (tiles == plan.tile_grid) break;
    scene.hologram.tiles = tiles;
    plan = make_plan(scene, world, use.method, rays_per_axis, has_doubles);
  }
  plan.why_tiles = why;
  return plan;
}

}  // namespace

Plan fitting_plan(const Scene& scene, const World& world, const MemoryLimits& limits,
                  const MemoryUse& use, int rays_per_axis, bool has_doubles) {
  auto plan = make_plan(scene, world, use.method, rays_per_axis, has_doubles);
  if (scene.hologram.tiles) {
    plan.why_tiles = "given";
    return plan;
  }
  return divided_to_fit(scene, world, std::move(plan), limits, use, rays_per_axis, has_doubles);
}

Plan fitting_plan_of_poses(Scene& scene, World& world, int poses,
                           const std::function<void(int pose)>& move_to, const MemoryLimits& limits,
                           const MemoryUse& use, int rays_per_axis, bool has_doubles) {
  // Layers and tiles only grow, and light that has gone over to WRPs stays there
  constexpr int most_rounds = 16;
  const auto is_alike = [](const Plan& a, const Plan& b) {
    return a.tile_grid == b.tile_grid && a.most_layers == b.most_layers &&
           a.compact.has_value() == b.compact.has_value();
  };
  move_to(0);
  auto plan = fitting_plan(scene, world, limits, use, rays_per_axis, has_doubles);
  int last_change = 0;
  for (int round = 0; round < most_rounds; ++round) {
    bool serves_all = true;
    for (int pose = 0; pose < poses; ++pose) {
      move_to(pose);
      auto here = make_plan(scene, world, use.method, rays_per_axis, has_doubles, &plan);
      if (!scene.hologram.tiles) {
        auto as_here = scene;
        as_here.wrp.layers = here.most_layers;
        as_here.wrp.propagation = here.compact ? WrpPropagation::compact : WrpPropagation::spectrum;
        const auto why_propagation = here.why_propagation;
        here = divided_to_fit(std::move(as_here), world, std::move(here), limits, use,
                              rays_per_axis, has_doubles);
        here.why_propagation = why_propagation;
      }
      if (is_alike(here, plan)) continue;  // what it still lacks, the renderer says
      plan = std::move(here);
      serves_all = false;
      last_change = pose;
    }
    if (serves_all) return plan;
  }
  throw InputError(one_line(scene.file.string()) + ": no plan serves all " + std::to_string(poses) +
                   " pictures: that of picture " + std::to_string(last_change) +
                   " has other tiles, depth layers or propagation than the others; give "
                   "hologram.tiles, wrp.layers and wrp.propagation");
}

}  // namespace raywave
