// SPDX-License-Identifier: Apache-2.0
#include "host/view/reconstruct.hpp"

#include <array>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_set.hpp"
#include "host/cli/progress.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/report.hpp"
#include "host/scene/units.hpp"
#include "host/view/colour_picture.hpp"

namespace raywave::cli {

namespace {

struct ReconstructArguments {
  HologramOptions hologram;
  DepthOptions depths;
  ViewOptions view;
  DeviceOptions device;
  ReportOptions report;
  std::string eyepiece;
  bool field = false;

  /// --eyepiece, or what the report of a hologram tells.
  ViewerSpec viewer(const HologramOptions& of) const {
    if (eyepiece.empty()) return of.viewer();
    const bool two = eyepiece.find(',') != std::string::npos;
    const auto [focal, distance] =
        two ? two_parts(eyepiece, ',', "--eyepiece") : std::pair(eyepiece, eyepiece);
    ViewerSpec spec;
    spec.eyepiece_m = positive_length_m(focal, "--eyepiece");
    spec.eyepiece_distance_m = given_length_m(distance, "--eyepiece");
    if (!(spec.eyepiece_distance_m >= 0))
      throw InputError("--eyepiece " + in_quotes(eyepiece) +
                       ": its distance from the hologram, on the eye's side, must be >= 0");
    return spec;
  }
};

/// What the three holograms of a report show, in colour.
void reconstruct_lasers(const ReconstructArguments& options, const ReportedLasers& reported) {
  const std::filesystem::path report(options.hologram.files[0]);
  std::array<FieldStack, 3> holograms;
  std::array<HologramSpec, 3> specs;
  ViewerSpec viewer;
  for (std::size_t i = 0; i < 3; ++i) {
    auto of_laser = options.hologram;
    of_laser.files.clear();
    if (options.field && reported.files[i].field.empty())
      throw InputError(one_line(report.string()) +
                       ": its fields were not kept; render without --no-field");
    for (const auto& name :
         options.field ? std::vector{reported.files[i].field} : reported.files[i].pictures)
      of_laser.files.push_back(
          (report.parent_path() / std::filesystem::path(name).filename()).string());
    require_of_report(report, {of_laser.files.begin(), of_laser.files.end()});
    holograms[i] = of_laser.load();
    specs[i] = of_laser.spec({holograms[i].nx, holograms[i].ny});
    viewer = options.viewer(of_laser);
  }

  ReconstructSpec what;
  what.window_m = options.depths.window_m();
  what.view = options.view.view();
  what.aperture = options.view.aperture();
  options.view.check_percentile();
  const cl::Device device(options.device.info());
  const auto backend = options.device.backend(device.info());
  auto pictures = nlohmann::ordered_json::array();
  for (const double z_m : options.depths.depths_m([&] { return viewer; })) {
    what.z_m = z_m;
    const auto name = name_at_depth("reconstruction", z_m);
    std::array<Image, 3> light;
    {
      ProgressBar bar(options.report.quiet);
      for (std::size_t i = 0; i < 3; ++i) {
        light[i] = reconstruct(device, backend, holograms[i], specs[i], what, [&](double share) {
          bar.show(name, (static_cast<double>(i) + share) / 3);
        });
        // Fields have the unit of white already
        for (float& pixel : light[i].pixels)
          pixel = static_cast<float>(double{pixel} * (options.field ? 1 : reported.gain(i)));
      }
    }
    pictures.push_back(options.view.save(picture_of_lasers(reported.lasers, light).channels, name,
                                         z_m, "light", options.report));
  }
  options.report.write(nlohmann::ordered_json{{"pictures", pictures}});
}

void run_reconstruct(const ReconstructArguments& options) {
  if (const auto& files = options.hologram.files;
      files.size() == 1 && extension_of(files[0]) == ".json") {
    if (const auto reported = lasers_of_report(files[0])) {
      reconstruct_lasers(options, *reported);
      return;
    }
  }
  if (options.field)
    throw InputError("--field takes the report of three lasers; give field.npy for one");
  const auto hologram = options.hologram.load();
  const auto spec = options.hologram.spec({hologram.nx, hologram.ny});

  ReconstructSpec what;
  what.window_m = options.depths.window_m();
  what.view = options.view.view();
  what.aperture = options.view.aperture();
  options.view.check_percentile();
  const auto depths_m = options.depths.depths_m([&] { return options.viewer(options.hologram); });

  const cl::Device device(options.device.info());
  const auto backend = options.device.backend(device.info());
  auto pictures = nlohmann::ordered_json::array();
  for (const double z_m : depths_m) {
    what.z_m = z_m;
    const auto name = name_at_depth("reconstruction", z_m);
    Image image;
    {
      ProgressBar bar(options.report.quiet);
      image = reconstruct(device, backend, hologram, spec, what,
                          [&](double share) { bar.show(name, share); });
    }
    pictures.push_back(options.view.save({&image, 1}, name, z_m, "intensity", options.report));
  }
  options.report.write(nlohmann::ordered_json{{"pictures", pictures}});
}

}  // namespace

void add_reconstruct(CLI::App& app) {
  auto* command =
      add_command(app, section::look, "reconstruct", "Show what a hologram shows at given depths",
                  "build/raywave render data/teapot.toml -o out --preset draft\n"
                  "build/raywave reconstruct out/report.json -z 95mm -z 100mm -o out");
  auto options = std::make_shared<ReconstructArguments>();
  options->hologram.add_to(*command,
                           "report.json or hologram.png ... (what the SLM shows, mean of the "
                           "frames), or field.npy");
  command
      ->add_flag("--field", options->field,
                 "Of a report of three lasers: show their fields, which no SLM shows")
      ->group(group::pictures);
  options->depths.add_to(*command, "", "the hologram's");
  command
      ->add_option("--eyepiece", options->eyepiece,
                   "Focal length of the lens that the eye looks through, and its distance from the "
                   "hologram where it is another; report.json tells them when not given")
      ->type_name("LENGTH[,LENGTH]")
      ->group(group::pictures);
  options->device.add_to(*command);
  options->view.add_to(*command);
  options->report.add_to(*command, "the list of pictures");
  command->callback([options] { run_reconstruct(*options); });
}

}  // namespace raywave::cli
