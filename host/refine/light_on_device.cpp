// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>
#include <span>
#include <string>
#include <utility>

#include "cl/program.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/propagate/propagation.hpp"
#include "host/refine/light.hpp"

namespace raywave::refinement {
namespace {

using Sample = std::complex<float>;

/// By kernels around the device's FFTs.
class LightOnDevice : public Light {
public:
  LightOnDevice(const cl::Device& device, cl::FftBackend backend)
      : Light(device), backend_(backend), beam_on_device_(device, 1, "light on pixels") {}

  OpenPart read_back(std::size_t key) const override { return {{0, 0}, grid(key).size}; }
  void show(const PhaseStack& holograms, int frame, std::size_t key) override;
  void step(PhaseStack& holograms, int frame, std::size_t key, double step) override;
  const cl::ComplexBuffer& back(std::size_t key) override;

private:
  /// Tables of a key on the device: chirps; of spectra their phases and the chirp of the finer
  /// samples.
  struct OnDevice {
    cl::ComplexBuffer column_chirp, row_chirp, spectrum_columns, spectrum_rows, fine_columns,
        fine_rows;
  };

  void prepare() override;
  void to_pupil(const PhaseStack& holograms, int frame) override;
  void from_pupil(PhaseStack& holograms, int frame, double step) override;

  OnDevice prepare(const PictureGrid& grid, const Tables& t);
  OnDevice chirps_of(const Tables& t) const;
  cl::ComplexBuffer table(const std::vector<Sample>& values) const;
  void fit_transform(glm::ivec2 size);
  void run_fft(cl::ComplexBuffer& plane, glm::ivec2 size, bool inverse);
  cl::Program program(bool has_beam) const;
  cl::Kernel& kernel(const char* name);
  void spread(const PhaseStack& holograms, int frame, std::size_t key, cl::ComplexBuffer& to,
              glm::ivec2 size);
  void spread_hologram(const PhaseStack& holograms, int frame, const Tables& t, const OnDevice& d,
                       float side, cl::ComplexBuffer& to, glm::ivec2 size);
  void spread_plane(const cl::ComplexBuffer& from, std::uint32_t first, int pitch,
                    const cl::ComplexBuffer& columns_chirp, const cl::ComplexBuffer& rows_chirp,
                    glm::ivec2 open, cl::ComplexBuffer& to, glm::ivec2 size);
  void turn_spectrum(std::size_t key, bool back);
  void show_by_spectrum(const PhaseStack& holograms, int frame, std::size_t key);
  void back_by_spectrum(std::size_t key);
  void step_phases(PhaseStack& holograms, int frame, const Tables& t, const OnDevice& d, float side,
                   const cl::ComplexBuffer& change, int pitch, double step);

