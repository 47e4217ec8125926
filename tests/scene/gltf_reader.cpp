// SPDX-License-Identifier: Apache-2.0
// What a glTF 2.0 file says is what is read: numbers by the accessor's formula, shapes and colours
// by what the writers here have written.
#include <draco/compression/encode.h>
#include <draco/mesh/triangle_soup_mesh_builder.h>
#include <meshoptimizer.h>

#include <tuple>

#include "tests/support/gltf.hpp"
#include "tests/support/mesh_files.hpp"

namespace raywave {
namespace {

using namespace test;
using Json = nlohmann::json;
using glm::dvec2;
using glm::dvec3;

using test::load;
Mesh load(const Folder& folder, const Gltf& file) {
  return load(folder.write("a.gltf", file.gltf()));
}

/// A square of area 4.
Gltf square_file(const Json& node = Json::object()) {
  Gltf file;
  return file.add(Gltf::square(1, {0, 0, 0}), node);
}

Json& first_primitive(Gltf& file) { return file.root["meshes"][0]["primitives"][0]; }

/// What a number of an accessor means (glTF 2.0, 3.11).
double meant(double stored, int type, bool is_normalized) {
  const double most = type == 5120 ? 127 : type == 5121 ? 255 : type == 5122 ? 32767 : 65535;
  return is_normalized && type != 5126 ? std::max(stored / most, -1.0) : stored;
}

TEST_CASE("attributes of a glTF file are read by their type, normalized or not") {
  const Folder folder;
  std::mt19937 random(33);
  const auto number = [&](int type) {
    const bool is_signed = type == 5120 || type == 5122 || type == 5126,
               is_small = type == 5120 || type == 5121;
    const int most = is_small ? (is_signed ? 127 : 255) : is_signed ? 32767 : 65535;
    const int value = std::uniform_int_distribution(is_signed ? -most - 1 : 0, most)(random);
    return type == 5126 ? value / 256.0 : value;
  };
  for (const int type : {5120, 5121, 5122, 5123, 5126}) {
    for (const bool is_normalized : {false, true}) {
      for (const bool has_alpha : {false, true}) {
        INFO(type << (is_normalized ? " normalized" : "") << (has_alpha ? ", with alpha" : ""));
        constexpr std::size_t count = 60;
        Gltf file = square_file();
        auto& attributes = first_primitive(file)["attributes"];
        first_primitive(file).erase("indices");
        const auto add = [&](const char* name, const char* kind, std::size_t each, int as) {
          std::vector<double> stored(each * count);
          for (auto& value : stored) value = number(as);
          const int made = file.numbers(stored, as, kind, each);
          file.root["accessors"][made]["normalized"] = is_normalized;
          attributes[name] = made;
          for (auto& value : stored) value = meant(value, as, is_normalized);
          return stored;
        };
        const auto positions = add("POSITION", "VEC3", 3, type),
                   uvs = add("TEXCOORD_0", "VEC2", 2, type);
        const int signed_type = type == 5121 ? 5120 : type == 5123 ? 5122 : type;
        const auto normals = add("NORMAL", "VEC3", 3, signed_type);
        const std::size_t each = has_alpha ? 4 : 3;
        const int colour_type = type == 5120 ? 5121 : type == 5122 ? 5123 : type;
        auto colours = add("COLOR_0", has_alpha ? "VEC4" : "VEC3", each, colour_type);
        const Mesh mesh = load(folder, file);
        REQUIRE(mesh.triangles.size() == count / 3);
        for (std::size_t i = 0; i < count; ++i) {
          const auto v = mesh.triangles[i / 3][static_cast<int>(i % 3)];
          const dvec3 normal(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]);
          for (int k = 0; k < 3; ++k) CHECK(mesh.positions[v][k] == positions[3 * i + k]);
          CHECK(glm::distance(mesh.normals[v], glm::normalize(normal)) < 1e-12);
          CHECK(glm::distance(mesh.uvs[v], dvec2(uvs[2 * i], 1 - uvs[2 * i + 1])) < 1e-9);
          for (std::size_t k = 0; k < each; ++k) {
            // Whole numbers are shares also where the file forgets to say so, with a note
            const double share = is_normalized ? colours[each * i + k]
                                               : meant(colours[each * i + k], colour_type, true);
            CHECK(double{mesh.colours[v][static_cast<int>(k)]} ==
                  Catch::Approx(std::clamp(share, 0.0, k < 3 ? 1e6 : 1.0)));
          }
        }
        CHECK((notes_of(mesh).find("not normalized") != std::string::npos) ==
              (!is_normalized && type != 5126));
      }
    }
  }
}

TEST_CASE("sparse parts and strides of a glTF file's accessors are followed") {
  const Folder folder;
  Gltf file = square_file();
  // One corner of the square goes to (3, 3, 0): a kite, by the shoelace formula of area 8
  const auto number = first_primitive(file)["attributes"]["POSITION"].get<std::size_t>();
  const int places = file.add_view(std::string("\2\0", 2));
  const std::array<float, 3> corner{3, 3, 0};
  const int values =
      file.add_view(std::string(reinterpret_cast<const char*>(corner.data()), sizeof corner));
  file.root["accessors"][number]["sparse"] = {
      {"count", 1},
      {"indices", {{"bufferView", places}, {"componentType", 5123}}},
      {"values", {{"bufferView", values}}}};
  CHECK(area_of(load(folder, file)) == Catch::Approx(8));
  // Positions every 20 bytes, behind 4 that are none
  std::string bytes(4, 'x');
  for (const auto& p : Gltf::square(1, {0, 0, 0}).positions)
    bytes += std::string(reinterpret_cast<const char*>(&p), sizeof p) + std::string(8, 'x');
  auto strided = square_file();
  const int view = strided.add_view(bytes);
  strided.root["bufferViews"][view]["byteStride"] = 20;
  auto& accessor = strided.root["accessors"][number];
  accessor["bufferView"] = view;
  accessor["byteOffset"] = 4;
  CHECK(area_of(load(folder, strided)) == Catch::Approx(4));
  accessor["count"] = 5;
  first_primitive(strided)["attributes"] = {{"POSITION", number}};
  CHECK_REFUSED(load(folder, strided), "mesh 0: POSITION lie beyond the end of their buffer");
}

TEST_CASE("extensions of a glTF file are obeyed, or named") {
  const Folder folder;
  auto file = square_file();
  file.root["extensionsUsed"] = {"EXT_new_shapes", "KHR_materials_sheen"};
  CHECK_SAYS(notes_of(load(folder, file)), "the extension EXT_new_shapes is ignored");
  file.root["extensionsRequired"] = {"KHR_texture_transform", "EXT_new_shapes"};
  CHECK_REFUSED(load(folder, file), "it requires the extension EXT_new_shapes");

  // Three instances: moved, turned about x by a right angle and stretched
  auto many = square_file({{"translation", {0, 0, 7}}});
  const int turns =
      many.numbers({0, 0, 0, 32767, 23170, 0, 0, 23170, 0, 0, 0, 32767}, 5122, "VEC4", 4);
  many.root["accessors"][turns]["normalized"] = true;
  many.root["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = {
      {"TRANSLATION", many.numbers({0, 0, 0, 9, 0, 0, 0, 9, 0}, 5126, "VEC3", 3)},
      {"ROTATION", turns},
      {"SCALE", many.numbers({1, 1, 1, 1, 1, 1, 2, -1, 1}, 5126, "VEC3", 3)}};
  const auto three = load(folder, many);
  CHECK(area_of(three) == Catch::Approx(4 + 4 + 8));
  dvec3 low(1e9), high(-1e9);
  for (const auto& p : three.positions) low = glm::min(low, p), high = glm::max(high, p);
  CHECK(glm::distance(low, dvec3(-2, -1, 6)) < 1e-4);
  CHECK(glm::distance(high, dvec3(10, 10, 8)) < 1e-4);

  // Hidden nodes hide those in them
  auto hidden = square_file({{"children", {1}}});
  hidden.root["nodes"].push_back({{"mesh", 0}, {"translation", {5, 0, 0}}});
  CHECK(area_of(load(folder, hidden)) == Catch::Approx(8));
  for (const std::size_t node : {0, 1}) {
    auto one = hidden;
    one.root["nodes"][node]["extensions"]["KHR_node_visibility"]["visible"] = false;
    if (node == 1)
      CHECK(area_of(load(folder, one)) == Catch::Approx(4));
    else
      CHECK_REFUSED(load(folder, one), "no triangle");
  }
}

TEST_CASE("a texture whose picture only an unknown extension has is named") {
  const Folder folder;
  Gltf file;
  const Json unread{{"KHR_texture_basisu", {{"source", 1}}}};
  file.root["images"] = {{{"uri", "a.png"}}, {{"uri", "a.ktx2"}}};
  file.root["textures"] = {{{"source", 0}, {"extensions", unread}}, {{"extensions", unread}}};
  for (const int texture : {0, 1, 7}) {
    auto one = file;
    one.add(Gltf::square(1, {0, 0, 0},
                         one.material({{"pbrMetallicRoughness",
                                        {{"baseColorTexture", test::texture_info(texture)}}}})));
    const auto mesh = load(folder, one);
    const auto& map = mesh.materials.at(0).look.base_map;
    CHECK((map.picture >= 0) == (texture == 0));
    CHECK_SAYS(notes_of(mesh), texture == 0   ? "in place of that of KHR_texture_basisu"
                               : texture == 1 ? "has no picture but that of KHR_texture_basisu"
                                              : "its texture or its picture is not there");
  }
}

TEST_CASE("buffers of a glTF file are where its URIs say (RFC 3986)") {
  const Folder folder;
  auto file = square_file();
  std::filesystem::create_directory(folder / "sub");
  for (const auto& [name, uri] :
       std::vector<std::pair<std::string, std::string>>{{"my data.bin", "my%20data.bin"},
                                                        {"my data.bin", "my data.bin"},
                                                        {"a%20b.bin", "a%2520b.bin"},
                                                        {"\xc3\xa4.bin", "%C3%A4.bin"},
                                                        {"\xc3\xa4.bin", "\xc3\xa4.bin"},
                                                        {"a#b?c.bin", "a%23b%3fc.bin"},
                                                        {"100%.bin", "100%25.bin"},
                                                        {"sub/d.bin", "./sub/../sub/d.bin"},
                                                        {"e.bin", "e.bin?version=2#part"}}) {
    INFO(uri);
    const auto written = folder.write(name, file.data);
    auto whole = file.root;
    whole["buffers"] = {{{"byteLength", file.data.size()}, {"uri", uri}}};
    CHECK(area_of(load(folder.write("a.gltf", whole.dump()))) == Catch::Approx(4));
    std::filesystem::remove(written);
    CHECK_REFUSED(load(folder / "a.gltf"), "its buffer ", "cannot be read");
  }
  std::string escaped;
  for (const char c : file.data) {
    constexpr const char* digits = "0123456789ABCDEF";
    escaped += {'%', digits[static_cast<unsigned char>(c) >> 4],
                digits[static_cast<unsigned char>(c) & 15]};
  }
  for (const auto& uri :
       {"data:," + escaped, "data:application/gltf-buffer;base64," + test::base64_of(file.data)}) {
    auto whole = file.root;
    whole["buffers"] = {{{"byteLength", file.data.size()}, {"uri", uri}}};
    CHECK(area_of(load(folder.write("a.gltf", whole.dump()))) == Catch::Approx(4));
  }
}

TEST_CASE("a glTF is known by its first bytes, and names may have any bytes") {
  const Folder folder;
  Gltf file;
  file.add(Gltf::square(1, {0, 0, 0},
                        file.material({{"name", "caf\xc3\xa9"},
                                       {"pbrMetallicRoughness", {{"metallicFactor", 0.25}}}})));
  auto latin = file.gltf();
  latin.replace(latin.find("\xc3\xa9"), 2, "\xe9");
  for (const auto& path :
       {folder.write("a.gltf", file.glb()), folder.write("b.glb", file.gltf()),
        folder.write("c.mesh", file.glb()), folder.write("d.gltf", "\xef\xbb\xbf" + file.gltf()),
        folder.write("e.gltf", latin)}) {
    INFO(path);
    const auto mesh = load(path);
    CHECK(area_of(mesh) == Catch::Approx(4));
    REQUIRE(mesh.materials.size() == 1);
    CHECK(mesh.materials[0].look.metallic == 0.25);
    CHECK(mesh.materials[0].name ==
          (path.filename() == "e.gltf" ? "caf\xef\xbf\xbd" : "caf\xc3\xa9"));
  }
  const auto damaged = file.gltf();
  CHECK_REFUSED(load(folder.write("a.gltf", "{\n\n" + damaged.substr(1, damaged.size() / 2))),
                "its JSON is damaged in line 3");
  for (const auto& [place, value, words] : std::vector<std::tuple<std::string, Json, std::string>>{
           {"/asset/version", "3.0", "its asset.version is \"3.0\""},
           {"/materials/0/pbrMetallicRoughness", {0.5}, "its JSON has [0.5] where an object"},
           {"/materials/0/pbrMetallicRoughness/metallicFactor", "0.5",
            "its JSON has \"0.5\" where a number"},
           {"/nodes/0/mesh", -1, "its JSON has -1 where a whole number"}}) {
    auto other = file;
    other.root[Json::json_pointer(place)] = value;
    CHECK_REFUSED(load(folder, other), words);
  }
}

TEST_CASE("materials of a glTF file without a name, or of one name, are told apart") {
  const Folder folder;
  Gltf file;
  for (const int i : {0, 1, 2})
    file.add(Gltf::square(
        1, {3 * i, 0, 0},
        file.material({{"emissiveFactor", {0.5, 0.25, 0}},
                       {"extensions",
                        {{"KHR_materials_ior", {{"ior", 1.25 + 0.25 * i}}},
                         {"KHR_materials_transmission", {{"transmissionFactor", 0.25 * i}}},
                         {"KHR_materials_emissive_strength", {{"emissiveStrength", 1 + i}}}}}})));
  for (const bool has_names : {false, true}) {
    if (has_names)
      for (auto& material : file.root["materials"]) material["name"] = "glass";
    const auto mesh = load(folder, file);
    REQUIRE(mesh.materials.size() == 3);
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      const double number = std::floor(mesh.positions[mesh.triangles[i].x].x / 3 + 0.5);
      const auto& look =
          mesh.materials.at(static_cast<std::size_t>(mesh.triangle_material[i])).look;
      CHECK(look.ior == 1.25 + 0.25 * number);
      CHECK(look.transmission == 0.25 * number);
      CHECK(look.emission == (1 + number) * dvec3(0.5, 0.25, 0));
    }
  }
}

