// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <span>

#include "host/common/this_cpu.hpp"
#include "host/refine/light.hpp"

namespace raywave::refinement {
namespace {

using Sample = std::complex<float>;

PlanePart part(const OpenPart& open) {
  return {{count_of(open.first.x), count_of(open.size.x)},
          {count_of(open.first.y), count_of(open.size.y)}};
}

/// Part of the plane that the blur of the region reads.
PlanePart wanted_of(const PictureGrid& grid) {
  return part(grid.pixels({grid.radius_x(), grid.radius_y()}));
}

/// to = sums of `bin` numbers each, a power of two; they and scratch, of as many, are overwritten.
void sum_bins(float* values, float* scratch, std::size_t count, int bin, float* to) {
  for (; bin > 1; bin /= 2, count /= 2) {
    const float* __restrict in = values;
    float* __restrict out = scratch;
    for_this_cpu([ =, half = count / 2 ]() __attribute__((always_inline)) {
      for (std::size_t i = 0; i < half; ++i) out[i] = in[2 * i] + in[2 * i + 1];
    });
    std::swap(values, scratch);
  }
  for (std::size_t i = 0; i < count; ++i) to[i] += values[i];
}

/// Adds the light of one of the plane's rows to its bins, which begin with a bin's first row.
///
/// wide  the bins, in rows of grid.wide_size()
void add_to_bins(const PictureGrid& grid, int row, const Sample* line, float* scratch,
                 float* wide) {
  const auto size = grid.wide_size();
  const auto lit = grid.pixels({grid.radius_x(), grid.radius_y()});
  const auto number = count_of(row / grid.bin.y - grid.region_first.y + grid.radius_y());
  float* to = wide + number * count_of(size.x);
  if (row % grid.bin.y == 0) std::fill_n(to, size.x, 0.0f);
  const float* __restrict in = floats(line + lit.first.x);
  float* __restrict squares = scratch;
  for_this_cpu([ =, count = lit.size.x ]() __attribute__((always_inline)) {
    for (int i = 0; i < count; ++i)
      squares[i] = in[2 * i] * in[2 * i] + in[2 * i + 1] * in[2 * i + 1];
  });
  sum_bins(scratch, scratch + lit.size.x, count_of(lit.size.x), grid.bin.x,
           to + lit.first.x / grid.bin.x - grid.region_first.x + grid.margin_x());
}

/// Bins beyond the plane have no light.
void clear_beyond(const PictureGrid& grid, const PlanePart& wanted, std::span<float> wide) {
  if (wide.empty()) return;
  const auto size = grid.wide_size();
  const auto row_of = [&](std::size_t row) {
    return (static_cast<int>(row) / grid.bin.y - grid.region_first.y + grid.radius_y()) * size.x;
  };
  std::fill(wide.begin(), wide.begin() + row_of(wanted.y.first), 0.0f);
  const auto end = wide.begin() + size.x * size.y,
             dark = wide.begin() + row_of(wanted.y.first + wanted.y.count - 1) + size.x;
  std::fill(dark, end, 0.0f);
}

/// to = from, times what bins of so many samples change.
template <int bin>
void change_bins(const Sample* from, const float* change, int bins, Sample* to) {
  const float* __restrict in = floats(from);
  const float* __restrict by = change;
  float* __restrict out = floats(to);
  for_this_cpu([=]() __attribute__((always_inline)) {
    for (int b = 0; b < bins; ++b)
      for (int i = 2 * bin * b; i < 2 * bin * (b + 1); ++i) out[i] = by[b] * in[i];
  });
}

/// A row of the region, times what its bins change.
void change_row(const PictureGrid& grid, int row, const Sample* plane, const float* change,
                Sample* to) {
  const int number = row / grid.bin.y - grid.region_first.y;
  const Sample* from =
      plane + count_of(row) * count_of(grid.size.x) + count_of(grid.region_first.x * grid.bin.x);
  const auto change_here = grid.bin.x == 1   ? change_bins<1>
                           : grid.bin.x == 2 ? change_bins<2>
                           : grid.bin.x == 4 ? change_bins<4>
                                             : change_bins<8>;
  change_here(from, change + number * grid.region_size.x, grid.known_size.x, to);
}

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

/// In three passes over memory.
class LightOnHost : public Light {
public:
  explicit LightOnHost(const cl::Device& device) : Light(device) {}

