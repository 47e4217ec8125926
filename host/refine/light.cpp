// SPDX-License-Identifier: Apache-2.0
#include "host/refine/light.hpp"

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <limits>
#include <map>
#include <optional>
#include <utility>

#include "cl/program.hpp"
#include "host/common/error.hpp"
#include "host/common/plane_fft.hpp"
#include "host/common/threads.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/plan/message_text.hpp"

namespace raywave::refinement {
namespace {

using Sample = std::complex<float>;

constexpr int packet = PictureGrid::packet;

std::size_t count_of(int n) { return static_cast<std::size_t>(n); }
int whole_packets(int n) { return (n + packet - 1) / packet * packet; }

/// Samples from a row of a hologram to the next.
int row_pitch(glm::ivec2 size) { return whole_packets(size.x) + packet; }

/// A sample over its modulus; 1 for zero.
Sample phase_of(const Sample& value) {
  // In double, so that neither the brightest nor the faintest field is lost
  const double re = value.real(), im = value.imag(), square = re * re + im * im;
  if (!(square > 0)) return 1;
  const double inverse = 1 / std::sqrt(square);
  return {static_cast<float>(re * inverse), static_cast<float>(im * inverse)};
}

/// The amplitude that nine of ten lit samples do not exceed; 0: none is lit.
double clip_of(const cl::ComplexBuffer& field) {
  constexpr std::size_t stride = 17;
  constexpr float least_lit = 0.02f;
  std::vector<float> amplitudes;
  field.on_host(
      [&](std::span<const Sample> samples) {
        for (std::size_t i = 0; i < samples.size(); i += stride)
          amplitudes.push_back(std::abs(samples[i]));
      },
      0, field.size());
  const float dark = least_lit * *std::ranges::max_element(amplitudes);
  std::erase_if(amplitudes, [dark](float a) { return !(a > dark); });
  if (amplitudes.empty()) return 0;
  const auto nth = amplitudes.begin() + static_cast<std::ptrdiff_t>(amplitudes.size() / 10 * 9);
  std::nth_element(amplitudes.begin(), nth, amplitudes.end());
  return *nth;
}

cl::Program program_of(const cl::Device& device, bool has_beam = false) {
  return {device,
          "kernels/refine/refine.cl",
          {{option::lanes, std::to_string(device.info().float_lanes)},
           {option::beam, has_beam ? "1" : "0"}}};
}

PlanePart part(glm::ivec2 first, glm::ivec2 count) {
  return {{count_of(first.x), count_of(count.x)}, {count_of(first.y), count_of(count.y)}};
}

/// Part of the plane along one axis that the blur of the region reads.
LinePart with_margin(int first, int count, int margin, int plane) {
  const int low = std::max(0, first - margin), high = std::min(plane, first + count + margin);
  return {count_of(low), count_of(high - low)};
}

}  // namespace

void PhaseStack::resize(glm::ivec2 size, int frames) {
  const auto pitch = row_pitch(size);
  const std::size_t all = count_of(frames) * count_of(size.y) * count_of(pitch);
  if (all > std::numeric_limits<std::uint32_t>::max())
    throw InputError("refinement: " + std::to_string(frames) + " frames of " + extent_text(size) +
                     " pixels are too many for one call; refine fewer frames at a time");
  if (size == size_ && frames == frames_) return;
  samples = {};  // frees the old memory first
  samples = {device_, all, "phases of the holograms"};
  samples.fill_zero();
  size_ = size;
  frames_ = frames;
  pitch_ = pitch;
}

void PhaseStack::take(const FieldStack& field) {
  resize({field.nx, field.ny}, field.frames);
  const auto width = count_of(size_.x), stride = count_of(pitch_),
             rows = count_of(frames_) * count_of(size_.y);
  samples.on_host([&](std::span<Sample> padded) {
    auto& threads = cl::Threads::shared();
    threads.for_each(threads.count(), rows, 16, [&](std::size_t, std::size_t row) {
      for (std::size_t x = 0; x < width; ++x)
        padded[row * stride + x] = phase_of(field.samples[row * width + x]);
    });
  });
}

void PhaseStack::take(const cl::ComplexBuffer& field, glm::ivec2 from, glm::ivec2 count, int frame,
                      bool keeps_amplitudes) {
  if (!take_phases_) take_phases_ = program_of(device_).kernel("take_phases");
  const double clip = keeps_amplitudes ? clip_of(field) : 0;
  run_rows(device_, *take_phases_, count.x, count.y, field, count.x, count.y, samples,
           first(frame, from), pitch_, static_cast<float>(clip > 0 ? 1 / clip : 0));
}

const cl::ComplexBuffer& PhaseStack::frame(int frame) {
  if (frame_.size() != area_of(size_)) frame_ = {device_, area_of(size_), "phases of a hologram"};
  frame_.copy_rows_from(samples, first(frame, {0, 0}), count_of(size_.x), count_of(pitch_));
  return frame_;
}

FieldStack PhaseStack::read() const {
  FieldStack field{size_.x, size_.y, frames_, {}};
  const std::size_t rows = count_of(frames_) * count_of(size_.y);
  field.samples.reserve(rows * count_of(size_.x));
  samples.on_host(
      [&](std::span<const Sample> padded) {
        for (std::size_t row = 0; row < rows; ++row) {
          const auto from = padded.begin() + static_cast<std::ptrdiff_t>(row * count_of(pitch_));
          field.samples.insert(field.samples.end(), from, from + size_.x);
        }
      },
      0, samples.size());
  return field;
}

struct Light::State {
  State(const cl::Device& its_device, cl::FftBackend its_backend)
      : device(its_device),
        backend(its_backend),
        program(program_of(its_device)),
        beam(its_device, 1, "light on pixels") {}
  void take_beam();
  void fit_pupil(const Pupil& pupil);
  PlanePart live_in_pupil() const;
  void transform_pupil(cl::ComplexBuffer& plane, bool inverse);
  void fit(const Optics& its_optics, std::vector<PictureGrid> its_grids);

