// SPDX-License-Identifier: Apache-2.0
// load_npy reads in this process: whatever bytes come, a field of finite samples or an InputError.
#include "host/common/npy.hpp"

#include "tests/fuzz/fuzz.hpp"

using namespace raywave;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const fuzz::File file(fuzz::text(data, size));
  fuzz::refuses_or_reads([&] {
    const FieldStack field = load_npy(file.path());
    fuzz::require(field.nx >= 1 && field.ny >= 1 && field.frames >= 1);
    fuzz::require(field.samples.size() == std::size_t{1} * field.nx * field.ny * field.frames);
    for (const auto& s : field.samples)
      fuzz::require(std::isfinite(s.real()) && std::isfinite(s.imag()));
  });
  return 0;
}
