// SPDX-License-Identifier: Apache-2.0
#include "host/cli/hologram_part.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <glm/common.hpp>
#include <glm/vec2.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "host/animate/frame_files.hpp"
#include "host/common/cache.hpp"
#include "host/common/error.hpp"
#include "host/common/json.hpp"
#include "host/common/text.hpp"
#include "host/encode/panel.hpp"
#include "host/encode/shown.hpp"
#include "host/view/reconstruct.hpp"

namespace raywave::cli {
namespace {

/// Of all frames of a light field and its levels; pictures of it take several times as much.
constexpr double most_pixels = 1 << 28;

/// First pixel along a side that lets light through, and the one after the last.
std::pair<int, int> pixels_along(int n, double centre, double size) {
  int first = 0, end = n;
  while (first < n && !lets_through(first, n, centre, size)) ++first;
  while (end > first && !lets_through(end - 1, n, centre, size)) --end;
  return {first, end};
}

/// Whether tiles that begin at these pixels of a side cover it from end to end.
bool cover(const std::vector<int>& firsts, int tile_px, int side_px) {
  std::int64_t end = 0;
  for (const int first : firsts) {
    if (first < 0 || first > end || tile_px < 1) return false;
    end = std::int64_t{first} + tile_px;
  }
  return end == side_px;
}

/// Ranges of numbers as --tiles takes them: "3..7, 12".
std::string ranges_text(const std::vector<int>& numbers) {
  std::string text;
  for (std::size_t i = 0; i < numbers.size();) {
    std::size_t end = i + 1;
    while (end < numbers.size() && numbers[end] == numbers[end - 1] + 1) ++end;
    text += (text.empty() ? "" : ", ") + std::to_string(numbers[i]);
    if (end > i + 1) text += ".." + std::to_string(numbers[end - 1]);
    i = end;
  }
  return text;
}

/// Copies what a tile has of a part.
///
/// at  of the tile's first pixel from the part's
void copy(const std::vector<std::uint8_t>& tile, glm::ivec2 tile_size, glm::ivec2 at,
          std::vector<std::uint8_t>& part, glm::ivec2 part_size) {
  const auto first = glm::max(at, 0), end = glm::min(at + tile_size, part_size);
  for (int y = first.y; y < end.y; ++y)
    std::copy_n(&tile[static_cast<std::size_t>(y - at.y) * static_cast<std::size_t>(tile_size.x) +
                      static_cast<std::size_t>(first.x - at.x)],
                end.x - first.x,
                &part[static_cast<std::size_t>(y) * static_cast<std::size_t>(part_size.x) +
                      static_cast<std::size_t>(first.x)]);
}

}  // namespace

HologramPart load_part(const HologramOptions& options, glm::dvec2 view, glm::dvec2 aperture) {
  const std::filesystem::path report(options.files.at(0));
  const auto name = one_line(report.string());
  HologramPart part;
  part.spec = hologram_of_report(report);
  const auto whole = part.spec.resolution;
  const auto slm = options.slm_spec();
  // Rows are counted downwards
  const auto [left, right] = pixels_along(whole.x, view.x, aperture.x);
  const auto [top, bottom] = pixels_along(whole.y, -view.y, aperture.y);
  const glm::ivec2 first(left, top), size = glm::ivec2(right, bottom) - first;
  if (size.x <= 0 || size.y <= 0)
    throw InputError("--view, --aperture: no pixel of the hologram lies in this part");
  try {
    std::ifstream in(report);
    const auto json = Json::parse(in);
    const auto& tiles = json.at("tiles");
    const auto columns = tiles.at("columns_px").get<std::vector<int>>(),
               rows = tiles.at("rows_px").get<std::vector<int>>();
    const glm::ivec2 tile_size(tiles.at("size_px").at(0).get<int>(),
                               tiles.at("size_px").at(1).get<int>());
    const int frames = json.at("scene").at("sampling").at("frames");
    if (!cover(columns, tile_size.x, whole.x) || !cover(rows, tile_size.y, whole.y) || frames < 1)
      throw InputError(name + ": its tiles do not make up its hologram; the report is damaged");
    if (1.0 * frames * size.x * size.y > most_pixels)
      throw InputError(
          name + ": this part of the hologram has " + std::to_string(size.x) + " x " +
          std::to_string(size.y) + " pixels in " + std::to_string(frames) + " frames, more than " +
          std::to_string(static_cast<int>(most_pixels)) +
          ", which can be looked at together; give --aperture a smaller one (a --pupil "
          "does not tell which tiles to read)");
    const auto digests = FrameFiles::digests(report.parent_path());
    std::vector<std::vector<std::uint8_t>> levels(
        static_cast<std::size_t>(frames),
        std::vector<std::uint8_t>(static_cast<std::size_t>(size.x) *
                                  static_cast<std::size_t>(size.y)));
    std::vector<int> missing;
    const auto meets = [&](int at, int axis) {
      return at < first[axis] + size[axis] && at + tile_size[axis] > first[axis];
    };
    int tile = -1;
    for (const int y : rows)
      for (const int x : columns) {
        ++tile;
        if (!meets(x, 0) || !meets(y, 1)) continue;
        for (std::size_t frame = 0; frame < levels.size(); ++frame) {
          const auto file = FrameFiles::tile_name(tile * static_cast<int>(levels.size()) +
                                                  static_cast<int>(frame));
          const auto place = report.parent_path() / file;
          const auto known = digests.find(file);
          if (known == digests.end() || digest_of_file(place) != known->second) {
            missing.push_back(tile);
            break;
          }
          if (!missing.empty()) break;
          glm::ivec2 size_px;
          const auto of_tile = load_hologram_levels(place, slm, &size_px);
          if (size_px != tile_size) throw InputError(one_line(place.string()) + ": is no tile");
          copy(of_tile, tile_size, glm::ivec2(x, y) - first, levels[frame], size);
        }
      }
    if (!missing.empty())
      throw InputError(name +
                       ": tiles of this part are missing or damaged: " + ranges_text(missing) +
                       "; the command that made the others makes them, with --tiles");
    part.spec.resolution = size;
    part.field = shown_field(
        Panel(slm, size, part.spec.pitch_m, part.spec.wavelength_m, PanelPart{whole, first}),
        levels);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(name + ": not a report of raywave: " + json_reason(error));
  }
  const auto middle = glm::dvec2(first) + glm::dvec2(size) / 2.0 - glm::dvec2(whole) / 2.0;
  part.centre_m = glm::dvec2(middle.x, -middle.y) * part.spec.pitch_m;
  return part;
}

}  // namespace raywave::cli
