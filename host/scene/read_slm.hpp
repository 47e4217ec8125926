// SPDX-License-Identifier: Apache-2.0
/// Reading of section [slm].
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host/scene/slm.hpp"

namespace raywave {

struct SceneText;  // host/scene/scene_text.hpp
class Section;     // host/scene/document.hpp

/// Section [slm] of a scene. The LUT and the flatness picture are read, too.
///
/// wavelength_m  of the hologram: of tables by wavelength, it takes the nearest value
/// most_bits     of a grey level
/// from          what the section leaves as it is
/// throws        InputError: one line with file and line
SlmSpec read_slm(Section section, double wavelength_m, int most_bits = 8, const SlmSpec& from = {});

/// Section [illumination] of a scene, or of a file that describes an SLM.
///
/// throws  InputError: one line with file and line
Illumination read_illumination(Section section, Illumination from = {});

/// Reads the picture of flatness.file.
///
/// throws  InputError, starting with flatness.where
void load_flatness(FlatnessSpec& flatness);
/// The same of profile.file.
void load_profile(BeamProfile& profile);

/// Reads [slm] and [illumination] of a file that holds nothing else, or of a scene; overrides as in
/// load_scenes. Other than in a scene, levels may have 10 bits.
///
/// throws  InputError: one line with file and line
SlmSpec load_slm(const std::filesystem::path& file, double wavelength_m,
                 const std::vector<std::string>& overrides = {});

/// The same from the text of such a file.
///
/// from  what text and overrides leave as it is
SlmSpec parse_slm(const SceneText& text, double wavelength_m,
                  const std::vector<std::string>& overrides = {}, const SlmSpec& from = {});

}  // namespace raywave
