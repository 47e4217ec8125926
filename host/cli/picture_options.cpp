// SPDX-License-Identifier: Apache-2.0
#include "host/cli/picture_options.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>

#include "host/common/error.hpp"
#include "host/scene/scene.hpp"
#include "host/view/reconstruct.hpp"

namespace raywave::cli {
namespace {

double number(const std::string& text, const std::string& what, const char* wanted = "a number") {
  std::size_t used = 0;
  double value = NAN;
  try {
    value = std::stod(text, &used);
  } catch (const std::exception&) {
  }
  if (used != text.size() || !std::isfinite(value))
    throw InputError(what + " \"" + text + "\": " + wanted + " is needed");
  return value;
}

}  // namespace

std::pair<std::string, std::string> two_parts(const std::string& text, char separator,
                                              const std::string& what) {
  const auto at = text.find(separator);
  if (at == std::string::npos || text.find(separator, at + 1) != std::string::npos)
    throw InputError(what + " \"" + text + "\": two values with '" + separator +
                     "' between them are needed");
  return {text.substr(0, at), text.substr(at + 1)};
}

double positive_length_m(const std::string& text, const std::string& what) {
  const double length = parse_length_m(text, what);
  if (!(length > 0)) throw InputError(what + " \"" + text + "\": must be > 0");
  return length;
}

std::string name_at_depth(const std::string& stem, double z_m) {
  std::array<char, 32> depth;
  std::snprintf(depth.data(), depth.size(), "_%gmm", z_m * 1e3);
  return stem + depth.data();
}

void PictureOptions::add_to(CLI::App& command) {
  command.add_option("-z", z, "Depth, e.g. 95mm; may be given many times")
      ->required()
      ->allow_extra_args(false);
  command.add_option("-o,--out", out, "Folder for the pictures")->required();
  command.add_option("--window", window,
                     "Size of the picture, e.g. 14.36mmx8.08mm; the hologram's when not given");
  command.add_option("--view", view_centre,
                     "Look through a part of the hologram centred there, e.g. 0.5,0: (-1,-1) "
                     "bottom left to (1,1) top right");
  command.add_option("--aperture", aperture_size,
                     "Size of that part in holograms, \"hologram\" for all of it, \"part\" for "
                     "0.5; part with --view, else hologram");
  command.add_option("--percentile", percentile,
                     "Percentile of the pixels that the PNG shows white");
}

std::vector<double> PictureOptions::depths_m() const {
  std::vector<double> depths;
  for (const auto& text : z) depths.push_back(positive_length_m(text, "-z"));
  return depths;
}

std::optional<glm::dvec2> PictureOptions::window_m() const {
  if (window.empty()) return std::nullopt;
  const auto [x, y] = two_parts(window, 'x', "--window");
  return glm::dvec2(positive_length_m(x, "--window"), positive_length_m(y, "--window"));
}

glm::dvec2 PictureOptions::view() const {
  if (view_centre.empty()) return {0, 0};
  const auto [x, y] = two_parts(view_centre, ',', "--view");
  const glm::dvec2 centre(number(x, "--view"), number(y, "--view"));
  if (std::abs(centre.x) > 1 || std::abs(centre.y) > 1)
    throw InputError("--view \"" + view_centre + "\": both must be from -1 to 1");
  return centre;
}

glm::dvec2 PictureOptions::aperture() const {
  const auto text = !aperture_size.empty() ? aperture_size
                    : view_centre.empty()  ? "hologram"
                                           : "part";
  const double size = text == "hologram" ? 1
                      : text == "part"
                          ? 0.5
                          : number(text, "--aperture", "a number, \"hologram\" or \"part\"");
  if (!(size > 0 && size <= 1))
    throw InputError("--aperture \"" + text +
                     "\": must be > 0 and <= 1, or \"hologram\" or \"part\"");
  return {size, size};
}

void PictureOptions::check_percentile() const {
  if (!(percentile > 0 && percentile <= 100))
    throw InputError("--percentile: must be > 0 and <= 100");
}

void PictureOptions::save(const Image& image, const std::string& name, const char* quantity,
                          bool quiet) const {
  double white = 0;
  const auto picture = expose(image, percentile, &white);
  const auto base = std::filesystem::path(out) / name;
  save_png(base.string() + ".png", image.width, image.height, picture);
  save_exr(base.string() + ".exr", image.width, image.height, image.pixels);
  if (!quiet)
    std::printf("%s.png  %d x %d, white = %s %.4g (percentile %g), .exr beside it\n", base.c_str(),
                image.width, image.height, quantity, white, percentile);
}

}  // namespace raywave::cli
