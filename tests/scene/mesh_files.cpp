// SPDX-License-Identifier: Apache-2.0
// What OBJ, MTL, PLY, STL and OFF files say: written here, with shapes and colours that are known.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "host/scene/image.hpp"
#include "host/scene/mesh.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"
#include "tests/support/german.hpp"
#include "tests/support/gltf.hpp"

namespace raywave {
namespace {

using Catch::Matchers::ContainsSubstring;
using Outline = std::vector<glm::dvec2>;

const std::string three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n", face = "f 1 2 3\n";

Mesh load(const std::filesystem::path& file) { return load_mesh(file, Normals::file, "here"); }

std::string refusal(const std::filesystem::path& file) {
  return input_error_of([&] { load(file); });
}

/// Area of the triangles, and of what they show towards `up`.
std::pair<double, double> areas_of(const Mesh& mesh, const glm::dvec3& up = {0, 0, 1}) {
  std::pair<double, double> sum{0, 0};
  for (const auto& t : mesh.triangles) {
    const auto twice = glm::cross(mesh.positions[t.y] - mesh.positions[t.x],
                                  mesh.positions[t.z] - mesh.positions[t.x]);
    sum.first += glm::length(twice) / 2;
    sum.second += glm::dot(twice, up) / 2;
  }
  return sum;
}

double area_of(const Mesh& mesh) { return areas_of(mesh).first; }

double shoelace(const Outline& outline) {
  double twice = 0;
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const auto &a = outline[i], &b = outline[(i + 1) % outline.size()];
    twice += a.x * b.y - b.x * a.y;
  }
  return twice / 2;
}

/// Columns that reach up and down from the x axis by random lengths: rectilinear, without holes.
Outline random_columns(std::mt19937& random) {
  const auto draw = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  Outline above, below;
  double x = 0;
  for (int columns = 1 + draw(12); columns > 0; --columns) {
    const double top = 1 + draw(6), bottom = -1 - draw(6), next = x + 1 + draw(3);
    above.insert(above.end(), {{x, top}, {next, top}});
    below.insert(below.end(), {{x, bottom}, {next, bottom}});
    x = next;
  }
  below.insert(below.end(), above.rbegin(), above.rend());
  return below;
}

std::string obj_of(const Outline& outline, const glm::dvec3& u, const glm::dvec3& v,
                   const glm::dvec3& origin) {
  std::ostringstream out, corners;
  out.precision(17);
  for (std::size_t i = 0; i < outline.size(); ++i) {
    const auto p = origin + outline[i].x * u + outline[i].y * v;
    out << "v " << p.x << ' ' << p.y << ' ' << p.z << '\n';
    corners << ' ' << i + 1;
  }
  return out.str() + "f" + corners.str() + "\n";
}

const MeshMaterial& material_of(const Mesh& mesh, std::size_t triangle) {
  REQUIRE(triangle < mesh.triangle_material.size());
  REQUIRE(mesh.triangle_material[triangle] >= 0);
  return mesh.materials.at(static_cast<std::size_t>(mesh.triangle_material[triangle]));
}

std::string notes_of(const Mesh& mesh) {
  std::string all;
  for (const auto& note : mesh.notes) all += note + "\n";
  for (const auto& material : mesh.materials)
    for (const auto& note : material.notes) all += note + "\n";
  return all;
}

float linear(double srgb) {
  return static_cast<float>(srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4));
}

/// All vertices have this colour, given in sRGB.
void check_colour(const Mesh& mesh, const glm::vec3& srgb) {
  REQUIRE(mesh.colours.size() == mesh.positions.size());
  for (const auto& c : mesh.colours)
    for (int i = 0; i < 3; ++i) CHECK(std::abs(c[i] - linear(srgb[i])) < 2e-5f);
  CHECK(material_of(mesh, 0).look.vertex_colours == 1);
}

/// Bytes of numbers, in the order of this machine or turned.
struct Bytes {
  bool swaps = false;
  std::string all{};

  template <class T>
  Bytes& put(T value) {
    auto bytes = std::bit_cast<std::array<char, sizeof(T)>>(value);
    if (swaps) std::reverse(bytes.begin(), bytes.end());
    all.append(bytes.data(), sizeof(T));
    return *this;
  }
  Bytes& put(const std::string& type, double value) {
    if (type == "char") return put(static_cast<std::int8_t>(value));
    if (type == "uchar") return put(static_cast<std::uint8_t>(value));
    if (type == "short") return put(static_cast<std::int16_t>(value));
    if (type == "ushort") return put(static_cast<std::uint16_t>(value));
    if (type == "int") return put(static_cast<std::int32_t>(value));
    if (type == "uint") return put(static_cast<std::uint32_t>(value));
    return type == "float" ? put(static_cast<float>(value)) : put(value);
  }
};

