// SPDX-License-Identifier: Apache-2.0
#include <sstream>

#include "host/geometry/world.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"
#include "tests/support/gltf.hpp"

using namespace raywave;

namespace {

using Json = nlohmann::json;

/// Triangles of three corners each; every file format below is written from this form.
using Soup = std::vector<std::array<glm::dvec3, 3>>;

/// A box around the origin, counter-clockwise seen from outside. Each side has two triangles, so a
/// corner belongs to one or two triangles of a side.
Soup box(const glm::dvec3& size) {
  const auto corner = [&](int i) {
    return glm::dvec3(i & 1 ? 0.5 : -0.5, i & 2 ? 0.5 : -0.5, i & 4 ? 0.5 : -0.5) * size;
  };
  Soup soup;
  for (const auto& s : std::vector<std::array<int, 4>>{
           {0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
    soup.push_back({corner(s[0]), corner(s[1]), corner(s[2])});
    soup.push_back({corner(s[0]), corner(s[2]), corner(s[3])});
  }
  return soup;
}

std::string obj(const Soup& soup) {
  std::ostringstream out;
  out.precision(17);
  for (const auto& triangle : soup)
    for (const glm::dvec3& p : triangle) out << "v " << p.x << ' ' << p.y << ' ' << p.z << '\n';
  for (std::size_t i = 0; i < soup.size(); ++i)
    out << "f " << 3 * i + 1 << ' ' << 3 * i + 2 << ' ' << 3 * i + 3 << '\n';
  return out.str();
}

std::string ply(const Soup& soup, bool binary) {
  std::ostringstream out;
  out.precision(9);
  out << "ply\nformat " << (binary ? "binary_little_endian" : "ascii") << " 1.0\nelement vertex "
      << 3 * soup.size() << "\nproperty float x\nproperty float y\nproperty float z\nelement face "
      << soup.size() << "\nproperty list uchar int vertex_indices\nend_header\n";
  const auto end_line = [&] {
    if (!binary) out << '\n';
  };
  const auto put = [&](auto value) {
    if (binary)
      out.write(reinterpret_cast<const char*>(&value), sizeof value);
    else
      out << +value << ' ';
  };
  for (const auto& triangle : soup)
    for (const glm::dvec3& p : triangle) {
      for (int i = 0; i < 3; ++i) put(static_cast<float>(p[i]));
      end_line();
    }
  for (int i = 0; i < static_cast<int>(soup.size()); ++i) {
    put(static_cast<unsigned char>(3));
    for (int k = 0; k < 3; ++k) put(3 * i + k);
    end_line();
  }
  return out.str();
}

std::string binary_stl(const Soup& soup) {
  std::string out(80, ' ');
  const auto put = [&](auto value) {
    out.append(reinterpret_cast<const char*>(&value), sizeof value);
  };
  put(static_cast<std::uint32_t>(soup.size()));
  for (const auto& triangle : soup) {
    for (int i = 0; i < 3; ++i) put(0.0f);  // no normal
    for (const glm::dvec3& p : triangle)
      for (int i = 0; i < 3; ++i) put(static_cast<float>(p[i]));
    put(std::uint16_t{0});
  }
  return out;
}

/// glTF text: the soup as one mesh, on each of these nodes.
std::string gltf(const Soup& soup, const std::vector<Json>& nodes) {
  test::Gltf::Part part;
  for (const auto& triangle : soup)
    for (const glm::dvec3& p : triangle) {
      part.indices.push_back(static_cast<std::uint32_t>(part.positions.size()));
      part.positions.emplace_back(p);
    }
  test::Gltf file;
  const int mesh = file.mesh(part);
  for (auto node : nodes) {
    node["mesh"] = mesh;
    file.add_node(node);
  }
  return file.gltf();
}

std::pair<glm::dvec3, glm::dvec3> bounds(const Mesh& mesh) {
  glm::dvec3 min = mesh.positions.front(), max = min;
  for (const glm::dvec3& p : mesh.positions) min = glm::min(min, p), max = glm::max(max, p);
  return {min, max};
}

glm::dvec3 face_normal(const Mesh& mesh, const glm::uvec3& t) {
  return glm::normalize(glm::cross(mesh.positions[t.y] - mesh.positions[t.x],
                                   mesh.positions[t.z] - mesh.positions[t.x]));
}

/// Checks that all triangles of a mesh around the origin face outwards.
bool faces_outwards(const Mesh& mesh, const glm::dvec3& centre = glm::dvec3(0)) {
  return std::all_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const glm::uvec3& t) {
    return glm::dot(face_normal(mesh, t), mesh.positions[t.x] - centre) > 0 &&
           glm::dot(face_normal(mesh, t), mesh.normals[t.x]) > 0.1;
  });
}

double max_difference(const glm::dvec3& a, const glm::dvec3& b) {
  return std::max({std::abs(a.x - b.x), std::abs(a.y - b.y), std::abs(a.z - b.z)});
}

Mesh load(const std::filesystem::path& file, Normals normals = Normals::file) {
  return load_mesh(file, normals, "here");
}

Scene scene_of(const std::vector<Object>& objects) { return Scene{.objects = objects}; }

Object object_of(const std::filesystem::path& mesh) {
  Object object{.mesh = mesh, .position_m = {0, 0, 0.1}};
  object.where = "scene.toml:7: object 0";
  return object;
}

}  // namespace

