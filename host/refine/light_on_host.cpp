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

/// In three passes over memory.
class LightOnHost : public Light {
public:
  explicit LightOnHost(const cl::Device& device) : Light(device) {}

  OpenPart read_back(std::size_t key) const override {
    return {grid(key).region_first, grid(key).region_size};
  }
  void show(const PhaseStack& holograms, int frame, std::size_t key) override;
  void step(PhaseStack& holograms, int frame, std::size_t key, double step) override;
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
  void show(const Tables& t, const LentRows& from, Sample* to, const PlanePart& wanted);
  void back(const Tables& t, const Sample* from, const PlanePart& live,
            const std::function<void(std::size_t, const Sample*)>& open);
  void put_back(const Tables& t, const Sample* from, const PlanePart& live, double factor,
                bool adds, const LentPlane& to);

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
  return part(low, high - low);
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

void LightOnHost::show(const Tables& t, const LentRows& from, Sample* to, const PlanePart& wanted) {
  transforms_ += t.path.transforms();
  passes_.show(
      t.path,
      [&](std::size_t row, Sample* line) { spread_row(from, row, t.columns, t.rows[row], line); },
      to, wanted);
}

void LightOnHost::back(const Tables& t, const Sample* from, const PlanePart& live,
                       const std::function<void(std::size_t, const Sample*)>& open) {
  transforms_ += t.path.transforms();
  passes_.back(t.path, from, live, open);
}

void LightOnHost::put_back(const Tables& t, const Sample* from, const PlanePart& live,
                           double factor, bool adds, const LentPlane& to) {
  const auto put = !adds     ? put_back_row<false, false>
                   : to.beam ? put_back_row<true, true>
                             : put_back_row<true, false>;
  back(t, from, live, [&](std::size_t row, const Sample* line) {
    put(line, row, t.columns, static_cast<float>(factor) * t.rows[row], to);
  });
}

void LightOnHost::show(const PhaseStack& holograms, int frame, std::size_t key) {
  const auto& grid = grids_[key];
  const auto& t = tables_[key];
  const auto make = [&](std::span<const Sample> light, std::span<Sample> picture) {
    show(t,
         grid.pupil ? rows_in_pupil(light, t, grid.is_disc)
                    : rows_of(light, holograms, t, grid.side),
         picture.data(), wanted_of(grid));
  };
  if (grid.pupil)
    return std::as_const(in_pupil_).on_host_with(plane(key), make, 0, in_pupil_.size());
  holograms.samples.on_host_with(plane(key), make, holograms.first(frame, {0, 0}),
                                 holograms.frame_samples());
}

void LightOnHost::step(PhaseStack& holograms, int frame, std::size_t key, double step) {
  const auto& grid = grids_[key];
  const auto& t = tables_[key];
  const double factor = std::pow(unitary(key), 2);
  const auto take = [&](std::span<Sample> light, std::span<Sample> picture) {
    put_back(t, picture.data(), region_of(grid), grid.pupil ? factor : step * factor, !grid.pupil,
             grid.pupil ? rows_in_pupil(light, t, false) : rows_of(light, holograms, t, grid.side));
  };
  if (grid.pupil) return added_in_pupil_.on_host_with(plane(key), take, 0, added_in_pupil_.size());
  holograms.samples.on_host_with(plane(key), take, holograms.first(frame, {0, 0}),
                                 holograms.frame_samples());
}

const cl::ComplexBuffer& LightOnHost::back(std::size_t key) {
  const auto& grid = grids_[key];
  const auto pitch = count_of(back_pitch(key));
  make_room(opened_, {back_pitch(key), grid.open.size.y}, "light of the open part");
  const auto take = [&](std::span<Sample> rows, std::span<Sample> picture) {
    back(tables_[key], picture.data(), region_of(grid), [&](std::size_t row, const Sample* from) {
      std::copy_n(from, grid.open.size.x, rows.data() + row * pitch);
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
  const auto leave = [&](std::span<Sample> rows, std::span<Sample> pupil) {
    put_back(*of_pupil_, pupil.data(), live_in_pupil(), step, true,
             rows_of(rows, holograms, *of_pupil_, 1));
  };
  holograms.samples.on_host_with(added_in_pupil_, leave, holograms.first(frame, {0, 0}),
                                 holograms.frame_samples());
}

}  // namespace

std::unique_ptr<Light> make_light_on_host(const cl::Device& device) {
  return std::make_unique<LightOnHost>(device);
}

}  // namespace raywave::refinement