/// A PLY file of a triangle of area 0.5, whose elements may have more to say.
struct Ply {
  std::string before{}, vertex{}, of_face{};  // lines of the header
  std::string index = "int", count = "uchar", list = "vertex_indices";
  std::function<void(Bytes&)> put_before{}, put_vertex{}, put_face{};
  std::string line_end = "\n";
  bool swaps = false;
  float first_x = 0;

  std::string text() const {
    std::string header = "ply\nformat binary_" + std::string(swaps ? "big" : "little") +
                         "_endian 1.0\n" + before +
                         "element vertex 3\nproperty float x\ncomment within\nproperty float y\n"
                         "obj_info within\nproperty float z\n" +
                         vertex + "element face 1\nproperty list " + count + ' ' + index + ' ' +
                         list + '\n' + of_face + "end_header\n";
    for (auto at = header.find('\n'); at != header.npos;
         at = header.find('\n', at + line_end.size()))
      header.replace(at, 1, line_end);
    Bytes data{swaps};
    if (put_before) put_before(data);
    for (const auto& p : {std::array{first_x, 0.0f}, {1.0f, 0.0f}, {0.0f, 1.0f}}) {
      data.put(p[0]).put(p[1]).put(0.0f);
      if (put_vertex) put_vertex(data);
    }
    data.put(count, 3);
    for (int i = 0; i < 3; ++i) data.put(index, i);
    if (put_face) put_face(data);
    return header + data.all;
  }
};

std::string stl_of(const std::string& header, const std::vector<std::uint16_t>& attributes) {
  Bytes bytes;
  bytes.all = header;
  bytes.all.resize(80, ' ');
  bytes.put(static_cast<std::uint32_t>(attributes.size()));
  float z = 0;
  for (const auto attribute : attributes) {
    for (const float x : {0.f, 0.f, 1.f, 0.f, 0.f, z, 1.f, 0.f, z, 0.f, 1.f, z}) bytes.put(x);
    bytes.put(attribute);
    z += 1;
  }
  return bytes.all;
}

const std::string text_stl =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n"
    "endfacet\nendsolid a\n";

}  // namespace

TEST_CASE("triangles cover what the outline of a face encloses") {
  const Folder folder;
  const Outline corner{{1, 1}, {3, 1}, {3, 2}, {4, 2}, {4, 3}, {2, 3}, {2, 5}, {1, 5}};
  CHECK(area_of(load(folder.write("a.obj", obj_of(corner, {1, 0, 0}, {0, 1, 0}, {})))) ==
        Catch::Approx(7).epsilon(1e-12));
  std::string ply =
                  "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
                  "property float z\nelement face 1\nproperty list uchar int vertex_index\n"
                  "end_header\n",
              off = "OFF\n8 1 0\n", vertices;
  for (const auto& p : corner) vertices += std::to_string(p.x) + ' ' + std::to_string(p.y) + " 0\n";
  CHECK(area_of(load(folder.write("a.ply", ply + vertices + "8 0 1 2 3 4 5 6 7\n"))) ==
        Catch::Approx(7).epsilon(1e-12));
  CHECK(area_of(load(folder.write("a.off", off + vertices + "8 7 6 5 4 3 2 1 0\n"))) ==
        Catch::Approx(7).epsilon(1e-12));

  std::mt19937 random(33);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 60; ++i) {
    INFO(i);
    auto outline = random_columns(random);
    std::rotate(outline.begin(), outline.begin() + static_cast<int>(random() % outline.size()),
                outline.end());
    if (i % 2) std::reverse(outline.begin(), outline.end());
    const auto draw = [&] { return glm::dvec3(normal(random), normal(random), normal(random)); };
    const double size = std::pow(10, 3 * normal(random));
    const auto u = glm::normalize(draw()), up = glm::normalize(glm::cross(u, draw()));
    const auto v = glm::cross(up, u);
    const auto mesh =
        load(folder.write("a.obj", obj_of(outline, size * u, size * v, 100 * size * draw())));
    const auto [all, towards] = areas_of(mesh, up);
    const double wanted = shoelace(outline) * size * size;
    CHECK(all == Catch::Approx(std::abs(wanted)).epsilon(1e-6));
    CHECK(towards == Catch::Approx(wanted).epsilon(1e-6));
  }
}

