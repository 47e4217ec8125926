// SPDX-License-Identifier: Apache-2.0
#include <draco/compression/decode.h>

#include <algorithm>
#include <array>
#include <utility>

#include "host/common/error.hpp"
#include "host/scene/reader/gltf_file.hpp"

namespace raywave {
namespace {

/// glTF's componentType; 0: it has none.
std::uint64_t type_of(draco::DataType type) {
  constexpr std::array<std::pair<draco::DataType, std::uint64_t>, 6> known{
      {{draco::DT_INT8, 5120},
       {draco::DT_UINT8, 5121},
       {draco::DT_INT16, 5122},
       {draco::DT_UINT16, 5123},
       {draco::DT_UINT32, 5125},
       {draco::DT_FLOAT32, 5126}}};
  for (const auto& [of_draco, of_gltf] : known)
    if (type == of_draco) return of_gltf;
  return 0;
}

}  // namespace

DracoMesh decode_draco(std::string_view bytes, const nlohmann::json& attributes) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) throw InputError("its Draco data is damaged");
  const auto mesh = std::move(decoded).value();
  DracoMesh made;
  made.corners.reserve(std::size_t{3} * mesh->num_faces());
  for (draco::FaceIndex face(0); face < mesh->num_faces(); ++face)
    for (const auto& corner : mesh->face(face)) made.corners.push_back(corner.value());
  for (const auto& [name, id] : attributes.items()) {
    const auto* from = mesh->GetAttributeByUniqueId(
        static_cast<std::uint32_t>(std::min<std::uint64_t>(count_or(id, UINT32_MAX), UINT32_MAX)));
    if (!from) throw InputError("its Draco data has no " + name.substr(0, 100));
    GltfNumbers numbers;
    numbers.count = mesh->num_points();
    numbers.components = static_cast<std::uint64_t>(from->num_components());
    if (!numbers.set_type(type_of(from->data_type())))
      throw InputError("an attribute is of a type that glTF does not have");
    numbers.step = numbers.components * numbers.bytes;
    std::string values(numbers.count * numbers.step, '\0');
    for (draco::PointIndex point(0); point < mesh->num_points(); ++point) {
      const auto value = from->mapped_index(point);
      if (value.value() >= from->size()) throw InputError("its Draco data is damaged");
      from->GetValue(value, values.data() + point.value() * numbers.step);
    }
    made.attributes.emplace(name, std::pair(std::move(values), numbers));
  }
  return made;
}

}  // namespace raywave
