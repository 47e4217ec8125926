// SPDX-License-Identifier: Apache-2.0
/// A hologram's picture against that of a lens.
#pragma once

#include "host/reference/surfaces.hpp"
#include "host/render.hpp"
#include "host/trace/device_scene.hpp"
#include "host/view/compare.hpp"
#include "host/view/lens.hpp"
#include "host/view/reconstruct.hpp"

namespace raywave::test {

/// PSNR in dB of a field's reconstruction in a plane, against the picture of a lens that has this
/// plane, or another, in focus. Both are blurred by 3 pixels.
///
/// shown      of the stage, with its field
/// border_px  left out on all sides
inline double psnr_db_of_shown(const cl::Device& device, const reference::Stage& stage,
                               const RenderResult& shown, double lens_z_m, double shown_z_m,
                               int border_px) {
  const DeviceScene arrays(device, stage.world, shown.plan);
  LensSpec lens{.z_m = lens_z_m, .points = 10};
  ReconstructSpec what{.z_m = shown_z_m};
  PictureOptions options{.blur_px = 3, .border_px = border_px};
  return compare_pictures(
             lens_picture(device, shown.plan, arrays, lens),
             reconstruct(device, cl::FftBackend::host, shown.field, stage.scene.hologram, what),
             options)
      .psnr_db;
}

}  // namespace raywave::test
