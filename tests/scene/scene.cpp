// SPDX-License-Identifier: Apache-2.0
#include "host/scene/scene.hpp"

#include "tests/scene/workshop.hpp"

using namespace raywave;
using namespace raywave::test;
using Catch::Matchers::StartsWith;
using Catch::Matchers::WithinRel;

namespace {

/// kScene with one line replaced. Line numbers start at 1.
std::string with_line(int line, const std::string& text) {
  std::size_t start = 0;
  for (int i = 1; i < line; ++i) start = kScene.find('\n', start) + 1;
  return kScene.substr(0, start) + text + kScene.substr(kScene.find('\n', start));
}

/// A line of kScene in place of another, and what is said of it.
struct WrongLine {
  int line;
  const char *text, *message;  // after "scene.toml:LINE: "
};

/// Texts of scenes, and what is said of them after "scene.toml:".
void check_said(std::initializer_list<std::pair<std::string, std::string>> texts) {
  const Workshop workshop;
  for (const auto& [text, message] : texts)
    CHECK(workshop.refusal(text) == "scene.toml:" + message);
}

void check_wrong(std::initializer_list<WrongLine> lines) {
  for (const auto& [line, text, message] : lines)
    check_said({{with_line(line, text), std::to_string(line) + ": " + message}});
}

}  // namespace

TEST_CASE("every key of a scene arrives in metres, at its place") {
  const Workshop workshop;
  const Scene scene = workshop.load(kScene);
  CHECK(scene.hologram.resolution == glm::ivec2(1280, 720));
  CHECK_THAT(scene.hologram.pitch_m.x, WithinRel(8e-6, 1e-15));
  CHECK(scene.hologram.pitch_m.y == 4e-6);
  CHECK_THAT(scene.hologram.wavelength_m, WithinRel(532e-9, 1e-15));
  CHECK(scene.wrp.grid == glm::ivec2(3, 2));
  REQUIRE(scene.wrp.distances_m.size() == 1);
  CHECK_THAT(scene.wrp.distances_m[0], WithinRel(0.095, 1e-15));
  CHECK(scene.wrp.padding == 1.5);
  CHECK_THAT(scene.sampling.pitch_m, WithinRel(5e-5, 1e-15));
  CHECK(scene.sampling.seed == 4294967295u);
  CHECK(scene.sampling.frames == 4);
  CHECK(scene.trace.depth == 3);
  CHECK(scene.trace.shadows);

  REQUIRE(scene.lights.size() == 3);
  CHECK(scene.lights[0].type == LightType::directional);
  CHECK(scene.lights[0].direction == glm::dvec3(0.5, -0.6, 0.62));
  CHECK(scene.lights[0].intensity == 2);
  CHECK(scene.lights[1].type == LightType::point);
  CHECK(scene.lights[1].position_m == glm::dvec3(0.01, 0.02, 0.03));
  CHECK(scene.lights[1].intensity == 1);
  CHECK(scene.lights[2].type == LightType::ambient);

  REQUIRE(scene.materials.size() == 3);
  const Material& china = scene.materials[1];
  CHECK(china.name == "china");
  CHECK(china.ambient == glm::dvec3(0.08));
  CHECK(china.diffuse == glm::dvec3(0.7, 0.6, 0.5));
  CHECK(china.specular == glm::dvec3(0.6));
  CHECK(china.shininess == 30);
  CHECK(china.texture == workshop.folder / "checker.png");
  CHECK(china.reflectivity == 0.25);
  CHECK(china.transparency == 0.75);
  CHECK(china.ior == 1.33);

  REQUIRE(scene.objects.size() == 2);
  const Object& object = scene.objects[0];
  CHECK(object.mesh == workshop.folder / "teapot.ply");
  CHECK_THAT(object.width_m.value(), WithinRel(0.0125, 1e-15));
  CHECK(object.position_m == glm::dvec3(0.001, -0.002, 0.1));
  CHECK(object.rotation_deg == glm::dvec3(10, 30, -20.5));
  CHECK(object.material == 1);
  CHECK(scene.objects[1].material == 0);
  CHECK(object.normals == Normals::smooth);
  CHECK(object.where == (workshop.folder / "scene.toml").string() + ":36: object 0");
  CHECK(china.where == (workshop.folder / "scene.toml").string() + ":26: material \"china\"");
}