TEST_CASE(
    "holes that a face reaches along an edge stay open, and quads are cut where they can be") {
  const Folder folder;
  const auto area = [&](const Outline& outline) {
    return area_of(load(folder.write("a.obj", obj_of(outline, {1, 0, 0}, {0, 0, 1}, {}))));
  };
  CHECK(area({{0, 0}, {4, 0}, {4, 4}, {0, 4}, {0, 0}, {1, 1}, {1, 3}, {3, 3}, {3, 1}, {1, 1}}) ==
        Catch::Approx(12));
  CHECK(area({{0, 0}, {1, 1}, {2, 0}, {1, 3}}) == Catch::Approx(2));  // a dart
  CHECK(area({{0, 0}, {1, 0}, {2, 0}, {0, 3}}) == Catch::Approx(3));  // a corner on a side
  CHECK(area({{0, 0}, {2, 0}, {2, 0}, {0, 3}}) == Catch::Approx(3));  // a corner twice
  for (const Outline& crossing : {Outline{{0, 0}, {1, 1}, {1, 0}, {0, 1}},
                                  Outline{{0, 0}, {4, 4}, {4, 0}, {0, 2}, {-1, 1}}}) {
    const auto text = obj_of(crossing, {1, 0, 0}, {0, 1, 0}, {});
    CHECK_THAT(refusal(folder.write("a.obj", text)),
               ContainsSubstring("line " + std::to_string(crossing.size() + 1)) &&
                   ContainsSubstring("crosses itself"));
  }
  // Four corners that no plane shows as an outline: along the shorter diagonal, 0-2
  const glm::dvec3 p(-0.12, 0.194, -0.496), q(-0.132, 0.141, -0.496), r(0.092, 0.093, 0);
  const auto twisted = load(folder.write("a.obj",
                                         "v 0 0 0\nv -0.12 0.194 -0.496\nv -0.132 0.141 -0.496\n"
                                         "v 0.092 0.093 0\nf 1 2 3 4\n"));
  CHECK(area_of(twisted) ==
        Catch::Approx((glm::length(glm::cross(p, q)) + glm::length(glm::cross(q, r))) / 2));
  CHECK_THAT(notes_of(twisted), ContainsSubstring("line 5: a twisted face"));
  const auto pair = load(folder.write("a.obj", three + "f 1 2\n" + face + "f 3 2\n"));
  CHECK(area_of(pair) == 0.5);
  CHECK_THAT(notes_of(pair), ContainsSubstring("line 4: a face of fewer than three corners") &&
                                 ContainsSubstring("(2 times)"));
}

TEST_CASE("an OBJ wears the materials that it names, or the default, with a note: never others") {
  const Folder folder;
  folder.write("red.mtl", "newmtl red\nKd 1 0 0\n");
  folder.write("blue.mtl", "\xef\xbb\xbfnewmtl blue\r\nKd 0 0 1\r\n");
  folder.write("two words.mtl", "newmtl two words \nKd 0 1 0\n");
  struct Row {
    std::string text;
    std::vector<std::string> names;  // of each triangle; "": the default
    std::string note;
  };
  for (const auto& row : std::vector<Row>{
           {"mtllib red.mtl\nusemtl red\n" + three + face, {"red"}, ""},
           {"mtllib red.mtl  \t\nusemtl red \n" + three + face, {"red"}, ""},
           {"mtllib red.mtl blue.mtl\nusemtl red\n" + three + face + "usemtl blue\n" + face,
            {"red", "blue"},
            ""},
           {"mtllib red.mtl\nmtllib blue.mtl\nusemtl blue\n" + three + face, {"blue"}, ""},
           {"\xef\xbb\xbfmtllib red.mtl\r\nusemtl red\r\n" + three + face, {"red"}, ""},
           {"mtllib two words.mtl\nusemtl two words\n" + three + face, {"two words"}, ""},
           {"mtllib C:\\models\\red.mtl\nusemtl red\n" + three + face, {"red"}, ""},
           {"mtllib none.mtl\nusemtl red\n" + three + face, {""}, "line 1: library \"none.mtl\""},
           {"mtllib none.mtl blue.mtl\nusemtl blue\n" + three + face + "usemtl red\n" + face,
            {"blue", ""},
            "line 7: material \"red\""},
           {"mtllib red.mtl blue.mtl\nusemtl green\n" + three + face + "usemtl blue\n" + face,
            {"", "blue"},
            "line 2: material \"green\""},
           {"usemtl red\n" + three + face, {""}, "line 1: material \"red\""}}) {
    INFO(row.text);
    const auto mesh = load(folder.write("a.obj", row.text));
    REQUIRE(mesh.triangles.size() == row.names.size());
    for (std::size_t i = 0; i < row.names.size(); ++i) {
      const auto m = mesh.triangle_material.empty() ? -1 : mesh.triangle_material[i];
      CHECK((m < 0 ? "" : mesh.materials[static_cast<std::size_t>(m)].name) == row.names[i]);
    }
    CHECK_THAT(notes_of(mesh), ContainsSubstring(row.note));
    CHECK(row.note.empty() == notes_of(mesh).empty());
  }
}

