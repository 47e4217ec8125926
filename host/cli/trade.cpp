// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/trade/trade.hpp"

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>

#include "host/cli/commands.hpp"
#include "host/cli/picture_options.hpp"
#include "host/cli/progress.hpp"
#include "host/common/output.hpp"
#include "host/scene/image.hpp"

namespace raywave::cli {
namespace {

/// Holograms up to this size are compared with the sum of all points unasked.
constexpr double few_pixels = 512.0 * 512;

struct Options {
  std::string scene, out = ".", window;
  std::vector<std::string> z, set;
  TradeSpec trade;
  DeviceOptions device;
  std::optional<bool> against_points;
  bool quiet = false;
};

TradeSpec spec_of(const Options& options, const Scene& scene, const cl::DeviceInfo& device) {
  auto spec = options.trade;
  auto& pictures = spec.pictures;
  for (const auto& text : options.z) pictures.depths_m.push_back(positive_length_m(text, "-z"));
  if (!options.window.empty()) {
    const auto [x, y] = two_parts(options.window, 'x', "--window");
    pictures.window_m =
        glm::dvec2(positive_length_m(x, "--window"), positive_length_m(y, "--window"));
  }
  const auto size = scene.hologram.resolution;
  pictures.against_points =
      options.against_points.value_or(static_cast<double>(size.x) * size.y <= few_pixels);
  if (!options.device.fft.empty()) spec.fft = options.device.backend(device);
  return spec;
}

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

void run(const Options& options) {
  const auto scene = load_scene(options.scene, options.set);
  const cl::Device device(options.device.info());
  TradeBench bench(device, scene, spec_of(options, scene, device.info()));

  const std::filesystem::path out(options.out);
  const auto file = out / "trade.json";
  if (std::filesystem::exists(file)) {
    const auto known = bench.resume(text_of(file));
    if (!options.quiet && known)
      std::fprintf(stderr, "%s: %d rows taken over\n", file.c_str(), *known);
    if (!options.quiet && !known)
      std::fprintf(stderr,
                   "%s: of another scene, device, version or way of looking; starting anew\n",
                   file.c_str());
  }
  ColourPicture sheet;
  {
    ProgressBar bar(options.quiet);
    const auto progress = [&](const std::string& what, double share) { bar.show(what, share); };
    bench.measure([&] { write_text(file, trade_json(bench.trade())); }, progress);
    sheet = bench.sheet(progress);
  }
  write_text(file, trade_json(bench.trade()));
  write_text(out / "trade.csv", trade_csv(bench.trade()));
  save_png_rgb(out / "trade.png", sheet.width, sheet.height, sheet.rgb);
  if (options.quiet) return;
  std::fputs(trade_text(bench.trade()).c_str(), stdout);
  std::printf(
      "\n%s  pictures along the frontier; rows: depths, columns: lens, then the fastest first; "
      "trade.json and trade.csv beside it\n",
      (out / "trade.png").c_str());
}

}  // namespace

void add_trade(CLI::App& app) {
  auto* command = app.add_subcommand("trade",
                                     "Measure what each knob of a scene costs in time and buys in "
                                     "truth, and the frontier (goes on where it was interrupted)");
  auto options = std::make_shared<Options>();
  auto& trade = options->trade;
  trade.pictures.lens_points = 8;
  command
      ->add_option(
          "scene", options->scene,
          "Scene file (TOML); knobs that it gives stay as they are, --set KEY=auto frees them")
      ->required();
  command->add_option("-o,--out", options->out,
                      "Folder for trade.json, trade.csv and trade.png (.)");
  command->add_flag("--quick", trade.quick, "Fewer values of each knob");
  auto* presets = command->add_flag(
      "--presets", trade.presets,
      "Nothing but draft, balanced, accurate and reference, beside what plans predict of them");
  command
      ->add_flag("--exhaustive", trade.exhaustive,
                 "All that plans choose among, but what is predicted to be far from the frontier "
                 "(hours; with --quick, some)")
      ->excludes(presets);
  command
      ->add_option("--renders", trade.renders,
                   "Renders timed per configuration; 3 to 15 in a second when not given")
      ->check(CLI::Range(1, 1000));
  command
      ->add_option("-z", options->z,
                   "Depth, e.g. 95mm; may be given many times; nearest and farthest surface and a "
                   "little in front when not given")
      ->allow_extra_args(false);
  command->add_flag("--views,!--no-views", trade.pictures.views,
                    "Presets and single knobs also through the sides of the hologram");
  command->add_option(
      "--window", options->window,
      "Size of the pictures, e.g. 14.36mmx8.08mm; what the WRPs cover when not given");
  command->add_option("--border", trade.pictures.border_px,
                      "Pixels left out on every side after the blur (20)");
  command->add_option("--points", trade.pictures.lens_points,
                      "Points on the lens that rays start from, per axis (8)");
  command->add_flag_function(
      "--against-points,!--no-against-points",
      [options](std::int64_t count) { options->against_points = count > 0; },
      "Presets and single knobs are compared with the sum of all points, or not (slow); up to 512 "
      "x 512 pixels they are");
  command->add_option("--set", options->set, "Change a value of the scene: section.key=value")
      ->allow_extra_args(false);
  command->add_flag("--quiet", options->quiet, "Print nothing but errors");
  options->device.add_to(*command);
  command->callback([options] { run(*options); });
}

}  // namespace raywave::cli
