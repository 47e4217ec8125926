// SPDX-License-Identifier: Apache-2.0
#include "host/render.hpp"

#include <cstdio>
#include <memory>

#include "host/cli/commands.hpp"
#include "host/cli/goal_options.hpp"
#include "host/cli/progress.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/evaluate/report.hpp"
#include "host/scene/image.hpp"
#include "host/trace/tuning.hpp"

namespace raywave::cli {

void DeviceOptions::add_device_to(CLI::App& command) {
  command.add_option("--device", device,
                     "Device: index (0:1) or part of its name; also RAYWAVE_DEVICE");
}

void DeviceOptions::add_to(CLI::App& command) {
  add_device_to(command);
  command.add_option("--fft", fft,
                     "FFT back end: host, clfft or vkfft; chosen by device when not given");
}

cl::DeviceInfo DeviceOptions::info() const { return tuned(cl::find_device(device)); }

cl::FftBackend DeviceOptions::backend(const cl::DeviceInfo& info) const {
  if (fft.empty()) return cl::default_backend(info);
  for (const auto backend : cl::all_backends) {
    if (fft != cl::name_of(backend)) continue;
    if (!cl::serves(backend, info))
      throw cl::DeviceError("--fft " + fft + " does not serve " + info.name);
    return backend;
  }
  throw InputError("--fft " + fft + ": unknown back end; there are host, clfft and vkfft");
}

Method method_of(const std::string& name) {
  if (name == "wrp") return Method::wrp;
  if (name == "points") return Method::points;
  if (name == "rays") return Method::rays;
  throw InputError("--method " + name + ": unknown; there are wrp, points and rays");
}

namespace {

struct Options {
  std::string scene, out;
  std::vector<std::string> set;
  std::string method = "wrp";
  int rays = 100;
  DeviceOptions device;
  GoalOptions goal;
  bool json = false, quiet = false, save_wrps = false, no_field = false;
};

std::string numbered(const char* stem, std::size_t number, const char* extension) {
  return number == 1 ? std::string(stem) + extension
                     : std::string(stem) + "_" + std::to_string(number) + extension;
}

void run(const Options& options) {
  auto scene = load_scene(options.scene, options.set);
  const cl::Device device(options.device.info());
  RenderOptions how;
  how.fft = options.device.backend(device.info());
  how.method = method_of(options.method);
  const auto goal = options.goal.goal();
  if (goal.any() && how.method != Method::wrp)
    throw InputError("--quality, --budget and --psnr plan --method wrp alone");
  how.rays_per_axis = options.rays;
  how.keep_wrps = options.save_wrps;
  how.keep_field = !options.no_field;
  RenderResult result;
  std::vector<std::string> warnings;
  {
    ProgressBar bar(options.quiet);
    how.progress = [&](const std::string& what, double share) { bar.show(what, share); };
    if (goal.any()) {
      bar.show("plan", 0);
      const auto world = build_world(scene);
      auto planned = plan_scene(scene, world, figures_of(device.info()), goal);
      scene = std::move(planned.scene);
      warnings = std::move(planned.warnings);
      result = render(device, scene, world, how);
    } else {
      result = render(device, scene, how);
    }
  }

  if (!options.quiet) {
    for (const auto& warning : warnings) std::fprintf(stderr, "raywave: %s\n", warning.c_str());
    for (const auto& note : result.notes) std::fprintf(stderr, "raywave: %s\n", note.c_str());
  }

  const std::filesystem::path out(options.out);
  std::vector<std::string> written;
  for (std::size_t frame = 0; frame < result.levels.size(); ++frame) {
    written.push_back(numbered("hologram", frame + 1, ".png"));
    save_png(out / written.back(), result.plan.size.x, result.plan.size.y, result.levels[frame]);
  }
  const auto save_field = [&](const std::string& name, const FieldStack& field) {
    save_npy(out / name, field.nx, field.ny, field.frames, field.samples);
    written.push_back(name);
  };
  if (how.keep_field) save_field("field.npy", result.field);
  for (std::size_t i = 0; i < result.wrps.size(); ++i)
    save_field("wrp_" + std::to_string(i + 1) + ".npy", result.wrps[i]);
  const auto report = render_report_json(scene, result, device.info(), how.fft);
  write_text(out / "report.json", report);
  written.push_back("report.json");

  if (options.json) {
    std::fputs(report.c_str(), stdout);
  } else if (!options.quiet) {
    double total = 0;
    for (const auto& [stage, seconds] : result.seconds) total += seconds;
    std::printf("%d x %d hologram of %zu WRPs in %.2f s (trace %.2f s, propagate %.2f s) on %s\n",
                result.plan.size.x, result.plan.size.y, result.plan.wrps.size(), total,
                result.seconds["trace"], result.seconds["propagate"], device.info().name.c_str());
    for (const auto& name : written) std::printf("  %s\n", (out / name).c_str());
  }
}

}  // namespace

void add_render(CLI::App& app) {
  auto* command = app.add_subcommand("render", "Compute the hologram of a scene");
  auto options = std::make_shared<Options>();
  command->add_option("scene", options->scene, "Scene file (TOML)")->required();
  command
      ->add_option("-o,--out", options->out, "Folder for hologram.png, field.npy and report.json")
      ->required();
  command->add_option("--set", options->set, "Change a value of the scene: section.key=value")
      ->allow_extra_args(false);
  command->add_option("--method", options->method,
                      "wrp: rays to WRPs, carried to the hologram; points: every surface sample to "
                      "every pixel; rays: rays from every hologram pixel");
  command->add_option("--rays", options->rays, "Rays per axis and pixel of --method rays")
      ->check(CLI::Range(1, 1000));
  command->add_flag("--save-wrps", options->save_wrps,
                    "Also write the field of every WRP (wrp_1.npy, ...)");
  command->add_flag(
      "--no-field", options->no_field,
      "Do not keep the field: no field.npy, and an eighth of the host's memory for results");
  command->add_flag("--json", options->json, "Print the report instead of a summary");
  command->add_flag("--quiet", options->quiet, "Print nothing but errors");
  options->goal.add_to(*command);
  options->device.add_to(*command);
  command->callback([options] { run(*options); });
}

}  // namespace raywave::cli
