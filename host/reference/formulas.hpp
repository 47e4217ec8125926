// SPDX-License-Identifier: Apache-2.0
/// Formulas of shading and of random phases that several oracles share, in double precision.
#pragma once

#include <cstdint>

namespace raywave::reference {

/// c^m as shading uses it: 0 for c <= 0, but 0^0 = 1.
double power_of_cosine(double cosine, double exponent);

/// The random phase, in turns, of the cube (i, j, k), and of a sample's key: kernels/common/hash.h
/// in host arithmetic.
double phase_turns(std::int32_t i, std::int32_t j, std::int32_t k, std::uint32_t seed);
double phase_turns_of_key(std::uint32_t key, std::uint32_t seed);

}  // namespace raywave::reference
