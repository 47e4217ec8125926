// SPDX-License-Identifier: Apache-2.0
/// What an SLM shows of the phases that are refined: the light of its levels, with amplitudes that
/// come with phases, crosstalk, and light that leaves as it came.
#pragma once

#include <memory>

#include "host/encode/encode.hpp"
#include "host/refine/phase_stack.hpp"

namespace raywave::refinement {

/// Device memory that a PanelLight takes for each pixel: its light twice, what pixels are told,
/// levels and added phases.
constexpr std::uint64_t panel_bytes = 32;

/// Refinement propagates `light()`, corrects `modulated()`, and gives what that turned by to the
/// hologram. Each pixel's phase is turned by what its own light lacks, as though neighbours and
/// steps of levels were not there: the next iterations see what that has come to.
class PanelLight {
public:
  /// throws  InputError when the SLM's levels have more than 8 bits
  PanelLight(const cl::Device& device, std::shared_ptr<const Panel> panel);

  /// Encodes the phases of a frame, of the panel's size, and shows them.
  void show(PhaseStack& holograms, int frame);
  /// Turns the frame's phases as the modulated light was turned since.
  void turn(PhaseStack& holograms, int frame);

  const std::shared_ptr<const Panel>& panel() const { return panel_; }
  const PhaseStack& light() const { return light_; }
  PhaseStack& modulated() { return modulated_; }

private:
  /// By pixel, with a margin.
  struct Told {
    cl::Buffer<float> by_level, values;
  };
  void tell(Told& told, const cl::Buffer<std::uint8_t>& levels);
  bool has_added() const { return !encoder_.panel().added().empty(); }

  cl::Device device_;
  std::shared_ptr<const Panel> panel_;
  Encoder encoder_;
  cl::Program program_;
  glm::ivec2 margin_{0, 0};
  int told_pitch_ = 0;
  Told turns_, amplitudes_;
  cl::Buffer<float> weights_;
  cl::Buffer<std::uint16_t> added_;
  float share_, plain_;  // amplitudes of light that is modulated, and of that which is not
  PhaseStack light_, modulated_;
};

/// The panel, where refinement has to know it; null where it shows the phases that it is told.
std::shared_ptr<const Panel> panel_to_know(const SlmSpec& slm, glm::ivec2 size, glm::dvec2 pitch_m,
                                           double wavelength_m);

}  // namespace raywave::refinement
