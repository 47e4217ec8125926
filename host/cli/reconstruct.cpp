// SPDX-License-Identifier: Apache-2.0
#include "host/view/reconstruct.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <glm/common.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/hologram_part.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_set.hpp"
#include "host/cli/progress.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/plan/plan.hpp"
#include "host/scene/scene.hpp"
#include "host/scene/units.hpp"
#include "host/view/colour_picture.hpp"
#include "host/view/compare.hpp"

namespace raywave::cli {

namespace {

struct ReconstructArguments : LookArguments {
  HologramOptions hologram;
  std::string eyepiece, blur = "eye", centre;
  bool field = false;

  /// --centre.
  glm::dvec2 centre_m() const {
    if (centre.empty()) return {0, 0};
    const auto [x, y] = two_parts(centre, ',', "--centre");
    return {given_length_m(x, "--centre"), given_length_m(y, "--centre")};
  }

  /// --eyepiece, or what the report of a hologram tells.
  ViewerSpec viewer(const HologramOptions& of) const {
    auto spec = of.viewer();
    if (eyepiece.empty()) return spec;
    const bool two = eyepiece.find(',') != std::string::npos;
    const auto [focal, distance] =
        two ? two_parts(eyepiece, ',', "--eyepiece") : std::pair(eyepiece, eyepiece);
    spec.eyepiece_m = spec.eye_relief_m = positive_length_m(focal, "--eyepiece");
    spec.eyepiece_distance_m = given_length_m(distance, "--eyepiece");
    if (!(spec.eyepiece_distance_m >= 0))
      throw InputError("--eyepiece " + in_quotes(eyepiece) +
                       ": its distance from the hologram, on the eye's side, must be >= 0");
    return spec;
  }
};

/// --blur, in pixels: by default what the viewer's eye or lens leaves of a plane's detail.
double blur_px(const ReconstructArguments& options, const ViewerSpec& viewer, double pitch_m,
               double z_m) {
  if (options.blur == "eye") {
    const double eye_px = eye_blur_m(viewer, z_m) / pitch_m;
    if (eye_px > most_blur_px)
      throw InputError(
          "-z " + length_text(z_m) + ": what the viewer makes out there is a blur of " +
          number_text(std::round(eye_px)) + " pixels, at most " + number_text(most_blur_px) +
          " can be shown: give another depth, or --blur 0px");
    return eye_px;
  }
  const auto blur = parse_blur(options.blur);
  return blur.in_pixels ? blur.value : blur.value / pitch_m;
}

/// Says that pictures stand where the scene has them, not where the SLM's own carrier moves them.
void note_shift(const ReconstructArguments& options, const HologramOptions& hologram) {
  if (options.field || extension_of(hologram.files.at(0)) == ".npy") return;
  const auto slm = hologram.slm_spec();
  if (slm.shift_m != glm::dvec2(0))
    options.report.note(
        "slm.shift is taken off: pictures stand where the scene has them; on the "
        "bench they lie (" +
        length_text(slm.shift_m.x) + ", " + length_text(slm.shift_m.y) + ") from there at " +
        length_text(slm.shift_distance_m) + ", x and y of the hologram");
  else if (slm.carrier != glm::dvec2(0))
    options.report.note(
        "slm.carrier is taken off: pictures stand where the scene has them, and elsewhere on the "
        "bench");
}

/// The report beside a hologram; of several lasers, that of the first. Empty where there is none,
/// or objects move.
Json report_beside(const std::filesystem::path& file) {
  auto report = read_report(file.parent_path() / "report.json");
  if (!report.is_object() || report.contains("animation")) return {};
  const auto first = "/colour/lasers/0/report"_json_pointer;
  return report.contains(first) ? report.at(first) : report;
}

/// Where surfaces lie, mirrors' and glass's images included; empty where the report does not tell.
struct ScenePlace {
  glm::dvec2 reach_m{0};  // from the axis, to either side
  double near_m = std::numeric_limits<double>::infinity(), far_m = -near_m;
};
std::optional<ScenePlace> scene_place(const Json& report) {
  ScenePlace place;
  const auto widen = [&](const Json& depths) {
    place.near_m = std::min(place.near_m, depths.at("near_m").get<double>());
    place.far_m = std::max(place.far_m, depths.at("far_m").get<double>());
  };
  try {
    for (const auto& layer : report.at("plan").at("layers")) {
      widen(layer);
      for (const auto* end : {"low_m", "high_m"})
        place.reach_m =
            glm::max(place.reach_m, glm::abs(glm::dvec2(layer.at(end).at(0).get<double>(),
                                                        layer.at(end).at(1).get<double>())));
    }
    if (const auto images = "/plan/mirrors/images"_json_pointer; report.contains(images))
      widen(report.at(images));
  } catch (const nlohmann::json::exception&) {
    return {};
  }
  if (!(place.near_m <= place.far_m)) return {};
  return place;
}

/// -z where none is given: the scene's middle.
std::string depth_of(const std::optional<ScenePlace>& place) {
  if (!place)
    throw InputError(
        "-z is required: no report.json beside the hologram tells where its scene lies");
  return format("%.4gmm", 500 * (place->near_m + place->far_m));
}

/// A window around the axis that holds all surfaces, with some room, as --window takes it; empty
/// where the hologram's own does.
std::string window_of(const ScenePlace& place, glm::dvec2 hologram_m) {
  const auto sides_m = glm::max(2.1 * place.reach_m, hologram_m);
  if (sides_m == hologram_m) return {};
  const auto text = [](double m) { return number_text(std::ceil(m * 1e4) / 10) + "mm"; };
  return text(sides_m.x) + "x" + text(sides_m.y);
}

/// Says of a depth that nothing lies there: farther off than the scene is deep.
void note_depth(const ReconstructArguments& options, const ScenePlace& place, double z_m) {
  const double room_m = std::max(place.far_m - place.near_m, 0.1 * std::abs(place.near_m));
  if (z_m >= place.near_m - room_m && z_m <= place.far_m + room_m) return;
  options.report.note("nothing of the scene is sharp at " + length_text(z_m) + ": it lies " +
                      length_text(place.near_m) + " to " + length_text(place.far_m) +
                      " from the hologram");
}

/// Says where the scene's objects lie, where its report tells of none in the pictures.
void note_place(const ReconstructArguments& options, const Json& report, glm::dvec2 window_m) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  glm::dvec2 low(infinity), high(-infinity);
  try {
    for (const auto& object : report.at("scene").at("objects")) {
      const auto& place = object.at("position_m");
      const glm::dvec2 at(place.at(0).get<double>(), place.at(1).get<double>());
      const auto& width = object.at("width_m");  // or "as in the file"
      const double half_m = width.is_number() ? width.get<double>() / 2 : 0;
      low = glm::min(low, at - half_m);
      high = glm::max(high, at + half_m);
    }
  } catch (const nlohmann::json::exception&) {
    return;  // no report of a render
  }
  const auto away = glm::max(low - options.centre_m(), options.centre_m() - high);
  if (!(low.x <= high.x) || glm::all(glm::lessThan(away, window_m / 2.0))) return;
  const auto middle_mm = (low + high) / 2.0 * 1e3;
  const auto text = [](double mm) { return number_text(std::round(mm * 100) / 100) + "mm"; };
  options.report.note("the scene's objects lie beside these pictures: --centre=" +
                      text(middle_mm.x) + "," + text(middle_mm.y) + " shows their middle");
}

/// Says which files the report beside them, which tells their pixels, does not list.
void note_unlisted(const ReconstructArguments& options) {
  for (const std::filesystem::path file : options.hologram.files) {
    const auto report = read_report(file.parent_path() / "report.json");
    const auto listed = report.find("files");
    if (extension_of(file) != ".json" && listed != report.end() &&
        !listed->contains(file.filename().string()))
      options.report.note(one_line(file.string()) +
                          ": is not in the list of the report.json beside it: it may be of another "
                          "run; leave it out, or run that again");
  }
}

void run_reconstruct(const ReconstructArguments& options) {
  const LaserHolograms given(options.hologram, options.field);
  if (options.field && !given.lasers)
    throw InputError("--field takes the report of several lasers; give field.npy for one");
  ReconstructSpec what;
  what.window_m = options.depths.window_m();
  what.centre_m = options.centre_m();
  what.view = options.view.view();
  what.aperture = options.view.aperture();
  options.view.check_exposure();
  note_shift(options, given.each[0]);
  const auto viewer = options.viewer(given.each[0]);
  const auto told = report_beside(options.hologram.files.at(0));
  const auto place = scene_place(told);
  auto depths = options.depths;
  if (depths.z.empty()) depths.z.push_back(depth_of(place));
  const auto depths_m = depths.depths_m([&] { return viewer; });

  std::vector<FieldStack> holograms;
  std::vector<HologramSpec> specs;
  glm::dvec2 part_m(0);  // middle of what was read of the hologram
  const std::filesystem::path first(options.hologram.files.at(0));
  if (const auto report = first.parent_path() / "report.json";
      first.filename().string().starts_with("tile_") && is_of_tiles(report))
    throw InputError(one_line(first.string()) + ": is a tile of a hologram; give " +
                     one_line(report.string()) + " and, by --view and --aperture, a part of it");
  if (is_of_tiles(first)) {
    auto part = load_part(options.hologram, what.view, what.aperture);
    holograms.push_back(std::move(part.field));
    specs.push_back(part.spec);
    part_m = part.centre_m;
    what.centre_m -= part_m;
    what.view = {0, 0};
    what.aperture = {1, 1};
  } else {
    for (const auto& one : given.each) {
      holograms.push_back(one.load());
      specs.push_back(one.spec({holograms.back().nx, holograms.back().ny}));
    }
  }

  for (const double z_m : depths_m)
    blur_px(options, viewer, specs[0].pitch_m.x, z_m);  // or refuses

  note_unlisted(options);
  const auto hologram_m = glm::dvec2(specs[0].resolution) * specs[0].pitch_m;
  note_place(options, told, what.window_m.value_or(hologram_m));
  const cl::Device device(options.device.info());
  const auto backend = options.device.backend(device.info());
  auto pictures = Json::array();
  // Holograms of an animation have their numbers in their names
  const auto file = std::filesystem::path(options.hologram.files.at(0)).stem().string();
  const auto stem = "reconstruction" + (file.starts_with("frame_") ? file.substr(5) : "");
  if (const auto count = options.hologram.files.size(); count > 1 && file.starts_with("frame_"))
    options.report.note("the mean of these " + std::to_string(count) +
                        " holograms is shown; give those of one picture of an animation to see it");
  const auto pupils = options.pupils(viewer, specs[0]);
  for (std::size_t picture = 0; picture < depths_m.size() * pupils.size(); ++picture) {
    const std::size_t depth = picture / pupils.size(), number = picture % pupils.size();
    const double z_m = what.z_m = depths_m[depth];
    what.pupil = pupils[number];
    if (what.pupil) what.pupil->centre_m -= what.pupil->a * part_m;
    const auto name =
        name_at_depth(stem, depths.z[depth], z_m) + name_of_pupil(number, pupils.size());
    std::vector<Image> light;
    {
      ProgressBar bar(options.report.quiet);
      for (std::size_t i = 0; i < holograms.size(); ++i) {
        light.push_back(
            reconstruct(device, backend, holograms[i], specs[i], what, [&](double share) {
              bar.show(name,
                       (static_cast<double>(i) + share) / static_cast<double>(holograms.size()));
            }));
        // Fields have the unit of white already
        const double gain = given.lasers && !options.field ? given.lasers->gain(i) : 1;
        for (float& pixel : light[i].pixels) pixel = static_cast<float>(double{pixel} * gain);
      }
    }
    if (place) note_depth(options, *place, z_m);
    note_cut(options.report, light[0], what.window_m,
             place ? window_of(*place, hologram_m) : std::string());
    const auto [low, high] = std::ranges::minmax(light[0].pixels);
    if (z_m == 0 && high < 1.001F * low)
      options.report.note(name +
                          " is evenly bright: light of phases alone has no picture in the "
                          "SLM's own plane, unless slm.stop filters it");
    const double blur = blur_px(options, viewer, specs[0].pitch_m.x, z_m);
    pictures.push_back(
        given.lasers ? options.view.save(picture_of_lasers(given.lasers->lasers, light).channels,
                                         name, z_m, "light", options.report, blur, pupils[number])
                     : options.view.save(light, name, z_m, "intensity", options.report, blur,
                                         pupils[number]));
  }
  options.report.write(Json{{"pictures", pictures}});
}

}  // namespace