TEST_CASE("numbers of an OBJ are read as they are written") {
  const Folder folder;
  const auto area = [&](const std::string& text) {
    return area_of(load(folder.write("a.obj", text)));
  };
  CHECK(area("v .5 0 0\nv 1. 0 0\nv 0 +1 0\n" + face) == 0.25);
  CHECK(area("v 1d0 0 0\nv 2.5D+00 -0.D0 0\nv 0 1d1 0\n" + face) == 7.5);
  CHECK(area("v 0 0 0 1.0\nv 1e0 0 0 1.0\nv 0 1E+0 0 1.0\n" + face) == 0.5);
  CHECK(area("v 0 0 \\\n0\nv 1 0 0\nv 0 1 0\nf 1 \\\n2 3\n") == 0.5);
  CHECK(area("v 0 0 0 # a\r\nv 1 0 0\rv 0 1 0\nf -3 -2 -1 #b\n") == 0.5);
  CHECK(area("v 1e-400 0 0\nv 1 0 0\nv 0 1 0\n" + face) == 0.5);
  for (const char* bad : {"v 1,5 0 0\n", "v 1 0\n", "v a b c\n", "v 1e400 0 0\n", "v 1d0x 0 0\n"})
    CHECK_THAT(refusal(folder.write("a.obj", three + bad + face)), ContainsSubstring(": line 4: "));
  for (const char* bad : {"f 1 2 4\n", "f 0 1 2\n", "f 1 2 -4\n", "f 1/1/1/1 2 3\n", "f 1 2 x\n"})
    CHECK_THAT(refusal(folder.write("a.obj", three + bad)),
               ContainsSubstring(bad[4] == '2' && bad[6] == '4' ? "names a vertex" : ": line 4: "));

  const auto colours = [&](const std::string& of) {
    return load(
        folder.write("a.obj", "v 0 0 0" + of + "\nv 1 0 0" + of + "\nv 0 1 0" + of + "\n" + face));
  };
  check_colour(colours(" 1 .5 0"), {1, 0.5, 0});
  check_colour(colours(" 255 128 0"), {1, 128 / 255.0, 0});
  check_colour(colours(" 0.25 .5 0 1"), {0.25, 0.5, 0});
  check_colour(colours(" 64 128 0 255"), {64 / 255.0, 128 / 255.0, 0});
  check_colour(
      load(folder.write("a.obj",
                        "v 0 0 0 1 .5 .25 0\nv 1 0 0 1 .5 .25 0\nv 0 1 0 1 .5 .25 0.0\n" + face)),
      {1, 0.5, 0.25});
  const auto weighted =
      load(folder.write("a.obj", "v 0 0 0 1 0 0 1\nv 1 0 0 1 1 0 0\nv 0 1 0 1 0 1 .5\n" + face));
  REQUIRE(weighted.colours.size() == 3);
  for (const auto& [p, blue] : {std::pair{glm::dvec3(0), 1.0f}, {glm::dvec3(1, 0, 0), 0.0f}})
    for (std::size_t i = 0; i < 3; ++i)
      if (weighted.positions[i] == p) CHECK(weighted.colours[i].z == blue);
}

TEST_CASE("an MTL's maps lie where their options put them, whatever stands before their names") {
  const Folder folder;
  const auto picture = test::tga_picture(2, 2, [](int, int) { return glm::u8vec4(99); });
  std::filesystem::create_directory(folder / "maps");
  for (const char* name : {"t.tga", "a b #1 50%.tga", "2", "-x.tga", "maps/in.tga"})
    folder.write(name, picture);
  folder.write("maps/m.mtl", "newmtl m\nmap_Kd in.tga\n");
  const auto look = [&](const std::string& lines) {
    folder.write("m.mtl", "newmtl m\n" + lines);
    return load(folder.write("a.obj", "mtllib m.mtl\nusemtl m\n" + three + face));
  };
  struct Row {
    const char* line;
    std::array<double, 4> place;  // scale, offset
    const char* name = "t.tga";
  };
  for (const auto& row : std::vector<Row>{
           {"map_Kd t.tga", {1, 1, 0, 0}},
           {"map_Kd -s 2 3 1 -o .5 -0.25 0 t.tga", {2, 3, 0.5, -0.25}},
           {"map_Kd -s 2 t.tga", {2, 1, 0, 0}},
           {"map_Kd -o 0.5 -t 0 0 0 -bm 1 -blendu off -blendv on -s 1 2 t.tga ", {1, 2, 0.5, 0}},
           {"map_Kd -s 4 2", {4, 1, 0, 0}, "2"},
           {"map_Kd a b #1 50%.tga", {1, 1, 0, 0}, "a b #1 50%.tga"},
           {"map_Kd \"a b #1 50%.tga\"", {1, 1, 0, 0}, "a b #1 50%.tga"},
           {"map_Kd -s 2 2 2 -x.tga", {2, 2, 0, 0}, "-x.tga"},
           {"map_Kd D:\\pictures\\t.tga", {1, 1, 0, 0}, "D:/pictures/t.tga"}}) {
    INFO(row.line);
    const auto mesh = look(std::string(row.line) + "\n");
    const auto& map = material_of(mesh, 0).look.base_map;
    REQUIRE(map.picture >= 0);
    const auto name = mesh.pictures.at(static_cast<std::size_t>(map.picture)).name;
    CHECK(name == (std::string(row.name).starts_with("D:") ? "t.tga" : row.name));
    CHECK(map.place.across == std::array{row.place[0], 0.0, row.place[2]});
    CHECK(map.place.up == std::array{0.0, row.place[1], row.place[3]});
    CHECK(map.place.wrap_u == Wrap::repeat);
    CHECK(notes_of(mesh).empty());
    CHECK(material_of(mesh, 0).look.base == glm::dvec3(1));
  }
  const auto clamped = look("map_Kd -clamp on t.tga\nnorm -bm 0.5 t.tga\n");
  CHECK(material_of(clamped, 0).look.base_map.place.wrap_v == Wrap::clamp);
  CHECK(material_of(clamped, 0).look.normal_scale == 0.5);
  CHECK_THAT(notes_of(look("Kd 1 0 0\nmap_Kd lost.tga\n")),
             ContainsSubstring("\"lost.tga\"") && ContainsSubstring("m.mtl, line 3"));
  CHECK_THAT(notes_of(look("Kd 1 0 0\nPccns 1\nKd x 0 0\n")),
             ContainsSubstring("\"pccns\" is ignored (m.mtl, line 3)") &&
                 ContainsSubstring("\"x\" is no number and is ignored (m.mtl, line 4)"));
  const auto inner = load(folder.write("a.obj", "mtllib maps/m.mtl\nusemtl m\n" + three + face));
  CHECK(inner.pictures.at(0).name == "maps/in.tga");
}

