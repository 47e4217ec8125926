// SPDX-License-Identifier: Apache-2.0
/// Loops that are compiled for several CPUs: the binary is not built for the one that it runs on.
#pragma once

#include <complex>

namespace raywave {

/// Real and imaginary parts in turn, as such loops take them.
inline const float* floats(const std::complex<float>* samples) {
  return reinterpret_cast<const float*>(samples);
}
inline float* floats(std::complex<float>* samples) { return reinterpret_cast<float*>(samples); }

#if defined(__x86_64__)
template <class Loop>
[[gnu::target("avx2,fma"), gnu::flatten]] void run_for_avx2(const Loop& loop) {
  loop();
}
template <class Loop>
[[gnu::target("avx512f,avx512vl,avx512dq,avx512bw,fma,prefer-vector-width=512"), gnu::flatten]] void
run_for_avx512(const Loop& loop) {
  loop();
}
#endif

/// Calls loop(), which the compiler has vectorised for this CPU. It must be always_inline.
template <class Loop>
void for_this_cpu(const Loop& loop) {
#if defined(__x86_64__)
  static const bool has_avx512 =
      __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512bw");
  static const bool has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  if (has_avx512) return run_for_avx512(loop);
  if (has_avx2) return run_for_avx2(loop);
#endif
  loop();
}

}  // namespace raywave
