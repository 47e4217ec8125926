// SPDX-License-Identifier: Apache-2.0
/// Which library transforms padded planes, and the sizes that all of them transform fast.
#pragma once

#include <array>
#include <cstddef>

#include "host/common/choices.hpp"

namespace raywave {

inline constexpr std::array all_backends{FftBackend::host, FftBackend::clfft, FftBackend::vkfft};

/// The smallest size >= n that every back end transforms fast, so that all work on the same planes:
/// a product of 2, 3, 5 and 7 and, above 32, a multiple of 16 (FFTW takes 1.6 us for 1440 samples,
/// 2.5 to 4.2 us for 1350, 1372 and 1458).
std::size_t next_fast_size(std::size_t n);

}  // namespace raywave
