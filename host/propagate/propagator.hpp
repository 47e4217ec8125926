// SPDX-License-Identifier: Apache-2.0
/// Band-limited shifted angular spectrum propagation between parallel planes (Matsushima, Opt.
/// Express 18, 18453 (2010)).
///
/// A wave that diverges is exp(+i k r). Light travels towards -z; `distance_m` counts along the
/// direction of travel, so that a hologram at z = 0 lit from a WRP at z = 95 mm is +95 mm away and
/// a reconstruction at z = 100 mm is -100 mm from the hologram.
#pragma once

#include <glm/vec2.hpp>
#include <memory>
#include <span>

#include "host/propagate/propagation.hpp"

namespace raywave {

/// Carries fields from any number of planes to one target plane: load, add, load, add, ...,
/// collect. The inverse transform is done once, and only what the targets' bands hold is
/// transformed. Planes have equal size and pitch.
///
/// With FftBackend::host the host's threads do it all: each pass over columns or rows makes its
/// lines in the cache from the field, or from the pass before, so that no padded plane is ever in
/// memory. Else everything stays on the device.
class Propagator {
public:
  Propagator(const cl::Device& device, const PropagatorSpec& spec);
  ~Propagator();
  Propagator(Propagator&&) noexcept;

  glm::ivec2 padded_size() const;

  /// True when any sampled frequency carries light to such a target.
  bool reaches(const Target& target) const;

  /// Distance up to which the padded plane samples directions densely enough to reach everywhere:
  /// side^2 / wavelength.
  double farthest_m() const;

  /// throws  InputError when `add` would
  void require_reach(const Target& target) const;

  /// Takes over the source field (ny x nx, row 0 on top; frame `frame` of a stack of such) and
  /// transforms it, for these targets (any when there are none: slower). Of one target, `collect`
  /// takes its memory: load it again to add it again.
  void load(const cl::ComplexBuffer& field, int frame = 0, std::span<const Target> targets = {});

  /// Adds the loaded source, as it arrives at the target, to the sum. May be called for several
  /// targets in turn with a `collect` after each.
  ///
  /// throws    InputError when no frequency survives the band limit; the message gives the largest
  ///           usable shift, or the distance from which the padded plane samples too few directions
  /// accuracy  relative L2 error, measured: <= 5e-7 against the same discrete propagation in double
  ///           (1 m, shift 50 mm: 3.6e-7); <= 6e-7 against the direct Rayleigh-Sommerfeld sum for
  ///           fields inside window and band; <= 5e-3 for noise on planes at least
  ///           sqrt(wavelength z) wide, told of PropagatorSpec::distance_m; else up to 0.3
  void add(const Target& target);

  /// Transforms the sum back into `field` (ny x nx) and starts a new one. Zero when nothing was
  /// added.
  void collect(cl::ComplexBuffer& field);

private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace raywave