TEST_CASE("a box is the same closed box from every format") {
  const Folder folder;
  const Soup soup = box({1, 2, 4});
  for (const auto& file :
       {folder.write("box.obj", obj(soup)), folder.write("box.ply", ply(soup, false)),
        folder.write("binary.ply", ply(soup, true)), folder.write("box.stl", binary_stl(soup)),
        folder.write("box.gltf", gltf(soup, {Json{{"name", "box"}}}))}) {
    INFO(file.filename().string());
    const Mesh mesh = load(file);
    CHECK(mesh.triangles.size() == 12);
    // Vertices are joined within a side and split between sides, where normals differ.
    CHECK(mesh.positions.size() == 24);
    CHECK(mesh.normals.size() == mesh.positions.size());
    CHECK(mesh.uvs.size() == mesh.positions.size());
    CHECK(bounds(mesh).first == glm::dvec3(-0.5, -1, -2));
    CHECK(bounds(mesh).second == glm::dvec3(0.5, 1, 2));
    CHECK(faces_outwards(mesh));
    CHECK(is_closed(mesh));
  }
}

TEST_CASE("an edge with one, three or badly turned triangles leaves a mesh open") {
  const Folder folder;
  const Soup closed = box({1, 1, 1});
  const auto is_closed_as = [&](const std::function<void(Soup&)>& change) {
    Soup soup = closed;
    change(soup);
    return is_closed(load(folder.write("box.obj", obj(soup))));
  };
  CHECK(is_closed_as([](Soup&) {}));
  CHECK_FALSE(is_closed_as([](Soup& soup) { soup.pop_back(); }));
  CHECK_FALSE(is_closed_as([](Soup& soup) { std::swap(soup[3][0], soup[3][1]); }));
  CHECK_FALSE(is_closed_as([](Soup& soup) { soup.push_back(soup[0]); }));
  // A triangle without area is dropped.
  CHECK(is_closed_as([](Soup& soup) { soup.push_back({soup[0][0], soup[0][0], soup[0][1]}); }));
}

TEST_CASE("flat normals are those of the faces") {
  const Folder folder;
  const Mesh mesh = load(folder.write("box.obj", obj(box({1, 2, 3}))), Normals::flat);
  for (const glm::uvec3& t : mesh.triangles)
    for (int i = 0; i < 3; ++i)
      CHECK(max_difference(mesh.normals[t[i]], face_normal(mesh, t)) < 1e-14);
}

TEST_CASE("smooth normals of a box point along its diagonals, however its sides are cut") {
  const Folder folder;
  const Mesh mesh = load(folder.write("box.obj", obj(box({1, 1, 1}))), Normals::smooth);
  CHECK(mesh.positions.size() == 8);
  for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    CHECK(max_difference(mesh.normals[i], glm::normalize(mesh.positions[i])) < 1e-14);
}

