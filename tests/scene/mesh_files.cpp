// SPDX-License-Identifier: Apache-2.0
// What OBJ and MTL files say: written here, with shapes and colours that are known.
#include "tests/support/mesh_files.hpp"

#include <bit>
#include <sstream>

#include "tests/support/german.hpp"
#include "tests/support/gltf.hpp"

namespace raywave {
namespace {

using namespace test;
using Outline = std::vector<glm::dvec2>;

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
    CHECK_SAYS(refusal(folder.write("a.obj", text)), "line " + std::to_string(crossing.size() + 1),
               "crosses itself");
  }
  // Four corners that no plane shows as an outline: along the shorter diagonal, 0-2
  const glm::dvec3 p(-0.12, 0.194, -0.496), q(-0.132, 0.141, -0.496), r(0.092, 0.093, 0);
  const auto twisted = load(folder.write("a.obj",
                                         "v 0 0 0\nv -0.12 0.194 -0.496\nv -0.132 0.141 -0.496\n"
                                         "v 0.092 0.093 0\nf 1 2 3 4\n"));
  CHECK(area_of(twisted) ==
        Catch::Approx((glm::length(glm::cross(p, q)) + glm::length(glm::cross(q, r))) / 2));
  CHECK_SAYS(notes_of(twisted), "line 5: a twisted face");
  const auto pair = load(folder.write("a.obj", three + "f 1 2\n" + face + "f 3 2\n"));
  CHECK(area_of(pair) == 0.5);
  CHECK_SAYS(notes_of(pair), "line 4: a face of fewer than three corners", "(2 times)");
}

TEST_CASE("an OBJ has the materials that it names, or the default, with a note: never others") {
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
    CHECK_SAYS(notes_of(mesh), row.note);
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
    CHECK_SAYS(refusal(folder.write("a.obj", three + bad + face)), ": line 4: ");
  for (const char* bad : {"f 1 2 4\n", "f 0 1 2\n", "f 1 2 -4\n", "f 1/1/1/1 2 3\n", "f 1 2 x\n"})
    CHECK_SAYS(refusal(folder.write("a.obj", three + bad)),
               bad[4] == '2' && bad[6] == '4' ? "number 4, counted from 1, of 3" : ": line 4: ");

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
      {0.5, 0.25, 0});
  check_colour(colours(" 1 255 128 255"), {1, 128 / 255.0, 1});
  check_colour(colours(" 1 .5 .25 1"), {1, 0.5, 0.25});
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
  CHECK_SAYS(notes_of(look("Kd 1 0 0\nmap_Kd lost.tga\n")), "\"lost.tga\"", "m.mtl, line 3");
  CHECK_SAYS(notes_of(look("Kd 1 0 0\nPccns 1\nKd x 0 0\n")),
             "\"pccns\" is ignored (m.mtl, line 3)",
             "\"x\" is no number and is ignored (m.mtl, line 4)");
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
    CHECK_SAYS(notes_of(mesh), row.note);
    CHECK((*row.note == 0) == notes_of(mesh).empty());
  }
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
  CHECK_SAYS(before, "1875000 ", "shininess 12.5");
  const test::German german;
  CHECK(say() == before);
}

TEST_CASE("damaged OBJ and MTL files load, or are refused in one line") {
  const Folder folder;
  folder.write("m.mtl", "newmtl a\nKd 1 0 0\nmap_Kd -s 2 t.tga\nd -halo 0.5\nnewmtl b\nTr 1\n");
  const std::string obj = "mtllib m.mtl\nusemtl a\n" + three + "vt 0 0\nvn 0 0 1\nv 2 2 0 1 0 0\n" +
                          "f 1/1/1 2/1/1 4//1 3\nusemtl b\n" + face;
  const auto [accepted, refused] = read_damaged(folder, folder.write("a.obj", obj), 60, 100,
                                                [&](const auto& file) { load(file); });
  CHECK(accepted > 0);
  CHECK(refused > 0);
  const auto library = bytes_of(folder / "m.mtl");
  for_damaged(library, 60, 100, [&](const std::string& bytes) {
    folder.write("m.mtl", bytes);
    load(folder.write("a.obj", obj));
  });
}

}  // namespace raywave
