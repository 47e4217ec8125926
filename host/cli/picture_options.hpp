// SPDX-License-Identifier: Apache-2.0
/// Options of the commands that look at something from the hologram: which depths, how wide,
/// through which part, how shown.
#pragma once

#include <CLI/CLI.hpp>
#include <glm/vec2.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/scene/image.hpp"

namespace raywave::cli {

struct PictureOptions {
  std::vector<std::string> z;
  std::string out, window, view_centre, aperture_size;
  double percentile = 99.5;

  void add_to(CLI::App& command);

  /// All throw InputError naming the option when it cannot be understood.
  std::vector<double> depths_m() const;
  std::optional<glm::dvec2> window_m() const;
  glm::dvec2 view() const;      // centre of the open part, in half holograms
  glm::dvec2 aperture() const;  // its size in holograms
  void check_percentile() const;

  /// <name>.png, exposed, and <name>.exr in the output folder; prints a line about them unless
  /// quiet.
  void save(const Image& image, const std::string& name, const char* quantity, bool quiet) const;
};

/// "reconstruction_95mm"
std::string name_at_depth(const std::string& stem, double z_m);

double positive_length_m(const std::string& text, const std::string& what);

/// The parts of "a,b" before and after the separator.
std::pair<std::string, std::string> two_parts(const std::string& text, char separator,
                                              const std::string& what);

}  // namespace raywave::cli
