// SPDX-License-Identifier: Apache-2.0
// raywave new: a first scene for a mesh, which fits before an SLM and plans without a warning.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <sstream>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/options.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/forecast/presets.hpp"
#include "host/scene/scene.hpp"

namespace raywave::cli {
namespace {

namespace fs = std::filesystem;

struct NewArguments {
  std::string mesh, slm, out;
  ReportOptions report;
};

/// Where the mesh stands, and what follows from it.
struct Fit {
  double width_m = 1e-3, z_m = 0.1, pitch_m = 1e-4;
  glm::dvec2 shift_m{0, 0};
  std::optional<double> dioptres{};  // where it stands behind an eyepiece, in place of z_m
};

/// A length of two or three digits, as a person writes it: "12 mm".
std::string rounded(double length_m, int digits = 2) {
  if (length_m == 0) return "0 mm";
  const double unit = std::pow(10, std::floor(std::log10(std::abs(length_m))) - (digits - 1));
  return length_text(std::round(length_m / unit) * unit);
}

fs::path seen_from(const fs::path& file, const fs::path& folder) {
  std::error_code error;
  const auto near = fs::relative(file, folder.empty() ? fs::path(".") : folder, error);
  return error || near.empty() ? fs::absolute(file) : near;
}

/// What --slm takes of a file.
constexpr std::array sections_of_slm{"hologram", "slm", "illumination", "viewer"};

bool is_of_slm(const std::string& name) {
  return std::ranges::find(sections_of_slm, name) != sections_of_slm.end();
}

/// The lines of sections_of_slm of a file; names of files are made to hold from the scene's folder.
///
/// throws  InputError where it has none of them, or keys under no section
std::string copied_sections(const fs::path& slm, const fs::path& folder) {
  static const std::regex heading("^ *\\[+ *([a-z]+).*"), name("\"([^\"]{1,200})\"");
  std::istringstream lines(read_scene_text(slm).toml);
  std::string text;
  bool wanted = false, in_section = false;
  int number = 0;
  const auto needed = [](const std::string& where) {
    return InputError(where +
                      " --slm takes sections [hologram] (resolution, pitch, wavelength), "
                      "[slm], [illumination] and [viewer]");
  };
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::smatch found;
    if (line.size() < 400 && std::regex_match(line, found, heading)) {
      in_section = true;
      wanted = is_of_slm(found[1]);
    }
    if (const auto first = line.find_first_not_of(" \t\r");
        !in_section && first != std::string::npos && line[first] != '#')
      throw needed(slm.string() + ":" + std::to_string(number) + ": stands under no section;");
    if (!wanted) continue;
    std::error_code error;
    if (line.size() < 400 && std::regex_search(line, found, name))
      if (const auto file = slm.parent_path() / found[1].str();
          fs::path(found[1].str()).is_relative() && fs::is_regular_file(file, error))
        line.replace(static_cast<std::size_t>(found.position(1)), found[1].str().size(),
                     seen_from(file, folder).generic_string());
    text += line + "\n";
  }
  if (text.empty()) throw needed(slm.string() + ": has nothing for a new scene;");
  return text;
}

/// "key = value" with its comment at a column of its own.
std::string entry(const std::string& key_and_value, const char* comment) {
  return format("%-34s # %s\n", key_and_value.c_str(), comment);
}

std::string scene_text(const NewArguments& options, const std::string& sections, const Fit& fit) {
  const auto folder = fs::path(options.out).parent_path();
  const auto quoted = [](const std::string& text) { return '"' + text + '"'; };
  std::string text =
      "# Written by raywave new. docs/scene.md tells all keys; raywave preview shows "
      "what a viewer sees.\n\n";
  if (sections.find("[hologram]") == std::string::npos)
    text += "[hologram]\n" + entry("resolution = [1920, 1080]", "pixels of the SLM, x and y") +
            entry("pitch = \"3.74 um\"", "distance of their centres") +
            entry("wavelength = \"638 nm\"", "of the laser") + "\n";
  std::string shift;
  if (fit.shift_m != glm::dvec2(0))
    shift = entry("shift = [" + quoted(rounded(fit.shift_m.x, 3)) + ", " +
                      quoted(rounded(fit.shift_m.y, 3)) + "]",
                  "moves the picture beside the light that the SLM leaves as it is") +
            entry("shift_distance = " + quoted(rounded(fit.z_m)), "at this depth");
  if (const auto slm = sections.find("[slm]"); slm != std::string::npos)
    text += sections.substr(0, slm) + "[slm]\n" + shift +
            sections.substr(std::min(sections.find('\n', slm), sections.size() - 1) + 1);
  else
    text += sections + (shift.empty() ? "" : "[slm]\n" + shift);
  const auto mesh = seen_from(options.mesh, folder).generic_string();
  return text + "\n[sampling]\n" +
         entry("pitch = " + quoted(rounded(fit.pitch_m)),
               "of the points of light on surfaces; \"auto\" leaves it to --preset, --psnr") +
         "\n[trace]\n" +
         entry("shadows = false", "true: objects keep light from each other, which takes longer") +
         "\n[[light]]\n" +
         entry("direction = [0.5, -0.6, 0.62]",
               "of its travel: from the viewer's side, right and above") +
         "\n[[light]]\n" + entry("type = \"ambient\"", "light from everywhere") +
         entry("intensity = 0.5", "1 is that of the first light") + "\n[[object]]\n" +
         entry("mesh = " + nlohmann::json(mesh).dump(), "OBJ, PLY, STL, glTF ...") +
         entry("width = " + quoted(rounded(fit.width_m)), "its size along x") +
         entry("position = [0, 0, " +
                   quoted(fit.dioptres ? number_text(*fit.dioptres) + " D" : rounded(fit.z_m)) +
                   "]",
               fit.dioptres ? "of its middle: 1.5 D is seen 1 / 1.5 m behind the eyepiece"
                            : "of its middle: -x is the viewer's right, y up, z beyond the SLM") +
         entry("rotation = [0, 180, 0]",
               "degrees about x, y, z: turns the mesh's front, +z, to the viewer");
}

/// Finds the nearest place at which a scene plans without a warning: there the pixels show all of
/// the mesh, and the light that the SLM leaves undiffracted falls beside it.
std::string fitted_scene(const NewArguments& options, std::vector<std::string>& warnings) {
  const fs::path out(options.out);
  const auto sections = options.slm.empty() ? "" : copied_sections(options.slm, out.parent_path());
  const bool may_shift =
      !std::regex_search(sections, std::regex("(^|\n) *(shift|carrier|encoding *= *\"off-axis)"));
  Fit fit;
  std::string text;
  const auto parsed = [&] {
    text = scene_text(options, sections, fit);
    return parse_scenes({text, out, out.parent_path()});
  };
  auto scenes = parsed();
  auto world = build_world(scenes[0]);
  const auto size = (world.max_m - world.min_m) / fit.width_m;  // in widths
  const auto hologram = scenes[0].hologram;
  const auto slm_m = glm::dvec2(hologram.resolution) * hologram.pitch_m;
  if (const auto& viewer = scenes[0].viewer; viewer.eyepiece_m) {
    // Objects are as large as what the eyepiece shows, and sampled as finely as the eye makes out
    fit.dioptres = 1.5;
    fit.z_m = depth_of_dioptres(viewer, *fit.dioptres);
    fit.width_m = 0.5 * std::min(slm_m.x, slm_m.y / std::max(size.y, 1e-6));
    fit.pitch_m = detail_for_eye_m(viewer, fit.z_m);
    scenes = parsed();
    warnings = plan_scenes(scenes, build_world(scenes[0]), {})[0].warnings;
    return text;
  }
  constexpr double share = 0.6;
  fit.width_m = share * std::min({slm_m.x, slm_m.y / std::max(size.y, 1e-6),
                                  std::min(slm_m.x, slm_m.y) / std::max(size.z, 1e-6)});
  const auto tangents =
      hologram.wavelength_m / 2.0 / hologram.pitch_m;  // of the steepest light, nearly
  const auto reach_m = (slm_m + fit.width_m * glm::dvec2(1, size.y)) / 2.0;
  const double nearest_m = std::max(reach_m.x / tangents.x, reach_m.y / tangents.y);
  constexpr int tries = 12;
  constexpr double farther = 1.2;
  for (int i = 0; i < tries; ++i) {
    fit.z_m = nearest_m * std::pow(farther, i) + fit.width_m * size.z / 2;
    if (constexpr double farthest_m = 1e4; fit.z_m > farthest_m)
      throw InputError(options.slm + ": hologram: pitch " +
                       length_text(std::max(hologram.pitch_m.x, hologram.pitch_m.y)) +
                       " shows meshes no nearer than " + rounded(nearest_m) +
                       "; an SLM has 0.2 um to 100 um, and numbers without a unit are metres");
    fit.pitch_m = 1.2 * hologram.wavelength_m * fit.z_m / std::min(slm_m.x, slm_m.y);
    fit.shift_m = {0, 0};
    for (const bool shifted : {false, true}) {
      scenes = parsed();
      world = build_world(scenes[0]);
      const auto planned = plan_scenes(scenes, world, {});
      warnings = planned[0].warnings;
      if (warnings.empty()) return text;
      if (shifted || !may_shift) break;
      fit.shift_m = planned[0].prediction.slm_light.beside_m;
      if (fit.shift_m == glm::dvec2(0)) break;
    }
  }
  return text;
}

void run_new(const NewArguments& options) {
  std::error_code error;
  if (fs::exists(options.out, error))
    throw InputError(in_quotes(options.out) +
                     ": is there already, and is not overwritten; give "
                     "another --output, or remove it");
  if (fs::path(options.mesh).extension() == ".toml")
    throw InputError(in_quotes(options.mesh) + ": is a scene; new makes one for a mesh");
  std::vector<std::string> warnings;
  std::string text;
  try {
    text = fitted_scene(options, warnings);
  } catch (const InputError& wrong) {
    // Lines of a scene that is not written help nobody
    const std::string says = wrong.what(), start = options.out + ":";
    if (!says.starts_with(start)) throw;
    const auto what = says.substr(says.find(": ", start.size()) + 2);
    const auto section = what.substr(0, what.find_first_of(":."));
    throw InputError((is_of_slm(section) && !options.slm.empty() ? options.slm + ": " : "") + what);
  }
  write_text(options.out, text);
  for (const auto& warning : warnings) options.report.note(warning);
  const auto word = shell_word(options.out);
  if (options.report.prints_text())
    std::printf("%s  next: raywave preview %s, raywave plan %s\n", options.out.c_str(),
                word.c_str(), word.c_str());
  options.report.write(Json{{"scene", options.out}, {"warnings", warnings}});
}

}  // namespace

void add_new(CLI::App& app) {
  auto* command =
      add_command(app, section::make, "new", "Write a scene that shows a mesh beyond an SLM",
                  "build/raywave new data/vase.glb -o vase.toml --slm data/bench.toml");
  const auto options = arguments_of(*command, run_new);
  argument(*command, "MESH", options->mesh, "FILE", "OBJ, PLY, STL, OFF, glTF ...")->required();
  option(*command, "--slm", options->slm, "SCENE", group::scene,
         "File whose sections [hologram], [slm], [illumination] and [viewer] are taken; "
         "1920 x 1080 pixels of 3.74 um at 638 nm when not given");
  option(*command, "-o,--output", options->out, "FILE", group::output,
         "The scene file, which must not be there yet")
      ->required();
  options->report.add_to(*command, "what was written");
}

}  // namespace raywave::cli
