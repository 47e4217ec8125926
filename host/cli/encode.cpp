// SPDX-License-Identifier: Apache-2.0
#include "host/encode/encode.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

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
#include "host/evaluate/report.hpp"
#include "host/render.hpp"

namespace raywave::cli {
namespace {

struct EncodeArguments {
  HologramOptions hologram;
  DeviceOptions device;
  ReportOptions report;
  std::string out, format = "png";
};

/// A laser's field and what is made of it.
template <class Level>
struct EncodedLaser {
  FieldStack field;
  HologramSpec spec;
  std::shared_ptr<const Panel> panel;
  std::unique_ptr<Encoder> encoder;
  std::vector<std::vector<Level>> levels;
};

/// Encodes the fields of three lasers. Those that show amplitudes have one scale, that of the
/// brightest.
template <class Level>
void encode_lasers(const EncodeArguments& options, const ReportedLasers& reported,
                   std::vector<EncodedLaser<Level>> lasers, const cl::Device& device) {
  const auto format = picture_format_of(options.format);
  double clip = 0;
  for (auto& laser : lasers) {
    laser.encoder = std::make_unique<Encoder>(device, laser.panel);
    laser.levels = encode<Level>(device, *laser.encoder, laser.field);
    clip = std::max(clip, laser.encoder->own_clip());
  }
  for (auto& laser : lasers) {
    if (!laser.encoder->needs_clip() || laser.encoder->own_clip() == clip) continue;
    laser.encoder->show_up_to(clip);
    laser.levels = encode<Level>(device, *laser.encoder, laser.field);
  }

  OutputSet out(options.out);
  nlohmann::ordered_json report;
  auto& colour = report["colour"];
  colour = colour_json({reported.lasers});
  const auto encoding = lasers[0].panel->slm().encoding;
  std::vector<double> energies, needs;
  for (const auto& laser : lasers) {
    energies.push_back(mean_light_of(laser.field));
    needs.push_back(encoding == Encoding::phase ? energies.back()
                                                : clipping_loss(laser.field, clip));
  }
  const auto powers = laser_powers(reported.lasers, needs);
  for (std::size_t i = 0; i < lasers.size(); ++i) {
    const auto& laser = lasers[i];
    const auto stem = "hologram_" + laser_name(laser.spec.wavelength_m);
    const auto pictures =
        save_pictures(out.folder(), stem, format, *laser.panel, laser.levels, laser.field);
    for (const auto& name : pictures) out.add(name);
    if (format == PictureFormat::mat) {
      const auto name = stem + "_nrsh.txt";
      write_text(out.folder() / name, nrsh_configuration(laser.spec, name));
      out.add(name);
    }
    auto& told = colour["lasers"][i];
    told["power"] = powers[i];
    told["duty"] = 1.0 / static_cast<double>(lasers.size());
    told["mean_irradiance"] = energies[i];
    told["pictures"] = pictures;
    told["report"] =
        encoded_report(laser.spec, laser.panel->slm(), laser.field.frames, format, pictures);
  }
  const auto text = out.finish(report);
  if (options.report.prints_text()) {
    const auto& first = lasers[0];
    std::printf("%d x %d pixels, %d %s of each laser, by %s\n", first.field.nx, first.field.ny,
                first.field.frames, first.field.frames == 1 ? "frame" : "frames",
                name_of(encoding).c_str());
    for (std::size_t i = 0; i < lasers.size(); ++i)
      std::printf("%s: power %.3f\n", length_text(lasers[i].spec.wavelength_m).c_str(), powers[i]);
    out.print();
  }
  options.report.write(text);
}

void run_encode_lasers(const EncodeArguments& options, const ReportedLasers& reported) {
  const std::filesystem::path report(options.hologram.files.at(0));
  if (!options.hologram.pixels.wavelength.empty())
    throw InputError("--wavelength is for one field; those of a report have their own");
  for (const auto& files : reported.files)
    if (files.field.empty())
      throw InputError(one_line(report.string()) +
                       ": its fields were not kept; render without --no-field (raywave refine "
                       "keeps phases alone)");
  const auto encoded = [&]<class Level>(const Level&) {
    std::vector<EncodedLaser<Level>> lasers;
    for (const auto& files : reported.files) {
      auto of_laser = options.hologram;
      of_laser.files = {
          (report.parent_path() / std::filesystem::path(files.field).filename()).string()};
      require_of_report(report, {of_laser.files.begin(), of_laser.files.end()});
      auto& laser = lasers.emplace_back();
      laser.field = of_laser.load();
      const glm::ivec2 size(laser.field.nx, laser.field.ny);
      laser.spec = of_laser.spec(size);
      laser.spec.wavelength_m = reported.lasers.wavelengths_m[lasers.size() - 1];
      laser.panel = std::make_shared<const Panel>(of_laser.slm_spec(), size, laser.spec.pitch_m,
                                                  laser.spec.wavelength_m);
    }
    const cl::Device device(options.device.info());
    encode_lasers(options, reported, std::move(lasers), device);
  };
  auto of_first = options.hologram;
  of_first.files = {(report.parent_path() / reported.files[0].field).string()};
  of_first.slm_spec().bits > 8 ? encoded(std::uint16_t{}) : encoded(std::uint8_t{});
}

void run_encode(const EncodeArguments& options) {
  const auto format = picture_format_of(options.format);
  const auto& files = options.hologram.files;
  if (files.size() == 1 && extension_of(files[0]) == ".json") {
    if (const auto reported = lasers_of_report(files[0])) {
      run_encode_lasers(options, *reported);
      return;
    }
  }
  if (extension_of(files.at(0)) != ".npy")
    throw InputError(in_quotes(files[0]) +
                     ": encode takes the complex field that render writes, field.npy, or the "
                     "report.json of three lasers");
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
  options->hologram.add_to(*command, "field.npy, or report.json of three lasers for their fields");
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