  /// Tables of a key, beside its grid.
  struct Tables {
    cl::ComplexBuffer column_chirp, row_chirp;
    OpenPart open;  // part of the hologram that kernels take
    // Of spectra: their phases, and the chirp of the samples made of them
    cl::ComplexBuffer spectrum_columns, spectrum_rows, fine_columns, fine_rows;
  };

  bool is(Propagation propagation, std::size_t key) const {
    return grids[key].propagation == propagation;
  }
  void run_fft(cl::ComplexBuffer& plane, glm::ivec2 size, bool inverse, const PlanePart& live,
               const PlanePart& wanted);
  glm::ivec2 live_at_hologram(const PictureGrid& grid) const;
  void transform(std::size_t key, bool inverse);
  cl::ComplexBuffer& plane(std::size_t key) { return planes[count_of(grids[key].slot)]; }
  void spread(const PhaseStack& holograms, int frame, std::size_t key, cl::ComplexBuffer& to,
              int nx, int columns, int rows);
  void spread_hologram(const PhaseStack& holograms, int frame, const Tables& t, float side,
                       cl::ComplexBuffer& to, int nx, int columns, int rows);
  void step_phases(PhaseStack& holograms, int frame, const Tables& t, float side,
                   const cl::ComplexBuffer& change, int pitch, double step);
  void spread_plane(const cl::ComplexBuffer& from, std::uint32_t first, int pitch,
                    const cl::ComplexBuffer& columns_chirp, const cl::ComplexBuffer& rows_chirp,
                    glm::ivec2 open, cl::ComplexBuffer& to, int nx, int columns, int rows);
  cl::ComplexBuffer table(const std::vector<Sample>& values) const {
    return {device, std::span<const Sample>(values), "chirp"};
  }
  void make_room(cl::ComplexBuffer& plane, glm::ivec2 size, const char* what);
  void fit_spectrum(const PictureGrid& grid, Tables& t);
  void turn_spectrum(std::size_t key, bool back);
  void show_by_spectrum(const PhaseStack& holograms, int frame, std::size_t key);
  void back_by_spectrum(std::size_t key);
  const cl::ComplexBuffer& back(std::size_t key);
  int back_pitch(std::size_t key) const {
    const auto& grid = grids[key];
    return is(Propagation::fresnel, key) ? grid.size.x : grid.spectrum.pixels.x;
  }
  cl::Kernel& kernel(const char* name);
  /// A transform that serves planes of this size.
  void fit_transform(glm::ivec2 size);