TEST_CASE(
    "what an MTL says of opacity is what is seen, and a file that hides all of itself is not") {
  const Folder folder;
  const auto load_with = [&](const std::string& a, const std::string& b) {
    folder.write("m.mtl", "newmtl a\nKd 1 0 0\n" + a + "newmtl b\nKd 0 1 0\n" + b);
    return load(
        folder.write("a.obj", "mtllib m.mtl\nusemtl a\n" + three + face + "usemtl b\n" + face));
  };
  struct Row {
    const char *a, *b;
    double of_a, of_b;
    const char* note;
  };
  for (const auto& row :
       std::vector<Row>{{"d 0.5\n", "Tr 0.75\n", 0.5, 0.25, ""},
                        {"d -halo 0.5\n", "d 1\n", 0.5, 1, "-halo is ignored"},
                        {"d 1\nTr 0\n", "Tr 0\n", 1, 1, ""},
                        {"d 1\nTr 1\n", "Tr 1\nd 1\n", 1, 1, "Tr is ignored"},
                        {"Tr 1\n", "Tr 1.000\n", 1, 1, "every material has Tr 1 or d 0"},
                        {"d 0\n", "Tr 1\n", 1, 1, "every material has Tr 1 or d 0"},
                        {"Tr 1\n", "Tr 0\n", 0, 1, "Tr 1 or d 0 shows nothing of it"}}) {
    INFO(row.a << row.b);
    const auto mesh = load_with(row.a, row.b);
    for (std::size_t i = 0; i < 2; ++i) {
      const auto& look = material_of(mesh, i).look;
      CHECK(look.alpha == (i == 0 ? row.of_a : row.of_b));
      CHECK((look.alpha_mode == AlphaMode::blend) == (look.alpha < 1));
    }
    CHECK_THAT(notes_of(mesh), ContainsSubstring(row.note));
    CHECK((*row.note == 0) == notes_of(mesh).empty());
  }
}