  void show(const PhaseStack& holograms, int frame, std::size_t key,
            cl::Buffer<float>* intensity) override;
  void step(PhaseStack& holograms, int frame, std::size_t key, double step,
            const cl::Buffer<float>* change) override;
  const cl::ComplexBuffer& back(std::size_t key) override;

private:
  void prepare() override;
  void to_pupil(const PhaseStack& holograms, int frame) override;
  void from_pupil(PhaseStack& holograms, int frame, double step) override;

  template <class Element>
  Lent<Element> rows_of(std::span<Element> frame, const PhaseStack& holograms, const Tables& t,
                        float side) const;
  template <class Element>
  Lent<Element> rows_in_pupil(std::span<Element> pupil, const Tables& t, bool is_disc) const;
  PlanePart live_in_pupil() const;
  using MakeRow = std::function<void(std::size_t row, Sample* to)>;
  using TakeRow = std::function<void(std::size_t row, const Sample* from)>;
  void show(const Tables& t, const LentRows& from, Sample* to, const PlanePart& wanted,
            const std::function<void(std::size_t, const Sample*, float*)>& made = {});
  void back(const Tables& t, const PlanePart& live, const MakeRow& picture, const TakeRow& open);
  void put_back(const Tables& t, const PlanePart& live, const MakeRow& picture, double factor,
                bool adds, const LentPlane& to);
  /// Rows of a picture, or of the pupil's plane.
  static MakeRow rows(const Sample* from, int pitch, const PlanePart& live) {
    return [=](std::size_t row, Sample* to) {
      std::copy_n(from + row * count_of(pitch) + live.x.first, live.x.count, to);
    };
  }

