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
#include "host/common/this_cpu.hpp"
#include "host/common/threads.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/plan/message_text.hpp"
#include "host/refine/light_passes.hpp"
#include "host/view/pupil.hpp"

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

PlanePart wanted_of(const PictureGrid& grid) {
  const auto first = grid.region_first, count = grid.region_size;
  return {with_margin(first.x, count.x, grid.margin_x(), grid.size.x),
          with_margin(first.y, count.y, grid.radius_y(), grid.size.y)};
}

PlanePart region_of(const PictureGrid& grid) { return part(grid.region_first, grid.region_size); }

/// Rows of light in the host's memory.
template <class Element>
struct Lent {
  Element* first;
  std::size_t pitch;
  const float* beam;  // light on them, in rows of the same pitch; null: it is even
  float side;         // -1: their conjugates are meant
};
using LentRows = Lent<const Sample>;
using LentPlane = Lent<Sample>;

/// As `spread` in kernels/refine, one row.
void spread_row(const LentRows& from, std::size_t row, const std::vector<Sample>& columns,
                Sample row_chirp, Sample* to) {
  const float* __restrict in = floats(from.first + row * from.pitch);
  const float* __restrict chirp = floats(columns.data());
  const float* light = from.beam ? from.beam + row * from.pitch : nullptr;
  float* __restrict out = floats(to);
  const float side = from.side, p = row_chirp.real(), q = row_chirp.imag();
  for_this_cpu([ =, count = columns.size() ]() __attribute__((always_inline)) {
    for (std::size_t i = 0; i < count; ++i) {
      const float here = light ? light[i] : 1.0f, re = here * in[2 * i],
                  im = side * here * in[2 * i + 1], c = chirp[2 * i], s = chirp[2 * i + 1];
      const float u = re * c - im * s, v = re * s + im * c;
      out[2 * i] = u * p - v * q;
      out[2 * i + 1] = u * q + v * p;
    }
  });
}