TEST_CASE("normals of the file are kept at unit length, and face normals replace zero ones") {
  const Folder folder;
  const Mesh mesh = load(
      folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 3 4\nvn 0 0 0\nf 1//1 2//1 3//2\n"));
  REQUIRE(mesh.positions.size() == 3);
  CHECK(max_difference(mesh.normals[0], {0, 0.6, 0.8}) < 1e-7);
  CHECK(max_difference(mesh.normals[1], {0, 0.6, 0.8}) < 1e-7);
  CHECK(mesh.normals[2] == glm::dvec3(0, 0, 1));
}

TEST_CASE("texture coordinates keep (0, 0) at the bottom left, and polygons become triangles") {
  const Folder folder;
  const Mesh mesh = load(folder.write("a.obj",
                                      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 0.5 0\nvt "
                                      "0.5 0.25\nvt 0 0.25\nf 1/1 2/2 3/3 4/4\n"));
  CHECK(mesh.triangles.size() == 2);
  REQUIRE(mesh.positions.size() == 4);
  for (std::size_t i = 0; i < 4; ++i)
    CHECK(mesh.uvs[i] == glm::dvec2(0.5 * mesh.positions[i].x, 0.25 * mesh.positions[i].y));
}

TEST_CASE("a mesh of micrometres keeps its vertices apart") {
  const Folder folder;
  for (const double size : {1e-6, 1e-12, 1e12}) {
    const Mesh mesh = load(folder.write("box.obj", obj(box(glm::dvec3(size)))), Normals::smooth);
    CHECK(mesh.positions.size() == 8);
    CHECK(mesh.triangles.size() == 12);
    CHECK(is_closed(mesh));
  }
}

TEST_CASE("node transforms are applied, and a mirror does not turn a mesh inside out") {
  const Folder folder;
  const auto file = folder.write(
      "two.gltf", gltf(box({1, 1, 1}), {Json{{"translation", {10, 0, 0}}, {"scale", {-2, 1, 1}}},
                                        Json{{"translation", {-10, 0, 0}}}}));
  const Mesh mesh = load(file);
  CHECK(mesh.triangles.size() == 24);
  CHECK(bounds(mesh).first == glm::dvec3(-10.5, -0.5, -0.5));
  CHECK(bounds(mesh).second == glm::dvec3(11, 0.5, 0.5));
  CHECK(is_closed(mesh));
  Mesh mirrored = mesh;
  std::erase_if(mirrored.triangles, [&](const glm::uvec3& t) { return mesh.positions[t.x].x < 0; });
  CHECK(mirrored.triangles.size() == 12);
  CHECK(faces_outwards(mirrored, {10, 0, 0}));
}

/// A face in Collada, with what its asset says.
std::string collada(const std::string& asset, const std::string& places, const std::string& face) {
  return R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">)" +
         asset + R"(
<library_geometries><geometry id="g"><mesh><source id="p">
<float_array id="a" count=")" +
         std::to_string(3 * std::count(face.begin(), face.end(), ' ') + 3) + R"(">)" + places +
         R"(</float_array>
<technique_common><accessor source="#a" count=")" +
         std::to_string(std::count(face.begin(), face.end(), ' ') + 1) + R"(" stride="3">
<param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
</accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<polylist count="1"><input semantic="VERTEX" source="#v" offset="0"/><vcount>)" +
         std::to_string(std::count(face.begin(), face.end(), ' ') + 1) + R"(</vcount><p>)" + face +
         R"(</p></polylist>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>)";
}

TEST_CASE("a file that says its z axis is up, or its unit an inch, keeps its numbers") {
  const Folder folder;
  const std::string triangle = "0 0 0 1 0 0 0 2 0";
  for (const char* unit : {"", "<unit name=\"inch\" meter=\"0.0254\"/>", "<unit meter='100'/>"}) {
    const Mesh mesh = load(folder.write(
        "a.dae", collada(std::string("<asset>") + unit + "<up_axis>Z_UP</up_axis></asset>",
                         triangle, "0 1 2")));
    CHECK(bounds(mesh).second == glm::dvec3(1, 2, 0));
    REQUIRE(mesh.notes.size() == (*unit ? 1 : 0));
    if (*unit)
      CHECK_SAYS(mesh.notes[0], std::string(unit).find("inch") != std::string::npos
                                    ? "unit = \"0.0254 m\""
                                    : "unit = \"100 m\"");
  }
  const Mesh corner = load(folder.write(
      "b.dae",
      collada("<asset/>", "1 1 0 3 1 0 3 2 0 4 2 0 4 3 0 2 3 0 2 5 0 1 5 0", "0 1 2 3 4 5 6 7")));
  double area = 0;
  for (const glm::uvec3& t : corner.triangles)
    area += glm::length(glm::cross(corner.positions[t.y] - corner.positions[t.x],
                                   corner.positions[t.z] - corner.positions[t.x])) /
            2;
  CHECK(area == Catch::Approx(7));
}