TEST_CASE(
    "a wrong value of the hologram, its planes or samples is refused with what would be right") {
  check_wrong({
      {2, "resolution = [262145, 720]", "hologram: resolution[0] must be 1 to 262144, got 262145"},
      {2, "resolution = [1280.0, 720]",
       "hologram: resolution[0] must be a whole number, 1 to 262144, got 1280.0"},
      {2, "resolution = 1280", "hologram: resolution must be two whole numbers [x, y], got 1280"},
      {2, "resolution = [1, 2, 3]",
       "hologram: resolution must be two whole numbers [x, y], got [1, 2, 3]"},
      {3, "pitch = \"-8 um\"", "hologram: pitch must be 0.1 nm to 1 m, got \"-8 um\""},
      {3, "pitch = [8e-6, nan]", "hologram: pitch[1] must be 0.1 nm to 1 m, got nan"},
      {3, "pitch = [8e-6]", "hologram: pitch must be a length or two [x, y], got [8e-06]"},
      {3, "pitch = true",
       "hologram: pitch must be a length: a number in metres, or a string such as \"3.74 um\", got "
       "true"},
      {3, "pitch = 1979-05-27",
       "hologram: pitch must be a length: a number in metres, or a string such as \"3.74 um\", got "
       "a date or time"},
      {4, "wavelength = 638",
       "hologram: wavelength must be 1 nm to 10 mm (numbers are metres; \"638 nm\" has a unit of "
       "its own), got 638"},
      {4, "wavelength = inf", "hologram: wavelength must be 1 nm to 10 mm, got inf"},
      {4, "wavelength = 9007199254740993",
       "hologram: wavelength must be a length: a number in metres, or a string such as \"3.74 "
       "um\", got 9007199254740993"},
      {4, "wavelenght = 5e-7",
       "hologram: unknown key \"wavelenght\"; did you mean \"wavelength\"? (keys here: resolution, "
       "pitch, wavelength, tiles)"},
      {4, "colour = 5e-7",
       "hologram: unknown key \"colour\" (keys here: resolution, pitch, wavelength, tiles)"},
      {5, "[wpr]",
       "unknown key \"wpr\"; did you mean \"wrp\"? (keys here: hologram, colour, slm, "
       "illumination, wrp, sampling, trace, accuracy, viewer, refine, light, materials, object, "
       "scene, animation)"},
      {6, "grid = \"large\"", "wrp: grid must be two whole numbers [x, y], got \"large\""},
      {7, "distance = \"far\"",
       "wrp: distance must be a length such as \"3.74 um\" (units: nm, um, mm, cm, m, km; none for "
       "metres), got \"far\""},
      {7, "distance = []", "wrp: distance must be a length, or 1 to 16 of them, got an array of 0"},
      {7, "distance = [0.1, true]",
       "wrp: distance[1] must be a length: a number in metres, or a string such as \"3.74 um\", "
       "got true"},
      {7, "distance = [\"95 mm\", 0.095]",
       "wrp: distance[1] must be more than the one before, 95 mm, got 0.095"},
      {7, "distance = [0.095, 0.1, 0]",
       "wrp: distance[2] must be more than the one before, 100 mm, got 0"},
      {7, "distance = 0",
       "wrp: distance must be lengths of 1 nm or more, or of -1 nm or less, got 0"},
      {7, "layers = \"many\"", "wrp: layers must be a whole number, 1 to 16, got \"many\""},
      {8, "padding = \"2\"", "wrp: padding must be a number, got \"2\""},
      {10, "mode = \"fen\"", "sampling: mode must be \"aimed\" or \"fan\", got \"fen\""},
      {15, "depth = 17", "trace: depth must be 0 to 16, got 17"},
  });
}