  cl::Device device;
  cl::FftBackend backend;
  Optics optics;
  std::vector<PictureGrid> grids;
  std::vector<Tables> tables;
  cl::Program program;
  std::map<std::string, cl::Kernel> kernels;
  cl::Buffer<float> beam;  // in rows as of PhaseStack; one number where the light is even
  std::shared_ptr<const std::vector<float>> beam_of;                    // what it holds
  std::vector<cl::ComplexBuffer> planes;                                // by slot
  std::map<std::pair<int, int>, PlaneFft> host_ffts;                    // by size
  std::map<std::pair<int, int>, std::unique_ptr<cl::Fft>> device_ffts;  // by size
  // The open part's spectrum, and finer samples made of it; packets read beyond the last row's end
  cl::ComplexBuffer spectrum, fine;
  // The hologram's light in the pupil's plane, and what parts of it add; the hologram's tables.
  // Packets read beyond the last row's end
  cl::ComplexBuffer in_pupil, added_in_pupil;
  std::optional<Tables> to_pupil;
  std::optional<cl::Kernel> plain_spread;  // where the beam is in the light already
  int transforms = 0;
};

void Light::State::fit(const Optics& its_optics, std::vector<PictureGrid> its_grids) {
  optics = its_optics;
  grids = std::move(its_grids);
  take_beam();
  tables.clear();
  transforms = 0;
  to_pupil.reset();
  for (const auto& grid : grids)
    if (grid.pupil && !to_pupil) fit_pupil(*grid.pupil);
  std::vector<std::size_t> largest;  // by slot
  for (std::size_t key = 0; key < grids.size(); ++key) {
    const auto& grid = grids[key];
    largest.resize(std::max(largest.size(), count_of(grid.slot) + 1));
    auto& samples = largest[count_of(grid.slot)];
    samples = std::max(samples, area_of(grid.size));
    Tables t;
    t.open = grid.open;
    if (is(Propagation::fresnel, key)) {
      t.column_chirp = table(chirp_of(optics, grid, 0));
      t.row_chirp = table(chirp_of(optics, grid, 1));
    } else {
      fit_spectrum(grid, t);
    }
    fit_transform(grid.size);
    tables.push_back(std::move(t));
  }
  planes.resize(largest.size());
  for (std::size_t slot = 0; slot < planes.size(); ++slot) {
    if (planes[slot].size() == largest[slot]) continue;
    planes[slot] = {};  // frees the old memory first
    planes[slot] = {device, largest[slot], "light of the pictures"};
  }
}

void Light::State::fit_transform(glm::ivec2 size) {
  const std::pair shape(size.x, size.y);
  const auto nx = count_of(size.x), ny = count_of(size.y);
  if (backend == cl::FftBackend::host)
    host_ffts.try_emplace(shape, nx, ny);
  else if (!device_ffts.contains(shape))
    device_ffts.emplace(shape, cl::make_fft(device, backend, {nx, ny, nx, ny}));
}

/// Room for a plane, and for a packet beyond its last row's end.
void Light::State::make_room(cl::ComplexBuffer& plane, glm::ivec2 size, const char* what) {
  const auto samples = area_of(size) + packet;
  if (plane.size() >= samples) return;
  plane = {};  // frees the old memory first
  plane = {device, samples, what};
  plane.fill_zero();
}

void Light::State::fit_spectrum(const PictureGrid& grid, Tables& t) {
  const auto& sizes = grid.spectrum;
  const bool is_exact = grid.propagation == Propagation::exact;
  const auto alternating = [&](int axis) {
    return table(chirp({1, 0, grid.open.size[axis]}, 0, 0.5));
  };
  // Moves the open part behind its margin, or to its place before the picture's pixels, and makes
  // up for the transforms' factors
  const auto moved = [&](int axis) {
    const int n = sizes.pixels[axis];
    const double by =
        is_exact ? grid.open.first[axis] + (n - optics.size[axis]) / 2.0 : 1.0 * sizes.margin;
    return table(chirp({1, 0, n}, 0, -by / n, 1.0 / sizes.finer[axis]));
  };
  t.column_chirp = alternating(0);
  t.row_chirp = alternating(1);
  t.spectrum_columns = moved(0);
  t.spectrum_rows = moved(1);
  fit_transform(sizes.pixels);
  make_room(spectrum, sizes.pixels, "spectrum of the hologram");
  if (is_exact) return;
  t.fine_columns = table(chirp_of(optics, grid, 0));
  t.fine_rows = table(chirp_of(optics, grid, 1));
  fit_transform(sizes.finer);
  make_room(fine, sizes.finer, "finer samples of the hologram");
}

void Light::State::fit_pupil(const Pupil& pupil) {
  const auto n = optics.size, all = optics.pupil_plane;
  fit_transform(all);
  to_pupil.emplace();
  to_pupil->open = {{0, 0}, n};
  const auto chirp_along = [&](int axis) {
    const auto pitch_m = optics.pitch_m[axis];
    return table(chirp({n[axis], 0, n[axis]},
                       pupil.a * pitch_m * pitch_m / (2 * optics.wavelength_m * pupil.b_m),
                       to_middle(all[axis]), 1 / std::sqrt(1.0 * all[axis])));
  };
  to_pupil->column_chirp = chirp_along(0);
  to_pupil->row_chirp = chirp_along(1);
  make_room(in_pupil, all, "light in the pupil's plane");
  make_room(added_in_pupil, all, "changes in the pupil's plane");
}

/// Around all parts that are open.
PlanePart Light::State::live_in_pupil() const {
  glm::ivec2 low = optics.pupil_plane, high(0);
  for (const auto& grid : grids) {
    if (!grid.pupil) continue;
    low = glm::min(low, grid.open.first);
    high = glm::max(high, grid.open.first + grid.open.size);
  }
  return part(low, high - low);
}

void Light::State::run_fft(cl::ComplexBuffer& plane, glm::ivec2 size, bool inverse,
                           const PlanePart& live, const PlanePart& wanted) {
  ++transforms;
  const std::pair shape(size.x, size.y);
  if (backend != cl::FftBackend::host) {
    auto& fft = *device_ffts.at(shape);
    return inverse ? fft.inverse(plane) : fft.forward(plane);
  }
  auto& fft = host_ffts.at(shape);
  plane.on_host([&](std::span<Sample> samples) {
    inverse ? fft.inverse(samples.data(), live, wanted) : fft.forward(samples.data(), live, wanted);
  });
}

/// inverse: from the pupil to the hologram
void Light::State::transform_pupil(cl::ComplexBuffer& plane, bool inverse) {
  const auto hologram = part({0, 0}, optics.size);
  run_fft(plane, optics.pupil_plane, inverse, inverse ? live_in_pupil() : hologram,
          inverse ? hologram : live_in_pupil());
}

void Light::State::take_beam() {
  if (optics.showing.beam == beam_of) return;
  beam_of = optics.showing.beam;
  program = program_of(device, beam_of != nullptr);
  kernels.clear();
  const auto width = count_of(optics.size.x), stride = count_of(row_pitch(optics.size));
  std::vector<float> rows(beam_of ? stride * count_of(optics.size.y) : 1);
  for (std::size_t i = 0; beam_of && i < beam_of->size(); ++i)
    rows[i / width * stride + i % width] = (*beam_of)[i];
  beam = {device, rows.size(), "light on pixels"};
  beam.write(rows);
}

cl::Kernel& Light::State::kernel(const char* name) {
  auto known = kernels.find(name);
  if (known == kernels.end()) known = kernels.emplace(name, program.kernel(name)).first;
  return known->second;
}

/// What the last transform to the picture takes.
glm::ivec2 Light::State::live_at_hologram(const PictureGrid& grid) const {
  return grid.propagation == Propagation::fresnel ? grid.open.size : grid.spectrum.finer_open;
}

/// inverse: from the hologram to the picture
void Light::State::transform(std::size_t key, bool inverse) {
  const auto& grid = grids[key];
  const auto hologram = part({0, 0}, live_at_hologram(grid));
  const auto first = grid.region_first, count = grid.region_size;
  if (inverse)
    run_fft(plane(key), grid.size, true, hologram,
            {with_margin(first.x, count.x, grid.margin_x(), grid.size.x),
             with_margin(first.y, count.y, grid.radius_y(), grid.size.y)});
  else
    run_fft(plane(key), grid.size, false, part(first, count), hologram);
}

void Light::State::spread(const PhaseStack& holograms, int frame, std::size_t key,
                          cl::ComplexBuffer& to, int nx, int columns, int rows) {
  const auto& t = tables[key];
  if (grids[key].pupil) {
    const int pitch = optics.pupil_plane.x;
    return spread_plane(in_pupil,
                        static_cast<std::uint32_t>(t.open.first.y * pitch + t.open.first.x), pitch,
                        t.column_chirp, t.row_chirp, t.open.size, to, nx, columns, rows);
  }
  spread_hologram(holograms, frame, t, grids[key].side, to, nx, columns, rows);
}

void Light::State::spread_hologram(const PhaseStack& holograms, int frame, const Tables& t,
                                   float side, cl::ComplexBuffer& to, int nx, int columns,
                                   int rows) {
  run_rows(device, kernel("spread"), columns, rows, holograms.samples,
           holograms.first(frame, t.open.first), holograms.pitch(), side, beam,
           holograms.first(0, t.open.first), t.column_chirp, t.row_chirp, t.open.size.x,
           t.open.size.y, to, nx, columns, rows);
}

/// Adds `change`, in rows of `pitch` samples, to the holograms, and takes the phases.
void Light::State::step_phases(PhaseStack& holograms, int frame, const Tables& t, float side,
                               const cl::ComplexBuffer& change, int pitch, double step) {
  run_rows(device, kernel("step_phase"), t.open.size.x, t.open.size.y, holograms.samples,
           holograms.first(frame, t.open.first), holograms.pitch(), side, beam,
           holograms.first(0, t.open.first), t.column_chirp, t.row_chirp, t.open.size.x,
           t.open.size.y, change, pitch, static_cast<float>(step));
}

/// As `spread`, of light in rows of `pitch` samples, from `first` on.
void Light::State::spread_plane(const cl::ComplexBuffer& from, std::uint32_t first, int pitch,
                                const cl::ComplexBuffer& columns_chirp,
                                const cl::ComplexBuffer& rows_chirp, glm::ivec2 open,
                                cl::ComplexBuffer& to, int nx, int columns, int rows) {
  if (!plain_spread) plain_spread = program_of(device).kernel("spread");
  run_rows(device, *plain_spread, columns, rows, from, first, pitch, 1.0f, beam, first,
           columns_chirp, rows_chirp, open.x, open.y, to, nx, columns, rows);
}

/// From the spectrum to that of finer samples, with the phases that Fresnel's propagation lacks, or
/// to that of the picture, with all of them; or back.
void Light::State::turn_spectrum(std::size_t key, bool back) {
  const auto& grid = grids[key];
  const auto& t = tables[key];
  const bool is_exact = grid.propagation == Propagation::exact;
  auto& turned = is_exact ? plane(key) : fine;
  const auto n = grid.spectrum.pixels, size = grid.spectrum.finer;
  const auto sines = optics.wavelength_m / (optics.pitch_m * glm::dvec2(n));
  const auto waves = grid.z_m / optics.wavelength_m;
  // FFTs of the device read all of the plane
  const auto written = back || backend == cl::FftBackend::host ? n : size;
  run_rows(device, kernel("turn_spectrum"), written.x, written.y, back ? turned : spectrum,
           back ? size.x : n.x, t.spectrum_columns, t.spectrum_rows, n.x, n.y,
           static_cast<float>(sines.x), static_cast<float>(sines.y),
           static_cast<float>(is_exact ? waves : 0), static_cast<float>(is_exact ? 0 : waves / 2),
           std::int32_t{back}, back ? spectrum : turned, back ? n.x : size.x, written.x, written.y);
}

/// The exact propagation; or Fresnel's of a hologram whose spectrum has the phases of the exact
/// one, with room for light that its pixels send beyond the window.
void Light::State::show_by_spectrum(const PhaseStack& holograms, int frame, std::size_t key) {
  const auto& grid = grids[key];
  const auto& t = tables[key];
  const auto n = grid.spectrum.pixels, size = grid.spectrum.finer, open = live_at_hologram(grid);
  const bool on_host = backend == cl::FftBackend::host;
  const auto written = on_host ? grid.open.size : n;
  spread(holograms, frame, key, spectrum, n.x, written.x, written.y);
  run_fft(spectrum, n, false, part({0, 0}, grid.open.size), part({0, 0}, n));
  turn_spectrum(key, false);
  if (is(Propagation::corrected, key)) {
    run_fft(fine, size, true, part({0, 0}, n), part({0, 0}, open));
    const auto shown = on_host ? open : grid.size;
    spread_plane(fine, 0, size.x, t.fine_columns, t.fine_rows, open, plane(key), grid.size.x,
                 shown.x, shown.y);
  }
  transform(key, true);
}

/// The adjoint.
void Light::State::back_by_spectrum(std::size_t key) {
  const auto& grid = grids[key];
  const auto& t = tables[key];
  const auto n = grid.spectrum.pixels, size = grid.spectrum.finer, open = live_at_hologram(grid);
  transform(key, false);
  if (is(Propagation::corrected, key)) {
    const auto written = backend == cl::FftBackend::host ? open : size;
    run_rows(device, kernel("put_back"), written.x, written.y, fine, std::uint32_t{0}, size.x,
             t.fine_columns, t.fine_rows, written.x, written.y, plane(key), grid.size.x, 1.0f);
    run_fft(fine, size, false, part({0, 0}, open), part({0, 0}, n));
  }
  turn_spectrum(key, true);
  run_fft(spectrum, n, true, part({0, 0}, n), part({0, 0}, grid.open.size));
}

const cl::ComplexBuffer& Light::State::back(std::size_t key) {
  if (is(Propagation::fresnel, key)) {
    transform(key, false);
    return plane(key);
  }
  back_by_spectrum(key);
  return spectrum;
}

Light::Light(const cl::Device& device, cl::FftBackend backend)
    : state_(std::make_unique<State>(device, backend)) {}
void Light::fit(const Optics& optics, std::vector<PictureGrid> grids) {
  state_->fit(optics, std::move(grids));
}
Light::~Light() = default;
Light::Light(Light&&) noexcept = default;

const PictureGrid& Light::grid(std::size_t key) const { return state_->grids[key]; }
cl::ComplexBuffer& Light::plane(std::size_t key) { return state_->plane(key); }
int Light::transforms() const { return state_->transforms; }

OpenPart Light::read_back(std::size_t key) const {
  const auto& grid = state_->grids[key];
  if (state_->backend == cl::FftBackend::host) return {grid.region_first, grid.region_size};
  return {{0, 0}, grid.size};
}

void Light::enter_pupil(const PhaseStack& holograms, int frame) {
  auto& s = *state_;
  if (!s.to_pupil) return;
  const auto all = s.optics.pupil_plane,
             written = s.backend == cl::FftBackend::host ? s.optics.size : all;
  s.spread_hologram(holograms, frame, *s.to_pupil, 1, s.in_pupil, all.x, written.x, written.y);
  s.transform_pupil(s.in_pupil, false);
  s.added_in_pupil.fill_zero();
}

void Light::leave_pupil(PhaseStack& holograms, int frame, double step) {
  auto& s = *state_;
  if (!s.to_pupil) return;
  s.transform_pupil(s.added_in_pupil, true);
  s.step_phases(holograms, frame, *s.to_pupil, 1, s.added_in_pupil, s.optics.pupil_plane.x, step);
}

void Light::show(const PhaseStack& holograms, int frame, std::size_t key) {
  auto& s = *state_;
  const auto& grid = s.grids[key];
  if (!s.is(Propagation::fresnel, key)) return s.show_by_spectrum(holograms, frame, key);
  // FFTs of the device read all of the plane.
  const auto written = s.backend == cl::FftBackend::host ? grid.open.size : grid.size;
  s.spread(holograms, frame, key, s.plane(key), grid.size.x, written.x, written.y);
  s.transform(key, true);
}

void Light::step(PhaseStack& holograms, int frame, std::size_t key, double step) {
  auto& s = *state_;
  const auto& t = s.tables[key];
  const auto& change = s.back(key);
  const double factor = unitary(key);
  if (s.grids[key].pupil) {
    const int pitch = s.optics.pupil_plane.x;
    return run_rows(s.device, s.kernel("put_back"), t.open.size.x, t.open.size.y, s.added_in_pupil,
                    static_cast<std::uint32_t>(t.open.first.y * pitch + t.open.first.x), pitch,
                    t.column_chirp, t.row_chirp, t.open.size.x, t.open.size.y, change,
                    s.back_pitch(key), static_cast<float>(factor * factor));
  }
  s.step_phases(holograms, frame, t, s.grids[key].side, change, s.back_pitch(key),
                step * factor * factor);
}

const cl::ComplexBuffer& Light::back(std::size_t key) { return state_->back(key); }
std::size_t Light::back_pitch(std::size_t key) const { return count_of(state_->back_pitch(key)); }

std::vector<std::complex<float>> Light::column_chirp(std::size_t key) const {
  return state_->tables[key].column_chirp.read();
}
std::vector<std::complex<float>> Light::row_chirp(std::size_t key) const {
  return state_->tables[key].row_chirp.read();
}

double Light::unitary(std::size_t key) const {
  const auto& grid = this->grid(key);
  if (grid.propagation == Propagation::exact) return 1;
  const auto fine = grid.spectrum.fine();
  return std::sqrt(fine.x * fine.y / static_cast<double>(area_of(grid.size)));
}

}  // namespace raywave::refinement
