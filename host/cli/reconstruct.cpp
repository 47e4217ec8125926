// SPDX-License-Identifier: Apache-2.0
#include "host/reconstruct.hpp"

#include <cmath>
#include <cstdio>
#include <memory>

#include "host/cli/commands.hpp"
#include "host/cli/progress.hpp"
#include "host/error.hpp"
#include "host/report.hpp"

using namespace raywave;

namespace {

struct Options {
  std::string hologram, out, window, view, pitch, wavelength;
  std::vector<std::string> z;
  double aperture = 0, percentile = 99.5;
  DeviceOptions device;
  bool quiet = false;
};

std::pair<std::string, std::string> two_parts(const std::string& text, char separator, const std::string& what) {
  const auto at = text.find(separator);
  if (at == std::string::npos || text.find(separator, at + 1) != std::string::npos)
    throw InputError(what + " \"" + text + "\": two values with '" + separator + "' between them are needed");
  return {text.substr(0, at), text.substr(at + 1)};
}

double number(const std::string& text, const std::string& what) {
  std::size_t used = 0;
  double value = NAN;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
  }
  if (used != text.size() || !std::isfinite(value)) throw InputError(what + " \"" + text + "\": a number is needed");
  return value;
}

double positive_length_m(const std::string& text, const std::string& what) {
  const double length = parse_length_m(text, what);
  if (!(length > 0)) throw InputError(what + " \"" + text + "\": must be > 0");
  return length;
}

HologramSpec spec_of(const Options& options, const std::filesystem::path& file) {
  HologramSpec spec;
  if (options.pitch.empty() || options.wavelength.empty()) spec = hologram_of_report(file.parent_path() / "report.json");
  if (!options.pitch.empty()) {
    const bool two = options.pitch.find(',') != std::string::npos;
    const auto [x, y] = two ? two_parts(options.pitch, ',', "--pitch") : std::pair(options.pitch, options.pitch);
    spec.pitch_m = {positive_length_m(x, "--pitch"), positive_length_m(y, "--pitch")};
  }
  if (!options.wavelength.empty()) spec.wavelength_m = positive_length_m(options.wavelength, "--wavelength");
  return spec;
}

void run(const Options& options) {
  const std::filesystem::path file(options.hologram);
  const auto hologram = file.extension() == ".npy" ? load_npy(file) : field_of_levels(load_levels(file, file.string()));
  auto spec = spec_of(options, file);
  spec.resolution = {hologram.nx, hologram.ny};

  ReconstructSpec what;
  if (!options.window.empty()) {
    const auto [x, y] = two_parts(options.window, 'x', "--window");
    what.window_m = glm::dvec2(positive_length_m(x, "--window"), positive_length_m(y, "--window"));
  }
  if (!options.view.empty()) {
    const auto [x, y] = two_parts(options.view, ',', "--view");
    what.view = {number(x, "--view"), number(y, "--view")};
    if (std::abs(what.view.x) > 1 || std::abs(what.view.y) > 1)
      throw InputError("--view \"" + options.view + "\": both must be from -1 to 1");
  }
  const double aperture = options.aperture > 0 ? options.aperture : options.view.empty() ? 1.0 : 0.5;
  if (!(aperture <= 1)) throw InputError("--aperture: must be > 0 and <= 1");
  what.aperture = {aperture, aperture};
  if (!(options.percentile > 0 && options.percentile <= 100)) throw InputError("--percentile: must be > 0 and <= 100");

  std::vector<double> depths_m;
  for (const auto& z : options.z) depths_m.push_back(positive_length_m(z, "-z"));

  const cl::Device device(options.device.info());
  const auto backend = options.device.backend(device.info());
  for (const double z_m : depths_m) {
    what.z_m = z_m;
    std::array<char, 64> name;
    std::snprintf(name.data(), name.size(), "reconstruction_%gmm", z_m * 1e3);
    Image image;
    {
      ProgressBar bar(options.quiet);
      image = reconstruct(device, backend, hologram, spec, what, [&](double share) { bar.show(name.data(), share); });
    }
    double white = 0;
    const auto picture = expose(image, options.percentile, &white);
    const auto base = std::filesystem::path(options.out) / name.data();
    save_png(base.string() + ".png", image.width, image.height, picture);
    save_exr(base.string() + ".exr", image.width, image.height, image.pixels);
    if (!options.quiet)
      std::printf("%s.png  %d x %d, white = intensity %.4g (percentile %g), .exr beside it\n", base.c_str(), image.width, image.height,
                  white, options.percentile);
  }
}

}  // namespace

void add_reconstruct(CLI::App& app) {
  auto* command = app.add_subcommand("reconstruct", "Show what a hologram shows at given depths");
  auto options = std::make_shared<Options>();
  command->add_option("hologram", options->hologram, "field.npy, or hologram.png (phase levels)")->required();
  command->add_option("-z", options->z, "Depth, e.g. 95mm; may be given many times")->required()->allow_extra_args(false);
  command->add_option("-o,--out", options->out, "Folder for the pictures")->required();
  command->add_option("--window", options->window, "Size of the picture, e.g. 14.36mmx8.08mm; the hologram's when not given");
  command->add_option("--view", options->view,
                      "Look through a part of the hologram centred there, e.g. 0.5,0: (-1,-1) bottom left to (1,1) top right");
  command->add_option("--aperture", options->aperture, "Size of that part in holograms; 0.5 with --view, else 1");
  command->add_option("--percentile", options->percentile, "Percentile of the intensities that the PNG shows white");
  command->add_option("--pitch", options->pitch, "Pixel pitch (one, or x,y); from report.json beside the hologram when not given");
  command->add_option("--wavelength", options->wavelength, "Wavelength; from report.json beside the hologram when not given");
  command->add_flag("--quiet", options->quiet, "Print nothing but errors");
  options->device.add_to(*command);
  command->callback([options] { run(*options); });
}