TEST_CASE("a wrong value of a light, a material or an object is refused with what would be right") {
  check_wrong({
      {18, "type = \"sun\"",
       "light 0: type must be \"ambient\" or \"directional\" or \"point\" or \"spot\" or \"area\" "
       "or \"environment\", got \"sun\""},
      {19, "direction = [0, 0, 0]", "light 0: direction must be longer than 0, got [0, 0, 0]"},
      {19, "direction = ['0', '0', '1']", "light 0: direction[0] must be a number, got \"0\""},
      {19, "direction = [0, 0, 0, 0, 1]",
       "light 0: direction must be three numbers [x, y, z], got an array of 5"},
      {20, "intensity = -1", "light 0: intensity must be >= 0, got -1"},
      {20, "intensity = 1e31", "light 0: intensity must be <= 1e+30, got 1e+31"},
      {28, "diffuse = [0.7, 0.6]",
       "material \"china\": diffuse must be a number or [red, green, blue], got [0.7, 0.6]"},
      {28, "diffuse = [0.7, 0.6, -1]", "material \"china\": diffuse[2] must be >= 0, got -1"},
      {31, "texture = \"none.png\"",
       "material \"china\": texture must be a file (there is none at \"none.png\"), got "
       "\"none.png\""},
      {31, "texture = \".\"",
       "material \"china\": texture must be a file (there is none at \".\"), got \".\""},
      {31, "texture = \"\"", "material \"china\": texture must be the name of a file, got \"\""},
      {31, "texture = \"checker.png\\u0000.png\"",
       "material \"china\": texture must be the name of a file, got \"checker.png?.png\""},
      {33, "transparency = 0.8",
       "material \"china\": transparency must be <= 1 - reflectivity (0.25), got 0.8"},
      {37, "mesh = \"a\\nb.ply\"",
       "object 0: mesh must be a file (there is none at \"a?b.ply\"), got \"a?b.ply\""},
      {39, "position = [0, 0]", "object 0: position must be three lengths [x, y, z], got [0, 0]"},
      {40, "rotation = [0, 0, nan]", "object 0: rotation[2] must be -1e+06 to 1e+06, got nan"},
      {41, "material = \"chinna\"",
       "object 0: material must be one of china, gold, got \"chinna\""},
      {42, "normals = \"round\"",
       "object 0: normals must be \"file\" or \"smooth\" or \"flat\", got \"round\""},
      {42, "normal = \"flat\"",
       "object 0: unknown key \"normal\"; did you mean \"normals\"? (keys here: mesh, width, "
       "position, rotation, material, unit, anchor, cut, normals)"},
  });
}

TEST_CASE("a missing key is asked for at the table that needs it") {
  check_said({
      {with_line(19, ""),
       "17: light 0: direction is missing: give the way the light travels, for example [0, 0, 1]"},
      {with_line(23, ""),
       "21: light 1: position is missing: give the light's place, for example [\"0 mm\", \"50 "
       "mm\", \"20 mm\"]"},
      {with_line(37, ""), "36: object 0: mesh is missing: give the name of a mesh file"},
      {"[[light]]\ndirection = [0, 0, 1]\n",
       " there is no object: add [[object]] with mesh = \"FILE\""},
      {"[[object]]\nmesh = \"teapot.ply\"\n",
       " there is no light: add [[light]] with direction = [0, 0, 1]"},
      {"light = []\n[[object]]\nmesh = \"teapot.ply\"\n",
       " there is no light: add [[light]] with direction = [0, 0, 1]"},
      {"", " there is no object: add [[object]] with mesh = \"FILE\""},
  });
}

