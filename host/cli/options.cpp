// SPDX-License-Identifier: Apache-2.0
#include "host/cli/options.hpp"

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <tuple>

#include "host/cli/display_server.hpp"
#include "host/cli/help.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/quality.hpp"
#include "host/evaluate/report.hpp"
#include "host/forecast/tuning.hpp"
#include "host/geometry/world.hpp"
#include "host/scene/scene.hpp"
#include "host/scene/units.hpp"
#include "host/view/colour_picture.hpp"
#include "host/view/compare.hpp"
#include "host/view/pupil.hpp"

namespace raywave::cli {
namespace {

/// "draft|balanced|accurate|reference", a placeholder from which completion takes the values.
std::string choices(const auto& names) {
  std::string all;
  for (const auto* name : names) all += (all.empty() ? "" : "|") + std::string(name);
  return all;
}

/// NAN for what is not a number from its beginning to its end.
double number_of(const std::string& text) {
  try {
    std::size_t used = 0;
    const double value = std::stod(text, &used);
    return used == text.size() ? value : NAN;
  } catch (const std::exception&) {
    return NAN;
  }
}

double number(const std::string& text, const std::string& what, const char* wanted = "a number") {
  const double value = number_of(text);
  if (!std::isfinite(value))
    throw InputError(what + " " + in_quotes(text) + ": " + wanted + " is needed");
  return value;
}

double length_within_m(const std::string& text, const std::string& what, double least_m,
                       double largest_m) {
  const double length_m = given_length_m(text, what);
  if (!(length_m >= least_m && length_m <= largest_m))
    throw InputError(what + " " + in_quotes(text) + ": must be " + length_text(least_m) + " to " +
                     length_text(largest_m));
  return length_m;
}

}  // namespace

void ReportOptions::add_to(CLI::App& command, const std::string& content) {
  option(command, "--json", json, "[FILE]", group::output,
         "Print " + content +
             " as JSON and nothing else; with FILE (a name that ends in .json, or "
             "--json=FILE), write it there beside the usual text");
  flag(command, "--quiet", quiet, group::output,
       "Print nothing but errors, and JSON where --json asks for it");
}

void ReportOptions::print(const std::string& text) const {
  if (!prints_text()) return;
  std::fputs(text.c_str(), stdout);
  std::fflush(stdout);
}

void ReportOptions::note(const std::string& text) const {
  if (!quiet) std::fprintf(stderr, "raywave: %s\n", text.c_str());
}

void ReportOptions::write(const std::string& text) const {
  if (json == "-")
    std::fputs(text.c_str(), stdout);
  else if (!json.empty())
    write_text(json, text);
}

void ReportOptions::write(const Json& value) const {
  // Names of devices come from drivers, in any encoding.
  write(value.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
}

std::vector<Scene> load_all(const std::string& file, const std::vector<std::string>& set,
                            bool strict, const ReportOptions& report) {
  auto scenes = load_scenes(file, set);
  auto notes = scenes[0].notes;
  if (!strict) {
    for (const auto& note : notes) report.note(note);
    return scenes;
  }
  for (const auto& note : material_notes(scenes[0], build_world(scenes[0]))) notes.push_back(note);
  for (const auto& note : notes) std::fprintf(stderr, "raywave: --strict: %s\n", note.c_str());
  if (!notes.empty()) throw CLI::RuntimeError("", 1);
  return scenes;
}

void add_strict(CLI::App& command, bool& strict) {
  flag(command, "--strict", strict, group::scene,
       "End with an error where a note would be made of what the "
       "scene or a mesh says and is not shown");
}

void add_set(CLI::App& command, std::vector<std::string>& set) {
  option(command, "--set", set, "SECTION.KEY=VALUE", group::scene,
         "Change a value of the scene; may be given many times")
      ->allow_extra_args(false);
}

CLI::Option* SceneOptions::add_to(CLI::App& command, const std::string& help) {
  add_set(command, set);
  add_strict(command, strict);
  return argument(command, "SCENE", file, "SCENE", help);
}

void DeviceOptions::add_device_to(CLI::App& command, bool takes_several) {
  option(command, "--device", device, "DEVICE", group::device,
         std::string("Index (0:1), gpu, cpu, or part of a name (pocl)") +
             (takes_several ? "; 0:0,0:1, or all that are like the default" : "") +
             "; RAYWAVE_DEVICE when not given");
}

void DeviceOptions::add_to(CLI::App& command, bool takes_several) {
  add_device_to(command, takes_several);
  option(command, "--fft", fft, choices(names_of(cl::FftBackend{})), group::device,
         "FFT back end; the device's own choice when not given");
}

void DeviceOptions::add_waves_to(CLI::App& command) {
  option(command, "--waves-on", waves_on, "DEVICE", group::device,
         "A second device, an FPGA: gathers virtual planes and encodes; --device keeps "
         "rays and samples");
}

std::optional<cl::DeviceInfo> DeviceOptions::waves(cl::DeviceInfo& rays) const {
  if (waves_on.empty()) return std::nullopt;
  rays.compiles_always = true;
  return tuned(cl::find_device(waves_on));
}

bool DeviceOptions::names_several() const {
  // Names may have commas, too
  return device == "all" || (device.find(',') != std::string::npos &&
                             device.find_first_not_of("0123456789:,") == std::string::npos);
}

cl::DeviceInfo DeviceOptions::found() const {
  if (names_several())
    throw InputError("--device " + in_quotes(device) +
                     ": this needs one device; animate and render --tiles take several");
  return cl::find_device(device);
}

cl::DeviceInfo DeviceOptions::info() const { return tuned(found()); }

std::vector<cl::DeviceInfo> DeviceOptions::all() const {
  if (!names_several()) return {info()};
  const auto kind = [](const cl::DeviceInfo& one) {
    return std::tie(one.platform, one.name, one.driver);
  };
  std::vector<cl::DeviceInfo> all;
  if (device == "all") {
    const auto usual = cl::find_device();
    for (const auto& one : cl::list_devices())
      if (kind(one) == kind(usual)) all.push_back(tuned(one));
    return all;
  }
  const auto refuse = [&](const std::string& why) {
    throw InputError("--device " + in_quotes(device) + ": " + why);
  };
  std::istringstream names(device);
  for (std::string name; std::getline(names, name, ',');) {
    if (name.empty()) refuse("a device is missing between commas");
    const auto one = cl::find_device(name);
    for (const auto& other : all) {
      if (other.index == one.index) refuse(one.index + " " + one.name + " is named twice");
      if (kind(other) != kind(one))
        refuse(other.index + " " + other.name + " and " + one.index + " " + one.name +
               " differ, and their holograms would in rounding; give devices of one name and "
               "driver");
    }
    all.push_back(tuned(one));
  }
  if (all.empty()) refuse("a device is missing");
  return all;
}

cl::FftBackend DeviceOptions::backend(const cl::DeviceInfo& info) const {
  if (fft.empty()) return cl::default_backend(info);
  const auto backend = choice_of<cl::FftBackend>(fft, "--fft");
  if (!cl::serves(backend, info))
    throw cl::DeviceError("--fft " + fft + " does not serve " + info.name);
  return backend;
}

void GoalOptions::add_preset_to(CLI::App& command) {
  option(command, "--preset", preset, choices(names_of(Preset{})), group::plan,
         "From the fastest to the most accurate; reference, like --psnr and --budget, "
         "refines towards a lens where that shows more, which takes longer");
}

void GoalOptions::add_to(CLI::App& command) {
  add_preset_to(command);
  option(command, "--budget", budget, "TIME", group::plan,
         "The most accurate plan that takes this long: 30ms, 2s");
  option(command, "--psnr", psnr_db, "DB", group::plan,
         "The fastest plan whose pictures reach this PSNR, at the viewer's resolution")
      ->check(CLI::Range(0.0, 200.0));
  option(command, "--rate", rate_per_s, "PER_SECOND", group::plan,
         "The most accurate plan of which this device makes, and slm.rate shows, so many "
         "pictures a second")
      ->check(CLI::Range(0.001, 1e6));
}

Goal GoalOptions::goal() const {
  Goal goal;
  if (!preset.empty()) goal.preset = choice_of<Preset>(preset, "preset");
  if (!budget.empty()) goal.budget_s = given_duration_s(budget, "--budget");
  if (psnr_db) {
    // No range refuses it.
    if (std::isnan(*psnr_db)) throw InputError("--psnr must be 0 to 200, got \"nan\"");
    goal.psnr_db = *psnr_db;
  }
  if (rate_per_s && std::isnan(*rate_per_s))
    throw InputError("--rate must be 0.001 to 1e+06, got \"nan\"");
  goal.rate_per_s = rate_per_s;
  if (goal.count() > 1)
    throw InputError("--preset, --budget, --psnr and --rate: at most 1 of them can be given");
  return goal;
}

void MethodOptions::add_to(CLI::App& command) {
  option(command, "--method", name, choices(names_of(Method{})), group::method,
         "wrp: rays to WRPs, propagated to the hologram; points: every surface sample to "
         "every pixel (reference, slow); rays: rays from every pixel")
      ->capture_default_str();
  option(command, "--rays", rays_per_axis, "N", group::method,
         "Rays per axis and pixel of --method rays")
      ->check(CLI::Range(1, 1000))
      ->capture_default_str();
}

Method MethodOptions::method() const { return choice_of<Method>(name, "--method"); }

void DepthOptions::add_to(CLI::App& command, const std::string& default_depths,
                          const std::string& default_window) {
  const auto otherwise = [](const std::string& text) {
    return text.empty() ? "" : "; " + text + " when not given";
  };
  option(command, "-z", z, "LENGTH", group::pictures,
         "Depth, e.g. 95mm or -40mm, or 1.5D through an eyepiece; may be given many times" +
             otherwise(default_depths))
      ->required(default_depths.empty())
      ->allow_extra_args(false);
  option(command, "--window", window, "WIDTHxHEIGHT", group::pictures,
         "Size of the pictures, e.g. 14.36mmx8.08mm" + otherwise(default_window));
}

std::vector<double> DepthOptions::depths_m(const std::function<ViewerSpec()>& viewer) const {
  const auto depth_of = [&](const std::string& text) {
    if (!text.ends_with('D')) return given_length_m(text, "-z");
    const auto dioptres = dioptres_in(text);
    if (!dioptres)
      throw InputError("-z " + in_quotes(text) + ": a length, or a number of dioptres, is needed");
    try {
      return depth_of_dioptres(viewer ? viewer() : ViewerSpec{}, *dioptres);
    } catch (const InputError& error) {
      throw InputError("-z " + in_quotes(text) + ": " + error.what());
    }
  };
  std::vector<double> depths;
  for (const auto& text : z) {
    const double depth_m = depth_of(text) + 0.0;  // not -0
    for (std::size_t i = 0; i < depths.size(); ++i) {
      if (const auto name = name_at_depth("", text, depth_m);
          name == name_at_depth("", z[i], depths[i]))
        throw InputError("-z " + in_quotes(text) + ": a second picture of " + name.substr(1) +
                         " would overwrite the first; give each depth once");
    }
    depths.push_back(depth_m);
  }
  return depths;
}

std::optional<glm::dvec2> DepthOptions::window_m() const {
  if (window.empty()) return std::nullopt;
  const auto [x, y] =
      two_parts(window, window.find(',') != std::string::npos ? ',' : 'x', "--window");
  const auto side = [&](const std::string& text, const char* name) {
    return positive_length_m(text, "--window " + in_quotes(window) + ": the " + name);
  };
  const double width_m = side(x, "width");
  return glm::dvec2(width_m, side(y, "height"));
}

void FrameOption::add_to(CLI::App& command, const std::string& what) {
  option(command, "--frame", name, choices(names_of(Frame{})), group::pictures,
         what +
             ": the viewer's eye, a bare sensor before the SLM, or along the light, as "
             "arrays are")
      ->capture_default_str();
}

Frame FrameOption::frame() const { return choice_of<Frame>(name, "--frame"); }

void PupilOption::add_to(CLI::App& command) {
  option(command, "--pupil", given, "scene|none|SIZE[@X,Y]", group::pictures,
         "Look through a pupil: that of the scene's [viewer], one of 3mm on the axis, or "
         "at a place, 3mm@1mm,0 or scene@1mm,0; none: through all of the hologram. May be "
         "given many times; scene behind an eyepiece, else none, when not given")
      ->allow_extra_args(false);
}

std::vector<std::optional<Pupil>> PupilOption::pupils(const ViewerSpec& viewer, Frame frame,
                                                      bool is_part) const {
  return pupils_asked(given, viewer, frame, is_part, "--pupil");
}

std::vector<std::optional<Pupil>> LookArguments::pupils(const ViewerSpec& viewer,
                                                        const HologramSpec& hologram) const {
  const auto frame = view.frame.frame();
  const auto all = pupil.pupils(viewer, frame, view.is_part());
  for (const auto& one : all) {
    if (!one || !viewer.eyepiece_m) continue;
    const auto eyebox_m = one->eyebox_m(hologram);
    if (glm::all(glm::lessThanEqual(glm::abs(one->centre_m), eyebox_m / 2.0))) continue;
    report.note("a pupil of " + pupil_text(*one, frame) + " lies beyond the eyebox, " +
                millimetres(eyebox_m.x, 3) + " x " + millimetres(eyebox_m.y, 3) +
                " around the axis: it sees other orders of the SLM, or nothing");
  }
  return all;
}

std::string name_of_pupil(std::size_t number, std::size_t count) {
  return count > 1 ? "_eye" + std::to_string(number + 1) : "";
}

void ViewOptions::add_to(CLI::App& command) {
  frame.add_to(command, "From where --view and the pictures are seen");
  option(command, "--view", view_centre, "X,Y", group::pictures,
         "Look through a part of the hologram centred there, e.g. 0.5,0; from -1,-1 "
         "(bottom left) to 1,1 (top right)");
  option(command, "--aperture", aperture_size, "hologram|part|SIZE", group::pictures,
         "Size of that part in holograms; hologram: 1, part: 0.5; part with --view, else "
         "hologram");
  option(command, "--percentile", percentile, "N", group::pictures,
         "Percentile of the pixels that the PNG shows white")
      ->capture_default_str();
  option(command, "--white", white, "VALUE", group::pictures,
         "What the PNG shows white, in the unit that is printed with each picture: one for "
         "several depths or pupils; by --percentile when not given");
  option(command, "--display-server", display_server, "HOST:PORT", group::pictures,
         "Show the pictures in tev, which is open there: localhost:14158");
  add_output(command, folder, "the pictures (.png, .exr)")->required(folder.empty());
}

glm::dvec2 ViewOptions::view() const {
  if (view_centre.empty()) return {0, 0};
  const auto [x, y] = two_parts(view_centre, ',', "--view");
  const glm::dvec2 centre(number(x, "--view"), number(y, "--view"));
  if (std::abs(centre.x) > 1 || std::abs(centre.y) > 1)
    throw InputError("--view " + in_quotes(view_centre) + ": both must be from -1 to 1");
  return in_frame(centre, frame.frame());
}

glm::dvec2 ViewOptions::aperture() const {
  const auto text = !aperture_size.empty() ? aperture_size
                    : view_centre.empty()  ? "hologram"
                                           : "part";
  const double size = text == "hologram" ? 1
                      : text == "part"
                          ? 0.5
                          : number(text, "--aperture", "a number, \"hologram\" or \"part\"");
  if (!(size > 0 && size <= 1))
    throw InputError("--aperture " + in_quotes(text) +
                     ": must be > 0 and <= 1, or \"hologram\" or \"part\"");
  return {size, size};
}

void ViewOptions::check_exposure() const {
  if (!(percentile > 0 && percentile <= 100))
    throw InputError("--percentile: must be > 0 and <= 100");
  if (white && !(*white > 0 && std::isfinite(*white))) throw InputError("--white: must be > 0");
}

std::filesystem::path program_folder() {
  std::error_code ignored;
  return std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path();
}

const char* seen_by(Frame frame) {
  return frame == Frame::eye      ? "by an eye"
         : frame == Frame::sensor ? "by a bare sensor"
                                  : "along the light";
}

Json ViewOptions::save(std::span<const Image> pictures, const std::string& name, double z_m,
                       const char* quantity, const ReportOptions& report, double blur_px,
                       const std::optional<Pupil>& pupil) const {
  std::vector<Image> channels;
  for (const auto& one : pictures) channels.push_back(in_frame(one, frame.frame()));
  const bool in_colour = channels.size() > 1;
  auto seen = channels;
  for (auto& one : seen) one = blurred(one, blur_px);
  const double shown_white = white ? *white : white_of(seen, percentile);
  const auto base = (std::filesystem::path(folder) / name).string();
  const int width = channels[0].width, height = channels[0].height;
  save_picture(base + ".png", width, height, expose_to(seen, shown_white));
  save_picture(base + ".exr", width, height, interleaved(channels));
  if (!display_server.empty()) display(display_server, base, channels);
  if (report.prints_text())
    std::printf("%s.png  %d x %d%s, seen %s%s%s, white = %s %.4g%s, .exr beside it\n", base.c_str(),
                width, height, in_colour ? " in colour" : "", seen_by(frame.frame()),
                pupil ? (" through a pupil of " + pupil_text(*pupil, frame.frame())).c_str() : "",
                blur_px > 0 ? format(", blurred by %.3g px", blur_px).c_str() : "", quantity,
                shown_white, white ? "" : format(" (percentile %g)", percentile).c_str());
  Json told{{"z_m", z_m},
            {"png", base + ".png"},
            {"exr", base + ".exr"},
            {"size", {width, height}},
            {"frame", name_of(frame.frame())},
            {"png_blur_px", blur_px},
            {"quantity", quantity}};
  if (in_colour) told["colour"] = "linear sRGB";
  if (pupil) told["pupil"] = json_of(*pupil);
  told["white"] = shown_white;
  if (!white) told["percentile"] = percentile;
  return told;
}

void note_cut(const ReportOptions& report, const Image& picture,
              const std::optional<glm::dvec2>& window_m, const std::string& whole) {
  if (window_m) return;
  const auto mean_of = [&](int left, int right, int top, int bottom) {
    double sum = 0;
    for (int y = top; y < bottom; ++y)
      for (int x = left; x < right; ++x)
        sum += double{
            picture.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
                           static_cast<std::size_t>(x)]};
    return sum / ((right - left) * (bottom - top));
  };
  const int w = picture.width, h = picture.height, across = (w + 49) / 50, up = (h + 49) / 50;
  const double mean = mean_of(0, w, 0, h);
  constexpr double goes_on = 0.4;
  const double brightest = std::max({mean_of(0, across, 0, h), mean_of(w - across, w, 0, h),
                                     mean_of(0, w, 0, up), mean_of(0, w, h - up, h)});
  if (brightest > goes_on * mean)
    report.note("the picture goes on beyond the hologram's size, which is shown: " +
                (whole.empty() ? "a larger --window, such as 20mmx20mm, shows more"
                               : "--window " + whole + " shows all of the scene"));
}

std::string name_at_depth(const std::string& stem, const std::string& z, double z_m) {
  if (z.ends_with('D')) return stem + "_" + z;
  return stem + format("_%gmm", z_m * 1e3);
}

void add_blur(CLI::App& command, std::string& text, const std::string& default_blur) {
  option(command, "--blur", text, "LENGTH", group::pictures,
         "Blur both pictures first: standard deviation as a length (60um) or in pixels "
         "(4px); " +
             default_blur + " when not given");
}

Blur parse_blur(const std::string& text) {
  if (!text.ends_with("px")) return {given_length_m(text, "--blur"), false};
  auto digits = text.substr(0, text.size() - 2);
  digits.erase(digits.find_last_not_of(' ') + 1);
  const double pixels = number_of(digits);
  if (std::isnan(pixels))
    throw InputError("--blur " + in_quotes(text) + ": a number of pixels is needed, as in 4px");
  return {pixels, true};
}

CLI::Option* add_output(CLI::App& command, std::string& folder, const std::string& content) {
  auto* option = command.add_option("-o,--output", folder, "Folder for " + content);
  if (!folder.empty()) option->capture_default_str();
  return option->type_name("FOLDER")->group(group::output);
}

void add_lens_points(CLI::App& command, int& points) {
  option(command, "--lens-points", points, "N", group::pictures,
         "Points per axis of the ideal lens; its square is the number of rays per pixel")
      ->check(CLI::Range(1, 4096))
      ->capture_default_str();
}

void add_border(CLI::App& command, int& border_px) {
  option(command, "--border", border_px, "N", group::pictures,
         "Pixels left out on every side of a picture after the blur")
      ->capture_default_str();
}

void add_views(CLI::App& command, bool& views, const std::string& help) {
  flag(command, "--views,!--no-views", views, group::pictures, help);
}

void add_only(CLI::App& command, std::string& text, const std::string& example) {
  option(command, "--only", text, "TEXT", group::measurement,
         "Only rows whose name holds this text, e.g. " + example);
}

double positive_length_m(const std::string& text, const std::string& what) {
  const double length = given_length_m(text, what);
  if (!(length > 0)) throw InputError(what + " " + in_quotes(text) + ": must be > 0");
  return length;
}

glm::dvec2 given_pitch_m(const std::string& text) {
  const bool two = text.find(',') != std::string::npos;
  const auto [x, y] = two ? two_parts(text, ',', "--pitch") : std::pair(text, text);
  const auto pitch = [](const std::string& one) {
    return length_within_m(one, "--pitch", HologramSpec::least_pitch_m,
                           HologramSpec::largest_pitch_m);
  };
  return {pitch(x), pitch(y)};
}

double given_wavelength_m(const std::string& text) {
  return length_within_m(text, "--wavelength", HologramSpec::least_wavelength_m,
                         HologramSpec::largest_wavelength_m);
}

std::pair<std::string, std::string> two_parts(const std::string& text, char separator,
                                              const std::string& what) {
  const auto at = text.find(separator);
  if (at == std::string::npos || text.find(separator, at + 1) != std::string::npos)
    throw InputError(what + " " + in_quotes(text) + ": two values with '" + separator +
                     "' between them are needed");
  return {text.substr(0, at), text.substr(at + 1)};
}

}  // namespace raywave::cli
