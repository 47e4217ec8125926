// SPDX-License-Identifier: Apache-2.0
#include "host/encode/encode.hpp"

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/options.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/slm_json.hpp"

namespace raywave::cli {
namespace {

struct EncodeArguments {
  HologramOptions hologram;
  DeviceOptions device;
  ReportOptions report;
  std::string out;
};

void run_encode(const EncodeArguments& options) {
  if (!std::filesystem::path(options.hologram.files.at(0)).extension().string().ends_with("npy"))
    throw InputError(in_quotes(options.hologram.files[0]) +
                     ": encode takes the complex field that render writes, field.npy");
  const auto field = options.hologram.load();
  const glm::ivec2 size(field.nx, field.ny);
  const auto spec = options.hologram.spec(size);
  const auto slm = options.hologram.slm_spec();
  const auto panel = std::make_shared<const Panel>(slm, size, spec.pitch_m, spec.wavelength_m);
  const cl::Device device(options.device.info());
  Encoder encoder(device, panel);
  const auto levels = encode(device, encoder, field);

  const std::filesystem::path out(options.out);
  std::vector<std::string> written;
  for (std::size_t frame = 0; frame < levels.size(); ++frame)
    written.push_back(save_hologram(out, frame, slm, size, levels[frame]));
  // What reconstruct and encode need to know of the pictures beside it
  const nlohmann::ordered_json report{{"scene",
                                       {{"hologram",
                                         {{"resolution", {size.x, size.y}},
                                          {"pitch_m", {spec.pitch_m.x, spec.pitch_m.y}},
                                          {"wavelength_m", spec.wavelength_m}}},
                                        {"slm", json_of(slm)},
                                        {"sampling", {{"frames", field.frames}}}}},
                                      {"pictures", written}};
  write_text(out / "report.json", report.dump(2) + "\n");
  written.push_back("report.json");
  if (options.report.prints_text()) {
    std::printf("%d x %d pixels, %d %s, by %s\n", size.x, size.y, field.frames,
                field.frames == 1 ? "frame" : "frames", name_of(slm.encoding).c_str());
    for (const auto& name : written) std::printf("  %s\n", (out / name).c_str());
  }
  options.report.write(report);
}

}  // namespace

void add_encode(CLI::App& app) {
  auto* command =
      add_command(app, section::make, "encode",
                  "Make the pictures for an SLM from a field, without a new render",
                  "build/raywave render data/study.toml -o out\n"
                  "build/raywave encode out/field.npy --slm data/bench.toml -o encoded");
  auto options = std::make_shared<EncodeArguments>();
  options->hologram.add_to(*command, "field.npy");
  add_set(*command, options->hologram.set);
  options->device.add_device_to(*command);
  add_output(*command, options->out, "hologram.png ... and report.json")->required();
  options->report.add_to(*command, "report.json");
  command->callback([options] { run_encode(*options); });
}

}  // namespace raywave::cli