TEST_CASE("empty solids, and cameras and lights without a place, leave the surfaces beside them") {
  const Folder folder;
  const std::string whole =
      "solid whole\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
      "endloop\nendfacet\nendsolid whole\n";
  const std::string empty = "solid empty\nendsolid empty\n";
  // Assimp finds a second light in this file, which has no place.
  const std::string with_light =
      "Metric (key = \"distance\") {float {1.0}}\n"
      "GeometryNode $node1 {Name {string {\"Part\"}} ObjectRef {ref {$geometry1}}}\n"
      "LightNode $node2 {Name {string {\"Lamp\"}} ObjectRef {ref {$light1}}}\n"
      "GeometryObject $geometry1 {Mesh (primitive = \"triangles\") {\n"
      "VertexArray (attrib = \"position\") {float[3] {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, "
      "{0.0, 1.0, 0.0}}}\nIndexArray {unsigned_int32[3] {{0, 1, 2}}}}}\n"
      "LightObject $light1 (type = \"point\") {Color (attrib = \"light\") "
      "{float[3] {{1.0, 1.0, 1.0}}}}\n";
  for (const auto& file :
       {folder.write("first.stl", empty + whole), folder.write("last.stl", whole + empty),
        folder.write("light.ogex", with_light)}) {
    INFO(file);
    const auto mesh = load_mesh(file, Normals::flat, "here");
    REQUIRE(mesh.triangles.size() == 1);
    CHECK(mesh.positions.size() == 3);
  }
  CHECK_FALSE(input_error_of([&] {
                load_mesh(folder.write("empty.stl", empty), Normals::flat, "here");
              }).empty());
}

TEST_CASE("triangles without area are dropped, and a mesh of nothing else is refused") {
  const Folder folder;
  const std::string vertices = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 0 0\n";
  const Mesh mesh = load(folder.write("a.obj", vertices + "f 1 2 3\nf 1 2 4\nf 1 2 5\nf 1 1 4\n"),
                         Normals::smooth);
  CHECK(mesh.triangles.size() == 1);
  CHECK(mesh.positions.size() == 3);
  for (const glm::dvec3& n : mesh.normals) CHECK(max_difference(n, {0, 0, 1}) < 1e-15);
  CHECK_THAT(input_error_of([&] { load(folder.write("b.obj", vertices + "f 1 2 3\n")); }),
             Catch::Matchers::EndsWith("holds no triangle that has an area"));
  CHECK_THAT(input_error_of([&] {
               load(folder.write("nothing.ply",
                                 "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\n"
                                 "property float y\nproperty float z\nend_header\n"));
             }),
             Catch::Matchers::EndsWith("holds no triangle"));
}

TEST_CASE("slivers give finite unit normals") {
  const Folder folder;
  for (const char* apex : {"0.5 1e-30 0", "0.5 1e-7 0", "1e20 1e-20 0"}) {
    const Mesh mesh =
        load(folder.write("a.obj", std::string("v 0 0 0\nv 1 0 0\nv ") + apex + "\nf 1 2 3\n"),
             Normals::smooth);
    for (const glm::dvec3& n : mesh.normals) CHECK(max_difference(n, {0, 0, 1}) < 1e-12);
  }
}

