// SPDX-License-Identifier: Apache-2.0
/// Sums that define propagation and transforms, and fields to propagate: the oracles of
/// host/propagate/, whose conventions they have.
#pragma once

#include <complex>
#include <glm/vec2.hpp>
#include <vector>

#include "host/propagate/double_propagation.hpp"

namespace raywave::reference {

using in_double::Field;
using in_double::Setup;
using in_double::shifted_angular_spectrum;
using in_double::transform;

/// First Rayleigh-Sommerfeld integral as a sum over all pairs of samples with the exact kernel z
/// (1/r - ik) exp(ikr) / (2 pi r^2). A negative distance gives the field that was there before (the
/// conjugate field's forward propagation, conjugated).
///
/// rows  only these rows of the target are computed, all when empty
Field rayleigh_sommerfeld(const Field& source, const Setup& setup,
                          const std::vector<int>& rows = {});

/// Transform of a plane as the sums that define it, axis by axis; shares nothing with `transform`.
Field direct_transform(const Field& plane, glm::ivec2 size, int sign);

/// Fields to propagate: complex normal noise in floats; and exp(-(x^2 + y^2) / waist^2) that
/// travels along (sine.x, sine.y), x right and y up.
std::vector<std::complex<float>> noise(glm::ivec2 size, unsigned seed);
Field beam(const Setup& setup, double waist_m, glm::dvec2 sine);

/// Root of sum |a - b|^2 / sum |b|^2.
double relative_error(const Field& a, const Field& b);

Field to_double(const std::vector<std::complex<float>>& field);
std::vector<std::complex<float>> to_float(const Field& field);

}  // namespace raywave::reference
