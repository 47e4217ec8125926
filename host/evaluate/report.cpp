// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/report.hpp"

#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/encode/pictures.hpp"
#include "host/evaluate/refinement.hpp"
#include "host/scene/read_slm.hpp"
#include "host/trace/work_shape.hpp"
#include "raywave_version.hpp"

namespace raywave {
namespace {

std::uint64_t host_peak_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<std::uint64_t>(usage.ru_maxrss) * 1024;
}

/// Light, over that of white, that a laser would have to take away for some colour of sRGB.
double most_negative(const LaserSet& lasers, std::size_t laser) {
  const auto row = lasers.from_rgb[laser];
  return std::max(0.0, -(std::min(row.x, 0.0) + std::min(row.y, 0.0) + std::min(row.z, 0.0)));
}

Json white_json(glm::dvec3 rgb) {
  const auto shown = chromaticity_of(xyz_from_srgb() * rgb);
  return {{"chromaticity", {shown.x, shown.y}}, {"delta_e_2000", white_error(rgb)}};
}

[[noreturn]] void refuse_damaged(const std::filesystem::path& report,
                                 const nlohmann::json::exception& error) {
  throw InputError(one_line(report.string()) + ": not a report of raywave: " + json_reason(error));
}

/// "scene" of a report; of several lasers, that of the one whose picture or field the file is.
///
/// throws  InputError when it is none's; nlohmann::json::exception when the report is damaged
Json scene_of_report(const Json& report, const std::filesystem::path& name,
                     const std::filesystem::path& file) {
  if (!report.contains("colour")) return report.at("scene");
  std::string names;
  for (const auto& laser : report.at("colour").at("lasers")) {
    if (laser.contains("files")) {  // of an animation
      const std::string number = "%05d", pattern = laser.at("files").get<std::string>(),
                        name_here = file.filename().string();
      const auto at = pattern.find(number);
      if (at != std::string::npos && name_here.starts_with(pattern.substr(0, at)) &&
          name_here.ends_with(pattern.substr(at + number.size())))
        return laser.at("report").at("scene");
      names += (names.empty() ? "" : ", ") + one_line(pattern);
      continue;
    }
    auto files = laser.at("pictures").get<std::vector<std::string>>();
    for (const auto* kept : {"field", "refined"})
      if (laser.contains(kept)) files.push_back(laser.at(kept));
    for (const auto& one : files) {
      if (file.filename() == one) return laser.at("report").at("scene");
      names += (names.empty() ? "" : ", ") + one_line(one);
    }
  }
  throw InputError(one_line(name.string()) +
                   ": is of several lasers; give the file of one: " + names);
}

}  // namespace

Json render_report_json(const Scene& scene, const RenderResult& result,
                        const cl::DeviceInfo& device, cl::FftBackend fft) {
  Json j;
  j["raywave"] = version;
  j["scene"] = json_of(scene);
  j["scene"]["slm"] = json_of(result.plan.slm);  // what the pictures are for
  add_found(result.found, j["scene"]["objects"]);
  j["plan"] = plan_json(result.plan);
  j["accuracy"] = accuracy_json(scene.accuracy, result.plan);
  j["device"] = json_of(device);
  j["device"]["fft"] = cl::name_of(fft);
  j["samples"] = {{"count", result.samples}, {"with_visibility_rays", result.hidden_samples}};
  j["seed"] = scene.sampling.seed;
  if (result.refined) {
    j["refine"] = refinement_json({}, result.refined->figures);
    j["refine"]["blur_m"] = result.plan.refine->blur_m.value();
    j["refine"]["brightness"] = result.plan.refine->brightness;
  }
  j["notes"] = scene.notes;
  for (const auto& note : result.notes) j["notes"].push_back(note);
  j["seconds"] = result.seconds;
  j["processor_seconds"] = result.processor_seconds;
  j["peak_memory"] = {{"host_bytes", host_peak_bytes()},
                      {"device_bytes", result.device_peak_bytes}};
  return j;
}

