// SPDX-License-Identifier: Apache-2.0
#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/encode/pictures.hpp"

#ifdef RAYWAVE_MATIO
#include <matio.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <memory>
#include <system_error>
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
  using File = std::unique_ptr<mat_t, int (*)(mat_t*)>;
  using Variable = std::unique_ptr<matvar_t, void (*)(matvar_t*)>;
  constexpr const char* name = "dh";
  write_whole_by_name(file, [&](const std::filesystem::path& temporary) {
    const auto require = [&](bool done) {
      if (!done) throw InputError(in_quotes(file.string()) + ": cannot be written");
    };
    {
      const File mat(
          Mat_CreateVer(temporary.c_str(), "MATLAB 5.0 MAT-file, by raywave", MAT_FT_MAT5),
          Mat_Close);
      std::array<std::size_t, 2> size{static_cast<std::size_t>(ny), static_cast<std::size_t>(nx)};
      mat_complex_split_t parts{re.data(), im.data()};
      const Variable variable(
          Mat_VarCreate(name, MAT_C_SINGLE, MAT_T_SINGLE, 2, size.data(), &parts, MAT_F_COMPLEX),
          Mat_VarFree);
      require(mat && variable &&
              Mat_VarWrite(mat.get(), variable.get(), MAT_COMPRESSION_NONE) == 0);
    }
    // libmatio does not say when a disk is full: the file is read again. Its reader does not miss
    // the last bytes, so their number is compared with what the matrix's tag says.
    constexpr std::size_t header_bytes = 128, tag_bytes = 8;
    std::uint32_t tag[2] = {0, 0};
    std::ifstream(temporary, std::ios::binary)
        .seekg(header_bytes)
        .read(reinterpret_cast<char*>(tag), sizeof tag);
    std::error_code error;
    require(std::filesystem::file_size(temporary, error) == header_bytes + tag_bytes + tag[1]);
    const File mat(Mat_Open(temporary.c_str(), MAT_ACC_RDONLY), Mat_Close);
    const Variable variable(mat ? Mat_VarRead(mat.get(), name) : nullptr, Mat_VarFree);
    require(variable && variable->isComplex && variable->data_type == MAT_T_SINGLE &&
            variable->nbytes == re.size() * sizeof(float));
    const auto& parts = *static_cast<const mat_complex_split_t*>(variable->data);
    require(std::memcmp(parts.Re, re.data(), variable->nbytes) == 0 &&
            std::memcmp(parts.Im, im.data(), variable->nbytes) == 0);
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