TEST_CASE("tables of the wrong kind are refused with the heading they need") {
  check_said({
      {"hologram = 3\n", "1: hologram must be a table, [hologram], got 3"},
      {"\n[light]\n", "2: light must be an array of tables, each headed [[light]], got a table"},
      {"object = [1, {}]\n",
       "1: object must be an array of tables, each headed [[object]], got an array of 2"},
      {"\nmaterials.gold = 3\n", "2: materials: gold must be a table, [materials.NAME], got 3"},
      {"[materials]\n\"a\\nb\" = 3\n",
       "2: materials: a?b must be a table, [materials.NAME], got 3"},
      {"[[object]]\nmesh = \"teapot.ply\"\nmaterial = \"gold\"\n",
       "3: object 0: material must be one of [materials.NAME], of which there is none, got "
       "\"gold\""},
      {"[[light]]\ntype = \"ambient\"\ndirection = [0, 0, 1]\n",
       "3: light 0: unknown key \"direction\" (keys here: type, intensity)"},
  });
}

TEST_CASE("[refine] alone asks for refinement, and its keys arrive") {
  const Folder folder;
  const std::string object = "[[light]]\ndirection = [0, 0, 1]\n[[object]]\nmesh = \"a.ply\"\n";
  folder.write("a.ply", "");
  CHECK_FALSE(load_scene(folder.write("none.toml", object)).refine);
  CHECK(load_scene(folder.write("bare.toml", "[refine]\n" + object)).refine);
  const auto all = load_scene(folder.write("all.toml",
                                           "[refine]\niterations = 30\nviews = 24\nbrightness = "
                                           "1.15\ndepths = [\"9 mm\", \"1 cm\"]\nblur = \"15 um\"\n"
                                           "lens_points = 12\n" +
                                               object))
                       .refine.value();
  CHECK(all.iterations == 30);
  CHECK(all.views == 24);
  CHECK(all.brightness == 1.15);
  REQUIRE(all.depths_m.size() == 2);
  CHECK(all.depths_m[1] == Catch::Approx(1e-2));
  CHECK(all.blur_m.value() == Catch::Approx(15e-6));
  CHECK(all.lens_points == 12);
}

TEST_CASE("keys of virtual planes arrive, and are the planner's choice where left out") {
  const Workshop workshop;
  const auto given =
      workshop.load(kScene, {"wrp.guard=1.1", "wrp.bell=8", "wrp.margin=6", "wrp.lines=3"});
  CHECK(given.wrp.guard == 1.1);
  CHECK(given.wrp.bell == 8);
  CHECK(given.wrp.margin_px == 6);
  CHECK(given.wrp.lines == 3);
  CHECK_FALSE(workshop.load(kScene).wrp.guard.has_value());
  CHECK_FALSE(workshop.load(kScene, {"wrp.lines=auto"}).wrp.lines.has_value());
}

TEST_CASE("a scene file that cannot be read is refused by name") {
  const Workshop workshop;
  CHECK(input_error_of([&] { load_scene(workshop.folder / "none.toml"); }) ==
        (workshop.folder / "none.toml").string() + ": there is no such file");
  CHECK(input_error_of([&] { load_scene(workshop.folder / ""); }) ==
        (workshop.folder / "").string() + ": is a folder, no file");
  CHECK(workshop.refusal(std::string((1 << 20) + 1, '#')) ==
        "scene.toml: too large for a scene file (at most 1 MiB)");
}

TEST_CASE("more than 1024 lights are refused, and ambient ones are not counted") {
  const Workshop workshop;
  const auto scene_of = [](int shining, int ambient) {
    std::string text = "[[object]]\nmesh = \"teapot.ply\"\n";
    for (int i = 0; i < shining; ++i) text += "[[light]]\ndirection = [0, 0, 1]\n";
    for (int i = 0; i < ambient; ++i) text += "[[light]]\ntype = \"ambient\"\n";
    return text;
  };
  CHECK(workshop.load(scene_of(1024, 2)).lights.size() == 1026);
  CHECK_THAT(workshop.refusal(scene_of(1025, 0)),
             StartsWith("scene.toml: 1025 lights with a place or a direction, at most 1024 are"));
}