Json report_json(const std::vector<Scene>& scenes, const Rendered& result,
                 const std::vector<LaserFiles>& files, const cl::DeviceInfo& device,
                 cl::FftBackend fft) {
  if (scenes.size() == 1) return render_report_json(scenes[0], result.lasers[0], device, fft);
  Json j{{"raywave", version}};
  j["colour"] = colour_json(scenes.at(0).colour.value(), result.powers);
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    auto& laser = j["colour"]["lasers"][i];
    laser["mean_irradiance"] = result.energies[i];
    laser["pictures"] = files[i].pictures;
    if (!files[i].field.empty()) laser["field"] = files[i].field;
    if (!files[i].refined.empty()) laser["refined"] = files[i].refined;
    laser["report"] = render_report_json(scenes[i], result.lasers[i], device, fft);
  }
  return j;
}

Json colour_json(const ColourSpec& colour, const std::vector<double>& light) {
  Json j{{"primaries", "srgb"}, {"white", "D65"}, {"order", "sequential"}};
  j["white_shown"] = white_json(colour.lasers.white());
  for (std::size_t i = 0; i < colour.lasers.count(); ++i) {
    const auto row = colour.lasers.from_rgb[i];
    j["lasers"].push_back({{"wavelength_m", colour.lasers.wavelengths_m[i]},
                           {"white_power", colour.lasers.white_powers[i]},
                           {"from_rgb", {row.x, row.y, row.z}},
                           {"most_clipped", most_negative(colour.lasers, i)}});
  }
  const auto& bench = colour.bench;
  const auto& [powers, efficiencies, duties] = bench;
  j["bench"] = {{"power", powers}, {"efficiency", efficiencies}, {"duty", duties}};
  for (std::size_t i = 0; i < colour.lasers.count(); ++i)
    j["lasers"][i]["duty"] =
        bench.duties.empty() ? 1 / static_cast<double>(colour.lasers.count()) : bench.duties[i];
  if (light.empty()) return j;
  const auto drive = drive_of(colour.lasers, bench, light);
  for (std::size_t i = 0; i < light.size(); ++i) {
    auto& laser = j["lasers"][i];
    laser["power"] = light[i];
    laser["beam_power"] = drive.powers[i];
    if (!drive.shares.empty()) laser["share_of_given_power"] = drive.shares[i];
  }
  if (!drive.shares.empty()) j["white_at_given_powers"] = white_json(drive.full);
  return j;
}

std::string drive_text(const ColourSpec& colour, const std::vector<double>& light,
                       const std::string& what) {
  const auto drive = drive_of(colour.lasers, colour.bench, light);
  if (drive.shares.empty()) return "";
  std::string text = what + " by ";
  for (std::size_t i = 0; i < light.size(); ++i)
    text += (i > 0 ? ", " : "") + percent_text(drive.shares[i]) + " at " +
            length_text(colour.lasers.wavelengths_m[i]);
  const auto full = chromaticity_of(xyz_from_srgb() * drive.full);
  return text + " of the given powers; all in full show (" + format("%.3f, %.3f", full.x, full.y) +
         "), a CIEDE2000 of " + format("%.1f", white_error(drive.full)) + " from D65";
}

std::string laser_suffix(double wavelength_m, std::size_t lasers) {
  return lasers > 1 ? "_" + laser_name(wavelength_m) : "";
}

LaserFiles files_of_laser(const RenderResult& laser, const std::string& suffix, bool keeps_field,
                          bool keeps_refined) {
  LaserFiles files;
  for (int frame = 0; frame < laser.plan.hologram.frames; ++frame)
    files.pictures.push_back("hologram" + suffix +
                             (frame == 0 ? "" : "_" + std::to_string(frame + 1)) + ".png");
  if (keeps_field) files.field = "field" + suffix + ".npy";
  if (keeps_refined && laser.refined) files.refined = "refined" + suffix + ".npy";
  return files;
}

