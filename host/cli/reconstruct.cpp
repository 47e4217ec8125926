// SPDX-License-Identifier: Apache-2.0
#include "host/view/reconstruct.hpp"

#include <memory>

#include "host/cli/commands.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/progress.hpp"
#include "host/common/error.hpp"
#include "host/evaluate/report.hpp"

namespace raywave::cli {

namespace {

struct Options {
  std::string hologram, pitch, wavelength;
  PictureOptions picture;
  DeviceOptions device;
  bool quiet = false;
};

HologramSpec spec_of(const Options& options, const std::filesystem::path& file) {
  HologramSpec spec;
  if (options.pitch.empty() || options.wavelength.empty())
    spec = hologram_of_report(file.parent_path() / "report.json");
  if (!options.pitch.empty()) {
    const bool two = options.pitch.find(',') != std::string::npos;
    const auto [x, y] =
        two ? two_parts(options.pitch, ',', "--pitch") : std::pair(options.pitch, options.pitch);
    spec.pitch_m = {positive_length_m(x, "--pitch"), positive_length_m(y, "--pitch")};
  }
  if (!options.wavelength.empty())
    spec.wavelength_m = positive_length_m(options.wavelength, "--wavelength");
  return spec;
}

void run(const Options& options) {
  const std::filesystem::path file(options.hologram);
  const auto hologram = file.extension() == ".npy"
                            ? load_npy(file)
                            : field_of_levels(load_levels(file, file.string()));
  auto spec = spec_of(options, file);
  spec.resolution = {hologram.nx, hologram.ny};

  ReconstructSpec what;
  what.window_m = options.picture.window_m();
  what.view = options.picture.view();
  what.aperture = options.picture.aperture();
  options.picture.check_percentile();
  const auto depths_m = options.picture.depths_m();

  const cl::Device device(options.device.info());
  const auto backend = options.device.backend(device.info());
  for (const double z_m : depths_m) {
    what.z_m = z_m;
    const auto name = name_at_depth("reconstruction", z_m);
    Image image;
    {
      ProgressBar bar(options.quiet);
      image = reconstruct(device, backend, hologram, spec, what,
                          [&](double share) { bar.show(name, share); });
    }
    options.picture.save(image, name, "intensity", options.quiet);
  }
}

}  // namespace

void add_reconstruct(CLI::App& app) {
  auto* command = app.add_subcommand("reconstruct", "Show what a hologram shows at given depths");
  auto options = std::make_shared<Options>();
  command->add_option("hologram", options->hologram, "field.npy, or hologram.png (phase levels)")
      ->required();
  options->picture.add_to(*command);
  command->add_option(
      "--pitch", options->pitch,
      "Pixel pitch (one, or x,y); from report.json beside the hologram when not given");
  command->add_option("--wavelength", options->wavelength,
                      "Wavelength; from report.json beside the hologram when not given");
  command->add_flag("--quiet", options->quiet, "Print nothing but errors");
  options->device.add_to(*command);
  command->callback([options] { run(*options); });
}

}  // namespace raywave::cli
