// SPDX-License-Identifier: Apache-2.0
/// A process that finds out which kernels its work needs (cl/compile_ahead.hpp).
#pragma once

namespace raywave {

/// While it is true, kernels are neither compiled nor launched, device memory is zero, and FFTW
/// measures nothing: results mean nothing.
inline bool is_rehearsal = false;

}  // namespace raywave
