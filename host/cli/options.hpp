// SPDX-License-Identifier: Apache-2.0
/// Options that commands share, each declared once: the same name, words and meaning everywhere.
///
/// An option's placeholder (its type name) also tells shell completion what to offer: SCENE, FILE,
/// FOLDER and DEVICE are known to it, and words with '|' between them are choices
/// (host/cli/completion.cpp).
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <functional>
#include <glm/vec2.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "cl/device.hpp"
#include "cl/fft.hpp"
#include "host/common/json.hpp"
#include "host/forecast/presets.hpp"
#include "host/scene/image.hpp"
#include "host/scene/scene.hpp"
#include "host/view/colour_picture.hpp"

namespace raywave::cli {

/// --json [FILE] and --quiet: what a command says, and where.
struct ReportOptions {
  std::string json;  // empty: not asked for; "-": standard output; else a file
  bool quiet = false;

  /// content  of the JSON, e.g. "the report"
  void add_to(CLI::App& command, const std::string& content);
  /// Whether tables and summaries are printed: neither with --quiet nor beside JSON.
  bool prints_text() const { return !quiet && json != "-"; }
  /// Prints at once, where text is printed.
  void print(const std::string& text) const;
  /// Prints one line to standard error, but not with --quiet.
  void note(const std::string& text) const;
  /// Writes the JSON to where --json asks for it, if it does. A file is written whole or not at
  /// all.
  void write(const std::string& text) const;
  void write(const Json& value) const;
};

/// Loads the scenes of all lasers and prints their notes. With `strict` all that is not understood
/// of the scene and its meshes ends the command, with exit status 1.
std::vector<Scene> load_all(const std::string& file, const std::vector<std::string>& set,
                            bool strict, const ReportOptions& report);

void add_set(CLI::App& command, std::vector<std::string>& set);
void add_strict(CLI::App& command, bool& strict);

/// SCENE, --set and --strict.
struct SceneOptions {
  std::string file;
  std::vector<std::string> set;
  bool strict = false;

  CLI::Option* add_to(CLI::App& command, const std::string& help = "Scene file (TOML)");
  std::vector<Scene> load_all(const ReportOptions& report) const {
    return cli::load_all(file, set, strict, report);
  }
};

/// --device and --fft. Some commands take several devices: "0:0,0:1", or "all".
struct DeviceOptions {
  std::string device, fft, waves_on;

  void add_device_to(CLI::App& command, bool takes_several = false);
  void add_to(CLI::App& command, bool takes_several = false);  // and --fft
  void add_waves_to(CLI::App& command);                        // --waves-on
  /// The device of --waves-on; none: that of --device does it all. `rays` compiles beside it.
  std::optional<cl::DeviceInfo> waves(cl::DeviceInfo& rays) const;
  bool names_several() const;
  /// throws  InputError where several are named, DeviceError when there is no such device
  cl::DeviceInfo found() const;
  /// The same, in the work shape that `raywave tune` has stored for it, if any.
  /// throws  InputError when that file is damaged, too
  cl::DeviceInfo info() const;
  /// One or several of the same platform, name and driver, whose results are the same, bit for bit;
  /// in such shapes.
  /// throws  InputError for devices that differ or are named twice, and as info()
  std::vector<cl::DeviceInfo> all() const;
  /// throws  InputError when the named back end is unknown, DeviceError when it does not serve the
  ///         device
  cl::FftBackend backend(const cl::DeviceInfo& device) const;
};

/// --preset, --budget, --psnr and --rate: what the planner aims at.
struct GoalOptions {
  std::string preset, budget;
  std::optional<double> psnr_db, rate_per_s;

  void add_to(CLI::App& command);
  void add_preset_to(CLI::App& command);
  /// throws  InputError for an unknown preset, for what is no time, and when several are given
  Goal goal() const;
};

/// What most commands on scenes are asked for.
struct SceneArguments {
  SceneOptions scene;
  GoalOptions goal;
  DeviceOptions device;
  ReportOptions report;
};

/// --method and --rays.
struct MethodOptions {
  std::string name = "wrp";
  int rays_per_axis = 100;

  void add_to(CLI::App& command);
  /// throws  InputError when the method is unknown
  Method method() const;
};

/// -z and --window: the pictures that are looked at.
struct DepthOptions {
  std::vector<std::string> z;
  std::string window;

  /// default_depths  which depths are taken when none is given; empty: -z is required
  /// default_window  whose size is taken when none is given
  void add_to(CLI::App& command, const std::string& default_depths,
              const std::string& default_window);
  /// Both throw InputError naming the option when it cannot be understood.
  ///
  /// viewer  tells the eyepiece through which a depth in dioptres ("1.5D") is seen; called for
  ///         these alone
  std::vector<double> depths_m(const std::function<ViewerSpec()>& viewer = {}) const;
  std::optional<glm::dvec2> window_m() const;
};

/// --frame: from where pictures show a plane.
struct FrameOption {
  std::string name = name_of(Frame::eye);

