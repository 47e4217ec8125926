// SPDX-License-Identifier: Apache-2.0
/// From a phase hologram to the light of a picture, and back: the operators A of the keys and their
/// adjoints A*. All data stays on the device, which lends it to FFTs on the host.
#pragma once

#include <complex>
#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "cl/fft.hpp"
#include "cl/program.hpp"
#include "host/refine/light_passes.hpp"
#include "host/refine/phase_stack.hpp"
#include "host/refine/picture_grid.hpp"

namespace raywave::refinement {

/// The operators of a list of keys. Keys of one slot share a plane, which holds the light of the
/// one that was shown last.
class Light {
public:
  /// With FFTs of this back end: in passes over memory on the host, or by kernels around them.
  static std::unique_ptr<Light> make(const cl::Device& device, cl::FftBackend backend);
  virtual ~Light() = default;
  Light(const Light&) = delete;
  Light& operator=(const Light&) = delete;

  /// Takes other keys. Memory and transforms that fit are kept.
  ///
  /// throws  DeviceError when memory is out or the back end does not serve the sizes; InputError
  ///         where no light of the hologram reaches a picture
  void fit(const Optics& optics, std::vector<PictureGrid> grids);

  const PictureGrid& grid(std::size_t key) const { return grids_[key]; }
  /// Rows of grid.size.x samples. Right after `show` in the region and the blur's margin around it,
  /// as far as the plane goes.
  cl::ComplexBuffer& plane(std::size_t key) {
    return planes_[static_cast<std::size_t>(grids_[key].slot)];
  }
  /// Samples of the plane that `back` reads: they have to be zero outside the region. With FFTs on
  /// the host that is the region alone.
  virtual OpenPart read_back(std::size_t key) const = 0;

  /// Carries the hologram to the pupil's plane, where keys have a pupil: before they are shown.
  void enter_pupil(const PhaseStack& holograms, int frame);
  /// plane = A hologram, times the beam where the light on the SLM is not even; the hologram's
  /// conjugate, which shows the mirror image through z = 0, for pictures before it.
  virtual void show(const PhaseStack& holograms, int frame, std::size_t key) = 0;
  /// hologram = phase of (hologram [times the beam] + step A* plane), A being unitary but for the
  /// parts that aperture and region cut off. Of keys with a pupil, A* plane waits in the pupil's
  /// plane until leave_pupil.
  virtual void step(PhaseStack& holograms, int frame, std::size_t key, double step) = 0;
  void leave_pupil(PhaseStack& holograms, int frame, double step);

  /// The part of `step` that makes A* plane but for the chirp: rows of `back_pitch` samples. For
  /// tests.
  virtual const cl::ComplexBuffer& back(std::size_t key) = 0;
  int back_pitch(std::size_t key) const;
  /// The chirp that `show` multiplies with, in the open part: per column and per row.
  const std::vector<std::complex<float>>& column_chirp(std::size_t key) const {
    return tables_[key].columns;
  }
  const std::vector<std::complex<float>>& row_chirp(std::size_t key) const {
    return tables_[key].rows;
  }
  /// Factor from the plane to the values of a unitary transform.
  double unitary(std::size_t key) const;

  int transforms() const { return transforms_; }  // FFTs of planes since `fit`

protected:
  /// Of a key, or of the way to the pupil's plane.
  struct Tables {
    OpenPart open;                                   // part of the hologram that is taken
    std::vector<std::complex<float>> columns, rows;  // chirp before the first transform
    LightPath path;
  };

  explicit Light(const cl::Device& device) : device_(device) {}

  /// Plans transforms and makes room, when grids and tables are those of other keys.
  virtual void prepare() = 0;
  virtual void to_pupil(const PhaseStack& holograms, int frame) = 0;
  virtual void from_pupil(PhaseStack& holograms, int frame, double step) = 0;

  bool is(Propagation propagation, std::size_t key) const {
    return grids_[key].propagation == propagation;
  }
  std::uint32_t first_in_pupil(const Tables& t) const {
    return static_cast<std::uint32_t>(t.open.first.y * optics_.pupil_plane.x + t.open.first.x);
  }
  void make_room(cl::ComplexBuffer& plane, glm::ivec2 size, const char* what) const;

  cl::Device device_;
  Optics optics_;
  std::vector<PictureGrid> grids_;
  std::vector<Tables> tables_;
  std::vector<cl::ComplexBuffer> planes_;  // by slot
  // Light on pixels, in rows as of PhaseStack; one number where it is even
  std::vector<float> beam_;
  std::shared_ptr<const std::vector<float>> beam_of_;  // what it holds
  // The hologram's light in the pupil's plane, and what parts of it add; the hologram's tables.
  // Packets read beyond the last row's end
  cl::ComplexBuffer in_pupil_, added_in_pupil_;
  std::optional<Tables> of_pupil_;
  std::vector<float> disc_;  // what the pupil lets through of its plane
  int transforms_ = 0;

private:
  void take_beam();
  Tables tables_of(std::size_t key) const;
  LightLine line_of(const PictureGrid& grid, int axis) const;
  void fit_pupil(const Pupil& pupil);
};

std::unique_ptr<Light> make_light_on_host(const cl::Device& device);
std::unique_ptr<Light> make_light_on_device(const cl::Device& device, cl::FftBackend backend);

}  // namespace raywave::refinement
