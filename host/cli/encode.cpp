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
#include "host/scene/scene_json.hpp"

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
  std::vector<ShownLight> light;  // of each frame

  std::size_t pixels() const { return area_of(panel->size_px()); }
};

/// Encodes the field of each laser. Those that show amplitudes have one scale, that of the
/// brightest.
template <class Level>
std::vector<EncodedLaser<Level>> encode_each(const LaserHolograms& holograms,
                                             const DeviceOptions& on) {
  std::vector<EncodedLaser<Level>> lasers;
  for (const auto& one : holograms.each) {
    auto& laser = lasers.emplace_back();
    laser.field = one.load();
    const glm::ivec2 size(laser.field.nx, laser.field.ny);
    laser.spec = one.spec(size);
    laser.panel = std::make_shared<const Panel>(one.slm_spec(), size, laser.spec.pitch_m,
                                                laser.spec.wavelength_m);
  }
  const cl::Device device(on.info());
  double clip = 0;
  for (auto& laser : lasers) {
    laser.encoder = std::make_unique<Encoder>(device, laser.panel);
    laser.levels = encode<Level>(device, *laser.encoder, laser.field, &laser.light);
    clip = std::max(clip, laser.encoder->own_clip());
  }
  for (auto& laser : lasers) {
    // Frames have clips of their own
    const bool has_own =
        lasers.size() == 1 || (laser.field.frames == 1 && laser.encoder->own_clip() == clip);
    if (!laser.encoder->needs_clip() || has_own) continue;
    laser.encoder->show_up_to(clip);
    laser.light.clear();
    laser.levels = encode<Level>(device, *laser.encoder, laser.field, &laser.light);
  }
  return lasers;
}

/// Powers of lasers whose levels show amplitudes up to the same one.
template <class Level>
std::vector<double> powers_of(const LaserSet& set, const std::vector<EncodedLaser<Level>>& lasers) {
  std::vector<double> needs;
  for (const auto& laser : lasers)
    needs.push_back(laser_need(laser.light, laser.pixels(), laser.panel->slm().encoding));
  return laser_powers(set, needs);
}

template <class Level>
void encode_all(const EncodeArguments& options, const LaserHolograms& holograms) {
  const auto format = picture_format_of(options.format);
  const auto lasers = encode_each<Level>(holograms, options.device);
  std::vector<double> powers;
  Json report;
  if (holograms.lasers) {
    powers = powers_of(holograms.lasers->lasers, lasers);
    report["colour"] =
        colour_json({holograms.lasers->lasers, 0, false, holograms.lasers->bench}, powers);
  }
  OutputSet out(options.out);
  for (std::size_t i = 0; i < lasers.size(); ++i) {
    const auto& [field, spec, panel, encoder, levels, light] = lasers[i];
    const auto stem = "hologram" + laser_suffix(spec.wavelength_m, lasers.size());
    const auto pictures = save_pictures(out.folder(), stem, format, *panel, levels, field);
    for (const auto& name : pictures) out.add(name);
    if (format == PictureFormat::mat) {
      const auto name = stem + "_nrsh.txt";
      write_text(out.folder() / name, nrsh_configuration(spec, name));
      out.add(name);
    }
    auto of_laser = encoded_report(spec, panel->slm(), field.frames, format, pictures);
    of_laser["scene"]["viewer"] = json_of(holograms.each[i].viewer());
    if (!holograms.lasers) {
      report = std::move(of_laser);
      break;
    }
    auto& told = report["colour"]["lasers"][i];
    told["mean_irradiance"] = laser_need(light, lasers[i].pixels(), Encoding::phase);
    told["pictures"] = pictures;
    told["report"] = std::move(of_laser);
  }
  const auto text = out.finish(report, options.report);
  if (options.report.prints_text()) {
    const auto& first = lasers[0];
    std::printf("%d x %d pixels, %d %s%s, by %s\n", first.field.nx, first.field.ny,
                first.field.frames, first.field.frames == 1 ? "frame" : "frames",
                powers.empty() ? "" : " of each laser", name_of(first.panel->slm().encoding));
    for (std::size_t i = 0; i < powers.size(); ++i)
      std::printf("%s: power %.3f\n", length_text(lasers[i].spec.wavelength_m).c_str(), powers[i]);
    out.print();
  }
  options.report.write(text);
}

void run_encode(const EncodeArguments& options) {
  picture_format_of(options.format);  // refused before any work
  const LaserHolograms holograms(options.hologram, true);
  if (extension_of(holograms.each[0].files[0]) != ".npy")
    throw InputError(in_quotes(options.hologram.files[0]) +
                     ": encode takes the complex field that render writes, field.npy, or "
                     "report.json beside it");
  const std::filesystem::path file(holograms.each[0].files[0]);
  const auto name = file.filename().string();
  if (name == "refined.npy" && file != options.hologram.files[0])
    options.report.note("the phases that were refined are encoded, refined.npy");
  if (name.starts_with("field"))
    if (const auto refined = "refined" + name.substr(5);
        std::filesystem::exists(file.parent_path() / refined))
      options.report.note("the field before its phases were refined is encoded; " + refined +
                          " has these");
  if (holograms.lasers && !options.hologram.pixels.wavelength.empty())
    throw InputError("--wavelength is for one field; those of a report have their own");
  holograms.each[0].slm_spec().bits > 8 ? encode_all<std::uint16_t>(options, holograms)
                                        : encode_all<std::uint8_t>(options, holograms);
}

}  // namespace

void add_encode(CLI::App& app) {
  auto* command =
      add_command(app, section::make, "encode",
                  "Make the pictures for an SLM from a field, without a new render",
                  "build/raywave render data/study.toml -o out\n"
                  "build/raywave encode out/field.npy --slm data/bench.toml -o encoded");
  const auto options = arguments_of(*command, run_encode);
  options->hologram.add_to(*command, "field.npy, or report.json for the fields beside it");
  add_set(*command, options->hologram.set);
  options->device.add_device_to(*command);
  option(*command, "--format", options->format, picture_format_names(), group::output,
         "Of the pictures; rgb-24x1 and the like hold 24 frames of 1 bit ... in one RGB "
         "picture, exr and mat hold the field (docs/slm.md)")
      ->capture_default_str();
  add_output(*command, options->out, "hologram.png ... and report.json")->required();
  options->report.add_to(*command, "report.json");
}

}  // namespace raywave::cli
