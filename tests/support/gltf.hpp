// SPDX-License-Identifier: Apache-2.0
/// glTF 2.0 files made in code, and pictures for them.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

namespace raywave::test {

inline std::string base64_of(const std::string& bytes) {
  static const char* digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k)
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k)
      out += i + k <= bytes.size() ? digits[word >> (18 - 6 * k) & 63] : '=';
  }
  return out;
}

/// A TGA file of 8 bits a channel: red, green, blue, alpha of each pixel, row 0 on top.
inline std::string tga_of(int width, int height, const std::vector<glm::u8vec4>& pixels) {
  std::string out{0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0};
  for (const int n : {width, height}) {
    out += static_cast<char>(n & 255);
    out += static_cast<char>(n >> 8);
  }
  out += static_cast<char>(32);
  out += static_cast<char>(0x28);
  for (const auto& p : pixels)
    for (const int channel : {2, 1, 0, 3}) out += static_cast<char>(p[channel]);
  return out;
}

/// A picture whose pixel (i, j), j from the top, is f(i, j).
template <class F>
std::string tga_picture(int width, int height, F f) {
  std::vector<glm::u8vec4> pixels;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) pixels.push_back(f(i, j));
  return tga_of(width, height, pixels);
}

/// A glTF file in the making: each part is a mesh with one primitive, on a node of its own.
class Gltf {
public:
  using Json = nlohmann::json;

  struct Part {
    std::vector<glm::vec3> positions{};
    std::vector<glm::vec2> uvs{};  // glTF's: (0, 0) is the top left of a picture
    std::vector<glm::vec3> normals{};
    std::vector<glm::vec4> colours{};
    std::vector<std::uint32_t> indices{};  // three a triangle
    int material = -1;
  };

  /// A square from (-1, -1) to (1, 1) times half, at z, that faces +z; its picture stands upright.
  static Part square(float half, glm::vec3 centre, int material = -1) {
    Part part;
    for (const auto& [x, y] :
         std::vector<std::pair<float, float>>{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}) {
      part.positions.push_back(centre + half * glm::vec3(x, y, 0));
      part.uvs.emplace_back((x + 1) / 2, (1 - y) / 2);
      part.normals.emplace_back(0, 0, 1);
    }
    part.indices = {0, 1, 2, 0, 2, 3};
    part.material = material;
    return part;
  }

  /// Index of a texture with this picture inside the file.
  int texture(const std::string& picture, const Json& sampler = {}) {
    const int view = add_view(picture);
    return add_texture({{"bufferView", view}, {"mimeType", "image/png"}}, sampler);
  }
  /// Index of a texture with the picture at this place.
  int texture_at(const std::string& uri, const Json& sampler = {}) {
    return add_texture({{"uri", uri}}, sampler);
  }

  int material(const Json& material) {
    root["materials"].push_back(material);
    return static_cast<int>(root["materials"].size()) - 1;
  }

  Gltf& add(const Part& part, const Json& node = Json::object()) {
    Json placed = node;
    placed["mesh"] = mesh(part);
    return add_node(placed);
  }

  /// Index of a mesh, which nodes name.
  int mesh(const Part& part) {
    Json primitive;
    auto& attributes = primitive["attributes"];
    attributes["POSITION"] = floats(part.positions, "VEC3");
    if (!part.uvs.empty()) attributes["TEXCOORD_0"] = floats(part.uvs, "VEC2");
    if (!part.normals.empty()) attributes["NORMAL"] = floats(part.normals, "VEC3");
    if (!part.colours.empty()) attributes["COLOR_0"] = floats(part.colours, "VEC4");
    std::string bytes(reinterpret_cast<const char*>(part.indices.data()), 4 * part.indices.size());
    primitive["indices"] = accessor(add_view(bytes), 5125, part.indices.size(), "SCALAR");
    if (part.material >= 0) primitive["material"] = part.material;
    root["meshes"].push_back({{"primitives", {primitive}}});
    return static_cast<int>(root["meshes"].size()) - 1;
  }

  /// Adds keys of a node to an animation, which is made where it is not there.
  ///
  /// path    "translation", "rotation", "scale"; steps "STEP", "LINEAR", "CUBICSPLINE"
  template <class Vector>
  Gltf& animate(std::size_t animation, std::size_t node, const char* path, const char* steps,
                const std::vector<float>& times_s, const std::vector<Vector>& values) {
    return add_channel(animation, node, path, steps, times_s,
                       floats(values, Vector::length() == 4 ? "VEC4" : "VEC3"));
  }
  /// Adds keys of all weights of a node's morph targets.
  Gltf& animate_weights(std::size_t animation, std::size_t node, const char* steps,
                        const std::vector<float>& times_s, const std::vector<double>& values) {
    return add_channel(animation, node, "weights", steps, times_s,
                       numbers(values, 5126, "SCALAR", 1));
  }

  /// Index of an accessor of numbers, element after element.
  ///
  /// type  glTF's componentType: 5126 for floats; each: numbers of an element
  int numbers(const std::vector<double>& values, int type, const char* kind, std::size_t each) {
    const int made = accessor(add_view(bytes_as(values, type)), type, values.size() / each, kind);
    if (type == 5126 && std::string(kind) == "VEC3") add_limits(values, made);
    return made;
  }

  /// Index of an accessor of vectors that are zero but for some.
  int sparse(std::size_t count, const std::vector<double>& places,
             const std::vector<double>& values) {
    const int indices = add_view(bytes_as(places, 5123)), to = add_view(bytes_as(values, 5126));
    root["accessors"].push_back({{"componentType", 5126},
                                 {"count", count},
                                 {"type", "VEC3"},
                                 {"sparse",
                                  {{"count", places.size()},
                                   {"indices", {{"bufferView", indices}, {"componentType", 5123}}},
                                   {"values", {{"bufferView", to}}}}}});
    const int made = static_cast<int>(root["accessors"].size()) - 1;
    add_limits(values, made);
    return made;
  }

