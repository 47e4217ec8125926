// SPDX-License-Identifier: Apache-2.0
#include "host/trace/samples.hpp"

#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include "host/common/error.hpp"
#include "host/geometry/kernel_options.hpp"

namespace raywave {
namespace {

/// Approximate memory for the samples of a band: 64 MiB, less on small devices.
std::size_t band_bytes(const cl::DeviceInfo& device) {
  return static_cast<std::size_t>(std::min(
      {std::uint64_t{64} << 20, device.largest_buffer_bytes / 2, device.memory_bytes / 16}));
}

constexpr int most_samples = 1 << 28;

device::Lattice lattice_of(const Plan& plan, const DeviceScene& scene) {
  const auto& wanted = plan.lattice;
  const glm::dvec3 centre = -plan.origin_m;
  device::Lattice lattice{};
  lattice.first_x = wanted.first.x;
  lattice.first_y = wanted.first.y;
  lattice.nx = wanted.size.x;
  lattice.ny = wanted.size.y;
  lattice.step = static_cast<float>(wanted.step);
  lattice.centre_x = static_cast<float>(centre.x);
  lattice.centre_y = static_cast<float>(centre.y);
  lattice.centre_z = static_cast<float>(centre.z);
  const auto eye = wanted.eye_m - plan.origin_m;
  lattice.eye_x = static_cast<float>(eye.x);
  lattice.eye_y = static_cast<float>(eye.y);
  lattice.eye_z = static_cast<float>(eye.z);
  lattice.steepest_x = lattice.steepest_y = std::numeric_limits<float>::max();
  lattice.near_z = static_cast<float>(plan.near_m - plan.origin_m.z) - 0.01f * scene.diameter_m;
  lattice.full_z = static_cast<float>(wanted.full_z_m);
  lattice.layer_gap = static_cast<float>(1e-3 * wanted.step * wanted.full_z_m);
  lattice.bias = scene.bias_m;
  lattice.reach = static_cast<float>(
      plan.near_m > 0 ? plan.far_m * 2 : 2 * (plan.farthest_m + plan.far_m - plan.near_m));
  lattice.half_width =
      static_cast<float>(plan.size.x * plan.pitch_m.x / 2 * std::max(1.0, plan.cone_half_width));
  lattice.half_height =
      static_cast<float>(plan.size.y * plan.pitch_m.y / 2 * std::max(1.0, plan.cone_half_width));
  return lattice;
}

/// Reallocates a buffer that is too small, with an eighth to spare: a moving scene sometimes needs
/// a little more, and new memory is slow at first. The contents are lost.
template <class T>
void make_room(const cl::Device& device, cl::Buffer<T>& buffer, std::size_t size,
               const char* name) {
  if (buffer.size() < size) {
    buffer = {};  // frees the old memory first
    buffer = {device, size + size / 8, name};
  }
}

/// Enlarges a buffer to at least `wanted` elements and keeps its first `kept`.
template <class T>
void grow(const cl::Device& device, cl::Buffer<T>& buffer, std::size_t kept, std::size_t wanted,
          const char* name) {
  if (buffer.size() >= wanted) return;
  cl::Buffer<T> larger(device, wanted + wanted / (kept > 0 ? 2 : 8), name);
  if (kept > 0) larger.copy_from(buffer, 0, kept);
  buffer = std::move(larger);
}

}  // namespace

SampleTable::SampleTable(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
                         bool keep_unseen)
    : visibility_parts(plan.visibility_parts),
      device_(device),
      program_(
          device, "kernels/samples/samples.cl",
          cl::with(scene.options, {{option::antialias, std::to_string(plan.antialias)},
                                   {option::visibility_parts, std::to_string(visibility_parts)},
                                   {option::keep_unseen, keep_unseen ? "1" : "0"}})),
      find_samples_(program_.kernel("find_samples")),
      pack_samples_(program_.kernel("pack_samples")),
      breaks_(device, scene) {
  if (plan.colour) show_laser_.emplace(program_.kernel("show_laser"));
  if (plan.has_specular_samples())
    specular_.emplace(
        device,
        cl::with(scene.options, {{option::antialias, std::to_string(plan.antialias)},
                                 {option::visibility_parts, std::to_string(visibility_parts)},
                                 {option::paths, has_fitted_paths(plan) ? "1" : "0"}}));
  find(plan, scene);
}

std::vector<glm::ivec2> SampleTable::find_specular(const Plan& plan, const DeviceScene& scene,
                                                   std::size_t first_cell, std::size_t cells) {
  mirrors_.clear();
  if (!specular_) return {};
  band_.mirrors.on_host(
      [&](std::span<std::int32_t> mirrors) {
        for (std::size_t cell = 0; cell < cells; ++cell) {
          if (mirrors[cell] > 0)
            mirrors_.emplace_back(static_cast<std::int32_t>(first_cell + cell), mirrors[cell] - 1);
        }
      },
      CL_MAP_READ);
  if (mirrors_.empty()) return {};
  return specular_->find(plan, scene, lattice, mirrors_);
}

void SampleTable::show(const Plan& plan, const DeviceScene& scene) {
  const auto wanted = lattice_of(plan, scene);
  if (!show_laser_ || specular_ || visibility_parts != plan.visibility_parts ||
      std::memcmp(&wanted, &lattice, sizeof wanted) != 0)
    find(plan, scene);
  else
    show_laser(scene);
}

void SampleTable::show_laser(const DeviceScene& scene) {
  if (!show_laser_ || count == 0) return;
  const cl::Range group{lanes_for(device_.info()) == 1 ? std::size_t{64} : std::size_t{1}};
  show_laser_->run({static_cast<std::size_t>(count)}, group, colours, scene.light,
                   static_cast<std::int32_t>(count), samples);
}

void SampleTable::find(const Plan& plan, const DeviceScene& scene) {
  // Sizes of the lattice and of one slot (a place for one sample in a cell)
  lattice = lattice_of(plan, scene);
  breaks_.find(lattice, scene);
  const auto nx = static_cast<std::size_t>(lattice.nx), ny = static_cast<std::size_t>(lattice.ny);
  const auto lights = static_cast<std::size_t>(scene.light_words());
  const auto colours_of_sample = std::size_t{plan.colour ? 6u : 0u};
  const auto bytes_per_slot =
      sizeof(device::Sample) + 4 * (visibility_words() + lights + colours_of_sample);
  const int lanes = lanes_for(device_.info());
  const cl::Range local = lanes == 1 ? cl::Range{8, 8} : cl::Range{1, 1};
  const cl::Range group{lanes == 1 ? std::size_t{64} : std::size_t{1}};

  // Samples are found band by band of the lattice's rows. first: samples, and hidden samples, in
  // all cells before a cell
  std::vector<glm::ivec2> first(nx * ny + 1, {0, 0});
  std::int64_t total = 0;
  hidden = specular = 0;
  for (std::size_t row = 0; row < ny;) {
    const auto rows = std::clamp<std::size_t>(
        band_bytes(device_.info()) / (nx * bytes_per_slot * static_cast<std::size_t>(slots_)), 1,
        ny - row);
    const auto cells = rows * nx, room = cells * static_cast<std::size_t>(slots_);
    make_room(device_, band_.counts, cells, "samples of each cell");
    make_room(device_, band_.mirrors, cells, "mirrors of each cell");
    make_room(device_, band_.samples, room, "samples");
    make_room(device_, band_.visibility_masks, room * visibility_words(),
              "visibility masks of samples");
    make_room(device_, band_.lit, room * lights, "lights on samples");
    make_room(device_, band_.colours, std::max<std::size_t>(1, room * colours_of_sample),
              "colours of samples");
    find_samples_.run(
        {(nx + static_cast<std::size_t>(lanes) - 1) / static_cast<std::size_t>(lanes), rows}, local,
        scene.arguments(), lattice, breaks_.known, breaks_.cells, breaks_.tiles,
        static_cast<std::int32_t>(row), static_cast<std::int32_t>(rows), slots_, band_.counts,
        band_.mirrors, band_.samples, band_.visibility_masks, band_.lit, band_.colours);

    // The counts of the band's cells, summed: a cell's samples in mirrors and glass follow those
    // that are seen directly
    const auto specular_counts = find_specular(plan, scene, row * nx, cells);
    std::vector<glm::ivec4> specular_first;
    int most = 0;
    const auto total_before = total;
    const auto hidden_before = hidden, specular_before = specular;
    band_.counts.on_host(
        [&](std::span<glm::ivec2> counts) {
          for (std::size_t cell = 0; cell < cells; ++cell) {
            most = std::max(most, counts[cell].x);
            total += counts[cell].x;
            hidden += counts[cell].y;
            if (const auto place = specular_first.size();
                place < mirrors_.size() &&
                mirrors_[place].x == static_cast<std::int32_t>(row * nx + cell)) {
              specular_first.emplace_back(
                  static_cast<std::int32_t>(std::min<std::int64_t>(total, INT32_MAX)), hidden,
                  specular, 0);
              total += specular_counts[place].x;
              hidden += specular_counts[place].y;
              specular += specular_counts[place].x;
            }
            first[row * nx + cell + 1] = {
                static_cast<std::int32_t>(std::min<std::int64_t>(total, INT32_MAX)), hidden};
          }
        },
        CL_MAP_READ);
    // A cell had more samples than slots: the band is repeated with enough slots.
    if (most > slots_) {
      slots_ = most;
      total = total_before;
      hidden = hidden_before;
      specular = specular_before;
      continue;
    }
    if (total > most_samples)
      throw InputError(
          "sampling.pitch: " + std::to_string(total) +
          " surface samples or more, at most 268435456 are allowed; give a larger pitch");

    // The band's samples are appended to the table without gaps.
    const auto kept = static_cast<std::size_t>(total_before),
               wanted = static_cast<std::size_t>(std::max<std::int64_t>(total, 1));
    grow(device_, samples, kept, wanted, "samples");
    grow(device_, visibility_masks, kept * visibility_words(), wanted * visibility_words(),
         "visibility masks of samples");
    grow(device_, lit, kept * lights, wanted * lights, "lights on samples");
    grow(device_, colours, kept * colours_of_sample,
         std::max<std::size_t>(1, wanted * colours_of_sample), "colours of samples");
    make_room(device_, band_.first, cells, "samples of each cell");
    band_.first.write(std::span<const glm::ivec2>(first).subspan(row * nx, cells));
    pack_samples_.run({cells}, group, band_.counts, band_.first, static_cast<std::int32_t>(cells),
                      slots_, band_.samples, band_.visibility_masks, band_.lit, band_.colours,
                      samples, visibility_masks, lit, colours);
    grow(device_, paths, static_cast<std::size_t>(specular_before),
         static_cast<std::size_t>(std::max(specular, 1)), "paths over mirrors and through glass");
    if (!specular_first.empty())
      specular_->pack(specular_first, samples, visibility_masks, lit, paths);
    row += rows;
  }

  count = static_cast<int>(total);
  show_laser(scene);

  // Index of the table by cell for the device, and by row for the host
  std::vector<std::int32_t> cells;
  for (const auto& at : first) cells.push_back(at.x);
  if (first_of_cell.size() != cells.size())
    first_of_cell = {device_, cells.size(), "sample lattice"};
  first_of_cell.write(cells);
  first_of_row.clear();
  first_profile_of_row.clear();
  for (std::size_t row = 0; row <= ny; ++row) {
    const auto at = first[row * nx];
    first_of_row.push_back(at.x);
    first_profile_of_row.push_back(at.x + std::int64_t{plane_wave_parts() - 1} * at.y);
  }
}

}  // namespace raywave
