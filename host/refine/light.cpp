// SPDX-License-Identifier: Apache-2.0
#include "host/refine/light.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "host/view/pupil.hpp"

namespace raywave::refinement {

std::unique_ptr<Light> Light::make(const cl::Device& device, cl::FftBackend backend) {
  return backend == cl::FftBackend::host ? make_light_on_host(device)
                                         : make_light_on_device(device, backend);
}

void Light::fit(const Optics& optics, std::vector<PictureGrid> grids) {
  optics_ = optics;
  grids_ = std::move(grids);
  take_beam();
  tables_.clear();
  transforms_ = 0;
  of_pupil_.reset();
  for (const auto& grid : grids_)
    if (grid.pupil && !of_pupil_) fit_pupil(*grid.pupil);
  std::vector<std::size_t> largest;  // by slot
  for (std::size_t key = 0; key < grids_.size(); ++key) {
    const auto& grid = grids_[key];
    largest.resize(std::max(largest.size(), count_of(grid.slot) + 1));
    auto& samples = largest[count_of(grid.slot)];
    samples = std::max(samples, area_of(grid.size));
    tables_.push_back(tables_of(key));
  }
  prepare();
  planes_.resize(largest.size());
  for (std::size_t slot = 0; slot < planes_.size(); ++slot) {
    if (planes_[slot].size() == largest[slot]) continue;
    planes_[slot] = {};  // frees the old memory first
    planes_[slot] = {device_, largest[slot], "light of the pictures"};
  }
}

void Light::take_beam() {
  if (optics_.showing.beam == beam_of_ && !beam_.empty()) return;
  beam_of_ = optics_.showing.beam;
  const auto width = count_of(optics_.size.x),
             stride = count_of(PhaseStack::row_pitch(optics_.size));
  beam_.assign(beam_of_ ? stride * count_of(optics_.size.y) : 1, 0);
  for (std::size_t i = 0; beam_of_ && i < beam_of_->size(); ++i)
    beam_[i / width * stride + i % width] = (*beam_of_)[i];
}

Light::Tables Light::tables_of(std::size_t key) const {
  const auto& grid = grids_[key];
  Tables t{grid.open, {}, {}, {}};
  const auto waves = static_cast<float>(grid.z_m / optics_.wavelength_m);
  t.path = {line_of(grid, 0), line_of(grid, 1)};
  is(Propagation::exact, key) ? t.path.turns = waves : t.path.more = waves / 2;
  for (int axis = 0; axis < 2; ++axis)
    // A spectrum begins with the lowest frequency
    (axis == 0 ? t.columns : t.rows) = is(Propagation::fresnel, key)
                                           ? chirp_of(optics_, grid, axis)
                                           : chirp({1, 0, grid.open.size[axis]}, 0, 0.5);
  t.columns.resize(count_of(grid.open.size.x));
  return t;
}

LightLine Light::line_of(const PictureGrid& grid, int axis) const {
  LightLine line;
  line.open = count_of(grid.open.size[axis]);
  line.picture = count_of(grid.size[axis]);
  if (grid.propagation == Propagation::fresnel) return line;
  const auto& sizes = grid.spectrum;
  const bool is_exact = grid.propagation == Propagation::exact;
  const int n = sizes.pixels[axis];
  line.spectrum = count_of(n);
  line.finer = count_of(sizes.finer[axis]);
  line.sine = optics_.wavelength_m / (optics_.pitch_m[axis] * n);
  // Moves the open part behind its margin, or to its place before the picture's pixels, and makes
  // up for the transforms' factors
  const double by =
      is_exact ? grid.open.first[axis] + (n - optics_.size[axis]) / 2.0 : 1.0 * sizes.margin;
  line.phases = chirp({1, 0, n}, 0, -by / n, 1.0 / sizes.finer[axis]);
  if (is_exact) return line;
  line.chirp = chirp_of(optics_, grid, axis);
  line.chirp.resize(count_of(sizes.finer_open[axis]));
  return line;
}

/// Room for a plane, and for a packet beyond its last row's end.
void Light::make_room(cl::ComplexBuffer& plane, glm::ivec2 size, const char* what) const {
  const auto samples = area_of(size) + PictureGrid::packet;
  if (plane.size() >= samples) return;
  plane = {};  // frees the old memory first
  plane = {device_, samples, what};
  plane.fill_zero();
}

void Light::fit_pupil(const Pupil& pupil) {
  const auto n = optics_.size, all = optics_.pupil_plane;
  auto& t = of_pupil_.emplace();
  t.open = {{0, 0}, n};
  t.path.inverse = false;
  for (int axis = 0; axis < 2; ++axis) {
    auto& line = axis == 0 ? t.path.x : t.path.y;
    line.open = count_of(n[axis]);
    line.picture = count_of(all[axis]);
    const auto pitch_m = optics_.pitch_m[axis];
    (axis == 0 ? t.columns : t.rows) = chirp(
        {n[axis], 0, n[axis]}, pupil.a * pitch_m * pitch_m / (2 * optics_.wavelength_m * pupil.b_m),
        to_middle(all[axis]), 1 / std::sqrt(1.0 * all[axis]));
  }
  t.columns.resize(count_of(n.x));
  make_room(in_pupil_, all, "light in the pupil's plane");
  make_room(added_in_pupil_, all, "changes in the pupil's plane");
  disc_.clear();
  if (std::ranges::none_of(grids_, &PictureGrid::is_disc)) return;
  disc_.resize(area_of(all));
  const auto step_m = optics_.wavelength_m * pupil.b_m / (glm::dvec2(all) * optics_.pitch_m);
  for (const auto& grid : grids_)
    for (int y = grid.open.first.y; grid.is_disc && y < grid.open.first.y + grid.open.size.y; ++y)
      for (int x = grid.open.first.x; x < grid.open.first.x + grid.open.size.x; ++x)
        disc_[count_of(y) * count_of(all.x) + count_of(x)] = static_cast<float>(open_share(
            pupil, glm::dvec2(x - (all.x - 1) / 2.0, (all.y - 1) / 2.0 - y) * step_m, step_m));
}

void Light::enter_pupil(const PhaseStack& holograms, int frame) {
  if (!of_pupil_) return;
  added_in_pupil_.fill_zero();
  to_pupil(holograms, frame);
}

void Light::leave_pupil(PhaseStack& holograms, int frame, double step) {
  if (of_pupil_) from_pupil(holograms, frame, step);
}

int Light::back_pitch(std::size_t key) const {
  const auto& grid = grids_[key];
  return is(Propagation::fresnel, key) ? grid.size.x : grid.spectrum.pixels.x;
}

double Light::unitary(std::size_t key) const {
  const auto& grid = grids_[key];
  if (grid.propagation == Propagation::exact) return 1;
  const auto fine = grid.spectrum.fine();
  return std::sqrt(fine.x * fine.y / static_cast<double>(area_of(grid.size)));
}

}  // namespace raywave::refinement