TEST_CASE("lights of every type have their keys, and no others") {
  const Workshop workshop;
  const std::string object = "[[object]]\nmesh = \"teapot.ply\"\n[[light]]\n";
  workshop.folder.write("sky.exr", "");
  const auto loaded = [&](const std::string& keys) {
    return workshop.load(object + keys).lights[0];
  };
  const auto spot = loaded(
      "type = \"spot\"\nposition = [0, 0, \"1 cm\"]\ndirection = [0, 1, 0]\ninner = 5\nouter = 20\n"
      "falloff = \"square\"\nhighlights = false\n");
  CHECK(spot.type == LightType::spot);
  CHECK(spot.position_m.z == Catch::Approx(0.01));
  CHECK(spot.direction == glm::dvec3(0, 1, 0));
  CHECK(spot.inner_deg == 5);
  CHECK(spot.outer_deg == 20);
  CHECK(spot.falls_off);
  CHECK_FALSE(spot.highlights);
  const auto panel = loaded(
      "type = \"area\"\nposition = [0, 0, 1e-2]\nedges = [[\"1 mm\", 0, 0], [0, 2e-3, 0]]\n");
  CHECK(panel.edges_m[0].x == Catch::Approx(1e-3));
  CHECK(panel.edges_m[1].y == Catch::Approx(2e-3));
  CHECK(panel.samples == 16);
  CHECK(panel.highlights);
  const auto disc = loaded(
      "type = \"area\"\nposition = [0, 0, 1e-2]\nradius = \"3 mm\"\ndirection = [1, 0, 0]\nsamples "
      "= 9\n");
  CHECK(disc.radius_m == Catch::Approx(3e-3));
  CHECK(disc.samples == 9);
  const auto sky = loaded("type = \"environment\"\npicture = \"sky.exr\"\nrotation = 30\n");
  CHECK(sky.picture.filename() == "sky.exr");
  CHECK(sky.rotation_deg == 30);
  CHECK(sky.samples == 64);
  CHECK_FALSE(sky.highlights);

  struct Case {
    const char *keys, *message;
  };
  const Case cases[] = {
      {"type = \"spot\"\nposition = [0, 0, 1e-2]\n", "direction is missing"},
      {"type = \"spot\"\ndirection = [0, 0, 1]\n", "position is missing"},
      {"type = \"spot\"\nposition = [0, 0, 1e-2]\ndirection = [0, 0, 1]\ninner = 60\n",
       "inner must be < outer (45), got 60"},
      {"type = \"spot\"\nposition = [0, 0, 1e-2]\ndirection = [0, 0, 1]\nouter = 91\n",
       "outer must be 0.5 to 90, got 91"},
      {"type = \"spot\"\nposition = [0, 0, 1e-2]\ndirection = [0, 0, 1]\nouter = 0.4\n",
       "outer must be 0.5 to 90, got 0.4"},
      {"type = \"area\"\nposition = [0, 0, 1e-2]\n", "edges is missing"},
      {"type = \"area\"\nposition = [0, 0, 1e-2]\nradius = 1e-3\n", "direction is missing"},
      {"type = \"area\"\nposition = [0, 0, 1e-2]\nedges = [[1, 0, 0], [2, 0, 0]]\n",
       "edges must be two edges that span an area"},
      {"type = \"area\"\nposition = [0, 0, 1e-2]\nedges = [1, 2]\n",
       "edges[0] must be three lengths"},
      {"type = \"area\"\nposition = [0, 0, 1e-2]\nedges = [[1, 0, 0], [0, 1, 0]]\nsamples = 0\n",
       "samples must be 1 to 1024, got 0"},
      {"type = \"environment\"\n", "picture is missing"},
      {"type = \"environment\"\npicture = \"none.exr\"\n", "picture must be a file"},
      {"type = \"environment\"\npicture = \"sky.exr\"\nfalloff = \"square\"\n",
       "unknown key \"falloff\""},
      {"direction = [0, 0, 1]\nsamples = 3\n", "unknown key \"samples\""},
      {"type = \"point\"\nposition = [0, 0, 1e-2]\nfalloff = \"cube\"\n",
       "falloff must be \"none\" or \"square\", got \"cube\""},
  };
  for (const Case& one : cases) {
    const auto message = workshop.refusal(object + one.keys);
    CHECK_SAYS(message, one.message);
    CHECK_SAYS(message, "light 0");
  }
  // Samples count against the limit
  CHECK_SAYS(workshop.refusal(object + "direction = [0, 0, 1]\n[[light]]\ntype = \"area\"\n"
                                       "position = [0, 0, 1e-2]\nedges = [[1, 0, 0], [0, 1, 0]]\n"
                                       "samples = 1024\n"),
             "1025 lights");
}

