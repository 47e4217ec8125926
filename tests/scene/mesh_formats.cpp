// SPDX-License-Identifier: Apache-2.0
// What PLY, STL and OFF files say: written here, with shapes and colours that are known.
#include <bit>

#include "tests/support/mesh_files.hpp"

namespace raywave {
namespace {

using namespace test;

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
  bool swaps = false, faces_first = false;
  float first_x = 0;

  std::string text() const {
    const auto vertices =
        "element vertex 3\nproperty float x\ncomment within\nproperty float y\n"
        "obj_info within\nproperty float z\n" +
        vertex;
    const auto faces =
        "element face 1\nproperty list " + count + ' ' + index + ' ' + list + '\n' + of_face;
    auto header = "ply\nformat binary_" + std::string(swaps ? "big" : "little") + "_endian 1.0\n" +
                  before + (faces_first ? faces + vertices : vertices + faces) + "end_header\n";
    for (auto at = header.find('\n'); at != header.npos;
         at = header.find('\n', at + line_end.size()))
      header.replace(at, 1, line_end);
    Bytes data{swaps}, face{swaps};
    face.put(count, 3);
    for (int i = 0; i < 3; ++i) face.put(index, i);
    if (put_face) put_face(face);
    if (put_before) put_before(data);
    if (faces_first) data.all += face.all;
    for (const auto& p : {std::array{first_x, 0.0f}, {1.0f, 0.0f}, {0.0f, 1.0f}}) {
      data.put(p[0]).put(p[1]).put(0.0f);
      if (put_vertex) put_vertex(data);
    }
    return header + data.all + (faces_first ? "" : face.all);
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

TEST_CASE("a PLY of every type, order of bytes and line end is read, elements before it skipped") {
  const Folder folder;
  const auto check = [&](const Ply& ply, const char* note = "") {
    const auto mesh = load(folder.write("a.ply", ply.text()));
    CHECK(area_of(mesh) == Catch::Approx(0.5).epsilon(1e-5));
    CHECK_SAYS(notes_of(mesh), note);
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
    CHECK_SAYS(notes, "of each vertex is ignored: quality", "of each face is ignored: weights");
    camera.faces_first = true;
    CHECK(notes_of(check(camera, "element \"camera\" is ignored")) == notes);
  }
  check(Ply{.faces_first = true});
  const auto text = load(folder.write(
      "a.ply",
      "ply\nformat ascii 1.0\nelement face 1\nproperty list uchar int vertex_index\nproperty uchar "
      "red\nproperty uchar green\nproperty uchar blue\nelement vertex 3\nproperty float x\n"
      "property float y\nproperty float z\nend_header\n3 0 1 2 9 9 9\n0 0 0\n\n1 0 0\n0 1 0\n"));
  CHECK(area_of(text) == Catch::Approx(0.5));
  CHECK(notes_of(text).empty());
  const auto whole = Ply().text();
  for (std::size_t length = 0; length < whole.size(); length += 7)
    CHECK_SAYS(refusal(folder.write("a.ply", whole.substr(0, length))), "mesh ");
  auto wrong = Ply();
  wrong.before = "element camera 4000000000\nproperty double f\n";
  CHECK_SAYS(refusal(folder.write("a.ply", wrong.text())), "\"camera\"");
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
    CHECK_SAYS(notes_of(longer), "8 bytes");
    CHECK_SAYS(refusal(folder.write("a.stl", stl_of(header, {0, 0, 0}).substr(0, 200))), "mesh ");
  }
  CHECK_SAYS(refusal(folder.write("a.stl", text_stl.substr(0, text_stl.find("endfacet")))),
             "within a facet");

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
    CHECK_SAYS(refusal(folder.write("a.off", file(bad, "", ""))), "mesh ");
  CHECK_SAYS(refusal(folder.write("a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n")),
             "line 6");
}

TEST_CASE("damaged STL and OFF files load, or are refused in one line") {
  const Folder folder;
  for (const auto& [name, bytes] : std::vector<std::pair<std::string, std::string>>{
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
}

TEST_CASE("an AMF without colours has none, and a RAW that Assimp loses parts of is refused") {
  const Folder folder;
  const std::string one = "1.0 0.5 0.0 0.0 0.0 0.0 1.0 0.0 0.0 0.0 1.0 0.0\n",
                    raw = "One\n" + one + one + "\n\n";
  CHECK(area_of(load(folder.write("a.raw", raw))) == 1);
  CHECK_SAYS(refusal(folder.write("b.raw", raw + "Two\n" + one + one)), "Assimp cannot read it",
             "export it as glTF");
  std::string corners;
  for (const char* at : {"<x>0</x><y>0</y>", "<x>1</x><y>0</y>", "<x>0</x><y>1</y>"})
    corners += std::string("<vertex><coordinates>") + at + "<z>0</z></coordinates></vertex>";
  const auto amf = load(folder.write(
      "a.amf", "<?xml version=\"1.0\"?>\n<amf><object id=\"1\"><mesh><vertices>" + corners +
                   "</vertices><volume><triangle><v1>0</v1><v2>1</v2><v3>2</v3></triangle>"
                   "</volume></mesh></object></amf>\n"));
  CHECK(area_of(amf) == 0.5);
  CHECK(amf.colours.empty());
}

TEST_CASE("a mesh all of whose materials are wholly transparent is shown, with a note") {
  const Folder folder;
  const auto of = [&](const std::string& first, const std::string& second) {
    std::string text = "AC3Db\n", parts;
    for (const auto& [place, trans] :
         {std::pair<std::string, std::string>{"0", first}, {"1", second}}) {
      text += "MATERIAL \"m" + place + "\" rgb 1 0 0  amb 0 0 0  emis 0 0 0  spec 0 0 0  shi 1  " +
              "trans " + trans + "\n";
      parts += "OBJECT poly\nnumvert 3\n0 0 " + place + "\n1 0 " + place + "\n0 1 " + place +
               "\nnumsurf 1\nSURF 0x20\nmat " + place + "\nrefs 3\n0 0 0\n1 0 0\n2 0 0\nkids 0\n";
    }
    return load(folder.write("a.ac", text + "OBJECT world\nkids 2\n" + parts));
  };
  const auto hidden = of("1", "1");
  REQUIRE(hidden.materials.size() == 2);
  for (const auto& material : hidden.materials) CHECK(material.look.alpha == 1);
  REQUIRE(hidden.notes.size() == 1);
  CHECK_SAYS(hidden.notes[0], "every material has an opacity of 0");
  const auto one = of("1", "0");
  REQUIRE(one.materials.size() == 2);
  CHECK(one.materials[0].look.alpha + one.materials[1].look.alpha == 1);
  CHECK(one.notes.empty());
}

}  // namespace raywave
