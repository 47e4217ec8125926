// SPDX-License-Identifier: Apache-2.0
#include "host/trace/samples.hpp"

#include <cstring>
#include <limits>

#include "host/common/error.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/plan/lattice.hpp"

namespace raywave {
namespace {

constexpr std::size_t tile = 8;  // BREAK_TILE of kernels/samples/breaks.h

void make_room(const cl::Device& device, cl::Buffer<float>& buffer, std::size_t size) {
  if (buffer.size() != size) buffer = {device, size, "breaks of surfaces"};
  buffer.fill_zero();
}

/// Approximate memory for the samples of a band: less on small devices.
std::size_t band_bytes(const cl::DeviceInfo& device) {
  return static_cast<std::size_t>(
      std::min({most_band_bytes(device.kind == DeviceKind::cpu), device.largest_buffer_bytes / 2,
                device.memory_bytes / 16}));
}

constexpr int most_samples = 1 << 28;
constexpr std::size_t floats_of_layers = 32;  // Layers of kernels/scene/bvh.h, without lanes

device::Lattice lattice_of(const Plan& plan, const DeviceScene& scene) {
  const auto& wanted = plan.lattice;
  device::Lattice lattice{};
  lattice.first_x = wanted.first.x;
  lattice.first_y = wanted.first.y;
  lattice.nx = wanted.size.x;
  lattice.ny = wanted.size.y;
  lattice.step = static_cast<float>(wanted.step);
  put(-plan.extent.origin_m, lattice.centre_x, lattice.centre_y, lattice.centre_z);
  put(wanted.eye_m - plan.extent.origin_m, lattice.eye_x, lattice.eye_y, lattice.eye_z);
  lattice.steepest_x = lattice.steepest_y = std::numeric_limits<float>::max();
  if (is_near_hologram(plan)) put(steepest_of_masks(plan), lattice.steepest_x, lattice.steepest_y);
  lattice.near_z =
      static_cast<float>(plan.extent.near_m - plan.extent.origin_m.z) - 0.01f * scene.diameter_m;
  lattice.full_z = static_cast<float>(wanted.full_z_m);
  lattice.layer_gap = static_cast<float>(1e-3 * wanted.step * wanted.full_z_m);
  lattice.bias = scene.bias_m;
  lattice.reach = static_cast<float>(
      plan.extent.near_m > 0
          ? plan.extent.far_m * 2
          : 2 * (plan.extent.farthest_m() + plan.extent.far_m - plan.extent.near_m) +
                scene.diameter_m);
  put(glm::dvec2(plan.hologram.size) * plan.hologram.pitch_m / 2.0 *
          std::max(1.0, plan.cone.half_width),
      lattice.half_width, lattice.half_height);
  return lattice;
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

cl::Options sample_options(const Plan& plan, const DeviceScene& scene) {
  const bool parts_differ = shades_parts(plan, scene.tree.triangles.size());
  return cl::with(scene.options,
                  {{option::antialias, std::to_string(plan.samples.antialias)},
                   {option::parts_differ, parts_differ ? "1" : "0"},
                   {option::visibility_parts, std::to_string(plan.samples.visibility_parts)}});
}

Breaks::Breaks(const cl::Device& device, const DeviceScene& scene)
    : cells(device, 1, "breaks of surfaces"),
      tiles(device, 1, "breaks of surfaces"),
      device_(device),
      program_(device, "kernels/samples/breaks.cl",
               {{option::alpha, scene.options.at(option::alpha)}}),
      find_faces_(program_.kernel("find_faces")),
      mark_breaks_(program_.kernel("mark_breaks")) {}

void Breaks::find(const device::Lattice& lattice, const DeviceScene& scene) {
  const float cell_m = lattice.step * (lattice.near_z - lattice.centre_z);
  known = scene.tree.has_neighbours() && cell_m > 0 &&
          lattice.bias < static_cast<float>(most_bias_of_breaks) * cell_m;
  if (!known) return;
  const auto along = [](std::int32_t n) { return (static_cast<std::size_t>(n) + tile - 1) / tile; };
  const auto tile_count = along(lattice.nx) * along(lattice.ny);
  make_room(device_, cells, tile * tile * tile_count);
  make_room(device_, tiles, tile_count);

  const auto count = scene.tree.triangles.size(), group = std::size_t{64};
  const auto triangles = static_cast<std::int32_t>(count);
  if (faces_.size() != count) faces_ = {device_, count, "faces of triangles"};
  find_faces_.run({count}, cl::Range{group}, scene.tree.arguments(), scene.materials, lattice,
                  triangles, faces_);
  mark_breaks_.run({count}, cl::Range{group}, scene.tree.arguments(), lattice, triangles,
                   scene.tree.neighbours, faces_, cells, tiles);
}

SampleTable::SampleTable(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
                         bool keep_unseen, std::optional<Counting> counting)
    : visibility_parts(plan.samples.visibility_parts),
      keep_unseen_(keep_unseen),
      parts_of_cell_(static_cast<std::size_t>(plan.samples.antialias * plan.samples.antialias)),
      device_(device),
      program_(device, "kernels/samples/samples.cl", sample_options(plan, scene)),
      find_samples_(program_.kernel("find_samples")),
      pack_samples_(program_.kernel("pack_samples")),
      breaks_(device, scene) {
  if (lanes_for(device.info()) == 1)
    apart_.emplace(device, program_, sample_options(plan, scene), plan.samples.antialias);
  if (plan.hologram.colour) show_laser_.emplace(program_.kernel("show_laser"));
  if (plan.has_specular_samples())
    specular_.emplace(device,
                      cl::with(sample_options(plan, scene),
                               {{option::paths, std::to_string(has_fitted_paths(plan))}}),
                      visibility_words());
  else if (counting.value_or(counting_of(device.info())) == Counting::on_device)
    on_device_.emplace(device);
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
  if (!show_laser_ || specular_ || visibility_parts != plan.samples.visibility_parts ||
      std::memcmp(&wanted, &lattice, sizeof wanted) != 0)
    find(plan, scene);
  else
    show_laser(scene);
}

void SampleTable::show_laser(const DeviceScene& scene) {
  if (!show_laser_ || count == 0) return;
  show_laser_->run({static_cast<std::size_t>(count)}, group_of_samples(device_.info()), colours,
                   scene.light, static_cast<std::int32_t>(count), samples);
}

void SampleTable::find(const Plan& plan, const DeviceScene& scene) {
  lattice = lattice_of(plan, scene);
  breaks_.find(lattice, scene);
  const auto cells = static_cast<std::size_t>(lattice.nx) * static_cast<std::size_t>(lattice.ny);
  if (first_of_cell.size() != cells + 1) first_of_cell = {device_, cells + 1, "sample lattice"};
  if (on_device_)
    make_room(device_, on_device_->first_of_row, static_cast<std::size_t>(lattice.ny) + 1,
              "rows of the lattice");
  else
    first_.assign(cells + 1, {0, 0});

  // Samples are found band by band of the lattice's rows.
  const auto columns = static_cast<std::size_t>(lattice.nx);
  Found found;
  for (int row = 0; row < lattice.ny;) {
    const auto most_rows = band_bytes(device_.info()) / (columns * bytes_of_cell(scene));
    const int rows = static_cast<int>(
        std::clamp<std::size_t>(most_rows, 1, static_cast<std::size_t>(lattice.ny - row)));
    find_band(scene, row, rows);
    const auto before = found;
    const int most = on_device_ ? count_on_device(row, rows, found)
                                : count_on_host(plan, scene, row, rows, found);
    // A cell had more samples than slots: the band is repeated with enough slots.
    if (most > slots_) {
      slots_ = most;
      found = before;
      continue;
    }
    if (found.samples > most_samples)
      throw InputError(
          "sampling.pitch: " + std::to_string(found.samples) +
          " surface samples or more, at most 268435456 are allowed; give a larger pitch");
    append_band(scene, static_cast<std::size_t>(rows) * static_cast<std::size_t>(lattice.nx),
                before, found);
    row += rows;
  }
  count = static_cast<int>(found.samples);
  hidden = found.hidden;
  specular = found.specular;
  show_laser(scene);
  index_cells();
}

std::size_t SampleTable::words_of_colours() const { return show_laser_ ? 6 : 0; }

/// Bytes of a slot: a place for one sample in a cell.
std::size_t SampleTable::bytes_of_slot(const DeviceScene& scene) const {
  return sizeof(device::Sample) +
         4 * (visibility_words() + static_cast<std::size_t>(scene.light_words()) +
              words_of_colours()) +
         (apart_ ? sizeof(device::Lookout) + 16 + parts_of_window() : 0);
}

std::size_t SampleTable::bytes_of_cell(const DeviceScene& scene) const {
  return static_cast<std::size_t>(slots_) * bytes_of_slot(scene) +
         (apart_ ? parts_of_cell_ * (floats_of_layers + 1) * sizeof(float) : 0);
}

SampleTable::RaysApart::RaysApart(const cl::Device& device, const cl::Program& samples,
                                  const cl::Options& options, int antialias)
    : program(device, "kernels/samples/look_around.cl", options),
      ask_parts(program.kernel("ask_parts")),
      settle_samples(program.kernel("settle_samples")) {
  if (antialias > 0) trace_parts.emplace(samples.kernel("trace_parts"));
}

void SampleTable::find_band(const DeviceScene& scene, int row, int rows) {
  const auto nx = static_cast<std::size_t>(lattice.nx), cells = nx * static_cast<std::size_t>(rows),
             room = cells * static_cast<std::size_t>(slots_);
  make_room(device_, band_.counts, cells, "samples of each cell");
  make_room(device_, band_.mirrors, cells, "mirrors of each cell");
  make_room(device_, band_.samples, room, "samples");
  make_room(device_, band_.visibility_masks, room * visibility_words(),
            "visibility masks of samples");
  make_room(device_, band_.lit, room * static_cast<std::size_t>(scene.light_words()),
            "lights on samples");
  make_room(device_, band_.colours, std::max<std::size_t>(1, room * words_of_colours()),
            "colours of samples");
  const auto parts = apart_ ? cells * parts_of_cell_ : 0;
  make_room(device_, band_.lookouts, apart_ ? room : 1, "places that samples look from");
  make_room(device_, band_.part_layers, std::max<std::size_t>(1, parts * floats_of_layers),
            "layers of parts of cells");
  make_room(device_, band_.part_from, std::max<std::size_t>(1, parts), "parts of cells");
  if (parts > 0)
    apart_->trace_parts->run({parts}, {128}, scene.arguments(), lattice, breaks_.known,
                             breaks_.cells, breaks_.tiles, row, rows, band_.part_layers,
                             band_.part_from);
  const auto lanes = static_cast<std::size_t>(lanes_for(device_.info()));
  // A GPU waits for the slowest cell of a group; llvmpipe never ends in groups of 4
  const bool on_processor = device_.info().kind == DeviceKind::cpu;
  const auto group = lanes > 1 ? cl::Range{1, 1} : cl::Range{on_processor ? 8U : 4U, 1};
  find_samples_.run({(nx + lanes - 1) / lanes, static_cast<std::size_t>(rows)}, group,
                    scene.arguments(), lattice, breaks_.known, breaks_.cells, breaks_.tiles, row,
                    rows, slots_, std::int32_t{keep_unseen_}, band_.counts, band_.mirrors,
                    band_.samples, band_.visibility_masks, band_.lit, band_.colours, band_.lookouts,
                    band_.part_layers, band_.part_from);
  if (apart_ && visibility_parts > 0) look_around(scene, cells);
}

void SampleTable::look_around(const DeviceScene& scene, std::size_t cells) {
  auto& apart = *apart_;
  const auto slots = static_cast<std::size_t>(slots_), room = cells * slots;
  make_room(device_, band_.sixteen, 16 * room, "parts that samples see");
  make_room(device_, band_.sees, parts_of_window() * room, "parts that samples see");
  for (const std::int32_t first_round : {1, 0}) {
    auto& sees = first_round ? band_.sixteen : band_.sees;
    apart.ask_parts.run({room * (first_round ? 16 : parts_of_window())}, {64}, scene.arguments(),
                        lattice, static_cast<std::int32_t>(cells), slots_, first_round,
                        band_.counts, band_.lookouts, band_.sixteen, sees);
  }
  apart.settle_samples.run({cells}, {64}, static_cast<std::int32_t>(cells), slots_,
                           std::int32_t{keep_unseen_}, band_.lookouts, band_.sixteen, band_.sees,
                           band_.counts, band_.samples, band_.visibility_masks, band_.lit,
                           band_.colours);
}

int SampleTable::count_on_host(const Plan& plan, const DeviceScene& scene, int row, int rows,
                               Found& found) {
  // A cell's samples in mirrors and glass follow those that are seen directly.
  const auto nx = static_cast<std::size_t>(lattice.nx), begin = static_cast<std::size_t>(row) * nx,
             cells = static_cast<std::size_t>(rows) * nx;
  const auto specular_counts = find_specular(plan, scene, begin, cells);
  specular_first_.clear();
  int most = 0;
  const auto place = [&] {
    return static_cast<std::int32_t>(std::min<std::int64_t>(found.samples, INT32_MAX));
  };
  band_.counts.on_host(
      [&](std::span<glm::ivec2> counts) {
        for (std::size_t cell = 0; cell < cells; ++cell) {
          most = std::max(most, counts[cell].x);
          found.samples += counts[cell].x;
          found.hidden += counts[cell].y;
          if (const auto number = specular_first_.size();
              number < mirrors_.size() &&
              mirrors_[number].x == static_cast<std::int32_t>(begin + cell)) {
            specular_first_.emplace_back(place(), found.hidden, found.specular, 0);
            found.samples += specular_counts[number].x;
            found.hidden += specular_counts[number].y;
            found.specular += specular_counts[number].x;
          }
          first_[begin + cell + 1] = {place(), found.hidden};
        }
      },
      CL_MAP_READ);
  make_room(device_, band_.first, cells, "samples of each cell");
  band_.first.write(std::span<const glm::ivec2>(first_).subspan(begin, cells));
  return most;
}

SampleTable::OnDevice::OnDevice(const cl::Device& device)
    : program(device, "kernels/samples/cells.cl", {}),
      place_cells(program.kernel("place_cells")),
      scan(device),
      found(device, 3, "samples of a band") {}

int SampleTable::count_on_device(int row, int rows, Found& found) {
  auto& d = *on_device_;
  const int cells = rows * lattice.nx;
  make_room(device_, band_.first, static_cast<std::size_t>(cells) + 1, "samples of each cell");
  band_.first.copy_from(band_.counts, 0, static_cast<std::size_t>(cells));
  d.scan.run(band_.first, 0, cells, {static_cast<std::int32_t>(found.samples), found.hidden});
  d.found.fill_zero();
  d.place_cells.run({static_cast<std::size_t>(cells) + 1}, {64}, band_.counts, band_.first, cells,
                    row * lattice.nx, lattice.nx, first_of_cell, d.first_of_row, d.found);
  const auto counted = d.found.read();
  found.samples = counted[1];
  found.hidden = counted[2];
  return counted[0];
}

void SampleTable::append_band(const DeviceScene& scene, std::size_t cells, const Found& before,
                              const Found& after) {
  const auto lights = static_cast<std::size_t>(scene.light_words()), colour = words_of_colours();
  const auto kept = static_cast<std::size_t>(before.samples),
             wanted = static_cast<std::size_t>(std::max<std::int64_t>(after.samples, 1));
  grow(device_, samples, kept, wanted, "samples");
  grow(device_, visibility_masks, kept * visibility_words(), wanted * visibility_words(),
       "visibility masks of samples");
  grow(device_, lit, kept * lights, wanted * lights, "lights on samples");
  grow(device_, colours, kept * colour, std::max<std::size_t>(1, wanted * colour),
       "colours of samples");
  pack_samples_.run({cells}, group_of_samples(device_.info()), band_.counts, band_.first,
                    static_cast<std::int32_t>(cells), slots_, band_.samples, band_.visibility_masks,
                    band_.lit, band_.colours, samples, visibility_masks, lit, colours);
  grow(device_, paths, static_cast<std::size_t>(before.specular),
       static_cast<std::size_t>(std::max(after.specular, 1)),
       "paths over mirrors and through glass");
  if (specular_ && !specular_first_.empty())
    specular_->pack(specular_first_, samples, visibility_masks, lit, paths);
}

void SampleTable::index_cells() {
  const auto nx = static_cast<std::size_t>(lattice.nx), ny = static_cast<std::size_t>(lattice.ny);
  std::vector<glm::ivec2> rows(ny + 1);
  if (on_device_) {
    on_device_->first_of_row.read(rows);
  } else {
    std::vector<std::int32_t> cells;
    for (const auto& at : first_) cells.push_back(at.x);
    first_of_cell.write(cells);
    for (std::size_t row = 0; row <= ny; ++row) rows[row] = first_[row * nx];
  }
  first_of_row.clear();
  first_profile_of_row.clear();
  for (const auto& at : rows) {
    first_of_row.push_back(at.x);
    first_profile_of_row.push_back(at.x + std::int64_t{plane_wave_parts() - 1} * at.y);
  }
}

}  // namespace raywave