  void add_to(CLI::App& command, const std::string& what);
  /// throws  InputError for an unknown name
  Frame frame() const;
};

/// --pupil: whether an eye's pupil, and not a lens as large as the hologram, is looked through.
struct PupilOption {
  std::vector<std::string> given;

  void add_to(CLI::App& command);
  /// What to look through, one after another; {empty}: the whole hologram. Where nothing is given,
  /// the viewer's pupils where there is an eyepiece.
  ///
  /// frame    that places on the command line count in
  /// is_part  a part of the hologram is looked through: without --pupil, there is no pupil
  std::vector<std::optional<Pupil>> pupils(const ViewerSpec& viewer, Frame frame,
                                           bool is_part = false) const;
};

/// --view, --aperture, --frame, --percentile and --output of the commands that save what is seen.
struct ViewOptions {
  std::string view_centre, aperture_size, folder, display_server;
  FrameOption frame;
  double percentile = 99.5;
  std::optional<double> white;

  void add_to(CLI::App& command);
  bool is_part() const { return !view_centre.empty() || !aperture_size.empty(); }
  /// All throw InputError naming the option when it cannot be understood.
  // Centre of the open part in half holograms, in the hologram's frame
  glm::dvec2 view() const;
  glm::dvec2 aperture() const;  // its size in holograms
  void check_exposure() const;

  /// Saves STEM_95mm.png, exposed, and STEM_95mm.exr in the output folder, prints a line about
  /// them, and sends what the EXR holds to the display server. Returns what --json says of them.
  ///
  /// blur_px   of the PNG, which is what is seen: standard deviation
  /// pupil     that it is seen through
  /// channels  in the hologram's frame; one, or red, green, blue: PNGs are sRGB, EXRs linear sRGB
  Json save(std::span<const Image> channels, const std::string& name, double z_m,
            const char* quantity, const ReportOptions& report, double blur_px = 0,
            const std::optional<Pupil>& pupil = {}) const;
};

/// What commands that save what is seen are asked for.
struct LookArguments {
  DepthOptions depths;
  ViewOptions view;
  PupilOption pupil;
  DeviceOptions device;
  ReportOptions report;

  /// As PupilOption's. Says which of them, behind an eyepiece, lie beyond the eyebox, where other
  /// orders of the SLM are seen.
  std::vector<std::optional<Pupil>> pupils(const ViewerSpec& viewer,
                                           const HologramSpec& hologram) const;
};

/// Notes where a picture in the hologram's own window is nearly as bright along a side as
/// elsewhere: it goes on there.
///
/// window_m  that was asked for
/// whole     as --window takes it, where it is known what shows all
void note_cut(const ReportOptions& report, const Image& picture,
              const std::optional<glm::dvec2>& window_m, const std::string& whole = {});

/// Of the program that runs; here, where the system does not tell it.
std::filesystem::path program_folder();

/// "by an eye" and so on: from where a picture is seen.
const char* seen_by(Frame frame);

/// "reconstruction_95mm"; "reconstruction_2D" where the depth was given in dioptres.
///
/// z  as it was given
std::string name_at_depth(const std::string& stem, const std::string& z, double z_m);

/// "_eye2" for the second of several pupils.
std::string name_of_pupil(std::size_t number, std::size_t count);

/// --blur: a standard deviation.
struct Blur {
  double value = 0;
  bool in_pixels = false;  // else metres
};

void add_blur(CLI::App& command, std::string& text, const std::string& default_blur);
/// throws  InputError for what is neither a length nor a number of pixels, as in 4px
Blur parse_blur(const std::string& text);

CLI::Option* add_output(CLI::App& command, std::string& folder, const std::string& content);
void add_lens_points(CLI::App& command, int& points);
void add_border(CLI::App& command, int& border_px);
void add_views(CLI::App& command, bool& views, const std::string& help);
void add_only(CLI::App& command, std::string& text, const std::string& example);

/// Lengths > 0 with a unit.
///
/// throws  InputError naming the option
double positive_length_m(const std::string& text, const std::string& what);

/// --pitch, one length or x,y, and --wavelength, within what scenes may have; rules as above.
glm::dvec2 given_pitch_m(const std::string& text);
double given_wavelength_m(const std::string& text);

/// The parts of "a,b" before and after the separator.
std::pair<std::string, std::string> two_parts(const std::string& text, char separator,
                                              const std::string& what);

}  // namespace raywave::cli
