// SPDX-License-Identifier: Apache-2.0
#include "host/encode/pictures.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <set>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/scene/image.hpp"

namespace raywave {
namespace {

/// A row of each PictureFormat, in their order.
struct Format {
  const char* name;
  const char* extension = ".png";
  int packed_bits = 0;  // of a frame in a RGB picture; 0: not packed
};
constexpr std::array<Format, 12> formats{{{"png"},
                                          {"png16"},
                                          {"bmp", ".bmp"},
                                          {"tiff", ".tif"},
                                          {"exr", ".exr"},
                                          {"npy", ".npy"},
                                          {"mat", ".mat"},
                                          {"rgb-24x1", ".png", 1},
                                          {"rgb-12x2", ".png", 2},
                                          {"rgb-8x3", ".png", 3},
                                          {"rgb-6x4", ".png", 4},
                                          {"red-blue"}}};
static_assert(static_cast<std::size_t>(PictureFormat::red_blue) + 1 == formats.size());

const Format& row_of(PictureFormat format) { return formats[static_cast<std::size_t>(format)]; }

std::string name_of_file(const std::string& stem, std::size_t number, PictureFormat format) {
  return stem + (number == 0 ? "" : "_" + std::to_string(number + 1)) + row_of(format).extension;
}

/// The levels that an encoder sends, from the lowest on; empty where it sends all.
std::vector<std::uint16_t> sent_levels(const Panel& panel) {
  if (panel.slm().encoding == Encoding::lee) return {0, 255};
  const std::set<std::uint16_t> levels(panel.level_table().begin(), panel.level_table().end());
  return {levels.begin(), levels.end()};
}

/// RGB pictures of 24 / bits frames each; frames that are missing from the last one are 0.
std::vector<std::vector<std::uint8_t>> packed(const Panel& panel, PictureFormat format,
                                              const std::vector<LevelPicture>& frames) {
  const int bits = row_of(format).packed_bits;
  const auto sent = sent_levels(panel);
  const std::size_t most = std::size_t{1} << bits;
  if (sent.empty() || sent.size() > most)
    throw InputError(std::string("--format ") + name_of(format) + " takes pictures of at most " +
                     std::to_string(most) + " levels, and slm.levels is " +
                     std::to_string(panel.slm().levels) +
                     "; give slm.levels = " + std::to_string(most));
  std::array<std::uint32_t, 256> rank{};
  for (std::uint32_t i = 0; i < sent.size(); ++i) rank[sent[i]] = i;

  const auto each = static_cast<std::size_t>(frames_each(format));
  std::vector<std::vector<std::uint8_t>> pictures;
  for (std::size_t first = 0; first < frames.size(); first += each) {
    std::vector<std::uint32_t> colours(frames[0].levels.size());
    for (std::size_t k = first; k < std::min(first + each, frames.size()); ++k)
      for (std::size_t i = 0; i < colours.size(); ++i)
        colours[i] |= rank[frames[k].levels[i]] << (static_cast<std::size_t>(bits) * (k - first));
    auto& picture = pictures.emplace_back();
    picture.reserve(3 * colours.size());
    for (const std::uint32_t colour : colours)
      for (const int shift : {0, 8, 16})
        picture.push_back(static_cast<std::uint8_t>(colour >> shift & 0xff));
  }
  return pictures;
}

/// throws  InputError when the format has not as many bits as the levels
void require_bits(PictureFormat format, int bits) {
  const bool holds_ten = format == PictureFormat::png16 || format == PictureFormat::npy ||
                         format == PictureFormat::red_blue;
  const bool holds_eight = format != PictureFormat::red_blue;
  if (bits > 8 ? holds_ten : holds_eight) return;
  throw InputError(std::string("--format ") + name_of(format) + " takes levels of " +
                   (holds_ten ? "10" : "8") + " bits, and slm.bits is " + std::to_string(bits) +
                   (holds_ten ? "; give slm.bits = 10" : "; give --format png16, npy or red-blue"));
}

/// Pixels of 16 bits: the upper bits are the level, which is repeated below them.
template <class Level>
std::vector<std::uint16_t> as_16_bits(const std::vector<Level>& levels, int bits) {
  std::vector<std::uint16_t> pixels;
  pixels.reserve(levels.size());
  for (const std::uint32_t level : levels)
    pixels.push_back(static_cast<std::uint16_t>(level << (16 - bits) | level >> (2 * bits - 16)));
  return pixels;
}

/// source  OpenWFS, devices/slm/texture.py, convert_floatdata_to_10b_rb (pull request 73), for HDMI
///         SLMs of Meadowlark
template <class Level>
std::vector<std::uint8_t> as_red_and_blue(const std::vector<Level>& levels) {
  std::vector<std::uint8_t> pixels;
  pixels.reserve(3 * levels.size());
  for (const std::uint32_t level : levels)
    for (const std::uint32_t channel : {level >> 2, 0u, level & 3})
      pixels.push_back(static_cast<std::uint8_t>(channel & 0xff));
  return pixels;
}

}  // namespace

std::string picture_format_names() {
  std::string names;
  for (const auto& format : formats) names += (names.empty() ? "" : "|") + std::string(format.name);
  return names;
}

PictureFormat picture_format_of(const std::string& name) {
  for (std::size_t i = 0; i < formats.size(); ++i)
    if (name == formats[i].name) return static_cast<PictureFormat>(i);
  if (name == "rgb-8x4")
    throw InputError(
        "--format rgb-8x4: 8 frames of 4 bits take 32 bits, and a RGB picture has 24; there are "
        "rgb-6x4 and rgb-8x3");
  std::string names = picture_format_names();
  for (std::size_t at; (at = names.find('|')) != std::string::npos;) names.replace(at, 1, ", ");
  throw InputError("--format " + one_line(name) + ": unknown; there are " + names);
}

int frames_each(PictureFormat format) {
  const int bits = row_of(format).packed_bits;
  return bits > 0 ? 24 / bits : 1;
}

const char* name_of(PictureFormat format) { return row_of(format).name; }

std::vector<std::uint8_t> packed_rgb(const std::array<LevelPicture, 3>& pictures,
                                     const std::array<double, 3>& wavelengths_m) {
  std::array<std::size_t, 3> order{0, 1, 2};
  std::ranges::sort(order, std::greater<>(), [&](std::size_t i) { return wavelengths_m[i]; });
  std::vector<std::uint8_t> pixels;
  for (std::size_t at = 0; at < pictures[0].levels.size(); ++at)
    for (const auto laser : order) pixels.push_back(pictures[laser].levels[at]);
  return pixels;
}

template <class Level>
std::vector<std::string> save_pictures(const std::filesystem::path& folder, const std::string& stem,
                                       PictureFormat format, const Panel& panel,
                                       const std::vector<std::vector<Level>>& levels,
                                       const FieldStack& field) {
  std::vector<std::string> written;
  const auto next_file = [&] {
    written.push_back(name_of_file(stem, written.size(), format));
    return folder / written.back();
  };
  if (format == PictureFormat::exr || format == PictureFormat::mat) {
    const auto pixels = std::size_t{1} * field.nx * field.ny;
    for (std::size_t frame = 0; frame < static_cast<std::size_t>(field.frames); ++frame) {
      const auto samples = std::span(field.samples).subspan(frame * pixels, pixels);
      format == PictureFormat::mat ? save_mat(next_file(), field.nx, field.ny, samples)
                                   : save_picture(next_file(), field.nx, field.ny, samples);
    }
    return written;
  }

  const int bits = panel.slm().bits;
  require_bits(format, bits);
  std::vector<LevelPictureOf<Level>> frames;
  for (const auto& frame : levels)
    frames.push_back(for_slm(LevelPictureOf<Level>{panel.size_px(), frame}, panel.slm()));
  const auto size = frames.at(0).size_px;
  if (format == PictureFormat::npy) {
    std::vector<Level> all;
    for (const auto& frame : frames)
      all.insert(all.end(), frame.levels.begin(), frame.levels.end());
    save_npy(next_file(), size.x, size.y, static_cast<int>(frames.size()), std::span(all));
  } else if (format == PictureFormat::png16) {
    for (const auto& frame : frames)
      save_picture(next_file(), size.x, size.y, as_16_bits(frame.levels, bits));
  } else if (format == PictureFormat::red_blue) {
    for (const auto& frame : frames)
      save_picture(next_file(), size.x, size.y, as_red_and_blue(frame.levels));
  } else if constexpr (sizeof(Level) == 1) {
    if (row_of(format).packed_bits > 0) {
      for (const auto& picture : packed(panel, format, frames))
        save_picture(next_file(), size.x, size.y, picture);
    } else {
      for (const auto& frame : frames) save_picture(next_file(), size.x, size.y, frame.levels);
    }
  }
  return written;
}

template std::vector<std::string> save_pictures(const std::filesystem::path&, const std::string&,
                                                PictureFormat, const Panel&,
                                                const std::vector<std::vector<std::uint8_t>>&,
                                                const FieldStack&);
template std::vector<std::string> save_pictures(const std::filesystem::path&, const std::string&,
                                                PictureFormat, const Panel&,
                                                const std::vector<std::vector<std::uint16_t>>&,
                                                const FieldStack&);

}  // namespace raywave