void add_reconstruct(CLI::App& app) {
  auto* command =
      add_command(app, section::look, "reconstruct", "Show what a hologram shows at given depths",
                  "build/raywave render data/teapot.toml -o out --preset draft\n"
                  "build/raywave reconstruct out/report.json -z 95mm -z 100mm -o out");
  const auto options = arguments_of(*command, run_reconstruct);
  options->hologram.add_to(*command,
                           "report.json or hologram.png ... (what the SLM shows, mean of the "
                           "frames), or field.npy");
  flag(*command, "--field", options->field, group::pictures,
       "Of a report of several lasers: show their fields, which no SLM shows");
  options->depths.add_to(*command, "the middle of the scene in report.json", "the hologram's");
  option(*command, "--centre", options->centre, "X,Y", group::pictures,
         "Middle of the pictures, as object.position: 0mm,14mm; the axis when not given");
  option(*command, "--eyepiece", options->eyepiece, "LENGTH[,LENGTH]", group::pictures,
         "Focal length of the lens that the eye looks through, and its distance from the "
         "hologram where it is another; report.json tells them when not given");
  option(*command, "--blur", options->blur, "eye|LENGTH", group::pictures,
         "Blur the PNGs, which show what is seen: eye, by what the viewer makes out, or a "
         "standard deviation as a length (60um) or in pixels (0px: none)")
      ->capture_default_str();
  options->device.add_to(*command);
  options->view.add_to(*command);
  options->pupil.add_to(*command);
  options->report.add_to(*command, "the list of pictures");
}

}  // namespace raywave::cli
