// SPDX-License-Identifier: Apache-2.0
/// Phase holograms in device memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "cl/program.hpp"
#include "host/common/npy.hpp"
#include "host/refine/picture_grid.hpp"

namespace raywave::refinement {

/// Holograms of modulus 1 in device memory, one per frame. Rows are longer than the holograms, so
/// that packets may begin in any column.
class PhaseStack {
public:
  explicit PhaseStack(const cl::Device& device) : device_(device) {}

  /// Samples from a row of a hologram to the next.
  static int row_pitch(glm::ivec2 size) { return whole_packets(size.x) + PictureGrid::packet; }

  /// Makes room for holograms, whose phases `take` brings.
  void resize(glm::ivec2 size, int frames);
  /// Takes the phases of all frames of the host's fields; zero samples have phase 0.
  void take(const FieldStack& field);
  /// The same of a tile of a frame, rows without gaps in device memory.
  ///
  /// keeps_amplitudes  neighbouring phases differ so that the tile's amplitudes are kept, all but
  ///                   the largest tenth
  void take(const cl::ComplexBuffer& field, glm::ivec2 first, glm::ivec2 size, int frame,
            bool keeps_amplitudes = false);

  FieldStack read() const;
  /// The samples of a frame, rows without gaps; valid until the next call.
  const cl::ComplexBuffer& frame(int frame);
  glm::ivec2 size() const { return size_; }
  int frames() const { return frames_; }
  std::int32_t pitch() const { return pitch_; }
  std::uint32_t first(int frame, glm::ivec2 pixel) const {
    return static_cast<std::uint32_t>((frame * size_.y + pixel.y) * pitch_ + pixel.x);
  }
  std::size_t frame_samples() const { return first(1, {0, 0}); }
  cl::ComplexBuffer samples;

private:
  cl::Device device_;
  std::optional<cl::Kernel> take_phases_;
  cl::ComplexBuffer frame_;
  glm::ivec2 size_{0, 0};
  int frames_ = 0;
  std::int32_t pitch_ = 0;
};

}  // namespace raywave::refinement
