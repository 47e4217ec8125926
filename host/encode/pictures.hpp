// SPDX-License-Identifier: Apache-2.0
/// The files that SLMs are sent, in the formats that their drivers read.
#pragma once

#include <array>
#include <complex>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "host/common/npy.hpp"
#include "host/encode/panel.hpp"

namespace raywave {

enum class PictureFormat {
  png,    // 8-bit grey
  png16,  // 16-bit grey, the level's bits repeated so that white is white: 257 times 8-bit levels
  bmp,    // 8-bit grey
  tiff,   // 8-bit grey
  exr,    // the field that was encoded, not the levels: R its real, G its imaginary part
  npy,    // uint8 levels, (frames, ny, nx)
  mat,    // the field that was encoded, as MATLAB's matrix dh, (ny, nx); where libmatio was found
  // Frames of few levels in the bits of 8-bit RGB PNGs, that DMDs and fast SLMs show one after
  // another. Frame 0 takes the lowest bits of red, the last one the highest of blue; bits are 0 for
  // the lowest level, 1 for the next ...
  rgb_24x1,
  rgb_12x2,
  rgb_8x3,
  rgb_6x4,
  // 10-bit levels in 8-bit RGB PNGs: red the upper 8 bits, blue the lower 2
  red_blue
};

/// "png|png16|bmp|..."
std::string picture_format_names();

/// throws  InputError for a name that is none
PictureFormat picture_format_of(const std::string& name);
const char* name_of(PictureFormat format);

/// True when reconstruct reads the pictures again.
constexpr bool is_read_again(PictureFormat format) {
  return format == PictureFormat::png || format == PictureFormat::png16 ||
         format == PictureFormat::bmp || format == PictureFormat::tiff;
}

/// Frames of the panel that a picture holds.
int frames_each(PictureFormat format);

/// A field as matrix `dh` of a MATLAB 5 file.
///
/// throws  InputError when it cannot be written, or raywave was built without libmatio
void save_mat(const std::filesystem::path& file, int nx, int ny,
              std::span<const std::complex<float>> field);

/// The pictures of three lasers as one, whose channel of the longest wavelength is red, of the
/// shortest blue.
std::vector<std::uint8_t> packed_rgb(const std::array<LevelPicture, 3>& pictures,
                                     const std::array<double, 3>& wavelengths_m);

/// Writes the frames as STEM.png, STEM_2.png ..., turned and flipped as the SLM wants them; the
/// field of `exr` and `mat` is not, as other programs encode it themselves.
///
/// levels   one picture per frame, of the panel's size: std::uint8_t or std::uint16_t (encode)
/// field    that they show, for `exr` and `mat`
/// returns  the files' names
/// throws   InputError when a file cannot be written, or the SLM has more levels than the format
template <class Level>
std::vector<std::string> save_pictures(const std::filesystem::path& folder, const std::string& stem,
                                       PictureFormat format, const Panel& panel,
                                       const std::vector<std::vector<Level>>& levels,
                                       const FieldStack& field);

}  // namespace raywave
