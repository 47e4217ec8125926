// SPDX-License-Identifier: Apache-2.0
#include "host/encode/encode.hpp"

#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_set.hpp"
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/encode/nrsh.hpp"
#include "host/encode/pictures.hpp"

namespace raywave::cli {
namespace {

struct EncodeArguments {
  HologramOptions hologram;
  DeviceOptions device;
  ReportOptions report;
  std::string out, format = "png";
};

void run_encode(const EncodeArguments& options) {
  const auto format = picture_format_of(options.format);
  if (extension_of(options.hologram.files.at(0)) != ".npy")
    throw InputError(in_quotes(options.hologram.files[0]) +
                     ": encode takes the complex field that render writes, field.npy");
  const auto field = options.hologram.load();
  const glm::ivec2 size(field.nx, field.ny);
  const auto spec = options.hologram.spec(size);
  const auto slm = options.hologram.slm_spec();
  const auto panel = std::make_shared<const Panel>(slm, size, spec.pitch_m, spec.wavelength_m);
  const cl::Device device(options.device.info());
  Encoder encoder(device, panel);

  OutputSet out(options.out);
  const auto save = [&](const auto& levels) {
    return save_pictures(out.folder(), "hologram", format, *panel, levels, field);
  };
  const auto pictures = slm.bits > 8 ? save(encode<std::uint16_t>(device, encoder, field))
                                     : save(encode(device, encoder, field));
  for (const auto& name : pictures) out.add(name);
  if (format == PictureFormat::mat) {
    const std::string name = "hologram_nrsh.txt";
    write_text(out.folder() / name, nrsh_configuration(spec, name));
    out.add(name);
  }
  const auto report = out.finish(encoded_report(spec, slm, field.frames, format, pictures));
  if (options.report.prints_text()) {
    std::printf("%d x %d pixels, %d %s, by %s\n", size.x, size.y, field.frames,
                field.frames == 1 ? "frame" : "frames", name_of(panel->slm().encoding).c_str());
    out.print();
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
  command
      ->add_option("--format", options->format,
                   "Of the pictures; rgb-24x1 and the like hold 24 frames of 1 bit ... in one RGB "
                   "picture, exr and mat hold the field (docs/slm.md)")
      ->type_name(picture_format_names())
      ->capture_default_str()
      ->group(group::output);
  add_output(*command, options->out, "hologram.png ... and report.json")->required();
  options->report.add_to(*command, "report.json");
  command->callback([options] { run_encode(*options); });
}

}  // namespace raywave::cli
