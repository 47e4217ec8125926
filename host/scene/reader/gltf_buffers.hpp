// SPDX-License-Identifier: Apache-2.0
/// The numbers in the buffers of glTF files.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace raywave {

/// A whole number, >= 0; `otherwise` where there is none.
std::uint64_t count_or(const nlohmann::json& value, std::uint64_t otherwise);

/// Reads accessors: floats and whole numbers, with strides and sparse parts, from the file itself,
/// data URIs and files beside it. Each buffer is read once.
class GltfBuffers {
public:
  /// root, file  stay as long as this does
  /// most        elements of all accessors together
  GltfBuffers(const nlohmann::json& root, const std::filesystem::path& file, std::uint64_t most)
      : root_(root), file_(file), most_(most), left_(most) {}

  /// All numbers of an accessor, element after element. Whole numbers stand for shares, 0 to 1 or
  /// -1 to 1.
  ///
  /// index  of the accessor
  /// type   as the file names it: "SCALAR", "VEC3", "VEC4", "MAT4"
  /// what   for messages: "keys of an animation"
  /// whole  whole numbers count as they are, unless the accessor is normalized
  /// throws InputError when there is no such accessor, or it does not lie in its buffer
  std::vector<double> numbers(const nlohmann::json& index, const std::string& type,
                              const std::string& what, bool whole = false);

private:
  struct View {
    const char* first = nullptr;
    std::uint64_t step = 0;
  };
  View view_of(const nlohmann::json& where, std::uint64_t count, std::uint64_t each,
               const std::string& what);
  const std::string& buffer(std::uint64_t index, const std::string& what);

  const nlohmann::json& root_;
  const std::filesystem::path& file_;
  std::map<std::uint64_t, std::string> buffers_;
  std::uint64_t most_, left_;
};

}  // namespace raywave
