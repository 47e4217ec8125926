// SPDX-License-Identifier: Apache-2.0
/// How much of a surface sample's wave the WRPs gather on its way to each part of the hologram:
/// sampling.cone and sampling.apodization.
#pragma once

namespace raywave {

/// In half holograms, alike along both axes.
struct Cone {
  double half_width = 1.2;   // half width
  double apodization = 0.2;  // width of its soft edge, within the half width

  bool operator==(const Cone&) const = default;

  /// Share of the amplitude that arrives `at` so many half holograms from the middle; as
  /// kernels/gather/gather.cl has it.
  double passed(double at) const;

  /// Relative L2 error of the hologram's field against the whole wave, which is 1 everywhere.
  double field_error() const;
};

}  // namespace raywave
