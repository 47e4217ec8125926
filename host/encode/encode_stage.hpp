// SPDX-License-Identifier: Apache-2.0
/// The stage "encode": from the fields at the hologram to the SLM's grey levels, on the host.
#pragma once

#include <array>
#include <complex>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "host/common/npy.hpp"
#include "host/common/stage_clock.hpp"
#include "host/encode/encode.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

/// Brings a field from the units that a device computes in to the scene's own: |u|^2 is then the
/// irradiance of the scene's radiance (docs/conventions.md#brightness).
///
/// radiance_unit  DeviceScene::radiance_unit
/// throws  InputError when the field is then brighter than a float holds
void brighten(std::span<std::complex<float>> field, double radiance_unit, const Plan& plan);

/// The results grow on the host tile by tile and frame by frame: the grey levels of one frame are
/// copied while the next frame is computed. An encoding that looks at the whole hologram
/// (encodes_whole) waits for all its tiles: their fields are kept on the host until `run_waiting`.
class EncodeStage {
public:
  struct Options {
    bool keep_field = true;    // also copy the complex fields to the host
    bool count_light = false;  // `light` is wanted
    bool share_clip = false;   // show_up_to comes, where no clip is given to `prepare`
    bool field_stays = false;  // on the device until then, of the last tile and frame
  };

  EncodeStage(const cl::Device& device, Options options, StageTimes& times);

  /// Takes the host's memory for a picture.
  ///
  /// plan  must outlive the picture
  /// clip  of all its holograms (Encoder::show_up_to), in the device's units of amplitude
  /// tile  only this one is encoded, by itself: results are as large as it
  void prepare(const Plan& plan, std::optional<double> clip = {},
               std::optional<std::size_t> tile = {});

  /// Encodes the field of one tile of one frame and begins to copy it; keeps the field where it is
  /// asked for.
  ///
  /// field  a transform only where `encodes_transforms` says so
  void run(const TileField& field, std::size_t tile, int frame);
  /// Encodes a frame of the whole hologram, rows without gaps.
  void run_whole(const cl::ComplexBuffer& hologram, int frame);

  /// Encodes the field that waited until it was whole (encodes_whole).
  void run_waiting();
  /// Encodes the picture anew, where the encoding shows amplitudes.
  ///
  /// clip           of all frames and lasers, in the scene's units of amplitude
  /// radiance_unit  DeviceScene::radiance_unit
  void show_up_to(double clip, double radiance_unit);
  /// Frees the device's memory until the next picture, or show_up_to.
  void release();
  /// Waits for the copies and completes the picture: `levels`, `light` and `field` may be taken
  /// then.
  void finish(double radiance_unit);
  /// True when the picture that was completed shows nothing. Where no field is kept, an SLM with
  /// flatness or a carrier hides it.
  bool is_dark() const { return is_dark_; }
  /// Encoder::own_clip of the picture, in the device's units.
  double own_clip() const { return encoder_->own_clip(); }

  // At the hologram, one per frame: when asked for, and where the encoding needs it (encodes_whole)
  FieldStack field;
  std::vector<std::vector<std::uint8_t>> levels;  // of the SLM, one per frame
  std::vector<ShownLight> light;                  // of each frame, when asked for
  std::shared_ptr<const Panel> panel() const { return panel_; }

private:
  bool looks_dark() const;
  /// Fields wait on the host until the hologram is whole; refined phases are encoded frame by
  /// frame, and a tile that is alone by itself.
  bool encodes_at_end() const { return encodes_whole(*plan_) && !plan_->refine && !tile_; }
  /// Where a tile lies in the results.
  PixelWindow window_of(std::size_t tile) const;
  /// Encodes a window of a frame and begins to copy it.
  void encode_window(const TileField& field, const PixelWindow& window, std::size_t frame);
  void encode_field();
  void brighten_field(double radiance_unit);
  void count_light(const TileField& field, const PixelWindow& window, std::size_t frame,
                   double clip);
  /// Begins to copy the pixels of a window to their places in the hologram.
  template <class T>
  cl::Copy start_reading(const cl::Buffer<T>& from, const PixelWindow& window,
                         std::span<T> hologram) const;

  cl::Device device_;
  Options options_;
  bool is_dark_ = false, has_light_ = false;
  bool is_bright_ = false;         // `field` is in the scene's units, and `light`
  bool needs_field_ = false;       // kept, or encoded when it is whole, or anew
  std::optional<TileField> last_;  // what show_up_to encodes; none: the whole field
  StageTimes& times_;
  const Plan* plan_ = nullptr;
  std::optional<std::size_t> tile_;  // the only one
  std::shared_ptr<const Panel> panel_;
  std::optional<Encoder> encoder_;  // from the first plan on: the SLM stays
  // After the results, which they write into, so that they end before them.
  std::array<cl::Copy, Encoder::buffers> copies_;
  std::size_t encoded_ = 0;
};

}  // namespace raywave
