// SPDX-License-Identifier: Apache-2.0
/// From a complex field to the grey levels of an SLM, on the device.
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <tuple>
#include <vector>

#include "cl/program.hpp"
#include "host/common/npy.hpp"
#include "host/encode/panel.hpp"
#include "host/plan/memory.hpp"
#include "host/propagate/tile_field.hpp"

namespace raywave {

/// A part of the SLM: its first column and row; its columns and rows.
struct PixelWindow {
  glm::ivec2 first{0, 0}, size{1, 1};
  bool operator==(const PixelWindow&) const = default;
};

/// Light of a field, and what is shown of it where its amplitudes end at a clip: sums of |u|^2.
struct ShownLight {
  double all = 0, shown = 0;

  ShownLight& operator+=(const ShownLight& more) {
    all += more.all;
    shown += more.shown;
    return *this;
  }
};

/// Grey levels of fields, by the SLM's encoding (docs/slm.md).
///
/// accuracy  a phase within 2e-7 turns of the middle between two levels may go to either; where
///           levels come from a table, within 1/8192 turn
class Encoder {
public:
  Encoder(const cl::Device& device, std::shared_ptr<const Panel> panel);

  const Panel& panel() const { return *panel_; }
  /// Takes another part of the same SLM.
  void set_part(std::shared_ptr<const Panel> part);

  /// True for encodings that show amplitudes.
  bool needs_clip() const { return panel_->slm().encoding != Encoding::phase; }
  /// The amplitude that the share slm.clip of a hologram's pixels does not exceed (of the lit ones
  /// where more than a fifth has less than 2 % of the largest amplitude), from at most
  /// 16,384 of them, or what show_up_to has set. 1 where the encoding does not need it, or the
  /// field is dark. Amplitudes are those over the beam's; `field` is then of the whole hologram.
  double clip_of(const TileField& field);
  double clip_of(std::span<const std::complex<float>> field);

  /// From now on, clip_of is this of all holograms, so that they share one scale; empty: of each by
  /// itself. Forgets own_clip.
  void show_up_to(std::optional<double> clip);
  /// The largest clip that a hologram had by itself since; 0: none had light.
  double own_clip() const { return own_clip_; }

  /// The light of the pixels.
  ///
  /// clip      as of levels_of; does not count where the encoding needs none
  /// accuracy  1e-6
  ShownLight light_of(const TileField& field, const PixelWindow& window, double clip);

  /// Frees the device's memory, which comes again when it is needed.
  void release();

  /// The grey levels on the device, valid until the next field is encoded into that buffer.
  ///
  /// field   of the window; of a transform, this is the last step of its propagation
  /// clip    of the whole hologram (clip_of): brighter pixels are shown as bright as this
  /// buffer  0 to buffers - 1: while one is copied to the host, the next field is encoded into
  ///         another
  /// throws  InputError when the SLM's levels have more bits than Level, or fit a byte and Level is
  ///         larger: std::uint8_t up to 8 bits, std::uint16_t beyond
  template <class Level = std::uint8_t>
  const cl::Buffer<Level>& levels_of(const TileField& field, const PixelWindow& window, double clip,
                                     std::size_t buffer = 0);
  static constexpr std::size_t buffers = level_buffers;

private:
  template <class Level>
  struct LevelBuffers {
    cl::Buffer<Level> table;
    std::array<cl::Buffer<Level>, level_buffers> levels;
  };

  /// The kernels for such a field.
  cl::Program& program_of(const TileField& field);
  /// Brings what each pixel of a window has of its own to the device: added phases, and the beam.
  void upload(const PixelWindow& window);
  bool knows_beam() const { return needs_clip() && !panel_->beam().empty(); }
  std::vector<float> amplitudes_of(const TileField& field);
  double clip_of_amplitudes(std::vector<float> amplitudes);

  cl::Device device_;
  std::shared_ptr<const Panel> panel_;
  std::array<std::optional<cl::Program>, 3> programs_;  // of fields, transforms, of two floats
  cl::Buffer<std::uint16_t> added_;
  cl::Buffer<float> beam_;              // over one
  PixelWindow window_{{0, 0}, {0, 0}};  // of both
  cl::Buffer<float> amplitudes_;
  cl::ComplexBuffer sums_;  // of light
  std::optional<double> clip_of_all_;
  double own_clip_ = 0;
  float least_lit_ = 0;  // over the clip: darker pixels have no phase of their own
  // The latter where levels have more than 8 bits
  std::tuple<LevelBuffers<std::uint8_t>, LevelBuffers<std::uint16_t>> level_buffers_;
};

/// The levels of holograms that the host holds, one picture per frame.
///
/// Level   std::uint8_t, or std::uint16_t where levels have more than 8 bits
/// field   of the panel's size
/// light   null, or where to put that of each frame
/// throws  InputError when it has another size, or the levels another type
template <class Level = std::uint8_t>
std::vector<std::vector<Level>> encode(const cl::Device& device, Encoder& encoder,
                                       const FieldStack& field,
                                       std::vector<ShownLight>* light = nullptr);

}  // namespace raywave
