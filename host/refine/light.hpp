// SPDX-License-Identifier: Apache-2.0
/// From a phase hologram to the light of a picture, and back: the operators A of the keys and their
/// adjoints A*. All data stays on the device, which lends it to FFTs on the host.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "cl/fft.hpp"
#include "cl/program.hpp"
#include "host/common/npy.hpp"
#include "host/propagate/propagation.hpp"
#include "host/refine/picture_grid.hpp"

namespace raywave::refinement {

/// Holograms of modulus 1 in device memory, one per frame. Rows are longer than the holograms, so
/// that packets may begin in any column.
class PhaseStack {
public:
  explicit PhaseStack(const cl::Device& device) : device_(device) {}

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

/// The operators of a list of keys. Keys of one slot share a plane, which holds the light of the
/// one that was shown last.
class Light {
public:
  Light(const cl::Device& device, cl::FftBackend backend);
  /// Takes other keys. Memory and transforms that fit are kept.
  ///
  /// throws  DeviceError when memory is out or the back end does not serve the sizes; InputError
  ///         where no light of the hologram reaches a picture
  void fit(const Optics& optics, std::vector<PictureGrid> grids);
  ~Light();
  Light(Light&&) noexcept;

  const PictureGrid& grid(std::size_t key) const;
  /// Rows of grid.size.x samples. Right after `show` in the region and the blur's margin around it,
  /// as far as the plane goes.
  cl::ComplexBuffer& plane(std::size_t key);
  /// Samples of the plane that `back` reads: they have to be zero outside the region. With FFTs on
  /// the host that is the region alone.
  OpenPart read_back(std::size_t key) const;

  /// Carries the hologram to the pupil's plane, where keys have a pupil: before they are shown.
  void enter_pupil(const PhaseStack& holograms, int frame);
  /// plane = A hologram, times the beam where the light on the SLM is not even; the hologram's
  /// conjugate, which shows the mirror image through z = 0, for pictures before it.
  void show(const PhaseStack& holograms, int frame, std::size_t key);
  /// hologram = phase of (hologram [times the beam] + step A* plane), A being unitary but for the
  /// parts that aperture and region cut off. Of keys with a pupil, A* plane waits in the pupil's
  /// plane until leave_pupil.
  void step(PhaseStack& holograms, int frame, std::size_t key, double step);
  void leave_pupil(PhaseStack& holograms, int frame, double step);

  /// The part of `step` that makes A* plane but for the chirp: rows of `back_pitch` samples. For
  /// tests.
  const cl::ComplexBuffer& back(std::size_t key);
  std::size_t back_pitch(std::size_t key) const;
  /// The chirp that `show` multiplies with, in the open part: per column and per row.
  std::vector<std::complex<float>> column_chirp(std::size_t key) const;
  std::vector<std::complex<float>> row_chirp(std::size_t key) const;
  /// Factor from the plane to the values of a unitary transform.
  double unitary(std::size_t key) const;

  int transforms() const;  // FFTs of planes since `fit`

private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace raywave::refinement
