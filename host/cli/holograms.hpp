// SPDX-License-Identifier: Apache-2.0
/// The holograms that commands look at or encode again, and the SLM that they are for.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "host/cli/options.hpp"
#include "host/common/npy.hpp"
#include "host/encode/pictures.hpp"
#include "host/evaluate/report.hpp"
#include "host/render.hpp"
#include "host/scene/scene.hpp"
#include "host/scene/slm.hpp"

namespace raywave::cli {

/// --pitch, --wavelength and --slm: what a hologram in a file is made for. What is not given comes
/// from report.json beside the hologram.
struct PixelOptions {
  std::string pitch, wavelength, slm;

  void add_to(CLI::App& command);
  bool any() const { return !pitch.empty() || !wavelength.empty() || !slm.empty(); }
  HologramSpec spec(const std::filesystem::path& hologram, glm::ivec2 size_px) const;
  /// Without --slm and report: an SLM of 256 levels to a turn.
  ///
  /// set        keys of the file of --slm that are changed
  /// most_bits  of a grey level: more are refused
  SlmSpec slm_spec(const std::filesystem::path& hologram, const std::vector<std::string>& set,
                   int most_bits = 8) const;
};

/// HOLOGRAM..., PixelOptions and --set.
struct HologramOptions {
  std::vector<std::string> files, set;
  PixelOptions pixels;

  /// what  of the files, for the help
  void add_to(CLI::App& command, const std::string& what);

  HologramSpec spec(glm::ivec2 size_px) const { return pixels.spec(files.at(0), size_px); }
  /// From report.json beside it; without an eyepiece where there is none.
  ViewerSpec viewer() const;
  SlmSpec slm_spec() const { return pixels.slm_spec(files.at(0), set, 10); }

  /// The complex field of a .npy file; or what an SLM shows of pictures, one frame each. A
  /// report.json stands for the pictures that were rendered with it.
  FieldStack load() const;
};

/// The holograms of the lasers that a report.json tells of; of other files, those of one laser.
struct LaserHolograms {
  std::optional<ReportedLasers> lasers;
  std::vector<HologramOptions> each;

  /// fields  of a report, the fields instead of the pictures, or the phases that were refined
  /// throws  InputError when they were not kept, or are of another render
  LaserHolograms(const HologramOptions& options, bool fields);
};

/// A render that is read again from its report: the scenes as they were planned, and the levels and
/// fields in the files beside it. Plans are left empty, and so are the samples of fields that were
/// not kept.
struct FinishedRender {
  std::vector<Scene> scenes;
  Rendered rendered;
  Json report;

  /// throws  InputError where the scene was changed since, or a file is missing or another's
  explicit FinishedRender(const std::filesystem::path& file);
};

/// Whether a file is the report of a hologram in tiles.
bool is_of_tiles(const std::filesystem::path& report);

/// The grey levels of a picture, as render and encode write them, in the hologram's frame: turned
/// and flipped back.
///
/// Level   std::uint8_t, or std::uint16_t where levels have more than 8 bits
/// throws  InputError when it is no grey picture of 8 or 16 bits
template <class Level = std::uint8_t>
std::vector<Level> load_hologram_levels(const std::filesystem::path& file, const SlmSpec& slm,
                                        glm::ivec2* size_px);

/// "hologram.png", "hologram_2.png" ...: of frames from 0 on.
std::string name_of_frame(std::size_t number, const std::string& stem = "hologram");

/// The names of the pictures that a report of one wavelength was written beside.
std::vector<std::string> picture_names(const nlohmann::json& report);

/// The report.json beside pictures that were not rendered: what reconstruct and encode need to know
/// of them.
Json encoded_report(const HologramSpec& hologram, const SlmSpec& slm, int frames,
                    PictureFormat format, const std::vector<std::string>& pictures);

/// The same of holograms that are numbered, of an animation or of tiles, which no list names.
Json numbered_report(const HologramSpec& hologram, const SlmSpec& slm, const ViewerSpec& viewer,
                     int frames);

/// Saves the levels of frame `number` (from 0) as STEM.png, STEM_2.png ..., turned and flipped as
/// the SLM wants them. Returns the file's name.
std::string save_hologram(const std::filesystem::path& folder, std::size_t number,
                          const SlmSpec& slm, glm::ivec2 size_px,
                          const std::vector<std::uint8_t>& levels, const std::string& stem);

}  // namespace raywave::cli