  /// Adds a camera to the scene, on a node of its own.
  Gltf& add_camera(double near, Json node = Json::object()) {
    root["cameras"] = {
        {{"type", "perspective"}, {"perspective", {{"yfov", 0.8}, {"znear", near}}}}};
    node["camera"] = 0;
    return add_node(node);
  }

  Gltf& add_node(const Json& node) {
    root["nodes"].push_back(node);
    root["scenes"][0]["nodes"].push_back(root["nodes"].size() - 1);
    return *this;
  }

  /// With its data in a URI.
  std::string gltf() const {
    Json whole = root;
    whole["buffers"] = {{{"byteLength", data.size()},
                         {"uri", "data:application/octet-stream;base64," + base64_of(data)}}};
    return whole.dump();
  }

  std::string glb() const {
    Json whole = root;
    whole["buffers"] = {{{"byteLength", data.size()}}};
    std::string text = whole.dump(), binary = data;
    text.resize((text.size() + 3) / 4 * 4, ' ');
    binary.resize((binary.size() + 3) / 4 * 4, '\0');
    std::string out;
    const auto put = [&](std::size_t number) {
      const auto word = static_cast<std::uint32_t>(number);
      out.append(reinterpret_cast<const char*>(&word), 4);
    };
    put(0x46546c67);
    put(2);
    put(12 + 8 + text.size() + 8 + binary.size());
    put(text.size());
    put(0x4e4f534a);
    out += text;
    put(binary.size());
    put(0x004e4942);
    return out + binary;
  }

  Json root{{"asset", {{"version", "2.0"}}},
            {"scene", 0},
            {"scenes", {{{"nodes", Json::array()}}}},
            {"nodes", Json::array()}};
  std::string data;  // the buffer

  int add_view(const std::string& bytes) {
    data.resize((data.size() + 3) / 4 * 4, '\0');
    root["bufferViews"].push_back(
        {{"buffer", 0}, {"byteOffset", data.size()}, {"byteLength", bytes.size()}});
    data += bytes;
    return static_cast<int>(root["bufferViews"].size()) - 1;
  }

private:
  static std::string bytes_as(const std::vector<double>& values, int type) {
    std::string bytes;
    const auto add = [&](auto number) {
      bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
    };
    for (const double v : values) {
      if (type == 5126) add(static_cast<float>(v));
      if (type == 5120) add(static_cast<std::int8_t>(v));
      if (type == 5121) add(static_cast<std::uint8_t>(v));
      if (type == 5122) add(static_cast<std::int16_t>(v));
      if (type == 5123) add(static_cast<std::uint16_t>(v));
      if (type == 5125) add(static_cast<std::uint32_t>(v));
    }
    return bytes;
  }

  /// min and max of vectors of three, 0 among them.
  void add_limits(const std::vector<double>& values, int made) {
    std::vector<double> low(3, 0), high(3, 0);
    for (std::size_t i = 0; i < values.size(); ++i) {
      low[i % 3] = std::min(low[i % 3], values[i]);
      high[i % 3] = std::max(high[i % 3], values[i]);
    }
    root["accessors"][made]["min"] = low;
    root["accessors"][made]["max"] = high;
  }

  Gltf& add_channel(std::size_t animation, std::size_t node, const char* path, const char* steps,
                    const std::vector<float>& times_s, int output) {
    while (root["animations"].size() <= animation)
      root["animations"].push_back({{"samplers", Json::array()}, {"channels", Json::array()}});
    auto& to = root["animations"][animation];
    const std::string bytes(reinterpret_cast<const char*>(times_s.data()), 4 * times_s.size());
    const int input = accessor(add_view(bytes), 5126, times_s.size(), "SCALAR");
    to["samplers"].push_back({{"input", input}, {"output", output}, {"interpolation", steps}});
    to["channels"].push_back(
        {{"sampler", to["samplers"].size() - 1}, {"target", {{"node", node}, {"path", path}}}});
    return *this;
  }

  int add_texture(const Json& image, const Json& sampler) {
    root["images"].push_back(image);
    Json texture{{"source", root["images"].size() - 1}};
    if (!sampler.is_null()) {
      root["samplers"].push_back(sampler);
      texture["sampler"] = root["samplers"].size() - 1;
    }
    root["textures"].push_back(texture);
    return static_cast<int>(root["textures"].size()) - 1;
  }

  int accessor(int view, int type, std::size_t count, const char* kind) {
    root["accessors"].push_back(
        {{"bufferView", view}, {"componentType", type}, {"count", count}, {"type", kind}});
    return static_cast<int>(root["accessors"].size()) - 1;
  }

  template <class Vector>
  int floats(const std::vector<Vector>& vectors, const char* kind) {
    const std::string bytes(reinterpret_cast<const char*>(vectors.data()),
                            sizeof(Vector) * vectors.size());
    const int made = accessor(add_view(bytes), 5126, vectors.size(), kind);
    if constexpr (Vector::length() == 3) {
      Vector low = vectors[0], high = vectors[0];
      for (const auto& v : vectors) {
        for (int i = 0; i < 3; ++i) {
          low[i] = std::min(low[i], v[i]);
          high[i] = std::max(high[i], v[i]);
        }
      }
      root["accessors"][made]["min"] = {low.x, low.y, low.z};
      root["accessors"][made]["max"] = {high.x, high.y, high.z};
    }
    return made;
  }
};

/// glTF's way to say which texture.
inline nlohmann::json texture_info(int texture) { return {{"index", texture}}; }

}  // namespace raywave::test