TEST_CASE("strips and fans of a glTF file have their area, and points and lines a note") {
  const Folder folder;
  // A band of quads, 9 long and 1 high, and a disc of 12 corners about its first one
  std::vector<double> band, disc{0, 0, 0};
  for (int i = 0; i < 10; ++i) band.insert(band.end(), {1.0 * i, 0, 0, 1.0 * i, 1, 0});
  for (int i = 0; i <= 12; ++i)
    disc.insert(disc.end(), {std::cos(i * std::acos(-1) / 6), std::sin(i * std::acos(-1) / 6), 0});
  const auto with = [&](const std::vector<double>& positions, int mode) {
    auto file = square_file();
    Json primitive{{"attributes", {{"POSITION", file.numbers(positions, 5126, "VEC3", 3)}}},
                   {"mode", mode}};
    file.root["meshes"].push_back({{"name", "more"}, {"primitives", {primitive}}});
    file.add_node({{"mesh", 1}, {"translation", {0, 0, 3}}});
    return load(folder, file);
  };
  const auto strip = with(band, 5), fan = with(disc, 6);
  CHECK(area_of(strip) == Catch::Approx(4 + 9));
  CHECK(area_of(fan) == Catch::Approx(4 + 3));  // 12 sin(30 degrees) / 2
  // All triangles face one side, the strip's -z
  CHECK(areas_of(strip).second == Catch::Approx(4 - 9));
  CHECK(areas_of(fan).second == Catch::Approx(4 + 3));
  for (const int mode : {0, 1, 2, 3}) {
    const auto mesh = with(band, mode);
    CHECK(area_of(mesh) == Catch::Approx(4));
    CHECK_SAYS(notes_of(mesh), "mesh \"more\": points and lines are not shown");
  }
}

