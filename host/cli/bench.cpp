// SPDX-License-Identifier: Apache-2.0
#include "host/evaluate/bench/bench.hpp"

#include <unistd.h>

#include <cstdlib>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/options.hpp"
#include "host/common/error.hpp"
#include "host/common/npy.hpp"
#include "host/common/text.hpp"
#include "host/forecast/presets.hpp"
#include "host/forecast/tuning.hpp"

namespace raywave::cli {
namespace {

namespace fs = std::filesystem;

struct BenchArguments : SceneArguments {
  std::string suite, only, data, peers;
  BenchOptions bench;
  bool markdown = false, no_quality = false;
};

/// `named`, or the first of the usual places that is there.
fs::path folder_of(const std::string& named, const std::vector<fs::path>& usual) {
  if (!named.empty()) return named;
  for (const auto& folder : usual) {
    if (fs::is_directory(folder)) return folder;
  }
  return usual.back();
}

BenchSuite suite_of(const BenchArguments& options, const cl::DeviceInfo& device) {
  if (!options.scene.file.empty()) {
    if (!options.suite.empty()) throw InputError("--suite and a scene: give one of them");
    BenchCase one;
    one.group = "scene";
    one.scenes = options.scene.load_all(options.report);
    if (const auto goal = options.goal.goal(); goal.any()) {
      const auto planned =
          plan_scenes(one.scenes, build_world(one.scenes[0]), figures_of(device), goal);
      for (std::size_t i = 0; i < planned.size(); ++i) one.scenes[i] = planned[i].scene;
      // Rows count holograms, of which a picture has several
      if (goal.rate_per_s)
        one.target.required_per_s = *goal.rate_per_s * planned[0].scene.sampling.frames *
                                    static_cast<double>(planned.size());
    }
    one.name = one_line(fs::path(options.scene.file).stem().string());
    return {"scene", {one}, {}, {}};
  }
  if (options.goal.goal().any())
    throw InputError("goals are for a scene: raywave bench SCENE, in place of a suite");
  const auto name = !options.suite.empty()               ? options.suite
                    : device.kind == cl::DeviceKind::gpu ? "gpu"
                                                         : "cpu";
  return bench_suite(name, folder_of(options.data, {program_folder() / ".." / "data", "data"}));
}

/// The rows of a program of tests/bench/; none where it is not built.
std::vector<BenchRow> rows_of(const BenchPeer& peer, const fs::path& folder, Bench& bench) {
  const auto program = folder / peer.program;
  if (!fs::exists(program)) return {};
  auto arguments = peer.arguments;
  arguments.insert(
      arguments.end(),
      {"--frames", std::to_string(bench.options().quick ? peer.quick_frames : peer.frames)});
  if (!peer.scene || !bench.options().quality) return run_peer(program, arguments);
  const auto field =
      fs::temp_directory_path() / ("raywave-peer-" + std::to_string(getpid()) + ".npy");
  arguments.insert(arguments.end(), {"--field", field.string()});
  auto rows = run_peer(program, arguments);
  for (auto& row : rows) {
    Rendered rendered;
    rendered.lasers.emplace_back().field = load_npy(field);
    row.quality = bench.quality_of({*peer.scene}, build_world(*peer.scene), std::move(rendered));
  }
  fs::remove(field);
  return rows;
}

void run_bench(const BenchArguments& options) {
  auto info = options.device.info();
  const auto waves = options.device.waves(info);
  if (waves && options.scene.file.empty())
    throw InputError("--waves-on is for a scene: raywave bench SCENE, in place of a suite");
  auto suite = suite_of(options, info);
  const auto unwanted = [&](const std::string& name) {
    return name.find(options.only) == std::string::npos;
  };
  std::erase_if(suite.cases, [&](const BenchCase& c) { return unwanted(c.group + " " + c.name); });
  std::erase_if(suite.peers, [&](const BenchPeer& p) { return unwanted("peer " + p.name); });
  if (suite.cases.empty() && suite.peers.empty())
    throw InputError("--only \"" + options.only +
                     "\": no row's name holds this; without --only all are measured");

  auto how = options.bench;
  how.waves = waves;
  how.fft = options.device.backend(waves.value_or(info));
  how.quality = !options.no_quality && !how.quick;
  if (how.quick) how.seconds = 1;
  Bench bench(info, how);
  const auto style = options.markdown ? BenchStyle::markdown : BenchStyle::aligned;
  options.report.print(bench_header(bench, suite.name) + "\n" + bench_heads(style));
  std::vector<BenchRow> rows;
  const auto add = [&](BenchRow row) {
    options.report.print(bench_line(row, style));
    rows.push_back(std::move(row));
  };
  for (const auto& c : suite.cases) add(bench.run(c));
  setenv("RAYWAVE_DEVICE", info.index.c_str(), 1);  // for the peers
  for (const auto& peer : suite.peers) {
    for (auto& row : rows_of(peer, folder_of(options.peers, {program_folder() / "tests"}), bench))
      add(std::move(row));
  }

  const auto ratios = fill_ratios(suite.ratios, rows);
  for (const auto& table :
       {bench_work_table(bench, rows, style), bench_ratio_table(ratios, style)}) {
    if (!table.empty()) options.report.print("\n" + table);
  }
  options.report.write(bench_json(bench, suite.name, rows, ratios));
}

}  // namespace

void add_bench(CLI::App& app) {
  auto* command = add_command(app, section::measure, "bench",
                              "Measure frames of moving scenes: time by stage, memory, quality",
                              "build/raywave bench --quick --only \"1 WRP\"");
  const auto options = arguments_of(*command, run_bench);
  options->scene.add_to(*command, "Scene file (TOML), in place of a suite");
  options->goal.add_to(*command);
  option(*command, "--suite", options->suite, "cpu|gpu|paper|scaling", group::measurement,
         "cpu or gpu, by device, when not given");
  add_only(*command, options->only, "\"1 WRP\"");
  option(*command, "--frames", options->bench.frames, "N", group::measurement,
         "Frames per row; as many as five seconds hold when not given, 3 to 101")
      ->check(CLI::Range(1, 100000));
  flag(*command, "--quick", options->bench.quick, group::measurement,
       "One second per row, without quality");
  flag(*command, "--no-quality", options->no_quality, group::measurement,
       "Leave out the comparison with the ideal lens");
  option(*command, "--data", options->data, "FOLDER", group::measurement,
         "Folder of the demo scenes; data/ beside the build or here when not given");
  option(*command, "--peers", options->peers, "FOLDER", group::measurement,
         "Folder of peer_embree_fftw and bench_propagation; tests/ beside the program "
         "when not given");
  add_lens_points(*command, options->bench.lens_points);
  options->device.add_to(*command);
  options->device.add_waves_to(*command);
  flag(*command, "--markdown", options->markdown, group::output, "Tables in Markdown");
  options->report.add_to(*command, "all figures");
}

}  // namespace raywave::cli
