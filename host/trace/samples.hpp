// SPDX-License-Identifier: Apache-2.0
/// The sample table: light sources on the scene's surfaces (kernels/samples/samples.cl).
#pragma once

#include <algorithm>
#include <cstdint>
#include <glm/vec2.hpp>
#include <optional>
#include <vector>

#include "cl/program.hpp"
#include "host/plan/memory.hpp"
#include "host/plan/plan.hpp"
#include "host/trace/device_scene.hpp"
#include "host/trace/scan.hpp"
#include "host/trace/specular_paths.hpp"

namespace raywave {

// Where surfaces end, fold or are too steep, as the hologram's centre sees them
// (kernels/samples/breaks.h).

/// The breaks in the cells of a lattice, in device memory.
class Breaks {
public:
  /// For scenes with the same options as this one.
  Breaks(const cl::Device& device, const DeviceScene& scene);

  /// Finds the breaks of a scene. They stay unknown when it has too many triangles for that to pay,
  /// or is so far away that rounding is felt in a cell.
  void find(const device::Lattice& lattice, const DeviceScene& scene);

  std::int32_t known = 0;
  cl::Buffer<float> cells, tiles;

private:
  cl::Device device_;
  cl::Program program_;
  cl::Kernel find_faces_, mark_breaks_;
  cl::Buffer<std::int32_t> faces_;
};

/// Options of the kernels that find samples: plans and scenes with equal ones share them.
cl::Options sample_options(const Plan& plan, const DeviceScene& scene);

/// The points where the rays of a lattice from the hologram's centre intersect the scene. Every
/// surface along a ray gives a sample: closed meshes on their outside, open meshes on both sides.
/// The samples do not depend on how a surface is divided into triangles.
class SampleTable {
public:
  /// keep_unseen  also keep samples that are hidden from the whole window of the hologram
  /// counting     of the samples in each cell; none: as the device asks for. Those in mirrors and
  ///              glass are counted on the host.
  SampleTable(const cl::Device& device, const Plan& plan, const DeviceScene& scene,
              bool keep_unseen = false, std::optional<Counting> counting = {});

  /// Finds the samples again, for a scene with the same options.
  /// throws  InputError when there are more than 2^28 cells or samples
  void find(const Plan& plan, const DeviceScene& scene);

  /// Shows the samples to another laser; finds them again where they differ, as those in mirrors
  /// and glass do.
  ///
  /// plan, scene  of the same world, after DeviceScene::show
  void show(const Plan& plan, const DeviceScene& scene);

  device::Lattice lattice{};
  int visibility_parts;  // SamplesPlan::visibility_parts
  int count = 0;
  int hidden = 0;    // samples that are hidden from some part of the window
  int specular = 0;  // samples that are seen in mirrors or through glass
  // nx * ny + 1 elements: the samples of cell c are [first_of_cell[c], first_of_cell[c + 1])
  cl::Buffer<std::int32_t> first_of_cell;
  // The first `count` elements, ordered by row and cell; the buffer has at least one element.
  cl::Buffer<device::Sample> samples;
  // Visibility mask of each sample: the parts of the window that see it, visibility_words() each
  // (kernels/samples/visibility.h)
  cl::Buffer<std::uint32_t> visibility_masks;
  cl::Buffer<std::uint32_t> lit;  // lights that reach each sample, 32 to a word
  // In colour, radiance and specular of each sample in red, green and blue: 6 numbers; at least one
  // element
  cl::Buffer<float> colours;
  cl::Buffer<device::SamplePath> paths;  // Sample::path; at least one element

  // First sample of each row of the lattice, then `count`
  std::vector<std::int32_t> first_of_row;
  // First profile (Sample::profile) of each row, then their number
  std::vector<std::int64_t> first_profile_of_row;

