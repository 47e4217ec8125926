// SPDX-License-Identifier: Apache-2.0
#include <draco/compression/decode.h>

#include <algorithm>

#include "host/common/error.hpp"
#include "host/scene/reader/gltf_file.hpp"

namespace raywave {
namespace {

Stored stored_as(draco::DataType type) {
  switch (type) {
    case draco::DT_INT8:
      return Stored::i8;
    case draco::DT_UINT8:
      return Stored::u8;
    case draco::DT_INT16:
      return Stored::i16;
    case draco::DT_UINT16:
      return Stored::u16;
    case draco::DT_UINT32:
      return Stored::u32;
    case draco::DT_FLOAT32:
      return Stored::f32;
    default:
      throw InputError("an attribute is of a type that glTF does not have");
  }
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
    numbers.type = stored_as(from->data_type());
    numbers.step = numbers.components * bytes_of(numbers.type);
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