TEST_CASE("a PLY of every type, order of bytes and line end is read, elements before it skipped") {
  const Folder folder;
  const auto check = [&](const Ply& ply, const char* note = "") {
    const auto mesh = load(folder.write("a.ply", ply.text()));
    CHECK(area_of(mesh) == Catch::Approx(0.5).epsilon(1e-5));
    CHECK_THAT(notes_of(mesh), ContainsSubstring(note));
    return mesh;
  };
  const auto line_feed = std::bit_cast<float>(std::array<char, 4>{0x0a, 0, 0, 0x40});
  for (const bool swaps : {false, true}) {
    for (const char* count : {"char", "uchar", "short", "ushort", "int", "uint"})
      for (const char* index : {"char", "uchar", "short", "ushort", "int", "uint"}) {
        INFO(count << ' ' << index << ' ' << swaps);
        Ply ply;
        ply.count = count;
        ply.index = index;
        ply.swaps = swaps;
        ply.list = swaps ? "vertex_index" : "vertex_indices";
        CHECK(notes_of(check(ply)).empty());
      }
    for (const char* line_end : {"\n", "\r\n", "\r"}) {
      Ply ply;
      ply.swaps = swaps;
      ply.line_end = line_end;
      check(ply);
      ply.first_x = 1e-9f;
      for (const float x : {line_feed, std::bit_cast<float>(std::uint32_t{0x0a0a0a0a})}) {
        ply.first_x = x;
        const auto mesh = load(folder.write("a.ply", ply.text()));
        CHECK(std::any_of(mesh.positions.begin(), mesh.positions.end(),
                          [&](const auto& p) { return p.x == double{x}; }));
      }
    }
    Ply camera;
    camera.swaps = swaps;
    camera.before = "element camera 2\nproperty double f\nproperty list ushort float k\n";
    camera.put_before = [](Bytes& bytes) {
      bytes.put(1.5).put(std::uint16_t{0});
      bytes.put(1.5).put(std::uint16_t{2}).put(1.0f).put(2.0f);
    };
    camera.vertex = "property uchar quality\n";
    camera.put_vertex = [](Bytes& bytes) { bytes.put(std::uint8_t{7}); };
    camera.of_face = "property list uchar float weights\n";
    camera.put_face = [](Bytes& bytes) { bytes.put(std::uint8_t{1}).put(7.0f); };
    const auto notes = notes_of(check(camera, "element \"camera\" is ignored"));
    CHECK_THAT(notes, ContainsSubstring("of each vertex is ignored: quality") &&
                          ContainsSubstring("of each face is ignored: weights"));
  }
  const auto whole = Ply().text();
  for (std::size_t length = 0; length < whole.size(); length += 7)
    CHECK_THAT(refusal(folder.write("a.ply", whole.substr(0, length))), ContainsSubstring("mesh "));
  auto wrong = Ply();
  wrong.before = "element camera 4000000000\nproperty double f\n";
  CHECK_THAT(refusal(folder.write("a.ply", wrong.text())), ContainsSubstring("\"camera\""));
}

TEST_CASE("colours and texture coordinates of a PLY are read under all of their names and types") {
  const Folder folder;
  for (const std::string prefix : {"", "diffuse_", "r"})
    for (const auto& [type, scale] : std::vector<std::pair<std::string, double>>{{"uchar", 255},
                                                                                 {"int", 255},
                                                                                 {"short", 255},
                                                                                 {"ushort", 65535},
                                                                                 {"uint", 65535},
                                                                                 {"float", 1},
                                                                                 {"double", 255}}) {
      for (const bool of_face : {false, true}) {
        INFO(prefix << ' ' << type << ' ' << of_face);
        Ply ply;
        auto& lines = of_face ? ply.of_face : ply.vertex;
        for (const std::string name : {"red", "green", "blue"})
          lines +=
              "property " + type + ' ' + (prefix == "r" ? name.substr(0, 1) : prefix + name) + '\n';
        (of_face ? ply.put_face : ply.put_vertex) = [type = type, scale = scale](Bytes& bytes) {
          bytes.put(type, scale)
              .put(type, std::floor(scale / 5 * 4) + (scale == 1 ? 0.75 : 0))
              .put(type, 0);
        };
        const double green = scale == 1 ? 0.75 : std::floor(scale / 5 * 4) / scale;
        const auto mesh = load(folder.write("a.ply", ply.text()));
        check_colour(mesh, {1, green, 0});
        CHECK(mesh.notes.empty());
      }
    }
  for (const auto& [u, v] : {std::pair{"s", "t"}, {"u", "v"}, {"texture_u", "texture_v"}}) {
    Ply ply;
    ply.vertex = std::string("property float ") + u + "\nproperty float " + v + "\n";
    ply.put_vertex = [](Bytes& bytes) { bytes.put(0.25f).put(0.75f); };
    for (const auto& uv : load(folder.write("a.ply", ply.text())).uvs)
      CHECK(uv == glm::dvec2(0.25, 0.75));
  }
  Ply wedges;
  wedges.before = "comment TextureFile t.tga\n";
  wedges.of_face = "property list uchar float texcoord\n";
  wedges.put_face = [](Bytes& bytes) {
    bytes.put(std::uint8_t{6});
    for (const float c : {0.f, 0.f, 1.f, 0.f, 0.f, 1.f}) bytes.put(c);
  };
  const auto mesh = load(folder.write("a.ply", wedges.text()));
  CHECK(mesh.pictures.at(0).name == "t.tga");
  for (std::size_t i = 0; i < 3; ++i) CHECK(mesh.uvs[i] == glm::dvec2(mesh.positions[i]));
}