TEST_CASE("unusable meshes are refused in one line that starts with the object") {
  const Folder folder;
  const auto refusal = [&](const std::filesystem::path& file) {
    return input_error_of([&] { load(file); });
  };
  using Catch::Matchers::StartsWith;
  const auto subject = [](const std::filesystem::path& file) {
    return "here: mesh \"" + file.string() + "\": ";
  };
  CHECK(refusal(folder / "none.obj") == subject(folder / "none.obj") + "there is no such file");
  CHECK(refusal(folder / "") == subject(folder / "") + "there is no such file");
  for (const auto& file :
       {folder.write("empty.obj", ""), folder.write("vertex.obj", "v 0 0 0\n"),
        folder.write("text.obj", "hello\n"), folder.write("line.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n"),
        folder.write("unknown.abc", "hello"), folder.write("empty.stl", ""),
        folder.write("none", "x"),
        folder.write("empty.ply", "ply\nformat ascii 1.0\nend_header\n")})
    CHECK_THAT(refusal(file), StartsWith("here: "));
  const Soup soup = box({1, 1, 1});
  std::string one_line_only = ply(soup, false);  // fails an assertion inside Assimp
  std::replace(one_line_only.begin() + one_line_only.find("end_header") + 11, one_line_only.end(),
               '\n', ' ');
  CHECK_THAT(refusal(folder.write("flat.ply", one_line_only)), StartsWith("here: "));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Soup broken = soup;
    broken[5][1].y = bad;
    CHECK_THAT(refusal(folder.write("bad.ply", ply(broken, true))), StartsWith("here: "));
    CHECK_THAT(refusal(folder.write("bad.stl", binary_stl(broken))), StartsWith("here: "));
    CHECK_THAT(refusal(folder.write("bad.obj", obj(broken))), StartsWith("here: "));
  }
}

TEST_CASE(
    "an object is turned about x, then y, then z, then scaled to its width and centred at its "
    "position") {
  const Folder folder;
  Object object = object_of(folder.write("a.obj", obj(box({1, 2, 4}))));
  // x: (x, -z, y), so 1 x 4 x 2; then y: (z, y, -x), so 2 x 4 x 1
  object.rotation_deg = {90, 90, 0};
  object.width_m = 0.02;
  object.position_m = {0.3, -0.2, 0.5};
  const World world = build_world(scene_of({object}));
  CHECK(max_difference(world.min_m, {0.29, -0.22, 0.495}) < 1e-15);
  CHECK(max_difference(world.max_m, {0.31, -0.18, 0.505}) < 1e-15);
  CHECK(world.object_closed == std::vector<bool>{true});

  // One corner of a tetrahedron followed through the three turns: (1,0,0) -> x: same -> y 30: (cos,
  // 0, -sin) -> z 90: (0, cos, -sin).
  Object corner = object_of(folder.write("b.obj", "v 1 0 0\nv -1 0 0\nv 0 0.1 0\nf 1 2 3\n"));
  corner.rotation_deg = {77, 30, 90};
  corner.position_m = {0, 0, 10};
  const World turned = build_world(scene_of({corner}));
  const glm::dvec3 edge = turned.positions[0] - turned.positions[1];
  CHECK(max_difference(edge, {0, std::sqrt(3.0), -1}) < 1e-14);
}

TEST_CASE(
    "without a width, mesh units are metres, and the bounding box's centre still moves to the "
    "position") {
  const Folder folder;
  Soup soup = box({0.01, 0.02, 0.03});
  for (auto& triangle : soup)
    for (glm::dvec3& p : triangle) p += glm::dvec3(5, 6, 7);
  const World world = build_world(scene_of({object_of(folder.write("a.obj", obj(soup)))}));
  // Numbers in the file are floats: at 5 m they have steps of 0.5 um.
  CHECK(max_difference(world.min_m, {-0.005, -0.01, 0.085}) < 1e-6);
  CHECK(max_difference(world.max_m, {0.005, 0.01, 0.115}) < 1e-6);
}

TEST_CASE("objects follow one another in the world, each with its own triangles") {
  const Folder folder;
  const auto box_file = folder.write("box.obj", obj(box({0.01, 0.01, 0.01})));
  const auto sheet_file = folder.write("sheet.obj", "v 0 0 0\nv 0.01 0 0\nv 0 0.01 0\nf 1 2 3\n");
  std::vector<Object> objects{object_of(box_file), object_of(sheet_file), object_of(box_file)};
  objects[2].position_m = {0.1, 0, 0.2};
  objects[2].width_m = 0.02;
  const World world = build_world(scene_of(objects));
  REQUIRE(world.triangles.size() == 25);
  REQUIRE(world.triangle_object.size() == 25);
  CHECK(std::count(world.triangle_object.begin(), world.triangle_object.end(), 0) == 12);
  CHECK(world.triangle_object[12] == 1);
  CHECK(world.triangle_object[13] == 2);
  CHECK(world.object_closed == std::vector<bool>{true, false, true});
  CHECK(world.normals.size() == world.positions.size());
  CHECK(world.uvs.size() == world.positions.size());
  for (std::size_t i = 13; i < 25; ++i)
    for (int k = 0; k < 3; ++k)
      CHECK(
          max_difference(glm::abs(world.positions[world.triangles[i][k]] - glm::dvec3(0.1, 0, 0.2)),
                         glm::dvec3(0.01)) < 1e-15);
  for (const glm::vec3& n : world.normals) CHECK(std::abs(glm::length(n) - 1) < 1e-6f);
  CHECK(max_difference(world.max_m, {0.11, 0.01, 0.21}) < 1e-9);
  // Numbers in the file are floats.
  CHECK(max_difference(world.min_m, {-0.005, -0.01, 0.095}) < 1e-9);
}

