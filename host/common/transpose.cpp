// SPDX-License-Identifier: Apache-2.0
#include "host/common/transpose.hpp"

#include <algorithm>
#include <cstring>

namespace raywave {
namespace {

using Sample = std::complex<float>;

/// to[c][r] = from[r][c], in blocks of 8 x 8 samples, so that each cache line is read and written
/// once. Rows of the field lie too far apart for the processor's prefetcher.
[[gnu::always_inline]] inline void transpose(const Sample* from, std::size_t from_pitch,
                                             std::size_t rows, std::size_t columns, Sample* to,
                                             std::size_t to_pitch) {
  using Quad = double __attribute__((vector_size(32)));  // four samples
  constexpr std::size_t block = 8, quad = 4;
  for (std::size_t r0 = 0; r0 < rows; r0 += block) {
    for (std::size_t c0 = 0; c0 < columns; c0 += block) {
      if (r0 + block > rows || c0 + block > columns) {
        for (std::size_t r = r0; r < std::min(rows, r0 + block); ++r)
          for (std::size_t c = c0; c < std::min(columns, c0 + block); ++c)
            to[c * to_pitch + r] = from[r * from_pitch + c];
        continue;
      }
      for (std::size_t i = 0; i < block; ++i) {
        __builtin_prefetch(from + (r0 + 2 * block + i) * from_pitch + c0);
        __builtin_prefetch(to + (c0 + 2 * block + i) * to_pitch + r0, 1);
      }
      for (std::size_t r = r0; r < r0 + block; r += quad) {
        for (std::size_t c = c0; c < c0 + block; c += quad) {
          const Sample* in = from + r * from_pitch + c;
          Sample* out = to + c * to_pitch + r;
          Quad a, b, d, e;
          std::memcpy(&a, in, sizeof a);
          std::memcpy(&b, in + from_pitch, sizeof b);
          std::memcpy(&d, in + 2 * from_pitch, sizeof d);
          std::memcpy(&e, in + 3 * from_pitch, sizeof e);
          const Quad even_ab = __builtin_shufflevector(a, b, 0, 4, 2, 6),
                     odd_ab = __builtin_shufflevector(a, b, 1, 5, 3, 7);
          const Quad even_de = __builtin_shufflevector(d, e, 0, 4, 2, 6),
                     odd_de = __builtin_shufflevector(d, e, 1, 5, 3, 7);
          a = __builtin_shufflevector(even_ab, even_de, 0, 1, 4, 5);
          b = __builtin_shufflevector(odd_ab, odd_de, 0, 1, 4, 5);
          d = __builtin_shufflevector(even_ab, even_de, 2, 3, 6, 7);
          e = __builtin_shufflevector(odd_ab, odd_de, 2, 3, 6, 7);
          std::memcpy(static_cast<void*>(out), &a, sizeof a);
          std::memcpy(static_cast<void*>(out + to_pitch), &b, sizeof b);
          std::memcpy(static_cast<void*>(out + 2 * to_pitch), &d, sizeof d);
          std::memcpy(static_cast<void*>(out + 3 * to_pitch), &e, sizeof e);
        }
      }
    }
  }
}

void transpose_any(const Sample* from, std::size_t from_pitch, std::size_t rows,
                   std::size_t columns, Sample* to, std::size_t to_pitch) {
  transpose(from, from_pitch, rows, columns, to, to_pitch);
}
#if defined(__x86_64__)
[[gnu::target("avx2")]] void transpose_avx2(const Sample* from, std::size_t from_pitch,
                                            std::size_t rows, std::size_t columns, Sample* to,
                                            std::size_t to_pitch) {
  transpose(from, from_pitch, rows, columns, to, to_pitch);
}
#endif

}  // namespace

Transpose transpose_here() {
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) return transpose_avx2;
#endif
  return transpose_any;
}

}  // namespace raywave
