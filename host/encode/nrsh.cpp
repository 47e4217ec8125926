// SPDX-License-Identifier: Apache-2.0
#include "host/encode/nrsh.hpp"

#include <utility>

#include "host/common/text.hpp"

namespace raywave {

std::string nrsh_configuration(const HologramSpec& hologram, const std::string& name) {
  const auto [size, pitch_m] = std::pair(hologram.resolution, hologram.pitch_m);
  auto text = text_stream();
  text.precision(12);
  text << "# Written by raywave. load('hologram.mat'); nrsh(dh, DEPTH_IN_METRES, "
          "getSettings('cfg_file', '"
       << name << "'))\n"
       << "#RECONSTRUCTION PARAMETERS#\n"
       << "wlen            : " << hologram.wavelength_m << "\n"
       << "pixel_pitch     : " << pitch_m.x;
  if (pitch_m.y != pitch_m.x) text << ", " << pitch_m.y;
  // NRSH pads by half of the size, and stops with an error where that is no whole number.
  text << "\n"
       << "method          : ASM\n"
       << "zero_pad        : " << (size.x % 2 == 0 && size.y % 2 == 0 ? 1 : 0) << "\n"
       << "apod            : 0\n\n"
       << "#ENHANCEMENT PARAMETERS#\n"
       << "perc_clip       : 0\n"
       << "perc_value      : 100\n"
       << "hist_stretch    : 0\n\n"
       << "#OUTPUT FILE OPTIONS#\n"
       << "save_as_mat     : 0\n"
       << "show            : 0\n"
       << "save_as_image   : 1\n"
       << "bit_depth       : 16\n"
       << "save_intensity  : 0\n";
  return text.str();
}

}  // namespace raywave