TEST_CASE("text that is not TOML is refused with its line") {
  const Workshop workshop;
  CHECK_THAT(workshop.refusal(with_line(8, "padding = = 2")), StartsWith("scene.toml:8: "));
  CHECK_THAT(workshop.refusal(with_line(9, "[wrp]")), StartsWith("scene.toml:9: "));
  CHECK_THAT(workshop.refusal("a = \"\xff\xfe\""), StartsWith("scene.toml:1: "));
  CHECK_THAT(workshop.refusal(std::string(1000, '\0')), StartsWith("scene.toml:1: "));
}

TEST_CASE("values with units that lack their quotes are told of them, other mistakes are not") {
  const Workshop workshop;
  const auto needs_quotes = Catch::Matchers::ContainsSubstring("unit needs quotes");
  for (const char* line : {"position = [0, 0, 100 mm]", "position = [0, 0, 100mm]",
                           "width = 12.5 mm  # \"12 mm\"", "pitch = 3.74 \u00b5m", "a = [1 m, 2]"})
    CHECK_THAT(workshop.refusal(with_line(8, line)), needs_quotes);
  for (const char* line : {"padding = = 2", "a = \"1 mm\" x", "a = 5 metres", "a = [5 mmm"})
    CHECK_THAT(workshop.refusal(with_line(8, line)), !needs_quotes);
  CHECK_THAT(workshop.refusal(std::string(1 << 19, '"')), !needs_quotes);
  CHECK_THAT(workshop.refusal(kScene, {"object.0.position=[0, 0, 100mm]"}), needs_quotes);
}

TEST_CASE("deep nesting is refused before it is followed") {
  const Workshop workshop;
  const auto repeat = [](const std::string& text, int count) {
    std::string all;
    for (int i = 0; i < count; ++i) all += text;
    return all;
  };
  CHECK(workshop.refusal("\n" + repeat("a.", 100000) + "a = 1\n") ==
        "scene.toml:2: more than 32 dots in one line");
  CHECK_THAT(workshop.refusal("a = " + repeat("[", 100000)), StartsWith("scene.toml:1: "));
  CHECK_THAT(workshop.refusal("a = " + repeat("[\n{" + repeat("a.", 31) + "a = ", 5000)),
             StartsWith("scene.toml:"));
  const std::string deepest = repeat("[{\"b\" = ", 100) + "1" + repeat("}]", 100);
  CHECK_THAT(workshop.refusal("trace = " + deepest),
             StartsWith("scene.toml:1: trace must be a table"));
  CHECK(workshop.refusal(kScene, {"wrp.padding=" + repeat("[", 100000)}).size() < 1000);
  CHECK(workshop.refusal(kScene, {"wrp.padding={" + repeat("a.", 100000) + "a=1}"}).size() < 1000);
  CHECK(workshop.refusal(kScene, {repeat("a.", 100000) + "=1"}).size() < 1000);
  CHECK(workshop.load("# " + std::string(80, '.') + "\n" + kScene).objects.size() == 2);
}