std::string sides_text(glm::dvec2 half_m) {
  return number_text(std::round(half_m.x * 2e4) / 10) + " x " +
         number_text(std::round(half_m.y * 2e4) / 10) + " mm";
}

glm::dvec2 field_m(const HologramSpec& hologram, double wavelength_m, double z_m) {
  glm::dvec2 field;
  for (int axis = 0; axis < 2; ++axis) {
    const double sine = std::min(0.999, wavelength_m / (2 * hologram.pitch_m[axis])),
                 half_m = hologram.resolution[axis] * hologram.pitch_m[axis] / 2;
    field[axis] = std::max(0.0, std::abs(z_m) * sine / std::sqrt(1 - sine * sine) - half_m);
  }
  return field;
}

std::string colour_warning(const std::vector<Scene>& scenes, const World& world) {
  if (scenes.size() == 1) return {};
  const auto& lasers = scenes.at(0).colour.value().lasers;
  if (!scenes[0].slm.illumination.is_plane()) return {};  // fields are of plane light
  const auto ends = std::minmax_element(lasers.wavelengths_m.begin(), lasers.wavelengths_m.end());
  const double shortest_m = *ends.first, longest_m = *ends.second;
  const auto& hologram = scenes[0].hologram;
  const double middle_m = (world.min_m.z + world.max_m.z) / 2;
  const auto positions = positions_now(world);
  const bool is_within = std::ranges::all_of(positions, [&](glm::dvec3 at_m) {
    const auto field = field_m(hologram, shortest_m, at_m.z);
    return std::abs(at_m.x) <= field.x && std::abs(at_m.y) <= field.y;
  });
  if (is_within) return {};
  return "the scene reaches beyond " + sides_text(field_m(hologram, shortest_m, middle_m)) +
         " (at " + length_text(middle_m) +
         "), from where on parts of the hologram show no light of " + length_text(shortest_m) +
         ", and edges turn to the colour of " + length_text(longest_m) +
         "; keep it within, move it away, or give a smaller hologram.pitch";
}

std::optional<ReportedLasers> lasers_of_report(const std::filesystem::path& report) {
  std::ifstream in(report);
  if (!in) throw InputError(one_line(report.string()) + ": cannot be read");
  try {
    const auto json = Json::parse(in);
    if (!json.contains("colour")) return {};
    if (json.contains("animation"))
      throw InputError(one_line(report.string()) +
                       ": is of an animation; give the hologram of one laser, such as "
                       "frame_00012_520nm.png, or see preview.mp4 for pictures in colour");
    const auto& all = json.at("colour").at("lasers");
    ReportedLasers found;
    std::vector<double> wavelengths_m;
    for (const auto& laser : all) {
      wavelengths_m.push_back(laser.at("wavelength_m"));
      found.powers.push_back(laser.at("power"));
      if (laser.at("report").contains("format")) {  // of encode
        const auto format = picture_format_of(laser.at("report").at("format").get<std::string>());
        if (!is_read_again(format))
          throw InputError(one_line(report.string()) + ": its pictures have the format " +
                           name_of(format) + ", which is not read again; encode with --format png");
      }
      found.files.push_back({laser.at("pictures").get<std::vector<std::string>>(),
                             laser.value("field", ""), laser.value("refined", "")});
    }
    found.lasers = laser_set(wavelengths_m);
    if (const auto& colour = json.at("colour"); colour.contains("bench")) {
      const auto read = [&](const char* key, std::vector<double>& numbers) {
        colour.at("bench").at(key).get_to(numbers);
        if (!numbers.empty() && numbers.size() != all.size())
          throw InputError(one_line(report.string()) + ": has not a " + key + " of each laser");
      };
      read("power", found.bench.powers);
      read("efficiency", found.bench.efficiencies);
      read("duty", found.bench.duties);
    }
    return found;
  } catch (const nlohmann::json::exception& error) {
    refuse_damaged(report, error);
  } catch (const std::invalid_argument&) {
    throw InputError(one_line(report.string()) + ": its lasers mix no white");
  }
}