TEST_CASE("an STL is text or binary by its size, and has the colours of Magics or VisCAM") {
  const Folder folder;
  const auto of = [&](const std::string& bytes) { return load(folder.write("a.stl", bytes)); };
  auto upper = text_stl;
  std::transform(upper.begin(), upper.end(), upper.begin(), [](char c) {
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  });
  for (const auto& text : {text_stl, upper, "  " + text_stl, "\xef\xbb\xbf" + text_stl})
    CHECK(area_of(of(text)) == 0.5);
  CHECK(area_of(of(text_stl + "solid b\nendsolid\n" + upper)) == 1);
  CHECK(of(stl_of("solid of binary", {0, 0})).triangles.size() == 2);
  for (const char* header : {"solid facet", "x"}) {
    const auto longer = of(stl_of(header, {0, 0, 0}) + "trailing");
    CHECK(area_of(longer) == 1.5);
    CHECK_THAT(notes_of(longer), ContainsSubstring("8 bytes"));
    CHECK_THAT(refusal(folder.write("a.stl", stl_of(header, {0, 0, 0}).substr(0, 200))),
               ContainsSubstring("mesh "));
  }
  CHECK_THAT(refusal(folder.write("a.stl", text_stl.substr(0, text_stl.find("endfacet")))),
             ContainsSubstring("within a facet"));

  check_colour(of(stl_of("made by VisCAM", {0x8000 | 31 << 10 | 15 << 5})), {1, 15 / 31.0, 0});
  const std::string magics("COLOR=\xff\x80\x00\xff", 10);
  check_colour(of(stl_of(magics, {31 | 15 << 5})), {1, 15 / 31.0, 0});
  check_colour(of(stl_of(magics, {0x8000})), {1, 128 / 255.0, 0});
  check_colour(of(stl_of("made by " + magics + ",MATERIAL=", {0, 0})), {1, 128 / 255.0, 0});
  const auto both = of(stl_of(magics, {0x8000, 31}));
  CHECK(both.colours.size() == 6);
  CHECK(std::count_if(both.colours.begin(), both.colours.end(),
                      [](const glm::vec4& c) { return c.y == 0; }) == 3);
  CHECK(of(stl_of("plain", {0, 7})).colours.empty());
}

TEST_CASE("OFF files of every kind of vertex are read, with comments, and colours of 1 or 255") {
  const Folder folder;
  const auto of = [&](const std::string& bytes) { return load(folder.write("a.off", bytes)); };
  const auto file = [](const std::string& kind, const std::string& more,
                       const std::string& face_more) {
    return kind + "3 1 0\n0 0 0" + more + "\n1 0 0" + more + "\n0 1 0" + more + "\n3 0 1 2" +
           face_more + "\n";
  };
  for (const char* head : {"OFF\n", "OFF ", "OFF # a\n# b\n\n", ""})
    CHECK(area_of(of(file(head, "", ""))) == 0.5);
  CHECK(area_of(of("OFF\n3 1 # counts\n\n0 0 0 # first\n# none\n1 0 0\n0 1 0\n3 0 1 2\n")) == 0.5);
  check_colour(of(file("COFF\n", " 255 128 0 255", "")), {1, 128 / 255.0, 0});
  check_colour(of(file("COFF\n", " 1 0.5 0 1", "")), {1, 0.5, 0});
  check_colour(of(file("COFF\n", " 255 128 0", "")), {1, 128 / 255.0, 0});
  check_colour(of(file("OFF\n", "", " 255 128 0")), {1, 128 / 255.0, 0});
  check_colour(of(file("OFF\n", "", " 1.0 0.5 0.0 1.0")), {1, 0.5, 0});
  const auto normals = of(file("NOFF\n", " 0 3 4", ""));
  for (const auto& n : normals.normals) CHECK(glm::distance(n, glm::dvec3(0, 0.6, 0.8)) < 1e-12);
  const auto all = of(file("STCNOFF\n", " 0 3 4 255 0 0 255 .25 .5", ""));
  check_colour(all, {1, 0, 0});
  CHECK(all.uvs[0] == glm::dvec2(0.25, 0.5));
  for (const char* bad : {"4OFF\n", "OFF BINARY\n", "nOFF\n3\n"})
    CHECK_THAT(refusal(folder.write("a.off", file(bad, "", ""))), ContainsSubstring("mesh "));
  CHECK_THAT(refusal(folder.write("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n")),
             ContainsSubstring("line 6"));
}

TEST_CASE("meshes and pictures are found whatever their names") {
  const Folder folder;
  for (const std::string name : {"a b", "a#b", "a?b", "a%20b", "a%b", "\xc3\xa4", "a;b&c=d"}) {
    INFO(name);
    std::filesystem::create_directory(folder / name);
    folder.write(name + "/" + name + ".tga",
                 test::tga_picture(2, 2, [](int, int) { return glm::u8vec4(188); }));
    folder.write(name + "/" + name + ".mtl", "newmtl " + name + "\nmap_Kd " + name + ".tga\n");
    const auto file = folder.write(name + "/" + name + ".obj",
                                   "mtllib " + name + ".mtl\nusemtl " + name + "\n" + three + face);
    const auto mesh = load(file);
    CHECK(notes_of(mesh).empty());
    const auto maps = load_maps(mesh, file, {}, "here");
    REQUIRE(maps.size() == 1);
    REQUIRE(maps[0].colour);
    CHECK(maps[0].colour.image->pixels[0] == Catch::Approx(linear(188 / 255.0)).epsilon(1e-5));
  }
}