TEST_CASE("an eyepiece shows planes at the dioptres of the thin-lens formula") {
  const Workshop workshop;
  const auto viewer = [&](const std::string& keys) {
    return workshop.load(kScene, {keys, "viewer.eyepiece='120 mm'"}).viewer;
  };
  const auto usual = viewer("viewer.distance=0.2");
  // The SLM stands in the focus: it is seen at infinity, and 1 D is 1 m away.
  CHECK(std::abs(depth_of_dioptres(usual, 0)) < 1e-12);
  CHECK(std::abs(depth_of_dioptres(usual, 1) - (1 / (1 / 0.12 + 1) - 0.12)) < 1e-12);
  const auto near = viewer("viewer.eyepiece_distance='50 mm'");
  for (const double dioptres : {-0.5, 0.0, 1.0, 4.0}) {
    const double z_m = depth_of_dioptres(near, dioptres);
    // 1 / object distance = 1 / focal length + 1 / image distance
    CHECK(std::abs(1 / (z_m + 0.05) - 1 / 0.12 - dioptres) < 1e-9);
    CHECK(std::abs(dioptres_of_depth(near, z_m) - dioptres) < 1e-9);
  }
  CHECK_THROWS(depth_of_dioptres(near, -9));
  CHECK_THROWS(depth_of_dioptres(ViewerSpec{}, 1));
}

TEST_CASE("places of a pupil, and depths of objects in dioptres, are read with an eyepiece") {
  const Workshop workshop;
  const std::vector<std::string> eyepiece{"viewer.eyepiece='50 mm'"};
  const auto with = [&](const std::string& key) {
    return workshop.load(kScene, {eyepiece[0], key});
  };
  const auto usual = workshop.load(kScene, eyepiece);
  CHECK(usual.viewer.eye_relief_m == 0.05);
  const auto alone = pupils_of(usual.viewer);
  REQUIRE(alone.size() == 1);
  CHECK(alone[0].diameter_m == 4e-3);
  CHECK(std::abs(alone[0].a) < 1e-12);
  CHECK(alone[0].b_m == Catch::Approx(0.05));
  CHECK(with("viewer.pupil_position=['1 mm', '-2 mm']").viewer.pupil_places_m ==
        std::vector{glm::dvec2(1e-3, -2e-3)});
  CHECK(with("viewer.pupil_position=[[0, 0], ['1 mm', 0]]").viewer.pupil_places_m ==
        std::vector{glm::dvec2(0), glm::dvec2(1e-3, 0)});
  CHECK(with("object.0.position=[0, 0, '1.5 D']").objects[0].position_m.z ==
        depth_of_dioptres(usual.viewer, 1.5));
  CHECK_SAYS(workshop.refusal(kScene, {"object.0.position=[0, 0, '1.5 D']"}),
             "dioptres are seen through an eyepiece");
  CHECK_SAYS(workshop.refusal(kScene, {eyepiece[0], "object.0.position=[0, 0, '-30 D']"}),
             "no plane is seen at -30 D");
  CHECK_SAYS(workshop.refusal(kScene, {eyepiece[0], "object.0.position=['1 D', 0, 0]"}),
             "must be a length");
  CHECK_SAYS(workshop.refusal(kScene, {"viewer.pupil_position=[[0, 0], [0]]"}),
             "two lengths [x, y]");
  CHECK_SAYS(workshop.refusal(kScene, {"viewer.eye_relief='20 mm'"}), "given with eyepiece");
}

TEST_CASE("damaged scenes load or are refused in one line") {
  const Workshop workshop;
  const auto file = workshop.folder.write("scene.toml", kScene);
  const auto [accepted, refused] = read_damaged(workshop.folder, file, 200, 3000,
                                                [](const auto& damaged) { load_scene(damaged); });
  CHECK(refused > 1000);
  CHECK(accepted > 10);  // a flipped digit gives another valid scene
}
