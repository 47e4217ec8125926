// SPDX-License-Identifier: Apache-2.0
/// Look-up tables of SLMs: what each grey level shows.
#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace raywave {

/// What grey levels show: phases in turns or radians, or amplitudes. Levels that are not listed are
/// not used.
struct Lut {
  std::vector<int> levels;  // rising; empty: 0, 1, 2 ...
  std::vector<double> values;

  bool operator==(const Lut&) const = default;
};

/// Reads text: a number for each level from 0 on, or a line for each with level and number in any
/// order. Headings, and comments behind #, are left out. Where ; stands between numbers, a comma is
/// a decimal point. Reads .npy, too: floats or integers of shape (n), (n, 2).
///
/// level_count  of the panel
/// throws       InputError naming file and line
Lut load_lut(const std::filesystem::path& file, int level_count);

/// A table of pairs of level and number.
///
/// where   starts messages
/// throws  InputError for levels that are no whole numbers of the panel, or are there twice
Lut lut_of_pairs(const std::vector<std::pair<double, double>>& pairs, int level_count,
                 const std::string& where);

/// What each level shows: between listed ones on a straight line, beyond them as the nearest.
std::vector<double> shown_by_level(const Lut& lut, int level_count);

/// Replaces values that turn back, as noise of a measurement makes them, by the nearest ones (least
/// squares) that do not.
///
/// returns  the largest change; 0: there was none
double make_monotone(std::vector<double>& values);

}  // namespace raywave