TEST_CASE("a texture's transform chooses the texture coordinates") {
  const Folder folder;
  Gltf file;
  const int texture =
      file.texture(test::tga_picture(2, 2, [](int, int) { return glm::u8vec4(255); }));
  auto info = test::texture_info(texture);
  info["extensions"]["KHR_texture_transform"] = {{"texCoord", 1}};
  file.add(Gltf::square(1, {0, 0, 0},
                        file.material({{"pbrMetallicRoughness", {{"baseColorTexture", info}}}})));
  const std::vector<double> second{0.25, 0.5, 0.5, 0.5, 0.5, 0.125, 0.25, 0.125};
  CHECK_SAYS(notes_of(load(folder, file)), "mesh 0: TEXCOORD_1 is missing");
  first_primitive(file)["attributes"]["TEXCOORD_1"] = file.numbers(second, 5126, "VEC2", 2);
  const auto mesh = load(folder, file);
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& p = mesh.positions[i];
    CHECK(mesh.uvs[i] == dvec2(p.x < 0 ? 0.25 : 0.5, 1 - (p.y < 0 ? 0.5 : 0.125)));
  }
}

TEST_CASE("a map whose texture coordinates are not those of the maps before it is named") {
  const Folder folder;
  Gltf file;
  const int texture =
      file.texture(test::tga_picture(2, 2, [](int, int) { return glm::u8vec4(255); }));
  auto second = test::texture_info(texture);
  second["texCoord"] = 1;
  file.add(Gltf::square(
      1, {0, 0, 0},
      file.material({{"name", "wood"},
                     {"pbrMetallicRoughness", {{"baseColorTexture", test::texture_info(texture)}}},
                     {"emissiveFactor", {1, 1, 1}},
                     {"emissiveTexture", second}})));
  const auto mesh = load(folder, file);
  CHECK(mesh.materials.at(0).look.base_map.picture >= 0);
  CHECK(mesh.materials.at(0).look.emission_map.picture < 0);
  CHECK_SAYS(notes_of(mesh),
             "wood: emission map is ignored: it lies by "
             "TEXCOORD_1, the maps before it by TEXCOORD_0");
}