  LightPasses passes_;
  cl::ComplexBuffer opened_;  // what `back` makes
};

void LightOnHost::prepare() {
  if (of_pupil_) passes_.prepare(of_pupil_->path, live_in_pupil().y.count);
  for (std::size_t key = 0; key < grids_.size(); ++key)
    passes_.prepare(tables_[key].path, wanted_of(grids_[key]).y.count);
}

/// Around all parts that are open.
PlanePart LightOnHost::live_in_pupil() const {
  glm::ivec2 low = optics_.pupil_plane, high(0);
  for (const auto& grid : grids_) {
    if (!grid.pupil) continue;
    low = glm::min(low, grid.open.first);
    high = glm::max(high, grid.open.first + grid.open.size);
  }
  return part({low, high - low});
}

/// Of a key's open part, which begins at the first; frame: all its rows.
template <class Element>
Lent<Element> LightOnHost::rows_of(std::span<Element> frame, const PhaseStack& holograms,
                                   const Tables& t, float side) const {
  const auto first = holograms.first(0, t.open.first);
  return {frame.data() + first, count_of(holograms.pitch()),
          beam_of_ ? beam_.data() + first : nullptr, side};
}

template <class Element>
Lent<Element> LightOnHost::rows_in_pupil(std::span<Element> pupil, const Tables& t,
                                         bool is_disc) const {
  return {pupil.data() + first_in_pupil(t), count_of(optics_.pupil_plane.x),
          is_disc ? disc_.data() + first_in_pupil(t) : nullptr, 1};
}

void LightOnHost::show(const Tables& t, const LentRows& from, Sample* to, const PlanePart& wanted,
                       const std::function<void(std::size_t, const Sample*, float*)>& made) {
  transforms_ += t.path.transforms();
  passes_.show(
      t.path,
      [&](std::size_t row, Sample* line) { spread_row(from, row, t.columns, t.rows[row], line); },
      to, wanted, made);
}

void LightOnHost::back(const Tables& t, const PlanePart& live, const MakeRow& picture,
                       const TakeRow& open) {
  transforms_ += t.path.transforms();
  passes_.back(t.path, live, picture, open);
}

void LightOnHost::put_back(const Tables& t, const PlanePart& live, const MakeRow& picture,
                           double factor, bool adds, const LentPlane& to) {
  const auto put = !adds     ? put_back_row<false, false>
                   : to.beam ? put_back_row<true, true>
                             : put_back_row<true, false>;
  back(t, live, picture, [&](std::size_t row, const Sample* line) {
    put(line, row, t.columns, static_cast<float>(factor) * t.rows[row], to);
  });
}

void LightOnHost::show(const PhaseStack& holograms, int frame, std::size_t key,
                       cl::Buffer<float>* intensity) {
  const auto& grid = grids_[key];
  const auto& t = tables_[key];
  const auto wanted = wanted_of(grid);
  const auto with = [&](std::span<float> wide) {
    const auto add = [&](std::size_t row, const Sample* line, float* scratch) {
      if (!wide.empty()) add_to_bins(grid, static_cast<int>(row), line, scratch, wide.data());
    };
    const auto make = [&](std::span<const Sample> light, std::span<Sample> picture) {
      clear_beyond(grid, wanted, wide);
      show(t,
           grid.pupil ? rows_in_pupil(light, t, grid.is_disc)
                      : rows_of(light, holograms, t, grid.side),
           picture.data(), wanted, add);
    };
    if (grid.pupil)
      return std::as_const(in_pupil_).on_host_with(plane(key), make, 0, in_pupil_.size());
    holograms.samples.on_host_with(plane(key), make, holograms.first(frame, {0, 0}),
                                   holograms.frame_samples());
  };
  intensity ? intensity->on_host_early(with) : with({});
}

void LightOnHost::step(PhaseStack& holograms, int frame, std::size_t key, double step,
                       const cl::Buffer<float>* change) {
  const auto& grid = grids_[key];
  const auto& t = tables_[key];
  const auto live = part(grid.pixels());
  const double factor = std::pow(unitary(key), 2);
  const auto with = [&](std::span<const float> of_bins) {
    const auto take = [&](std::span<Sample> light, std::span<Sample> picture) {
      const auto unchanged = rows(picture.data(), grid.size.x, live);
      const MakeRow changed = [&](std::size_t row, Sample* to) {
        change_row(grid, static_cast<int>(row), picture.data(), of_bins.data(), to);
      };
      put_back(
          t, live, of_bins.empty() ? unchanged : changed, grid.pupil ? factor : step * factor,
          !grid.pupil,
          grid.pupil ? rows_in_pupil(light, t, false) : rows_of(light, holograms, t, grid.side));
    };
    if (grid.pupil)
      return added_in_pupil_.on_host_with(plane(key), take, 0, added_in_pupil_.size());
    holograms.samples.on_host_with(plane(key), take, holograms.first(frame, {0, 0}),
                                   holograms.frame_samples());
  };
  change ? change->on_host_early(with) : with({});
}

const cl::ComplexBuffer& LightOnHost::back(std::size_t key) {
  const auto& grid = grids_[key];
  const auto pitch = count_of(back_pitch(key));
  const auto live = part(grid.pixels());
  make_room(opened_, {back_pitch(key), grid.open.size.y}, "light of the open part");
  const auto take = [&](std::span<Sample> opened, std::span<Sample> picture) {
    back(tables_[key], live, rows(picture.data(), grid.size.x, live),
         [&](std::size_t row, const Sample* from) {
           std::copy_n(from, grid.open.size.x, opened.data() + row * pitch);
         });
  };
  opened_.on_host_with(plane(key), take, 0, opened_.size());
  return opened_;
}

void LightOnHost::to_pupil(const PhaseStack& holograms, int frame) {
  const auto enter = [&](std::span<const Sample> rows, std::span<Sample> pupil) {
    show(*of_pupil_, rows_of(rows, holograms, *of_pupil_, 1), pupil.data(), live_in_pupil());
  };
  holograms.samples.on_host_with(in_pupil_, enter, holograms.first(frame, {0, 0}),
                                 holograms.frame_samples());
}

void LightOnHost::from_pupil(PhaseStack& holograms, int frame, double step) {
  const auto leave = [&](std::span<Sample> light, std::span<Sample> pupil) {
    put_back(*of_pupil_, live_in_pupil(),
             rows(pupil.data(), optics_.pupil_plane.x, live_in_pupil()), step, true,
             rows_of(light, holograms, *of_pupil_, 1));
  };
  holograms.samples.on_host_with(added_in_pupil_, leave, holograms.first(frame, {0, 0}),
                                 holograms.frame_samples());
}

}  // namespace

std::unique_ptr<Light> make_light_on_host(const cl::Device& device) {
  return std::make_unique<LightOnHost>(device);
}

}  // namespace raywave::refinement
