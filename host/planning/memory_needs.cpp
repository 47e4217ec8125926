// SPDX-License-Identifier: Apache-2.0
#include "host/planning/memory_needs.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>

#include "host/carriers/planning/facts.hpp"
#include "host/geometry/shared_types.hpp"
#include "host/plan/key_places.hpp"
#include "host/plan/message_text.hpp"
#include "host/planning/tiles.hpp"

namespace raywave {
namespace {

/// Share of the memory that a plan may take before its surface samples are known.
constexpr double share_without_samples = 7.0 / 8;

/// Arrays grow by an eighth more than is needed.
constexpr double grown = 9.0 / 8;

std::uint64_t size(auto n) { return static_cast<std::uint64_t>(n); }

/// Of a sample as it is found: itself, its visibility mask, the lights that reach it, its colours.
std::uint64_t bytes_of_found(const Plan& plan) {
  const auto parts = size(plan.samples.visibility_parts);
  return sizeof(device::Sample) +
         4 * (std::max<std::uint64_t>(1, parts * parts / 32) + plan.lighting.lights.size() / 32 +
              1 + (plan.hologram.colour ? 6 : 0));
}

/// What pictures to refine towards take: planes of light, and the parts of them that are wanted.
/// The host's FFTs have rows between their passes in its memory instead of spectra in the device's.
void add_pictures(const Plan& plan, const std::string& advice, bool has_host_fft,
                  MemoryNeeds& all) {
  auto& needs = all.device;
  const auto window_m = refine_window_m(plan);
  const double pixels = static_cast<double>(area_of(plan.hologram.size)),
               planes = refines_samples(plan) ? pixels : refine_padding * refine_padding * pixels;
  double wanted = 0, largest = 0, in_pupil = 0, by_spectrum = 0, in_spectrum = 0, between = 0;
  for (const auto& place : planned_places(plan)) {
    if (place.pupil) {
      const double samples = static_cast<double>(area_of(samples_through_pupil(
          place, plan.hologram.size, plan.hologram.pitch_m, plan.refine->blur_m.value())));
      in_pupil = 2 * pixels;
      between = std::max(between, pixels);
      wanted += samples;
      largest = std::max(largest, samples);
      continue;
    }
    const auto& h = plan.hologram;
    auto shown_m = h.wavelength_m * std::abs(place.z_m) / h.pitch_m;
    double samples = place.aperture.x * place.aperture.y * planes;
    // Between the passes: rows of the open part, or of the picture
    double columns = place.aperture.x * h.size.x, rows = place.aperture.y * h.size.y,
           tall = rows * std::sqrt(planes / pixels);
    const auto propagation =
        refines_samples(plan) ? KeyPropagation::fresnel
                              : key_propagation(h.size, h.pitch_m, h.wavelength_m,
                                                plan.refine->blur_m.value(), place.z_m, window_m);
    if (propagation != KeyPropagation::fresnel) {
      const auto of =
          spectrum_planes(propagation, place, h.size, h.pitch_m, h.wavelength_m, window_m);
      shown_m = glm::dvec2(of.picture) * of.pixel_m;
      samples = static_cast<double>(area_of(of.picture));
      by_spectrum = std::max(by_spectrum, samples);
      if (!has_host_fft)
        in_spectrum =
            std::max(in_spectrum, static_cast<double>(area_of(of.pixels) + area_of(of.finer)));
      columns = of.pixels.x;
      rows = of.open.y;
      tall = of.picture.y;
    }
    const auto share = glm::min(window_m / shown_m, 1.0);
    between = std::max(between, columns * std::max(rows, share.y * tall));
    wanted += share.x * share.y * samples;
    largest = std::max(largest, share.x * share.y * samples);
  }
  const auto bytes = [](double each, double count) {
    return static_cast<std::uint64_t>(each * grown * count);
  };
  // A frame for the encoding; intensities, what is blurred of them, and a picture
  needs.push_back({"light of the pictures",
                   bytes(8, pixels + std::max(planes, by_spectrum) + in_pupil + in_spectrum) +
                       bytes(14, largest),
                   advice});
  if (has_host_fft) all.host_bytes += bytes(8, between);
  if (refines_samples(plan)) all.host_bytes += bytes(24, largest);  // rasters of samples
  needs.push_back({"wanted pictures", bytes(plan.hologram.frames > 1 ? 8 : 4, wanted),
                   "fewer refine.iterations or a smaller refine.window need less"});
}

/// What is returned: levels, and the field where it is kept or has to be whole.
void add_results(const Plan& plan, const MemoryUse& use, MemoryNeeds& all) {
  const auto pixels = size(plan.hologram.frames) *
                      area_of(use.by_tile ? plan.tiling.tile_size : plan.hologram.size);
  const bool holds_field = use.keep_field || (encodes_whole(plan) && !plan.refine && !use.by_tile);
  all.results_bytes += (holds_field ? 9 : 1) * pixels;
  all.host_bytes += (holds_field ? 9 : 1) * pixels;
}

/// What more tiles do not make less: the scene's triangles and samples, what is returned of the
/// whole, and phases that are refined.
MemoryNeeds undivided_needs(const World& world, const Plan& plan, const MemoryUse& use) {
  const std::string mesh = "fewer triangles need less";
  MemoryNeeds all;
  auto& needs = all.device;
  if (plan.samples.aimed) {
    const std::string pitch = "a larger sampling.pitch needs less";
    needs.push_back({"sample lattice", 4 * (area_of(plan.lattice.size) + 1), pitch});
    needs.push_back({"samples of a band",
                     std::min(most_band_bytes(use.fft == FftBackend::host),
                              slots_of_cell * area_of(plan.lattice.size) * bytes_of_found(plan)),
                     pitch});
    needs.push_back({"breaks of surfaces", 4 * area_of(plan.lattice.size + 8), pitch});
    needs.push_back({"neighbours of triangles", 16 * world.triangles.size(), mesh});
  }
  needs.push_back({"triangles", sizeof(device::Triangle) * world.triangles.size(), mesh});
  // Leaves hold two triangles and more
  needs.push_back({"trees", sizeof(device::BvhNode) * (world.triangles.size() / 3 + 1), mesh});
  needs.push_back({"vertices", 8 * sizeof(float) * world.positions.size(), mesh});
  const auto all_pixels = area_of(plan.hologram.size),
             pictures = size(plan.hologram.frames) * all_pixels;
  if (plan.refine) {
    const std::string advice = "fewer sampling.frames or a smaller hologram.resolution needs less";
    needs.push_back({"phases of the holograms", 8 * pictures, advice});
    needs.push_back({"phases of a hologram", 8 * all_pixels, advice});
    if (adds_to_phases(plan.slm)) needs.push_back({"light of the panel", 32 * all_pixels, advice});
    add_pictures(plan, advice, use.fft == FftBackend::host, all);
    if (use.keep_field) all.results_bytes += 8 * pictures;
    all.host_bytes += all.results_bytes;
  }
  if (!use.by_tile) add_results(plan, use, all);
  return all;
}

/// Whether the SLM's pixels have phases of their own (host/encode/panel.cpp).
bool adds_phases(const Plan& plan) {
  const auto& slm = plan.slm;
  return !slm.flatness.picture.pixels.empty() || !slm.zernike.empty() || slm.lens_m ||
         slm.offset_turns != 0 || !slm.illumination.is_plane() ||
         carrier_of(slm, plan.hologram.pitch_m, plan.hologram.wavelength_m) != glm::dvec2(0);
}

std::uint64_t bytes_on_host(const MemoryNeeds& needs, const MemoryLimits& limits) {
  return needs.host_bytes + (limits.device_on_host ? needs.device_bytes() : 0);
}

std::string frames_text(const Plan& plan) {
  return std::to_string(plan.hologram.frames) +
         (plan.hologram.frames == 1 ? " frame of " : " frames of ") +
         extent_text(plan.hologram.size) + " pixels: ";
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

MemoryNeeds memory_needs(const World& world, const Plan& plan, const MemoryUse& use,
                         std::uint64_t largest_buffer_bytes) {
  const int together = frames_together(plan, largest_buffer_bytes);
  const std::string planes = advice_for_planes;
  const auto pixels = area_of(plan.tiling.tile_size);
  auto all = undivided_needs(world, plan, use);
  if (use.by_tile) add_results(plan, use, all);
  auto& needs = all.device;
  add_transform_memory(plan, use.fft, all);
  for (std::size_t i = 0; i < (together > 1 ? plan.most_wrps_of_a_tile() : 1); ++i)
    needs.push_back({"fields of a WRP", 8 * size(together) * size(plan.gathered_pixels()), planes});
  if (!encodes_transforms(plan, use.keep_field))
    needs.push_back({"field at the hologram", 8 * pixels, planes});
  const auto pictures = size(plan.hologram.frames) * plan.tiling.tiles.size();
  for (std::uint64_t i = 0; i < std::min<std::uint64_t>(pictures, level_buffers); ++i)
    needs.push_back({"hologram levels", pixels, planes});
  needs.push_back({"added phases", 2 * pixels, planes});
  if (adds_phases(plan))
    all.host_bytes += 2 * area_of(use.by_tile ? plan.tiling.tile_size : plan.hologram.size);
  return all;
}

double bytes_of_samples(const Plan& plan, double samples) {
  const double frames = plan.hologram.frames;
  double bytes = samples * (static_cast<double>(bytes_of_found(plan)) + 8 * frames) +
                 gathering_bytes(plan, samples);
  if (plan.refine && refines_samples(plan))
    bytes += 4 * std::pow(std::max(plan.samples.visibility_parts, 8), 2) *
             std::min(samples, 1.0 * most_lit_together);
  return grown * bytes;
}

std::uint64_t host_peak_bytes(const World& world, const Plan& plan, const MemoryNeeds& needs,
                              std::uint64_t results_bytes, std::uint64_t device_bytes,
                              bool compiles) {
  // Measured with PoCL 3.1, whose libraries hold 85 to 105 MB of a process; a triangle's share is
  // that of its object, its tree as it is built
  constexpr std::uint64_t process = 103'000'000, compiler = 165'000'000, of_triangle = 550;
  const auto pixels = area_of(plan.hologram.size);
  const auto computing = needs.host_bytes - needs.results_bytes + device_bytes;
  const auto writing = 3 * pixels;  // levels as the SLM takes them, and a growing PNG
  return process + (compiles ? compiler : 0) + of_triangle * world.triangles.size() +
         results_bytes + std::max(computing, writing);
}

std::string results_shortage(const Plan& plan, const MemoryNeeds& needs, const MemoryUse& use,
                             const MemoryLimits& limits) {
  // Amplitudes are scaled over all tiles, which keeps the field until all are there
  const bool scales_tiles =
      plan.slm.encoding != Encoding::phase && !use.by_tile &&
      (plan.tiling.tiles.size() > 1 || !missing_on_device(needs, limits).empty());
  auto bytes = needs.results_bytes;
  if (scales_tiles && !use.keep_field && !encodes_whole(plan))
    bytes += 8 * size(plan.hologram.frames) * area_of(plan.hologram.size);
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
         "; give fewer sampling.frames or a smaller hologram.resolution" + without_field +
         (use.by_tile || use.method != Method::wrp || plan.refine || plan.slm.band != glm::dvec2(1)
              ? ""
              : ", or let render write a file of each tile (--tiles all)");
}

std::string host_shortage(const Plan& plan, const MemoryNeeds& needs, const MemoryLimits& limits) {
  const auto bytes = bytes_on_host(needs, limits);
  if (bytes <= limits.host_bytes) return "";
  return frames_text(plan) + format_bytes(bytes) + " of memory needed, there are " +
         format_bytes(limits.host_bytes) +
         "; give fewer sampling.frames, a smaller hologram.resolution or more hologram.tiles";
}

std::string shortage_of_division(const World& world, const Plan& plan, const MemoryUse& use,
                                 const MemoryLimits& limits) {
  if (!why_in_one_piece(plan, use.method).empty() ||
      !missing(undivided_needs(world, plan, use), limits).empty())
    return "";
  return missing(memory_needs(world, plan, use, limits.largest_buffer_bytes), limits);
}

}  // namespace raywave