  cl::FftBackend backend_;
  std::map<std::pair<int, int>, std::unique_ptr<cl::Fft>> ffts_;  // by size
  std::map<std::string, cl::Kernel> kernels_;
  std::optional<cl::Kernel> disc_spread_;
  std::optional<cl::Kernel> plain_spread_;  // where the beam is in the light already
  std::vector<OnDevice> on_device_;         // by key
  OnDevice of_pupil_on_device_;
  cl::Buffer<float> beam_on_device_, disc_on_device_;
  std::shared_ptr<const std::vector<float>> beam_there_;  // what beam_on_device_ holds
  // The open part's spectrum, and finer samples made of it; packets read beyond the last row's end
  cl::ComplexBuffer spectrum_, fine_;
};

void LightOnDevice::prepare() {
  if (beam_there_ != beam_of_) {
    beam_there_ = beam_of_;
    beam_on_device_ = {device_, std::span<const float>(beam_), "light on pixels"};
    kernels_.clear();
  }
  if (of_pupil_) {
    fit_transform(optics_.pupil_plane);
    of_pupil_on_device_ = chirps_of(*of_pupil_);
    if (!disc_.empty()) {
      disc_on_device_ = {device_, std::span<const float>(disc_), "disc of the pupil"};
      if (!disc_spread_) disc_spread_ = program(true).kernel("spread");
    }
  }
  on_device_.clear();
  for (std::size_t key = 0; key < grids_.size(); ++key)
    on_device_.push_back(prepare(grids_[key], tables_[key]));
}

LightOnDevice::OnDevice LightOnDevice::prepare(const PictureGrid& grid, const Tables& t) {
  auto d = chirps_of(t);
  fit_transform(grid.size);
  if (grid.propagation == Propagation::fresnel) return d;
  const auto& sizes = grid.spectrum;
  d.spectrum_columns = table(t.path.x.phases);
  d.spectrum_rows = table(t.path.y.phases);
  fit_transform(sizes.pixels);
  make_room(spectrum_, sizes.pixels, "spectrum of the hologram");
  if (grid.propagation == Propagation::exact) return d;
  d.fine_columns = table(chirp_of(optics_, grid, 0));
  d.fine_rows = table(chirp_of(optics_, grid, 1));
  fit_transform(sizes.finer);
  make_room(fine_, sizes.finer, "finer samples of the hologram");
  return d;
}

/// Columns in whole packets.
LightOnDevice::OnDevice LightOnDevice::chirps_of(const Tables& t) const {
  auto columns = t.columns;
  columns.resize(count_of(whole_packets(static_cast<int>(columns.size()))));
  OnDevice d;
  d.column_chirp = table(columns);
  d.row_chirp = table(t.rows);
  return d;
}

cl::ComplexBuffer LightOnDevice::table(const std::vector<Sample>& values) const {
  return {device_, std::span<const Sample>(values), "chirp"};
}

/// A transform that serves planes of this size.
void LightOnDevice::fit_transform(glm::ivec2 size) {
  const std::pair shape(size.x, size.y);
  const auto nx = count_of(size.x), ny = count_of(size.y);
  if (!ffts_.contains(shape))
    ffts_.emplace(shape, cl::make_fft(device_, backend_, {nx, ny, nx, ny}));
}

void LightOnDevice::run_fft(cl::ComplexBuffer& plane, glm::ivec2 size, bool inverse) {
  ++transforms_;
  auto& fft = *ffts_.at({size.x, size.y});
  inverse ? fft.inverse(plane) : fft.forward(plane);
}

cl::Program LightOnDevice::program(bool has_beam) const {
  return {device_,
          "kernels/refine/refine.cl",
          {{option::lanes, std::to_string(device_.info().float_lanes)},
           {option::beam, has_beam ? "1" : "0"}}};
}

cl::Kernel& LightOnDevice::kernel(const char* name) {
  auto known = kernels_.find(name);
  if (known == kernels_.end())
    known = kernels_.emplace(name, program(beam_of_ != nullptr).kernel(name)).first;
  return known->second;
}

void LightOnDevice::spread(const PhaseStack& holograms, int frame, std::size_t key,
                           cl::ComplexBuffer& to, glm::ivec2 size) {
  const auto& t = tables_[key];
  const auto& d = on_device_[key];
  const auto first = first_in_pupil(t);
  const int pitch = optics_.pupil_plane.x;
  if (grids_[key].is_disc)
    return run_rows(device_, *disc_spread_, size.x, size.y, in_pupil_, first, pitch, 1.0f,
                    disc_on_device_, first, d.column_chirp, d.row_chirp, t.open.size.x,
                    t.open.size.y, to, size.x, size.y);
  if (grids_[key].pupil)
    return spread_plane(in_pupil_, first, pitch, d.column_chirp, d.row_chirp, t.open.size, to,
                        size);
  spread_hologram(holograms, frame, t, d, grids_[key].side, to, size);
}

void LightOnDevice::spread_hologram(const PhaseStack& holograms, int frame, const Tables& t,
                                    const OnDevice& d, float side, cl::ComplexBuffer& to,
                                    glm::ivec2 size) {
  run_rows(device_, kernel("spread"), size.x, size.y, holograms.samples,
           holograms.first(frame, t.open.first), holograms.pitch(), side, beam_on_device_,
           holograms.first(0, t.open.first), d.column_chirp, d.row_chirp, t.open.size.x,
           t.open.size.y, to, size.x, size.y);
}

/// Adds `change`, in rows of `pitch` samples, to the holograms, and takes the phases.
void LightOnDevice::step_phases(PhaseStack& holograms, int frame, const Tables& t,
                                const OnDevice& d, float side, const cl::ComplexBuffer& change,
                                int pitch, double step) {
  run_rows(device_, kernel("step_phase"), t.open.size.x, t.open.size.y, holograms.samples,
           holograms.first(frame, t.open.first), holograms.pitch(), side, beam_on_device_,
           holograms.first(0, t.open.first), d.column_chirp, d.row_chirp, t.open.size.x,
           t.open.size.y, change, pitch, static_cast<float>(step));
}

/// As `spread`, of light in rows of `pitch` samples, from `first` on.
void LightOnDevice::spread_plane(const cl::ComplexBuffer& from, std::uint32_t first, int pitch,
                                 const cl::ComplexBuffer& columns_chirp,
                                 const cl::ComplexBuffer& rows_chirp, glm::ivec2 open,
                                 cl::ComplexBuffer& to, glm::ivec2 size) {
  if (!plain_spread_) plain_spread_ = program(false).kernel("spread");
  run_rows(device_, *plain_spread_, size.x, size.y, from, first, pitch, 1.0f, beam_on_device_,
           first, columns_chirp, rows_chirp, open.x, open.y, to, size.x, size.y);
}

/// From the spectrum to that of finer samples, with the phases that Fresnel's propagation lacks, or
/// to that of the picture, with all of them; or back.
void LightOnDevice::turn_spectrum(std::size_t key, bool back) {
  const auto& grid = grids_[key];
  const auto& d = on_device_[key];
  auto& turned = is(Propagation::exact, key) ? plane(key) : fine_;
  const auto& path = tables_[key].path;
  const auto n = grid.spectrum.pixels, size = grid.spectrum.finer;
  const auto written = back ? n : size;
  run_rows(device_, kernel("turn_spectrum"), written.x, written.y, back ? turned : spectrum_,
           back ? size.x : n.x, d.spectrum_columns, d.spectrum_rows, n.x, n.y,
           static_cast<float>(path.x.sine), static_cast<float>(path.y.sine), path.turns, path.more,
           std::int32_t{back}, back ? spectrum_ : turned, written.x, written.y);
}

/// The exact propagation; or Fresnel's of a hologram whose spectrum_ has the phases of the exact
/// one, with room for light that its pixels send beyond the window.
void LightOnDevice::show_by_spectrum(const PhaseStack& holograms, int frame, std::size_t key) {
  const auto& grid = grids_[key];
  const auto& d = on_device_[key];
  const auto n = grid.spectrum.pixels, size = grid.spectrum.finer;
  spread(holograms, frame, key, spectrum_, n);
  run_fft(spectrum_, n, false);
  turn_spectrum(key, false);
  if (is(Propagation::corrected, key)) {
    run_fft(fine_, size, true);
    spread_plane(fine_, 0, size.x, d.fine_columns, d.fine_rows, grid.spectrum.finer_open,
                 plane(key), grid.size);
  }
  run_fft(plane(key), grid.size, true);
}

/// The adjoint.
void LightOnDevice::back_by_spectrum(std::size_t key) {
  const auto& grid = grids_[key];
  const auto& d = on_device_[key];
  const auto n = grid.spectrum.pixels, size = grid.spectrum.finer;
  run_fft(plane(key), grid.size, false);
  if (is(Propagation::corrected, key)) {
    run_rows(device_, kernel("put_back"), size.x, size.y, fine_, std::uint32_t{0}, size.x,
             d.fine_columns, d.fine_rows, size.x, size.y, plane(key), grid.size.x, 1.0f);
    run_fft(fine_, size, false);
  }
  turn_spectrum(key, true);
  run_fft(spectrum_, n, true);
}

const cl::ComplexBuffer& LightOnDevice::back(std::size_t key) {
  if (!is(Propagation::fresnel, key)) {
    back_by_spectrum(key);
    return spectrum_;
  }
  run_fft(plane(key), grids_[key].size, false);
  return plane(key);
}

void LightOnDevice::show(const PhaseStack& holograms, int frame, std::size_t key) {
  const auto size = grids_[key].size;
  if (!is(Propagation::fresnel, key)) return show_by_spectrum(holograms, frame, key);
  spread(holograms, frame, key, plane(key), size);
  run_fft(plane(key), size, true);
}

void LightOnDevice::step(PhaseStack& holograms, int frame, std::size_t key, double step) {
  const auto& t = tables_[key];
  const auto& d = on_device_[key];
  const auto& grid = grids_[key];
  const double factor = std::pow(unitary(key), 2);
  const auto& change = back(key);
  if (grid.pupil)
    return run_rows(device_, kernel("put_back"), t.open.size.x, t.open.size.y, added_in_pupil_,
                    first_in_pupil(t), optics_.pupil_plane.x, d.column_chirp, d.row_chirp,
                    t.open.size.x, t.open.size.y, change, back_pitch(key),
                    static_cast<float>(factor));
  step_phases(holograms, frame, t, d, grid.side, change, back_pitch(key), step * factor);
}

void LightOnDevice::to_pupil(const PhaseStack& holograms, int frame) {
  const auto all = optics_.pupil_plane;
  spread_hologram(holograms, frame, *of_pupil_, of_pupil_on_device_, 1, in_pupil_, all);
  run_fft(in_pupil_, all, false);
}

void LightOnDevice::from_pupil(PhaseStack& holograms, int frame, double step) {
  run_fft(added_in_pupil_, optics_.pupil_plane, true);
  step_phases(holograms, frame, *of_pupil_, of_pupil_on_device_, 1, added_in_pupil_,
              optics_.pupil_plane.x, step);
}

}  // namespace

std::unique_ptr<Light> make_light_on_device(const cl::Device& device, cl::FftBackend backend) {
  return std::make_unique<LightOnDevice>(device, backend);
}

}  // namespace raywave::refinement
