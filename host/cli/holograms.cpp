// SPDX-License-Identifier: Apache-2.0
#include "host/cli/holograms.hpp"

#include <cmath>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "host/cli/help.hpp"
#include "host/cli/output_set.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/encode/pictures.hpp"
#include "host/encode/shown.hpp"
#include "host/evaluate/report.hpp"
#include "host/scene/image.hpp"
#include "host/scene/read_slm.hpp"
#include "host/scene/scene_json.hpp"
#include "host/scene/scene_text.hpp"

namespace raywave::cli {

bool is_of_tiles(const std::filesystem::path& report) {
  if (extension_of(report) != ".json") return false;  // nothing is read of pipes
  const auto json = read_report(report);
  return json.is_object() && json.contains("tiles");
}

namespace {

/// throws  InputError for the report of a hologram in tiles
void refuse_tiles(const std::filesystem::path& report) {
  if (is_of_tiles(report))
    throw InputError(one_line(report.string()) +
                     ": is of a hologram in tiles; reconstruct shows parts of it (--view, "
                     "--aperture)");
}

/// The pictures that a report was written beside.
std::vector<std::filesystem::path> pictures_of(const std::filesystem::path& report) {
  std::ifstream in(report);
  if (!in) throw InputError(one_line(report.string()) + ": cannot be read");
  std::vector<std::filesystem::path> files;
  try {
    const auto json = nlohmann::json::parse(in);
    if (json.contains("colour"))
      throw InputError(one_line(report.string()) +
                       ": is of several lasers, and this takes one: give hologram_638nm.png or the "
                       "like");
    if (json.contains("animation"))
      throw InputError(one_line(report.string()) +
                       ": is of an animation; give holograms of one picture, such as "
                       "frame_00000.png");
    refuse_tiles(report);
    if (json.contains("format")) {  // of encode and pattern
      const auto format = picture_format_of(json.at("format").get<std::string>());
      if (!is_read_again(format))
        throw InputError(one_line(report.string()) + ": its pictures have the format " +
                         name_of(format) +
                         ", which is not read again; encode with --format png, or give field.npy");
    }
    for (const auto& name : picture_names(json))
      files.push_back(report.parent_path() / std::filesystem::path(name).filename());
    require_of_report(report, json, files);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(one_line(report.string()) +
                     ": not a report of raywave: " + json_reason(error));
  }
  return files;
}

/// Says a note of an SLM, which is read for each laser.
void say_once(const std::string& note) {
  static std::set<std::string> said;
  if (said.insert(note).second) std::fprintf(stderr, "raywave: %s\n", note.c_str());
}

}  // namespace

std::string name_of_frame(std::size_t number, const std::string& stem) {
  return stem + (number == 0 ? "" : "_" + std::to_string(number + 1)) + ".png";
}

std::vector<std::string> picture_names(const nlohmann::json& report) {
  if (report.contains("pictures")) return report.at("pictures").get<std::vector<std::string>>();
  const int frames = report.at("scene").at("sampling").at("frames");
  std::vector<std::string> names;
  for (int frame = 0; frame < frames; ++frame)
    names.push_back(name_of_frame(static_cast<std::size_t>(frame)));
  return names;
}

void PixelOptions::add_to(CLI::App& command) {
  option(command, "--pitch", pitch, "LENGTH", group::pictures,
         "Pixel pitch (one, or x,y); from report.json beside the hologram when not given");
  option(command, "--wavelength", wavelength, "LENGTH", group::pictures,
         "Wavelength; from report.json beside the hologram when not given");
  option(command, "--slm", slm, "SCENE", group::pictures,
         "File with section [slm]; from report.json beside the hologram when not given");
}

HologramSpec PixelOptions::spec(const std::filesystem::path& hologram, glm::ivec2 size_px) const {
  HologramSpec spec;
  if (pitch.empty() || wavelength.empty())
    spec = hologram_of_report(hologram.parent_path() / "report.json", hologram);
  if (!pitch.empty()) spec.pitch_m = given_pitch_m(pitch);
  if (!wavelength.empty()) spec.wavelength_m = given_wavelength_m(wavelength);
  spec.resolution = size_px;
  return spec;
}

SlmSpec PixelOptions::slm_spec(const std::filesystem::path& hologram,
                               const std::vector<std::string>& set, int most_bits) const {
  const auto report = hologram.parent_path() / "report.json";
  SlmSpec spec;
  spec.encoding = Encoding::phase;
  std::error_code error;
  const auto wavelength_m = [&] {
    return wavelength.empty() ? hologram_of_report(report, hologram).wavelength_m
                              : given_wavelength_m(wavelength);
  };
  if (!slm.empty()) {
    spec = load_slm(slm, wavelength_m(), set);
    // What was rendered for another encoding would show ghosts, or less than it could
    if (spec.encoding == Encoding::automatic && (pitch.empty() || wavelength.empty()))
      spec.encoding = slm_of_report(report, hologram).encoding;
  } else {
    if (std::filesystem::exists(report, error)) spec = slm_of_report(report, hologram);
    if (!set.empty()) spec = parse_slm({"", report, {}}, wavelength_m(), set, spec);
  }
  for (const auto& note : spec.notes) say_once(note);
  if (most_bits == 8) require_level_bytes(spec, 1);
  return spec;
}

void HologramOptions::add_to(CLI::App& command, const std::string& what) {
  argument(command, "HOLOGRAM", files, "FILE", what)->required();
  pixels.add_to(command);
}

ViewerSpec HologramOptions::viewer() const {
  const std::filesystem::path first(files.at(0));
  return viewer_of_report(first.parent_path() / "report.json", first);
}

namespace {

/// Pictures of one call are frames of one hologram, whose light adds up.
///
/// throws  InputError where the report beside both says that they are for two lasers
void require_one_laser(const PixelOptions& pixels, const std::filesystem::path& first,
                       const std::filesystem::path& file) {
  if (file == first || file.parent_path() != first.parent_path()) return;
  const double wanted_m = pixels.spec(first, {1, 1}).wavelength_m,
               wavelength_m = pixels.spec(file, {1, 1}).wavelength_m;
  if (wavelength_m != wanted_m)
    throw InputError(one_line(file.string()) + ": is for " + length_text(wavelength_m) + ", and " +
                     one_line(first.filename().string()) + " for " + length_text(wanted_m) +
                     "; give the pictures of one laser, or the report.json of a render");
}

}  // namespace

FieldStack HologramOptions::load() const {
  const std::filesystem::path first(files.at(0));
  if (extension_of(first) == ".npy") {
    if (files.size() > 1)
      throw InputError("holograms: one field (.npy) at a time can be given; run raywave for each");
    return load_npy(first);
  }
  std::vector<std::filesystem::path> pictures(files.begin(), files.end());
  if (extension_of(first) == ".json") {
    if (files.size() > 1)
      throw InputError(
          "holograms: one report (.json) at a time can be given; run raywave for each");
    pictures = pictures_of(first);
  }
  const auto slm = slm_spec();
  const auto shown_by = [&]<class Level>(const Level&) {
    glm::ivec2 size(0);
    std::vector<std::vector<Level>> frames;
    for (const auto& file : pictures) {
      require_one_laser(pixels, pictures.front(), file);
      glm::ivec2 size_here;
      frames.push_back(load_hologram_levels<Level>(file, slm, &size_here));
      if (frames.size() == 1) size = size_here;
      if (size_here != size)
        throw InputError(one_line(file.string()) + ": is " + std::to_string(size_here.x) + " x " +
                         std::to_string(size_here.y) + " pixels, the picture before it " +
                         std::to_string(size.x) + " x " + std::to_string(size.y));
    }
    const auto hologram = spec(size);
    return shown_field(Panel(slm, size, hologram.pitch_m, hologram.wavelength_m), frames);
  };
  return slm.bits > 8 ? shown_by(std::uint16_t{}) : shown_by(std::uint8_t{});
}

LaserHolograms::LaserHolograms(const HologramOptions& options, bool fields) {
  const std::filesystem::path report(options.files.at(0));
  if (extension_of(report) == ".toml")
    throw InputError(one_line(report.string()) +
                     ": is a scene; raywave render makes its hologram, and this takes its "
                     "report.json");
  const bool is_report = options.files.size() == 1 && extension_of(report) == ".json";
  if (is_report && fields) refuse_tiles(report);
  if (is_report) lasers = lasers_of_report(report);
  if (!lasers) {
    auto& one = each.emplace_back(options);
    if (fields && extension_of(report) == ".json") {
      const auto told = read_report(report);
      const bool is_refined =
          told.is_object() && told.contains("files") && told["files"].contains("refined.npy");
      one.files = {(report.parent_path() / (is_refined ? "refined.npy" : "field.npy")).string()};
    }
    return;
  }
  for (const auto& files : lasers->files) {
    if (fields && files.field.empty())
      throw InputError(one_line(report.string()) +
                       ": its fields were not kept; render without --no-field (raywave refine "
                       "keeps phases alone)");
    auto& one = each.emplace_back(options);
    one.files.clear();
    for (const auto& name : fields ? std::vector{files.field} : files.pictures)
      one.files.push_back((report.parent_path() / std::filesystem::path(name).filename()).string());
    require_of_report(report, {one.files.begin(), one.files.end()});
  }
}

FinishedRender::FinishedRender(const std::filesystem::path& file) {
  const auto name = one_line(file.string());
  const auto folder = file.parent_path();
  refuse_tiles(file);
  const auto lasers = lasers_of_report(file);
  try {
    std::ifstream in(file);
    report = Json::parse(in);
    const auto report_of = [&](std::size_t laser) -> const Json& {
      return lasers ? report.at("colour").at("lasers").at(laser).at("report") : report;
    };
    const auto& told = report_of(0).at("scene");
    if (!told.contains("digest"))
      throw InputError(name + ": is no report of render or refine, which tells its scene");
    const auto scene_file = told.at("file").get<std::string>();
    scenes = load_scenes(scene_file, report.value("set", std::vector<std::string>()));
    if (scenes[0].digest != told.at("digest").get<std::string>())
      throw InputError(one_line(scene_file) + ": was changed after it was rendered into " + name +
                       "; render it again");
    std::vector<std::filesystem::path> files;
    for (std::size_t i = 0; i < scenes.size(); ++i) {
      auto& scene = scenes[i];
      scene = settings_of_json(report_of(i).at("scene"), scene, file);
      const int frames = scene.sampling.frames;
      LaserFiles of_laser;
      if (lasers) of_laser = lasers->files.at(i);
      for (int frame = 0; !lasers && frame < frames; ++frame)
        of_laser.pictures.push_back(name_of_frame(static_cast<std::size_t>(frame)));
      if (!lasers && report.at("files").contains("field.npy")) of_laser.field = "field.npy";
      const auto beside = [&](const std::string& of) {
        return files.emplace_back(folder / std::filesystem::path(of).filename());
      };
      auto& laser = rendered.lasers.emplace_back();
      const auto size = scene.hologram.resolution;
      scene.slm = slm_of_report(file, of_laser.pictures.at(0));
      for (const auto& picture : of_laser.pictures) {
        glm::ivec2 size_px;
        laser.levels.push_back(load_hologram_levels(beside(picture), scene.slm, &size_px));
        if (size_px != size) throw InputError(name + ": is of pictures of another size");
      }
      laser.panel = std::make_shared<const Panel>(scene.slm, size, scene.hologram.pitch_m,
                                                  scene.hologram.wavelength_m);
      laser.field = of_laser.field.empty() ? FieldStack{size.x, size.y, frames, {}}
                                           : load_npy(beside(of_laser.field));
      report_of(i).at("seconds").get_to(laser.seconds);
      if (lasers)
        rendered.energies.push_back(
            report.at("colour").at("lasers").at(i).at("mean_irradiance").get<double>());
    }
    rendered.powers = lasers ? lasers->powers : std::vector<double>{1};
    require_of_report(file, report, files);
  } catch (const nlohmann::json::exception& error) {
    throw InputError(name + ": not a report of raywave: " + json_reason(error));
  }
}

template <class Level>
std::vector<Level> load_hologram_levels(const std::filesystem::path& file, const SlmSpec& slm,
                                        glm::ivec2* size_px) {
  const auto image = load_levels(file, "");
  LevelPictureOf<Level> picture{{image.width, image.height}, {}};
  picture.levels.reserve(image.pixels.size());
  for (const float value : image.pixels)
    picture.levels.push_back(
        static_cast<Level>(std::lround(value * static_cast<float>(grey_levels_of(slm) - 1))));
  picture = from_slm(std::move(picture), slm);
  *size_px = picture.size_px;
  return picture.levels;
}

template std::vector<std::uint8_t> load_hologram_levels(const std::filesystem::path&,
                                                        const SlmSpec&, glm::ivec2*);
template std::vector<std::uint16_t> load_hologram_levels(const std::filesystem::path&,
                                                         const SlmSpec&, glm::ivec2*);

Json encoded_report(const HologramSpec& hologram, const SlmSpec& slm, int frames,
                    PictureFormat format, const std::vector<std::string>& pictures) {
  return {{"scene",
           {{"hologram",
             {{"resolution", {hologram.resolution.x, hologram.resolution.y}},
              {"pitch_m", {hologram.pitch_m.x, hologram.pitch_m.y}},
              {"wavelength_m", hologram.wavelength_m}}},
            {"slm", json_of(slm)},
            {"sampling", {{"frames", frames}}}}},
          {"format", name_of(format)},
          {"pictures", pictures}};
}

Json numbered_report(const HologramSpec& hologram, const SlmSpec& slm, const ViewerSpec& viewer,
                     int frames) {
  auto json = encoded_report(hologram, slm, frames, PictureFormat::png, {});
  json["scene"]["viewer"] = json_of(viewer);
  json.erase("format");
  json.erase("pictures");
  return json;
}

std::string save_hologram(const std::filesystem::path& folder, std::size_t number,
                          const SlmSpec& slm, glm::ivec2 size_px,
                          const std::vector<std::uint8_t>& levels, const std::string& stem) {
  const auto picture = for_slm(LevelPicture{size_px, levels}, slm);
  const auto name = name_of_frame(number, stem);
  save_picture(folder / name, picture.size_px.x, picture.size_px.y, picture.levels);
  return name;
}

}  // namespace raywave::cli