TEST_CASE("objects lie beyond the hologram, before it, or in its plane") {
  const Folder folder;
  Object object = object_of(folder.write("a.obj", obj(box({0.5, 0.5, 0.5}))));
  for (const double z : {0.25, 0.2, 0.0, -0.25}) {
    object.position_m.z = z;
    const auto world = build_world(scene_of({object}));
    CHECK(closest_m(world) == 0);
    CHECK(world.min_m.z <= 0);
    CHECK(world.max_m.z >= 0);
  }
  object.position_m.z = 0.3;
  auto world = build_world(scene_of({object}));
  CHECK(std::abs(closest_m(world) - 0.05) < 1e-9);
  CHECK(!lies_before(world, 0));
  object.position_m.z = -0.3;
  world = build_world(scene_of({object}));
  CHECK(std::abs(closest_m(world) - 0.05) < 1e-9);
  CHECK(lies_before(world, 0));
  auto other = object;
  other.position_m.z = 0.29;
  world = build_world(scene_of({object, other}));
  CHECK(std::abs(closest_m(world) - 0.04) < 1e-9);
  CHECK(lies_before(world, 0));
  CHECK(!lies_before(world, 1));
}

TEST_CASE(
    "sizes that cannot be reached are refused, and any finite mesh can be scaled to a width") {
  const Folder folder;
  Object edge_on = object_of(folder.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"));
  edge_on.rotation_deg = {0, 90, 0};
  edge_on.width_m = 0.01;
  CHECK_THAT(input_error_of([&] { build_world(scene_of({edge_on})); }),
             Catch::Matchers::StartsWith("scene.toml:7: object 0: width cannot be reached"));

  for (const double size : {1e-30, 1e30}) {
    Object object = object_of(folder.write("b.obj", obj(box(glm::dvec3(size)))));
    CHECK_THAT(input_error_of([&] { build_world(scene_of({object})); }),
               Catch::Matchers::EndsWith("; give a width"));
    object.width_m = 0.01;
    const World world = build_world(scene_of({object}));
    CHECK(max_difference(world.max_m - world.min_m, glm::dvec3(0.01)) < 1e-8);
  }
  CHECK_THAT(input_error_of([] { build_world(Scene{}); }),
             Catch::Matchers::EndsWith("there is no object: add [[object]] with mesh = \"FILE\""));
}

// Under sanitizers the fuzzer sends such files to the same readers (tests/fuzz/mesh.cpp).
TEST_CASE("damaged meshes load with finite values, or are refused in one line", "[slow]") {
  const Folder folder;
  const Soup soup = box({1, 2, 3});
  for (const auto& file :
       {folder.write("box.obj", obj(soup)), folder.write("box.ply", ply(soup, false)),
        folder.write("binary.ply", ply(soup, true)), folder.write("box.stl", binary_stl(soup)),
        folder.write("box.gltf", gltf(soup, {Json{{"translation", {1, 0, 0}}}}))}) {
    INFO(file.filename().string());
    bool all_finite = true;
    const auto [accepted, refused] = read_damaged(folder, file, 100, 150, [&](const auto& damaged) {
      const Mesh mesh = load(damaged, Normals::smooth);
      for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        all_finite = all_finite && std::isfinite(glm::dot(mesh.positions[i], mesh.positions[i])) &&
                     std::abs(glm::length(mesh.normals[i]) - 1) < 1e-9;
      for (const glm::uvec3& t : mesh.triangles)
        all_finite = all_finite && std::max({t.x, t.y, t.z}) < mesh.positions.size();
    });
    CHECK(all_finite);
    CHECK(accepted > 0);
    CHECK(refused > 0);
  }
}