ViewerSpec viewer_of_report(const std::filesystem::path& report,
                            const std::filesystem::path& file) {
  ViewerSpec viewer;
  std::ifstream in(report);
  if (!in) return viewer;
  try {
    const auto scene = scene_of_report(Json::parse(in), report, file);
    if (!scene.contains("viewer")) return viewer;
    const auto& told = scene.at("viewer");
    const auto take = [&](const char* key, auto& value) {
      if (told.contains(key) && told.at(key).is_number()) value = told.at(key).get<double>();
    };
    take("distance_m", viewer.distance_m);
    take("resolution_m", viewer.resolution_m);
    take("eyepiece_m", viewer.eyepiece_m);
    take("eyepiece_distance_m", viewer.eyepiece_distance_m);
    take("pupil_m", viewer.pupil_m);
    viewer.eye_relief_m = told.value("eye_relief_m", viewer.eyepiece_m.value_or(0));
    for (const auto& place : told.value("pupil_position_m", Json::array()))
      viewer.pupil_places_m.emplace_back(place.at(0).get<double>(), place.at(1).get<double>());
  } catch (const nlohmann::json::exception& error) {
    refuse_damaged(report, error);
  }
  return viewer;
}

HologramSpec hologram_of_report(const std::filesystem::path& report,
                                const std::filesystem::path& file) {
  std::ifstream in(report);
  if (!in)
    throw InputError(one_line(report.string()) +
                     ": not found; it tells the hologram's pitch and wavelength (or give --pitch "
                     "and --wavelength)");
  try {
    const auto j = scene_of_report(Json::parse(in), report, file).at("hologram");
    HologramSpec spec;
    spec.resolution = {j.at("resolution").at(0).get<int>(), j.at("resolution").at(1).get<int>()};
    spec.pitch_m = {j.at("pitch_m").at(0).get<double>(), j.at("pitch_m").at(1).get<double>()};
    spec.wavelength_m = j.at("wavelength_m").get<double>();
    if (!(spec.pitch_m.x > 0 && spec.pitch_m.y > 0 && spec.wavelength_m > 0))
      throw InputError(one_line(report.string()) + ": pitch and wavelength must be > 0");
    return spec;
  } catch (const nlohmann::json::exception& error) {
    refuse_damaged(report, error);
  }
}

Json json_of(const cl::WorkShape& shape) {
  Json j;
  for (const auto& knob : work_knobs) j[knob.name] = shape.*knob.value;
  return j;
}

Json json_of(const cl::DeviceInfo& device) {
  return {{"index", device.index},
          {"name", device.name},
          {"platform", device.platform},
          {"vendor", device.vendor},
          {"version", device.version},
          {"driver", device.driver},
          {"work", json_of(work_shape(device))}};
}

SlmSpec slm_of_report(const std::filesystem::path& report, const std::filesystem::path& file) {
  const auto name = one_line(report.string());
  std::ifstream in(report);
  if (!in)
    throw InputError(name + ": not found; it tells how the SLM shows phases (or give --slm)");
  SlmSpec slm;
  try {
    const auto scene = scene_of_report(Json::parse(in), report, file);
    slm = slm_of_json(scene.at("slm"), report);
  } catch (const nlohmann::json::exception& error) {
    refuse_damaged(report, error);
  }
  if (!slm.flatness.file.empty()) {
    slm.flatness.where = name + ": flatness";
    load_flatness(slm.flatness);
  }
  if (auto& profile = slm.illumination.profile; !profile.file.empty()) {
    profile.where = name + ": profile";
    load_profile(profile);
  }
  return slm;
}

}  // namespace raywave
