// SPDX-License-Identifier: Apache-2.0
/// Transposition of parts of planes, between rows in memory and lines for FFTs.
#pragma once

#include <complex>
#include <cstddef>

namespace raywave {

/// to[c * to_pitch + r] = from[r * from_pitch + c] for r < rows and c < columns.
using Transpose = void (*)(const std::complex<float>* from, std::size_t from_pitch,
                           std::size_t rows, std::size_t columns, std::complex<float>* to,
                           std::size_t to_pitch);

/// The fastest for this CPU.
Transpose transpose_here();

/// Samples from one line to the next in scratch memory: whole cache lines, an odd number, so that
/// lines do not contend for one place.
constexpr std::size_t pitch_of_lines(std::size_t line) { return ((line + 7) / 8 | 1) * 8; }

}  // namespace raywave
