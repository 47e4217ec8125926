// SPDX-License-Identifier: Apache-2.0
#include "host/encode/pattern.hpp"

#include <charconv>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "host/cli/commands.hpp"
#include "host/cli/help.hpp"
#include "host/cli/holograms.hpp"
#include "host/cli/options.hpp"
#include "host/cli/output_set.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/encode/encode.hpp"
#include "host/scene/read_slm.hpp"
#include "host/scene/units.hpp"

namespace raywave::cli {
namespace {

struct PatternArguments {
  std::string pattern, slm, size, pitch, wavelength, focal = "300mm", to = "right", out;
  double period_px = 16;
  std::vector<std::string> set;
  DeviceOptions device;
  ReportOptions report;
};

int pixels(const std::string& text) {
  int count = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), count);
  if (error != std::errc() || end != text.data() + text.size() || count < 1 || count > 65536)
    throw InputError("--size " + in_quotes(text) + ": must be 1 to 65536 pixels, as in 1920x1080");
  return count;
}

HologramSpec hologram_of(const PatternArguments& options) {
  HologramSpec hologram;
  const auto [columns, rows] = two_parts(options.size, 'x', "--size");
  hologram.resolution = {pixels(columns), pixels(rows)};
  hologram.pitch_m = given_pitch_m(options.pitch);
  hologram.wavelength_m = given_wavelength_m(options.wavelength);
  return hologram;
}

SlmSpec slm_of(const PatternArguments& options, double wavelength_m) {
  SlmSpec slm;
  if (!options.slm.empty())
    slm = load_slm(options.slm, wavelength_m, options.set);
  else if (!options.set.empty())
    throw InputError("--set changes keys of the file of --slm, which is not given");
  return slm_of_pattern(std::move(slm));
}

/// What is to be seen where the SLM is described right.
std::string expectation(const PatternSpec& spec, const HologramSpec& hologram) {
  const auto rounded = [](double length_m) {
    return length_text(std::round(length_m * 1e5) / 1e5);
  };
  switch (spec.pattern) {
    case Pattern::lens:
      return spec.focal_m > 0
                 ? "a spot " + rounded(spec.focal_m) + " after the SLM"
                 : "a spot that seems to lie " + rounded(-spec.focal_m) + " before the SLM";
    case Pattern::blaze: {
      const char* side = spec.side == Side::right  ? "to the right"
                         : spec.side == Side::left ? "to the left"
                         : spec.side == Side::up   ? "up"
                                                   : "down";
      return "a spot " + rounded(blaze_slope(spec, hologram)) + " per metre of way " + side +
             ", looking along the light";
    }
    case Pattern::checker:
      return "no light on the axis, four spots around it";
    case Pattern::ramp:
      return "grey that rises to the right, under a plain quarter";
  }
  return "";
}

void run_pattern(const PatternArguments& options) {
  PatternSpec spec;
  spec.pattern = choice_of<Pattern>(options.pattern, "pattern");
  spec.side = choice_of<Side>(options.to, "to");
  spec.focal_m = given_length_m(options.focal, "--focal");
  spec.period_px = options.period_px;
  const auto hologram = hologram_of(options);
  const auto slm = slm_of(options, hologram.wavelength_m);
  const auto field = pattern_field(spec, hologram);
  const auto panel = std::make_shared<const Panel>(slm, hologram.resolution, hologram.pitch_m,
                                                   hologram.wavelength_m);
  const cl::Device device(options.device.info());
  Encoder encoder(device, panel);

  OutputSet out(options.out);
  const auto stem = std::string("pattern_") + name_of(spec.pattern);
  const auto format = slm.bits > 8 ? PictureFormat::png16 : PictureFormat::png;
  const auto save = [&](const auto& levels) {
    return save_pictures(out.folder(), stem, format, *panel, levels, field);
  };
  const auto pictures = slm.bits > 8 ? save(encode<std::uint16_t>(device, encoder, field))
                                     : save(encode(device, encoder, field));
  auto report = encoded_report(hologram, slm, 1, format, pictures);
  const auto seen = expectation(spec, hologram);
  report["pattern"] = {{"name", name_of(spec.pattern)}, {"shows", seen}};
  if (spec.pattern == Pattern::lens) report["pattern"]["focal_m"] = spec.focal_m;
  if (spec.pattern == Pattern::blaze) report["pattern"]["slope"] = blaze_slope(spec, hologram);
  for (const auto& name : pictures) out.add(name);
  const auto text = out.finish(std::move(report), options.report);
  if (options.report.prints_text()) {
    std::printf("%s shows %s\n", name_of(spec.pattern), seen.c_str());
    out.print();
  }
  options.report.write(text);
}

}  // namespace

void add_pattern(CLI::App& app) {
  auto* command = add_command(
      app, section::make, "pattern",
      "Make a test picture that tells whether an SLM is set up right",
      "build/raywave pattern lens --slm data/bench.toml --size 1920x1080 --pitch 3.74um \\\n"
      "    --wavelength 638nm -o patterns");
  const auto options = arguments_of(*command, run_pattern);
  argument(*command, "PATTERN", options->pattern, "lens|blaze|checker|ramp",
           "lens, blaze, checker or ramp; docs/slm.md says what to see")
      ->required();
  option(*command, "--slm", options->slm, "SCENE", group::pictures,
         "File with section [slm]; levels of phase when not given");
  add_set(*command, options->set);
  option(*command, "--size", options->size, "NXxNY", group::pictures,
         "Pixels of the SLM, e.g. 1920x1080")
      ->required();
  option(*command, "--pitch", options->pitch, "LENGTH", group::pictures,
         "Pixel pitch (one, or x,y)")
      ->required();
  option(*command, "--wavelength", options->wavelength, "LENGTH", group::pictures, "Wavelength")
      ->required();
  option(*command, "--focal", options->focal, "LENGTH", group::pictures,
         "lens: focal length; negative ones spread the light")
      ->capture_default_str();
  option(*command, "--period", options->period_px, "N", group::pictures,
         "blaze: pixels to a turn of phase; checker: pixels to two squares")
      ->capture_default_str();
  option(*command, "--to", options->to, "right|left|up|down", group::pictures,
         "blaze: where the light goes, looking along it")
      ->capture_default_str();
  options->device.add_device_to(*command);
  add_output(*command, options->out, "the picture and report.json")->required();
  options->report.add_to(*command, "report.json");
}

}  // namespace raywave::cli