TEST_CASE("a skin without inverse bind matrices has the identity") {
  const Folder folder;
  auto file = square_file({{"skin", 0}, {"translation", {9, 9, 9}}});
  file.add_node({{"translation", {0, 0, 2}}, {"scale", {3, 1, 1}}});
  file.root["skins"] = {{{"joints", {1}}}};
  auto& attributes = first_primitive(file)["attributes"];
  attributes["JOINTS_0"] = file.numbers(std::vector<double>(16, 0), 5121, "VEC4", 4);
  std::vector<double> weights(16, 0);
  for (std::size_t i = 0; i < 16; i += 4) weights[i] = 255;
  attributes["WEIGHTS_0"] = file.numbers(weights, 5121, "VEC4", 4);
  const auto mesh = load(folder, file);
  CHECK(area_of(mesh) == Catch::Approx(12));
  for (const auto& p : mesh.positions) CHECK((std::abs(p.x) == 3 && p.z == 2));
}

TEST_CASE("many primitives may share one list of vertices") {
  const Folder folder;
  Gltf file;
  constexpr int side = 200, parts = 300;
  Gltf::Part grid;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) grid.positions.emplace_back(i, j, 0);
  grid.indices = {0, 1, side};
  file.add(grid);
  for (int part = 1; part < parts; ++part) {
    const double first = part * 130 % (side * (side - 1));
    auto primitive = first_primitive(file);
    const bool is_last = static_cast<int>(first) % side == side - 1;
    const double corner = is_last ? first - 1 : first;
    primitive["indices"] = file.numbers({corner, corner + 1, corner + side}, 5125, "SCALAR", 1);
    file.root["meshes"][0]["primitives"].push_back(primitive);
  }
  const auto mesh = load(folder, file);
  CHECK(mesh.triangles.size() == parts);
  CHECK(area_of(mesh) == Catch::Approx(parts / 2.0));
}