TEST_CASE("the colours of a WebP are those of the file, whatever its alpha") {
  const Folder folder;
  // 2 x 2 texels, without loss: (200, 100, 50, 128), (10, 20, 30, 0), (255, 0, 0, 255) ...
  constexpr std::array<unsigned char, 70> bytes{
      0x52, 0x49, 0x46, 0x46, 0x3e, 0x00, 0x00, 0x00, 0x57, 0x45, 0x42, 0x50, 0x56, 0x50,
      0x38, 0x4c, 0x32, 0x00, 0x00, 0x00, 0x2f, 0x01, 0x40, 0x00, 0x10, 0x1f, 0x20, 0x10,
      0x20, 0x4c, 0xf8, 0xf2, 0x3f, 0x63, 0x43, 0x4c, 0x43, 0xcc, 0xab, 0x7f, 0x1e, 0xd5,
      0x88, 0x05, 0x53, 0x3c, 0x88, 0xee, 0x04, 0x02, 0x44, 0x9b, 0x33, 0x69, 0xce, 0x04,
      0x7b, 0xa0, 0x57, 0x09, 0xb2, 0x01, 0xca, 0x54, 0x61, 0x13, 0xd1, 0xff, 0xf8, 0x00};
  const auto file = folder.write("a.webp", {bytes.begin(), bytes.end()});
  const auto channels = load_channels(file, "rgA", "here");
  const std::array<std::array<double, 3>, 3> texels{{{200, 100, 128}, {10, 20, 0}, {255, 0, 255}}};
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(channels.at(0).pixels[i] == Catch::Approx(linear(texels[i][0] / 255)).epsilon(1e-5));
    CHECK(channels.at(1).pixels[i] == Catch::Approx(linear(texels[i][1] / 255)).epsilon(1e-5));
    CHECK(channels.at(2).pixels[i] == Catch::Approx(texels[i][2] / 255));
  }
}

TEST_CASE("a German program reads the same meshes and says the same of them") {
  const Folder folder;
  folder.write("m.mtl", "newmtl a\nKd .5 .25 1e-1\nKs 1 1 1\nNs 12.5\nillum 2\n");
  const auto obj =
      folder.write("a.obj", "mtllib m.mtl\nusemtl a\nv 0 0 0\nv 1.5 0 0\nv 0 2.5 0\n" + face);
  const auto say = [&] {
    const auto mesh = load(obj);
    const auto& from = material_of(mesh, 0);
    return std::to_string(std::lround(1e6 * area_of(mesh))) + ' ' +
           description_of(from, phong_of(from, {}, false, 1, ""), {}, 0);
  };
  const auto before = say();
  CHECK_THAT(before, ContainsSubstring("1875000 ") && ContainsSubstring("shininess 12.5"));
  const test::German german;
  CHECK(say() == before);
}

TEST_CASE("damaged OBJ, MTL, STL and OFF files load, or are refused in one line") {
  const Folder folder;
  folder.write("m.mtl", "newmtl a\nKd 1 0 0\nmap_Kd -s 2 t.tga\nd -halo 0.5\nnewmtl b\nTr 1\n");
  const std::string obj = "mtllib m.mtl\nusemtl a\n" + three + "vt 0 0\nvn 0 0 1\nv 2 2 0 1 0 0\n" +
                          "f 1/1/1 2/1/1 4//1 3\nusemtl b\n" + face;
  for (const auto& [name, bytes] : std::vector<std::pair<std::string, std::string>>{
           {"a.obj", obj},
           {"b.stl", text_stl + text_stl},
           {"c.stl", stl_of("COLOR=abcd", {1, 0x8000})},
           {"d.off",
            "COFF\n4 2 0\n0 0 0 1 0 0\n1 0 0 1 0 0\n1 1 0 0 1 0\n0 1 0 0 0 1\n4 0 1 2 3\n"
            "3 0 1 2 7 7 7\n"}}) {
    INFO(name);
    const auto [accepted, refused] = read_damaged(folder, folder.write(name, bytes), 60, 100,
                                                  [&](const auto& file) { load(file); });
    CHECK(accepted > 0);
    CHECK(refused > 0);
  }
  const auto library = bytes_of(folder / "m.mtl");
  for_damaged(library, 60, 100, [&](const std::string& bytes) {
    folder.write("m.mtl", bytes);
    load(folder.write("a.obj", obj));
  });
}

}  // namespace raywave