  /// Number of parts of the window along each axis whose light the profiles of a plane-wave sample
  /// store separately (kernels/samples/visibility.h).
  int plane_wave_parts() const { return std::clamp(visibility_parts, 1, 8); }
  std::size_t visibility_words() const {
    return static_cast<std::size_t>(std::max(1, visibility_parts * visibility_parts / 32));
  }

private:
  bool keep_unseen_;
  std::size_t parts_of_cell_;  // rays beside that through its centre

  /// Samples of a band of rows; every cell has room for the same number of samples.
  struct Band {
    cl::Buffer<glm::ivec2> counts, first;  // x: all samples, y: hidden samples
    cl::Buffer<device::Sample> samples;
    cl::Buffer<std::uint32_t> visibility_masks, lit;
    cl::Buffer<std::int32_t> mirrors;
    cl::Buffer<float> colours;
    // Of RaysApart; one element at least
    cl::Buffer<device::Lookout> lookouts;
    cl::Buffer<float> part_layers, part_from;
    cl::Buffer<std::uint8_t> sixteen, sees;
  };

  /// On devices with one cell per work-item: the rays of a cell, each by a work-item of its own.
  struct RaysApart {
    RaysApart(const cl::Device& device, const cl::Program& samples, const cl::Options& options,
              int antialias);
    std::optional<cl::Kernel> trace_parts;
    cl::Program program;
    cl::Kernel ask_parts, settle_samples;
  };

  /// Samples in the bands so far.
  struct Found {
    std::int64_t samples = 0;
    int hidden = 0, specular = 0;
  };

  std::size_t words_of_colours() const;
  std::size_t bytes_of_slot(const DeviceScene& scene) const;
  std::size_t bytes_of_cell(const DeviceScene& scene) const;
  std::size_t parts_of_window() const {
    return static_cast<std::size_t>(std::max(1, visibility_parts * visibility_parts));
  }

  /// Finds the samples of a band, as many to a cell as there are slots.
  void find_band(const DeviceScene& scene, int row, int rows);

  /// Finds out by rays what the samples of a band see.
  void look_around(const DeviceScene& scene, std::size_t cells);

  /// Counts the samples of a band that find_band has found, and places them behind those found
  /// before. Returns the largest number in a cell.
  int count_on_host(const Plan& plan, const DeviceScene& scene, int row, int rows, Found& found);
  int count_on_device(int row, int rows, Found& found);

  /// Finds the samples in mirrors and glass of a band, in the cells that `mirrors` names; empty
  /// where there are none.
  ///
  /// first_cell  of the band
  std::vector<glm::ivec2> find_specular(const Plan& plan, const DeviceScene& scene,
                                        std::size_t first_cell, std::size_t cells);

  /// Appends a band's samples to the table without gaps.
  void append_band(const DeviceScene& scene, std::size_t cells, const Found& before,
                   const Found& after);

  /// Makes the index of the table by cell, for the device, and by row, for the host.
  void index_cells();

  /// In colour: the light of the samples for the scene's laser.
  void show_laser(const DeviceScene& scene);

  cl::Device device_;
  cl::Program program_;
  cl::Kernel find_samples_, pack_samples_;
  std::optional<RaysApart> apart_;
  std::optional<cl::Kernel> show_laser_;  // in colour
  int slots_ = slots_of_cell;  // room in each cell, in samples; grows to the largest number found
  Band band_;
  std::optional<SpecularPaths> specular_;
  // For the host: samples, and hidden samples, in all cells before a cell
  std::vector<glm::ivec2> first_;
  std::vector<glm::ivec2> mirrors_;         // of a band: cells with mirrors, and sources met there
  std::vector<glm::ivec4> specular_first_;  // of their samples, as SpecularPaths::pack takes them
  struct OnDevice {
    explicit OnDevice(const cl::Device& device);
    cl::Program program;
    cl::Kernel place_cells;
    Scan<glm::ivec2> scan;
    cl::Buffer<glm::ivec2> first_of_row;
    cl::Buffer<std::int32_t> found;
  };
  std::optional<OnDevice> on_device_;
  Breaks breaks_;
};

}  // namespace raywave