/// A wavy grid of count x count vertices, and triangles as three numbers each.
struct Grid {
  std::vector<glm::vec3> positions;
  std::vector<std::uint32_t> corners;
  explicit Grid(std::uint32_t count) {
    for (std::uint32_t j = 0; j < count; ++j)
      for (std::uint32_t i = 0; i < count; ++i)
        positions.emplace_back(i, j, 8 * std::sin(0.1 * i) * std::cos(0.07 * j));
    for (std::uint32_t j = 0; j + 1 < count; ++j)
      for (std::uint32_t i = 0; i + 1 < count; ++i)
        for (const auto corner : {0u, 1u, count, 1u, count + 1, count})
          corners.push_back(j * count + i + corner);
  }
  double area() const {
    double sum = 0;
    for (std::size_t i = 0; i < corners.size(); i += 3) {
      const dvec3 a = positions[corners[i]], b = positions[corners[i + 1]],
                  c = positions[corners[i + 2]];
      sum += glm::length(glm::cross(b - a, c - a)) / 2;
    }
    return sum;
  }
};

std::string draco_of(const Grid& grid) {
  draco::TriangleSoupMeshBuilder builder;
  builder.Start(static_cast<int>(grid.corners.size() / 3));
  const int positions =
      builder.AddAttribute(draco::GeometryAttribute::POSITION, 3, draco::DT_FLOAT32);
  for (std::uint32_t i = 0; i < grid.corners.size(); i += 3)
    builder.SetAttributeValuesForFace(
        positions, draco::FaceIndex(i / 3), &grid.positions[grid.corners[i]],
        &grid.positions[grid.corners[i + 1]], &grid.positions[grid.corners[i + 2]]);
  const auto mesh = builder.Finalize();
  draco::Encoder encoder;
  draco::EncoderBuffer buffer;
  REQUIRE(encoder.EncodeMeshToBuffer(*mesh, &buffer).ok());
  return {buffer.data(), buffer.size()};
}

