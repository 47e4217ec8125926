// SPDX-License-Identifier: Apache-2.0
#include "host/view/reconstruct.hpp"

#include <memory>
#include <nlohmann/json.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/options.hpp"
#include "host/cli/progress.hpp"

namespace raywave::cli {

namespace {

struct ReconstructArguments {
  HologramOptions hologram;
  DepthOptions depths;
  ViewOptions view;
  DeviceOptions device;
  ReportOptions report;
};

void run_reconstruct(const ReconstructArguments& options) {
  const auto hologram = options.hologram.load();
  const auto spec = options.hologram.spec({hologram.nx, hologram.ny});

  ReconstructSpec what;
  what.window_m = options.depths.window_m();
  what.view = options.view.view();
  what.aperture = options.view.aperture();
  options.view.check_percentile();
  const auto depths_m = options.depths.depths_m(options.hologram.viewer());

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
    pictures.push_back(options.view.save(image, name, z_m, "intensity", options.report));
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
  options->depths.add_to(*command, "", "the hologram's");
  options->device.add_to(*command);
  options->view.add_to(*command);
  options->report.add_to(*command, "the list of pictures");
  command->callback([options] { run_reconstruct(*options); });
}

}  // namespace raywave::cli
