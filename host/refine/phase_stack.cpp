// SPDX-License-Identifier: Apache-2.0
#include "host/refine/phase_stack.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "host/common/error.hpp"
#include "host/common/threads.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/plan/message_text.hpp"
#include "host/propagate/propagation.hpp"

namespace raywave::refinement {
namespace {

using Sample = std::complex<float>;

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
  if (!take_phases_)
    take_phases_ = cl::Program(device_, "kernels/refine/refine.cl",
                               {{option::lanes, std::to_string(device_.info().float_lanes)}})
                       .kernel("take_phases");
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

}  // namespace raywave::refinement