Gltf draco_file(const Grid& grid) {
  Gltf file;
  const int view = file.add_view(draco_of(grid));
  file.root["accessors"] = {
      {{"componentType", 5126}, {"count", grid.positions.size()}, {"type", "VEC3"}},
      {{"componentType", 5125}, {"count", grid.corners.size()}, {"type", "SCALAR"}}};
  file.root["meshes"] = {{{"primitives",
                           {{{"attributes", {{"POSITION", 0}}},
                             {"indices", 1},
                             {"extensions",
                              {{"KHR_draco_mesh_compression",
                                {{"bufferView", view}, {"attributes", {{"POSITION", 0}}}}}}}}}}}};
  file.root["extensionsRequired"] = {"KHR_draco_mesh_compression"};
  return file.add_node({{"mesh", 0}});
}

/// The grid as EXT_meshopt_compression has it, in a buffer whose stand-in has no bytes.
Gltf meshopt_file(const Grid& grid, bool as_sequence) {
  Gltf file;
  const auto count = grid.positions.size();
  std::vector<unsigned char> packed(meshopt_encodeVertexBufferBound(count, 12));
  packed.resize(
      meshopt_encodeVertexBuffer(packed.data(), packed.size(), grid.positions.data(), count, 12));
  const auto add = [&](const std::vector<unsigned char>& bytes, std::size_t elements,
                       std::size_t step, const char* mode) {
    const int view = file.add_view({bytes.begin(), bytes.end()});
    auto& made = file.root["bufferViews"][view];
    Json how = made;
    how["count"] = elements;
    how["byteStride"] = step;
    how["mode"] = mode;
    made = {{"buffer", 1}, {"byteLength", elements * step}};
    made["extensions"]["EXT_meshopt_compression"] = how;
    return view;
  };
  const int positions = add(packed, count, 12, "ATTRIBUTES");
  packed.assign(meshopt_encodeIndexBufferBound(grid.corners.size(), count) +
                    meshopt_encodeIndexSequenceBound(grid.corners.size(), count),
                0);
  packed.resize((as_sequence ? meshopt_encodeIndexSequence<std::uint32_t>
                             : meshopt_encodeIndexBuffer<std::uint32_t>)(packed.data(),
                                                                         packed.size(),
                                                                         grid.corners.data(),
                                                                         grid.corners.size()));
  const int corners = add(packed, grid.corners.size(), 4, as_sequence ? "INDICES" : "TRIANGLES");
  file.root["accessors"] = {
      {{"bufferView", positions}, {"componentType", 5126}, {"count", count}, {"type", "VEC3"}},
      {{"bufferView", corners},
       {"componentType", 5125},
       {"count", grid.corners.size()},
       {"type", "SCALAR"}}};
  file.root["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}}}}}};
  file.root["extensionsRequired"] = {"EXT_meshopt_compression"};
  return file.add_node({{"mesh", 0}});
}

TEST_CASE("compressed glTF files of more than 65536 vertices are read, by Draco and meshopt") {
  const Folder folder;
  const Grid grid(260);
  for (const auto& [file, error] : {std::pair{draco_file(grid), 1e-9},
                                    {meshopt_file(grid, false), 1e-12},
                                    {meshopt_file(grid, true), 1e-12}}) {
    const auto mesh = load(folder, file);
    CHECK(mesh.triangles.size() == grid.corners.size() / 3);
    CHECK(area_of(mesh) == Catch::Approx(grid.area()).epsilon(error));
  }
}

TEST_CASE("damaged compressed glTF files are read or refused with one line") {
  const Folder folder;
  const Grid grid(12);
  for (const auto& file : {draco_file(grid), meshopt_file(grid, false), meshopt_file(grid, true)}) {
    const auto [read, refused] =
        read_damaged(folder, folder.write("a.glb", file.glb()), 12, 150, [](const auto& damaged) {
          for (const auto& p : load(damaged).positions) REQUIRE(std::isfinite(p.x + p.y + p.z));
        });
    CHECK(read + refused > 100);
    CHECK(refused > 20);
  }
}

}  // namespace
}  // namespace raywave