/// As `put_back` in kernels/refine, one row; with `adds`, as `step_phase`. What is decided within
/// the loop would keep the compiler from vectorising it.
template <bool adds, bool has_beam>
void put_back_row(const Sample* change, std::size_t row, const std::vector<Sample>& columns,
                  Sample row_chirp, const LentPlane& to) {
  const float* __restrict in = floats(change);
  const float* __restrict chirp = floats(columns.data());
  const float* __restrict light = has_beam ? to.beam + row * to.pitch : nullptr;
  float* __restrict out = floats(to.first + row * to.pitch);
  const float side = to.side, p = row_chirp.real(), q = row_chirp.imag();
  for_this_cpu([ =, count = columns.size() ]() __attribute__((always_inline)) {
    for (std::size_t i = 0; i < count; ++i) {
      const float a = in[2 * i], b = in[2 * i + 1], c = chirp[2 * i], s = chirp[2 * i + 1];
      const float u = a * c + b * s, v = b * c - a * s;
      float re = u * p + v * q, im = v * p - u * q;
      if constexpr (adds) {
        const float here = has_beam ? light[i] : 1.0f;
        re += here * out[2 * i];
        im = here * out[2 * i + 1] + side * im;
        const float square = re * re + im * im,
                    inverse = 1.0f / std::sqrt(square < 1e-30f ? 1e-30f : square);
        re *= inverse;
        im *= inverse;
      }
      out[2 * i] = re;
      out[2 * i + 1] = im;
    }
  });
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
      : device(its_device), backend(its_backend), beam(its_device, 1, "light on pixels") {}
  void take_beam();
  void fit_pupil(const Pupil& pupil);
  PlanePart live_in_pupil() const;
  void fit(const Optics& its_optics, std::vector<PictureGrid> its_grids);

  /// Tables of a key, beside its grid.
  struct Tables {
    OpenPart open;                      // part of the hologram that kernels take
    std::vector<Sample> columns, rows;  // chirp before the first transform
    LightPath path;
    // The same on the device, and of spectra their phases and the chirp of the finer samples
    cl::ComplexBuffer column_chirp, row_chirp, spectrum_columns, spectrum_rows, fine_columns,
        fine_rows;
  };

  bool on_host() const { return backend == cl::FftBackend::host; }
  bool is(Propagation propagation, std::size_t key) const {
    return grids[key].propagation == propagation;
  }
  void fit_line(const PictureGrid& grid, int axis, LightLine& line) const;
  void fit_device(const PictureGrid& grid, Tables& t);
  cl::ComplexBuffer& plane(std::size_t key) { return planes[count_of(grids[key].slot)]; }
  std::uint32_t first_in_pupil(const Tables& t) const {
    return static_cast<std::uint32_t>(t.open.first.y * optics.pupil_plane.x + t.open.first.x);
  }

  // With FFTs on the host
  template <class Element>
  Lent<Element> rows_of(std::span<Element> frame, const PhaseStack& holograms, const Tables& t,
                        float side) const;
  template <class Element>
  Lent<Element> rows_in_pupil(std::span<Element> pupil, const Tables& t, bool is_disc) const;
  void show_on_host(const Tables& t, const LentRows& from, Sample* to, const PlanePart& wanted);
  void back_on_host(const Tables& t, const Sample* from, const PlanePart& live,
                    const std::function<void(std::size_t, const Sample*)>& open);
  void put_back_on_host(const Tables& t, const Sample* from, const PlanePart& live, double factor,
                        bool adds, const LentPlane& to);

  // With FFTs on the device
  void run_fft(cl::ComplexBuffer& plane, glm::ivec2 size, bool inverse);
  void spread(const PhaseStack& holograms, int frame, std::size_t key, cl::ComplexBuffer& to,
              glm::ivec2 size);
  void spread_hologram(const PhaseStack& holograms, int frame, const Tables& t, float side,
                       cl::ComplexBuffer& to, glm::ivec2 size);
  void step_phases(PhaseStack& holograms, int frame, const Tables& t, float side,
                   const cl::ComplexBuffer& change, int pitch, double step);
  void spread_plane(const cl::ComplexBuffer& from, std::uint32_t first, int pitch,
                    const cl::ComplexBuffer& columns_chirp, const cl::ComplexBuffer& rows_chirp,
                    glm::ivec2 open, cl::ComplexBuffer& to, glm::ivec2 size);
  cl::ComplexBuffer table(const std::vector<Sample>& values) const {
    return {device, std::span<const Sample>(values), "chirp"};
  }
  void make_room(cl::ComplexBuffer& plane, glm::ivec2 size, const char* what);
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
  std::optional<cl::Program> program;  // of kernels, with FFTs on the device
  std::map<std::string, cl::Kernel> kernels;
  cl::Buffer<float> beam;        // in rows as of PhaseStack; one number where the light is even
  std::vector<float> beam_rows;  // the same, with FFTs on the host
  std::shared_ptr<const std::vector<float>> beam_of;                    // what it holds
  std::vector<cl::ComplexBuffer> planes;                                // by slot
  std::map<std::pair<int, int>, std::unique_ptr<cl::Fft>> device_ffts;  // by size
  // The open part's spectrum, and finer samples made of it; packets read beyond the last row's end
  cl::ComplexBuffer spectrum, fine;
  LightPasses passes;
  // The hologram's light in the pupil's plane, and what parts of it add; the hologram's tables.
  // Packets read beyond the last row's end
  cl::ComplexBuffer in_pupil, added_in_pupil;
  std::optional<Tables> to_pupil;
  std::vector<float> disc;  // what the pupil lets through of its plane, and on the device
  cl::Buffer<float> disc_on_device;
  std::optional<cl::Kernel> disc_spread;
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
    const auto waves = grid.z_m / optics.wavelength_m;
    t.path.turns = static_cast<float>(is(Propagation::exact, key) ? waves : 0);
    t.path.more = static_cast<float>(is(Propagation::exact, key) ? 0 : waves / 2);
    for (int axis = 0; axis < 2; ++axis) {
      fit_line(grid, axis, axis == 0 ? t.path.x : t.path.y);
      // A spectrum begins with the lowest frequency
      (axis == 0 ? t.columns : t.rows) = is(Propagation::fresnel, key)
                                             ? chirp_of(optics, grid, axis)
                                             : chirp({1, 0, grid.open.size[axis]}, 0, 0.5);
    }
    t.columns.resize(count_of(grid.open.size.x));
    if (on_host())
      passes.prepare(t.path, wanted_of(grid).y.count);
    else
      fit_device(grid, t);
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
  if (!on_host() && !device_ffts.contains(shape))
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

void Light::State::fit_line(const PictureGrid& grid, int axis, LightLine& line) const {
  line.open = count_of(grid.open.size[axis]);
  line.picture = count_of(grid.size[axis]);
  if (grid.propagation == Propagation::fresnel) return;
  const auto& sizes = grid.spectrum;
  const bool is_exact = grid.propagation == Propagation::exact;
  const int n = sizes.pixels[axis];
  line.spectrum = count_of(n);
  line.finer = count_of(sizes.finer[axis]);
  line.sine = optics.wavelength_m / (optics.pitch_m[axis] * n);
  // Moves the open part behind its margin, or to its place before the picture's pixels, and makes
  // up for the transforms' factors
  const double by =
      is_exact ? grid.open.first[axis] + (n - optics.size[axis]) / 2.0 : 1.0 * sizes.margin;
  line.phases = chirp({1, 0, n}, 0, -by / n, 1.0 / sizes.finer[axis]);
  if (is_exact) return;
  line.chirp = chirp_of(optics, grid, axis);
  line.chirp.resize(count_of(sizes.finer_open[axis]));
}

void Light::State::fit_device(const PictureGrid& grid, Tables& t) {
  const auto whole = [&](std::vector<Sample> chirp) {
    chirp.resize(count_of(whole_packets(static_cast<int>(chirp.size()))));
    return table(chirp);
  };
  t.column_chirp = whole(t.columns);
  t.row_chirp = table(t.rows);
  fit_transform(grid.size);
  if (grid.propagation == Propagation::fresnel) return;
  const auto& sizes = grid.spectrum;
  t.spectrum_columns = table(t.path.x.phases);
  t.spectrum_rows = table(t.path.y.phases);
  fit_transform(sizes.pixels);
  make_room(spectrum, sizes.pixels, "spectrum of the hologram");
  if (grid.propagation == Propagation::exact) return;
  t.fine_columns = table(chirp_of(optics, grid, 0));
  t.fine_rows = table(chirp_of(optics, grid, 1));
  fit_transform(sizes.finer);
  make_room(fine, sizes.finer, "finer samples of the hologram");
}

void Light::State::fit_pupil(const Pupil& pupil) {
  const auto n = optics.size, all = optics.pupil_plane;
  to_pupil.emplace();
  auto& t = *to_pupil;
  t.open = {{0, 0}, n};
  t.path.inverse = false;
  for (int axis = 0; axis < 2; ++axis) {
    auto& line = axis == 0 ? t.path.x : t.path.y;
    line.open = count_of(n[axis]);
    line.picture = count_of(all[axis]);
    const auto pitch_m = optics.pitch_m[axis];
    (axis == 0 ? t.columns : t.rows) = chirp(
        {n[axis], 0, n[axis]}, pupil.a * pitch_m * pitch_m / (2 * optics.wavelength_m * pupil.b_m),
        to_middle(all[axis]), 1 / std::sqrt(1.0 * all[axis]));
  }
  if (on_host()) {
    passes.prepare(t.path, live_in_pupil().y.count);
  } else {
    fit_transform(all);
    t.column_chirp = table(t.columns);
    t.row_chirp = table(t.rows);
  }
  t.columns.resize(count_of(n.x));
  make_room(in_pupil, all, "light in the pupil's plane");
  make_room(added_in_pupil, all, "changes in the pupil's plane");
  if (std::ranges::none_of(grids, &PictureGrid::is_disc)) return;
  disc.resize(area_of(all));
  const auto step_m = optics.wavelength_m * pupil.b_m / (glm::dvec2(all) * optics.pitch_m);
  for (const auto& grid : grids)
    for (int y = grid.open.first.y; grid.is_disc && y < grid.open.first.y + grid.open.size.y; ++y)
      for (int x = grid.open.first.x; x < grid.open.first.x + grid.open.size.x; ++x)
        disc[count_of(y) * count_of(all.x) + count_of(x)] = static_cast<float>(open_share(
            pupil, glm::dvec2(x - (all.x - 1) / 2.0, (all.y - 1) / 2.0 - y) * step_m, step_m));
  if (on_host()) return;
  disc_on_device = {device, disc, "disc of the pupil"};
  if (!disc_spread) disc_spread = program_of(device, true).kernel("spread");
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

void Light::State::run_fft(cl::ComplexBuffer& plane, glm::ivec2 size, bool inverse) {
  ++transforms;
  auto& fft = *device_ffts.at({size.x, size.y});
  inverse ? fft.inverse(plane) : fft.forward(plane);
}

void Light::State::take_beam() {
  if (optics.showing.beam == beam_of) return;
  beam_of = optics.showing.beam;
  program.reset();
  kernels.clear();
  const auto width = count_of(optics.size.x), stride = count_of(row_pitch(optics.size));
  beam_rows.assign(beam_of ? stride * count_of(optics.size.y) : 1, 0);
  for (std::size_t i = 0; beam_of && i < beam_of->size(); ++i)
    beam_rows[i / width * stride + i % width] = (*beam_of)[i];
  if (on_host()) return;
  beam = {device, beam_rows, "light on pixels"};
  beam_rows.clear();
}

cl::Kernel& Light::State::kernel(const char* name) {
  auto known = kernels.find(name);
  if (!program) program = program_of(device, beam_of != nullptr);
  if (known == kernels.end()) known = kernels.emplace(name, program->kernel(name)).first;
  return known->second;
}

/// Of a key's open part, which begins at the first; frame: all its rows.
template <class Element>
Lent<Element> Light::State::rows_of(std::span<Element> frame, const PhaseStack& holograms,
                                    const Tables& t, float side) const {
  const auto first = holograms.first(0, t.open.first);
  return {frame.data() + first, count_of(holograms.pitch()),
          beam_of ? beam_rows.data() + first : nullptr, side};
}

template <class Element>
Lent<Element> Light::State::rows_in_pupil(std::span<Element> pupil, const Tables& t,
                                          bool is_disc) const {
  return {pupil.data() + first_in_pupil(t), count_of(optics.pupil_plane.x),
          is_disc ? disc.data() + first_in_pupil(t) : nullptr, 1};
}

void Light::State::show_on_host(const Tables& t, const LentRows& from, Sample* to,
                                const PlanePart& wanted) {
  transforms += t.path.transforms();
  passes.show(
      t.path,
      [&](std::size_t row, Sample* line) { spread_row(from, row, t.columns, t.rows[row], line); },
      to, wanted);
}

void Light::State::back_on_host(const Tables& t, const Sample* from, const PlanePart& live,
                                const std::function<void(std::size_t, const Sample*)>& open) {
  transforms += t.path.transforms();
  passes.back(t.path, from, live, open);
}

void Light::State::put_back_on_host(const Tables& t, const Sample* from, const PlanePart& live,
                                    double factor, bool adds, const LentPlane& to) {
  const auto put = !adds     ? put_back_row<false, false>
                   : to.beam ? put_back_row<true, true>
                             : put_back_row<true, false>;
  back_on_host(t, from, live, [&](std::size_t row, const Sample* line) {
    put(line, row, t.columns, static_cast<float>(factor) * t.rows[row], to);
  });
}

void Light::State::spread(const PhaseStack& holograms, int frame, std::size_t key,
                          cl::ComplexBuffer& to, glm::ivec2 size) {
  const auto& t = tables[key];
  if (grids[key].is_disc)
    return run_rows(device, *disc_spread, size.x, size.y, in_pupil, first_in_pupil(t),
                    optics.pupil_plane.x, 1.0f, disc_on_device, first_in_pupil(t), t.column_chirp,
                    t.row_chirp, t.open.size.x, t.open.size.y, to, size.x, size.y);
  if (grids[key].pupil)
    return spread_plane(in_pupil, first_in_pupil(t), optics.pupil_plane.x, t.column_chirp,
                        t.row_chirp, t.open.size, to, size);
  spread_hologram(holograms, frame, t, grids[key].side, to, size);
}

void Light::State::spread_hologram(const PhaseStack& holograms, int frame, const Tables& t,
                                   float side, cl::ComplexBuffer& to, glm::ivec2 size) {
  run_rows(device, kernel("spread"), size.x, size.y, holograms.samples,
           holograms.first(frame, t.open.first), holograms.pitch(), side, beam,
           holograms.first(0, t.open.first), t.column_chirp, t.row_chirp, t.open.size.x,
           t.open.size.y, to, size.x, size.y);
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
                                cl::ComplexBuffer& to, glm::ivec2 size) {
  if (!plain_spread) plain_spread = program_of(device).kernel("spread");
  run_rows(device, *plain_spread, size.x, size.y, from, first, pitch, 1.0f, beam, first,
           columns_chirp, rows_chirp, open.x, open.y, to, size.x, size.y);
}

/// From the spectrum to that of finer samples, with the phases that Fresnel's propagation lacks, or
/// to that of the picture, with all of them; or back.
void Light::State::turn_spectrum(std::size_t key, bool back) {
  const auto& grid = grids[key];
  const auto& t = tables[key];
  auto& turned = is(Propagation::exact, key) ? plane(key) : fine;
  const auto n = grid.spectrum.pixels, size = grid.spectrum.finer;
  const auto written = back ? n : size;
  run_rows(device, kernel("turn_spectrum"), written.x, written.y, back ? turned : spectrum,
           back ? size.x : n.x, t.spectrum_columns, t.spectrum_rows, n.x, n.y,
           static_cast<float>(t.path.x.sine), static_cast<float>(t.path.y.sine), t.path.turns,
           t.path.more, std::int32_t{back}, back ? spectrum : turned, written.x, written.y);
}

/// The exact propagation; or Fresnel's of a hologram whose spectrum has the phases of the exact
/// one, with room for light that its pixels send beyond the window.
void Light::State::show_by_spectrum(const PhaseStack& holograms, int frame, std::size_t key) {
  const auto& grid = grids[key];
  const auto& t = tables[key];
  const auto n = grid.spectrum.pixels, size = grid.spectrum.finer;
  spread(holograms, frame, key, spectrum, n);
  run_fft(spectrum, n, false);
  turn_spectrum(key, false);
  if (is(Propagation::corrected, key)) {
    run_fft(fine, size, true);
    spread_plane(fine, 0, size.x, t.fine_columns, t.fine_rows, grid.spectrum.finer_open, plane(key),
                 grid.size);
  }
  run_fft(plane(key), grid.size, true);
}

/// The adjoint.
void Light::State::back_by_spectrum(std::size_t key) {
  const auto& grid = grids[key];
  const auto& t = tables[key];
  const auto n = grid.spectrum.pixels, size = grid.spectrum.finer;
  run_fft(plane(key), grid.size, false);
  if (is(Propagation::corrected, key)) {
    run_rows(device, kernel("put_back"), size.x, size.y, fine, std::uint32_t{0}, size.x,
             t.fine_columns, t.fine_rows, size.x, size.y, plane(key), grid.size.x, 1.0f);
    run_fft(fine, size, false);
  }
  turn_spectrum(key, true);
  run_fft(spectrum, n, true);
}

const cl::ComplexBuffer& Light::State::back(std::size_t key) {
  const auto& grid = grids[key];
  if (on_host()) {
    make_room(spectrum, {back_pitch(key), grid.open.size.y}, "light of the open part");
    const auto take = [&](std::span<Sample> rows, std::span<Sample> picture) {
      back_on_host(
          tables[key], picture.data(), region_of(grid), [&](std::size_t row, const Sample* from) {
            std::copy_n(from, grid.open.size.x, rows.data() + row * count_of(back_pitch(key)));
          });
    };
    spectrum.on_host_with(plane(key), take, 0, spectrum.size());
    return spectrum;
  }
  if (!is(Propagation::fresnel, key)) {
    back_by_spectrum(key);
    return spectrum;
  }
  run_fft(plane(key), grid.size, false);
  return plane(key);
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
  if (state_->on_host()) return {grid.region_first, grid.region_size};
  return {{0, 0}, grid.size};
}

void Light::enter_pupil(const PhaseStack& holograms, int frame) {
  auto& s = *state_;
  if (!s.to_pupil) return;
  s.added_in_pupil.fill_zero();
  const auto& t = *s.to_pupil;
  if (s.on_host()) {
    const auto enter = [&](std::span<const Sample> rows, std::span<Sample> pupil) {
      s.show_on_host(t, s.rows_of(rows, holograms, t, 1), pupil.data(), s.live_in_pupil());
    };
    return holograms.samples.on_host_with(s.in_pupil, enter, holograms.first(frame, {0, 0}),
                                          holograms.frame_samples());
  }
  const auto all = s.optics.pupil_plane;
  s.spread_hologram(holograms, frame, t, 1, s.in_pupil, all);
  s.run_fft(s.in_pupil, all, false);
}

void Light::leave_pupil(PhaseStack& holograms, int frame, double step) {
  auto& s = *state_;
  if (!s.to_pupil) return;
  const auto& t = *s.to_pupil;
  if (s.on_host()) {
    const auto leave = [&](std::span<Sample> rows, std::span<Sample> pupil) {
      s.put_back_on_host(t, pupil.data(), s.live_in_pupil(), step, true,
                         s.rows_of(rows, holograms, t, 1));
    };
    return holograms.samples.on_host_with(s.added_in_pupil, leave, holograms.first(frame, {0, 0}),
                                          holograms.frame_samples());
  }
  s.run_fft(s.added_in_pupil, s.optics.pupil_plane, true);
  s.step_phases(holograms, frame, t, 1, s.added_in_pupil, s.optics.pupil_plane.x, step);
}

void Light::show(const PhaseStack& holograms, int frame, std::size_t key) {
  auto& s = *state_;
  const auto& grid = s.grids[key];
  const auto& t = s.tables[key];
  if (s.on_host()) {
    const auto show = [&](std::span<const Sample> light, std::span<Sample> picture) {
      s.show_on_host(t,
                     grid.pupil ? s.rows_in_pupil(light, t, grid.is_disc)
                                : s.rows_of(light, holograms, t, grid.side),
                     picture.data(), wanted_of(grid));
    };
    if (grid.pupil)
      return std::as_const(s.in_pupil).on_host_with(s.plane(key), show, 0, s.in_pupil.size());
    return holograms.samples.on_host_with(s.plane(key), show, holograms.first(frame, {0, 0}),
                                          holograms.frame_samples());
  }
  if (!s.is(Propagation::fresnel, key)) return s.show_by_spectrum(holograms, frame, key);
  s.spread(holograms, frame, key, s.plane(key), grid.size);
  s.run_fft(s.plane(key), grid.size, true);
}

void Light::step(PhaseStack& holograms, int frame, std::size_t key, double step) {
  auto& s = *state_;
  const auto& t = s.tables[key];
  const auto& grid = s.grids[key];
  const double factor = std::pow(unitary(key), 2);
  if (s.on_host()) {
    const auto put_back = [&](std::span<Sample> light, std::span<Sample> picture) {
      s.put_back_on_host(t, picture.data(), region_of(grid), grid.pupil ? factor : step * factor,
                         !grid.pupil,
                         grid.pupil ? s.rows_in_pupil(light, t, false)
                                    : s.rows_of(light, holograms, t, grid.side));
    };
    if (grid.pupil)
      return s.added_in_pupil.on_host_with(s.plane(key), put_back, 0, s.added_in_pupil.size());
    return holograms.samples.on_host_with(s.plane(key), put_back, holograms.first(frame, {0, 0}),
                                          holograms.frame_samples());
  }
  const int pitch = s.optics.pupil_plane.x;
  const auto& change = s.back(key);
  if (grid.pupil)
    return run_rows(s.device, s.kernel("put_back"), t.open.size.x, t.open.size.y, s.added_in_pupil,
                    s.first_in_pupil(t), pitch, t.column_chirp, t.row_chirp, t.open.size.x,
                    t.open.size.y, change, s.back_pitch(key), static_cast<float>(factor));
  s.step_phases(holograms, frame, t, grid.side, change, s.back_pitch(key), step * factor);
}

const cl::ComplexBuffer& Light::back(std::size_t key) { return state_->back(key); }
std::size_t Light::back_pitch(std::size_t key) const { return count_of(state_->back_pitch(key)); }

std::vector<std::complex<float>> Light::column_chirp(std::size_t key) const {
  return state_->tables[key].columns;
}
std::vector<std::complex<float>> Light::row_chirp(std::size_t key) const {
  return state_->tables[key].rows;
}

double Light::unitary(std::size_t key) const {
  const auto& grid = this->grid(key);
  if (grid.propagation == Propagation::exact) return 1;
  const auto fine = grid.spectrum.fine();
  return std::sqrt(fine.x * fine.y / static_cast<double>(area_of(grid.size)));
}

}  // namespace raywave::refinement
