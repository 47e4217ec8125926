// SPDX-License-Identifier: Apache-2.0
// Objects that become other meshes: pictures of them, and tracks of meshes.
#include "host/animate/animate.hpp"
#include "host/animate/timeline.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/program.hpp"
#include "tests/support/render.hpp"

namespace raywave {
namespace {

using namespace test;
using glm::dvec3;

constexpr int sectors = 32, rings = 16;

/// A closed ball of diameter 1 whose vertices go elsewhere, with a normal each.
std::string shape_obj(const std::function<dvec3(dvec3)>& to,
                      const std::function<dvec3(dvec3)>& normal_of) {
  std::ostringstream text;
  text.precision(9);
  const auto put = [&](const char* what, dvec3 v) {
    text << what << ' ' << v.x << ' ' << v.y << ' ' << v.z << '\n';
  };
  for (int j = 0; j <= rings; ++j) {
    for (int i = 0; i < sectors; ++i) {
      const double a = 2 * std::numbers::pi * i / sectors, b = std::numbers::pi * j / rings,
                   r = j == 0 || j == rings ? 0 : 0.5 * std::sin(b);
      const dvec3 p(r * std::cos(a), 0.5 * std::cos(b), r * std::sin(a));
      put("v", to(p));
      put("vn", normal_of(p));
    }
  }
  const auto face = [&](int a, int b, int c) {
    text << 'f';
    for (const int i : {a, b, c}) text << ' ' << i + 1 << "//" << i + 1;
    text << '\n';
  };
  const auto at = [](int i, int j) { return j * sectors + i % sectors; };
  for (int j = 0; j < rings; ++j) {
    for (int i = 0; i < sectors; ++i) {
      if (j > 0) face(at(i, j), at(i + 1, j), at(i, j + 1));
      if (j + 1 < rings) face(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  return text.str();
}

/// The faces in the opposite order.
std::string faces_turned_round(const std::string& obj) {
  const auto first = obj.find("f ");
  std::string faces;
  std::istringstream lines(obj.substr(first));
  for (std::string line; std::getline(lines, line);) faces = line + "\n" + faces;
  return obj.substr(0, first) + faces;
}

dvec3 same(dvec3 p) { return p; }

/// A ball with a waist, and one whose parts are mixed: rays in its first tree would take long.
dvec3 with_waist(dvec3 p) {
  const double r = 0.6 + 1.6 * p.y * p.y;
  return {r * p.x, 1.2 * p.y, r * p.z};
}
dvec3 mixed(dvec3 p) {
  const double a = 40 * p.y;
  return {std::cos(a) * p.x - std::sin(a) * p.z, 0.1 * p.y + 0.4 * std::sin(90 * p.x), 0.7 * p.z};
}

/// The meshes of a ball that changes, and a wall behind it.
class Stage {
public:
  Stage() {
    folder_.write("ball.obj", shape_obj(same, same));
    folder_.write("waist.obj", shape_obj(with_waist, same));
    folder_.write("half.obj", shape_obj([](dvec3 p) { return 0.5 * (p + with_waist(p)); }, same));
    folder_.write("mixed.obj", shape_obj(mixed, same));
    folder_.write("wall.obj", square_obj());
    folder_.write("turned.obj", faces_turned_round(shape_obj(same, same)));
  }

  Scene load(const std::string& mesh, const std::string& more = "",
             const std::string& glass = "") const {
    return load_scene(folder_.write(
        "scene.toml",
        "[hologram]\nresolution = [64, 48]\npitch = \"4 um\"\n"
        "[sampling]\npitch = \"6 um\"\n"
        "[[light]]\ndirection = [0.3, -0.2, 1]\n"
        "[materials.skin]\ndiffuse = 0.8\n" +
            glass + "[[object]]\nmesh = \"" + mesh +
            "\"\nunit = \"0.2 mm\"\nanchor = \"origin\"\nposition = [0, 0, \"8 mm\"]\n"
            "material = \"skin\"\n"
            "[[object]]\nmesh = \"wall.obj\"\nwidth = \"0.4 mm\"\nposition = [0, 0, \"9 mm\"]\n" +
            more));
  }
  /// With a track of meshes: the ball, its waist, mixed, the ball again, at pictures 0, 2, 4, 6.
  Scene moving(const std::string& glass = "") const {
    return with_shapes(load("ball.obj",
                            "[animation]\nframes = 6\n[[animation.track]]\nof = \"object.0.mesh\"\n"
                            "at = [0, 2, 4, 6]\n"
                            "values = [\"ball.obj\", \"waist.obj\", \"mixed.obj\", \"ball.obj\"]\n",
                            glass));
  }
  const Folder& folder() const { return folder_; }

private:
  Folder folder_;
};

/// Moves a renderer to a picture, as Animator does.
void show(const Scene& scene, double picture, Renderer& renderer) {
  const auto there = scene_at(scene, picture);
  const auto& object = there.objects[0];
  renderer.set_solid_pose(0, object.position_m, object.rotation_deg, object.solid_scale.value());
  renderer.set_shape(0, object.shape.value());
}

DEVICE_TEST(
    "a picture of an object that deforms is that of a scene with the deformed mesh at rest") {
  const Stage stage;
  for (const bool glass : {false, true}) {
    const std::string material = glass ? "transparency = 0.6\n[trace]\ndepth = 2\n" : "";
    const auto scene = stage.moving(material);
    Renderer renderer(device, scene_at(scene, 0));
    for (const auto& [picture, mesh] :
         {std::pair{0.0, "ball.obj"}, {1.0, "half.obj"}, {2.0, "waist.obj"}, {4.0, "mixed.obj"}}) {
      show(scene, picture, renderer);
      const auto shown = renderer.render();
      const auto resting = stage.load(mesh, "", material);
      Renderer solid(device, resting);
      solid.set_solid_pose(0, resting.objects[0].position_m, {0, 0, 0}, 1);
      const auto moved = solid.render(), placed = render(device, resting);
      const double off = relative_l2(shown.field.samples, moved.field.samples),
                   off_placed = relative_l2(shown.field.samples, placed.field.samples);
      CAPTURE(picture, glass, off, off_placed);
      CHECK(shown.samples > 300);
      // Measured up to 1.3e-4; in glass 0.013, and 0.044 of another pose, where rays that pass an
      // edge within rounding, and paths at a caustic, decide. Surfaces that pass through each other
      // show other sides to other trees
      CHECK(off <= 0.02);
      CHECK(off_placed <= (mesh == std::string("mixed.obj") ? 0.5 : glass ? 0.06 : 0.02));
    }
  }
}

DEVICE_TEST("a picture of an object that deforms has the same bits whatever was shown before") {
  const Stage stage;
  const auto scene = stage.moving();
  // The mixed ball's picture gets a tree of its own, and the others the first one, refitted
  const auto cost_at = [&](double picture) {
    auto world = build_world(scene);
    move_objects(scene_at(scene, 0), world);
    const auto triangles = std::span(world.triangles).first(world.placed[0].triangles);
    auto bvh = build_bvh(world.positions, triangles, world.min_m, 4);
    const double before = surface_cost(bvh);
    move_objects(scene_at(scene, picture), world);
    refit_bvh(bvh, world.positions, triangles, world.min_m);
    return surface_cost(bvh) / before;
  };
  CHECK(cost_at(2) < most_refitted_cost);
  CHECK(cost_at(4) > most_refitted_cost);
  Renderer all(device, scene_at(scene, 0));
  for (const int picture : {0, 1, 2, 3, 4, 5, 1}) {
    show(scene, picture, all);
    const auto shown = all.render();
    Renderer alone(device, scene_at(scene, 0));
    show(scene, picture, alone);
    const auto expected = alone.render();
    INFO("picture " << picture);
    CHECK(shown.levels == expected.levels);
    CHECK((shown.field.samples == expected.field.samples));
  }
}

DEVICE_TEST(
    "a renderer refuses to make an object what it has no meshes for, and shows it as before") {
  const Stage stage;
  Renderer renderer(device, stage.load("ball.obj"));
  const auto shown = renderer.render();
  CHECK_REFUSED(renderer.set_shape(0, 1), "no meshes to become");
  CHECK((renderer.render().field.samples == shown.field.samples));
}

TEST_CASE("tracks of meshes are refused where the meshes cannot become each other") {
  const Stage stage;
  const auto refusal = [&](const std::string& lines, bool loads = false) {
    return input_error_of([&] {
      const auto scene = stage.load(
          "ball.obj",
          "[animation]\nframes = 9\n[[animation.track]]\nof = \"object.0.mesh\"\n" + lines);
      if (loads) build_world(with_shapes(scene));
    });
  };
  CHECK_SAYS(refusal("at = [0]\nvalues = [\"ball.obj\"]\nsteps = \"cubic\"\n"),
             "track 0: steps of meshes must be \"linear\" or \"hold\"");
  CHECK_SAYS(refusal("at = [0]\nvalues = [\"none.obj\"]\n"), "track 0: values[0] must be a file");
  CHECK_SAYS(refusal("at = [0, 4]\nvalues = [\"ball.obj\"]\n"), "as many as there are in `at`, 2");
  CHECK_SAYS(refusal("at = [0, 4]\nvalues = [\"ball.obj\", \"wall.obj\"]\n", true),
             "wall.obj\" of its track: has 2 triangles, and not the ");
  CHECK_SAYS(refusal("at = [0, 4]\nvalues = [\"ball.obj\", \"turned.obj\"]\n", true),
             "turned.obj\" of its track: its triangles join other vertices than those of \"");
  // Held shapes jump, linear ones do not
  const auto held = with_shapes(
      stage.load("ball.obj",
                 "[animation]\nframes = 9\n[[animation.track]]\nof = \"object.0.mesh\"\nat = [0, "
                 "4]\nvalues = [\"ball.obj\", \"waist.obj\"]\nsteps = \"hold\"\n"));
  CHECK(scene_at(held, 3).objects[0].shape == 0);
  CHECK(scene_at(held, 4).objects[0].shape == 1);
  CHECK(scene_at(stage.moving(), 3).objects[0].shape == 1.5);
  // Other commands read no mesh but the object's own
  CHECK(build_world(stage.load("ball.obj",
                               "[animation]\nframes = 9\n[[animation.track]]\nof = "
                               "\"object.0.mesh\"\nat = [0]\nvalues = [\"wall.obj\"]\n"))
            .placed[0]
            .deforming == nullptr);
}

TEST_CASE("holograms of other meshes of a track are told apart") {
  const Stage stage;
  const auto digest = [&] {
    const auto scene = stage.moving();
    return digest_of_contents(scene, build_world(scene));
  };
  const auto before = digest();
  CHECK(digest() == before);
  stage.folder().write("waist.obj", shape_obj(mixed, same));
  CHECK(digest() != before);
}

}  // namespace
}  // namespace raywave
