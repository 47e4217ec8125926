// SPDX-License-Identifier: Apache-2.0
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/encode/pictures.hpp"

#ifdef RAYWAVE_MATIO
#include <matio.h>

#include <array>
#include <memory>
#include <vector>
#endif

namespace raywave {

#ifdef RAYWAVE_MATIO

void save_mat(const std::filesystem::path& file, int nx, int ny,
              std::span<const std::complex<float>> field) {
  // By columns, as MATLAB keeps matrices
  std::vector<float> re, im;
  for (int x = 0; x < nx; ++x) {
    for (int y = 0; y < ny; ++y) {
      const auto sample = field[std::size_t{1} * y * nx + x];
      re.push_back(sample.real());
      im.push_back(sample.imag());
    }
  }
  write_whole(file, [&](const std::filesystem::path& temporary) {
    const std::unique_ptr<mat_t, int (*)(mat_t*)> mat(
        Mat_CreateVer(temporary.c_str(), "MATLAB 5.0 MAT-file, by raywave", MAT_FT_MAT5),
        Mat_Close);
    std::array<std::size_t, 2> size{static_cast<std::size_t>(ny), static_cast<std::size_t>(nx)};
    mat_complex_split_t parts{re.data(), im.data()};
    const std::unique_ptr<matvar_t, void (*)(matvar_t*)> variable(
        Mat_VarCreate("dh", MAT_C_SINGLE, MAT_T_SINGLE, 2, size.data(), &parts, MAT_F_COMPLEX),
        Mat_VarFree);
    if (!mat || !variable || Mat_VarWrite(mat.get(), variable.get(), MAT_COMPRESSION_NONE) != 0)
      throw InputError(in_quotes(file.string()) + ": cannot be written");
  });
}

#else

void save_mat(const std::filesystem::path&, int, int, std::span<const std::complex<float>>) {
  throw InputError(
      "--format mat: raywave was built without libmatio; install libmatio-dev and build again, or "
      "take --format exr");
}

#endif

}  // namespace raywave
