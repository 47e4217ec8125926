// SPDX-License-Identifier: Apache-2.0
#include "host/animate/animate.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <fstream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <set>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "host/animate/video_program.hpp"
#include "host/animate/write_queue.hpp"
#include "host/common/digest.hpp"
#include "host/scene/image.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/program.hpp"
#include "tests/support/render.hpp"
#include "tests/support/scenes.hpp"

namespace raywave {
namespace {

using namespace test;
namespace fs = std::filesystem;
using Catch::Matchers::ContainsSubstring;
using glm::dvec3;

/// A bar that turns and comes nearer, a wall that leans, a light that dims: 7 pictures of 2
/// holograms.
constexpr const char* moving_lines =
    "[[object]]\nmesh = \"square.obj\"\nwidth = \"0.05 mm\"\nposition = [0, 0, \"8 mm\"]\n"
    "[animation]\nframes = 7\nrate = 10\nsubframes = 2\n"
    "[[animation.track]]\nof = \"object.1.rotation\"\nat = [0, 7]\nvalues = [[0, 0, 0], [0, 40, "
    "180]]\n"
    "[[animation.track]]\nof = \"object.1.position\"\nat = [0, 3, 7]\nsteps = \"cubic\"\nvalues = "
    "[[0, 0, \"8 mm\"], [\"0.03 mm\", 0, \"4 mm\"], [0, 0, \"8 mm\"]]\n"
    "[[animation.track]]\nof = \"object.0.rotation\"\nat = [2, 4]\nvalues = [[0, 0, 0], [0, 9, "
    "0]]\n"
    "[[animation.track]]\nof = \"light.0.intensity\"\nat = [0, 7]\nvalues = [1, 0.2]\n";

/// The bar becomes a lozenge and a bar again.
constexpr const char* deforming_lines =
    "[[animation.track]]\nof = \"object.1.mesh\"\nat = [1, 3, 6]\n"
    "values = [\"square.obj\", \"lozenge.obj\", \"square.obj\"]\n";

/// square_obj with corners that lie elsewhere.
std::string lozenge_obj() {
  ObjText obj;
  obj.quad({-0.8, 0, 0}, {0, 0.3, 0.1}, {0.8, 0, 0}, {0, -0.3, -0.1});
  return obj.text();
}

/// All files of a folder.
std::map<std::string, std::string> files_of(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::directory_iterator(folder))
    files[entry.path().filename().string()] = bytes_of(entry.path());
  return files;
}

AnimateResult run(const Animator& animator, const fs::path& folder, FrameStorage storage) {
  FrameFiles files(folder, storage, animator.run_name(storage), animator.stored_size());
  return animator.make_frames(files, {});
}

TEST_CASE("a run that goes on behind any picture makes the files of one that was never stopped") {
  Desk desk;
  desk.folder().write("lozenge.obj", lozenge_obj());
  desk.scene(std::string(moving_lines) + deforming_lines);
  const auto scene = load_scene(desk.file("scene.toml"));
  for (const auto& device : all_devices()) {
    const Animator animator(device, scene, cl::FftBackend::host);
    for (const auto storage : {FrameStorage::pngs, FrameStorage::stream}) {
      const Folder whole;
      const auto made = run(animator, whole / "", storage);
      CHECK(made.pictures == 7);
      CHECK(made.holograms == 14);
      const auto wanted = files_of(whole / "");
      CHECK(wanted.size() == (storage == FrameStorage::pngs ? 15 : 2));
      std::istringstream report(wanted.at("report.jsonl"));
      std::vector<std::string> lines;
      for (std::string line; std::getline(report, line);) lines.push_back(line + "\n");
      REQUIRE(lines.size() == 7);
      for (const std::size_t kept : {1, 4, 7}) {
        const Folder stopped;
        std::string text;
        for (std::size_t i = 0; i < kept; ++i) text += lines[i];
        // A line that is not whole, and holograms that no line names
        stopped.write("report.jsonl", text + (kept < 7 ? lines[kept].substr(0, 20) : ""));
        for (const auto& [name, bytes] : wanted) {
          if (name.starts_with("frame_") && name < FrameFiles::png_name(2 * int(kept) + 1))
            stopped.write(name, bytes);
          if (name == "frames.raw")
            stopped.write("frames.raw.part", bytes.substr(0, (2 * kept + 1) * 48 * 32 - 5));
        }
        if (kept == 7 && storage == FrameStorage::stream)
          fs::rename(stopped / "frames.raw.part", stopped / "frames.raw");
        INFO(kept << " pictures were there");
        const auto rest = run(animator, stopped / "", storage);
        CHECK(rest.pictures == 7 - static_cast<int>(kept));
        CHECK((files_of(stopped / "") == wanted));
      }
    }
    // A hologram that was damaged, and those behind it, are made again.
    const Folder damaged;
    run(animator, damaged / "", FrameStorage::pngs);
    const auto wanted = files_of(damaged / "");
    damaged.write(FrameFiles::png_name(5), "no picture");
    CHECK(run(animator, damaged / "", FrameStorage::pngs).pictures == 5);
    CHECK((files_of(damaged / "") == wanted));
  }
}

TEST_CASE("a part has the files and lines that the whole animation has of its pictures") {
  Desk desk;
  desk.folder().write("lozenge.obj", lozenge_obj());
  desk.scene(std::string(moving_lines) + deforming_lines);
  std::vector<Scene> scenes{load_scene(desk.file("scene.toml"), {"slm.encoding=double-phase"})};
  // Numbers of holograms that no picture's number tells: 3 and 2 of them in turn
  auto uneven = std::string(moving_lines) + deforming_lines;
  uneven.replace(uneven.find("subframes = 2"), 13, "slm_rate = 25");
  desk.scene(uneven);
  scenes.push_back(load_scene(desk.file("scene.toml"), {"slm.encoding=phase"}));
  for (const auto& device : all_devices()) {
    for (const auto& scene : scenes) {
      const Animator animator(device, scene, cl::FftBackend::host);
      for (const auto storage : {FrameStorage::pngs, FrameStorage::stream}) {
        const Folder whole;
        run(animator, whole / "", storage);
        const auto wanted = files_of(whole / "");
        std::map<std::string, std::string> together;
        for (const auto& [first, end] : {std::pair(0, 1), {1, 4}, {4, 7}}) {
          const Folder part;
          // Of the pictures up to each of these, in turn: stopped, and gone on with
          for (const int until : {std::max(first + 1, end - 2), end}) {
            FrameFiles files(part / "", storage, animator.run_name(storage), animator.stored_size(),
                             {}, {first, animator.schedule().first_of(first)});
            animator.make_frames(files, {}, until);
            CHECK(files.next() == until);
          }
          for (const auto& [name, bytes] : files_of(part / "")) {
            if (name.starts_with("frame_")) CHECK(!together.contains(name));
            together[name] += bytes;
          }
          // What holds a part is no whole that was damaged
          const auto before = files_of(part / "");
          if (first > 0)
            CHECK_THROWS_WITH(
                run(animator, part / "", storage),
                ContainsSubstring("holds pictures from number " + std::to_string(first) +
                                  " on, and this run begins "
                                  "with 0"));
          if (first > 0) CHECK((files_of(part / "") == before));
        }
        CHECK((together == wanted));
      }
    }
  }
}

TEST_CASE(
    "animate --pictures makes parts, which are put together and finished by the same command") {
  Desk desk;
  desk.scene(moving_lines);
  const auto made = [&](const std::string& out, std::vector<std::string> more) {
    more.insert(more.begin(), {"animate", desk.file("scene.toml"), "-o", desk.file(out)});
    const auto outcome = desk.run(more, {"PATH=/nonexistent"});
    INFO(outcome.out << outcome.err);
    REQUIRE(outcome.code == 0);
    return outcome;
  };
  made("whole", {"--no-video", "--no-preview"});
  const auto one = made("one", {"--pictures", "5"});
  CHECK_THAT(one.out,
             ContainsSubstring("pictures 5 to 5, of 0 to 6; videos are made of all of them"));
  CHECK_THAT(one.err, !ContainsSubstring("ffmpeg"));
  for (const auto* name : {"frame_00010.png", "frame_00011.png"})
    CHECK(bytes_of(desk.file(std::string("one/") + name)) ==
          bytes_of(desk.file(std::string("whole/") + name)));
  CHECK(files_of(desk.file("one")).size() == 4);
  const auto animation =
      nlohmann::json::parse(bytes_of(desk.file("one/report.json"))).at("animation");
  CHECK(animation.at("part") == nlohmann::json({5, 5}));
  CHECK(animation.at("shape") == nlohmann::json({2, 32, 48}));
  CHECK(desk.run({"reconstruct", desk.file("one/frame_00011.png"), "-z", "9mm", "-o",
                  desk.file("seen"), "--quiet"})
            .code == 0);

  // Shared between machines
  made("a", {"--pictures", "0..2"});
  made("b", {"--pictures", "3..6"});
  REQUIRE(desk.shell("cp b/frame_*.png a/ && cat b/report.jsonl >> a/report.jsonl").code == 0);
  const auto finished = made("a", {"--no-preview"});
  CHECK_THAT(finished.out, ContainsSubstring("7 pictures were there"));
  CHECK_THAT(finished.err, ContainsSubstring("holograms.mkv are left out"));
  CHECK((files_of(desk.file("a")) == files_of(desk.file("whole"))));
  // A part of what is whole changes nothing
  made("a", {"--pictures", "0..4"});
  CHECK((files_of(desk.file("a")) == files_of(desk.file("whole"))));

  for (const auto& [text, says] : {std::pair("7", "has 7 pictures, 0 to 6"),
                                   {"3..9", "has 7 pictures, 0 to 6"},
                                   {"99999999999", "has 7 pictures, 0 to 6"},
                                   {"4..2", "comes before the first"},
                                   {"-1", "a number, or two with .."},
                                   {"1..", "a number, or two with .."},
                                   {"1..2..3", "a number, or two with .."},
                                   {" 1", "a number, or two with .."}})
    check_refused(desk.run({"animate", desk.file("scene.toml"), "-o", desk.file("x"),
                            std::string("--pictures=") + text}),
                  2, says);
  check_refused(desk.run({"animate", desk.file("scene.toml"), "-o", desk.file("one"), "--quiet"}),
                2, "give --pictures 5..LAST to go on behind them");
}

TEST_CASE("holograms of a scene that rests are the frames that render makes of it") {
  Desk desk;
  // An encoding of phases alone: holograms of amplitudes share a scale, frames of render do not
  desk.scene("[slm]\nencoding = \"phase\"\n[animation]\nframes = 3\nrate = 24\nslm_rate = 60\n");
  const auto scene = load_scene(desk.file("scene.toml"));
  auto still = scene;
  still.sampling.frames = 8;  // 3 + 2 + 3
  for (const auto& device : all_devices()) {
    const Folder folder;
    const auto levels = rendered(device, still).levels;
    run(Animator(device, scene, cl::FftBackend::host), folder / "", FrameStorage::stream);
    std::string wanted;
    for (const auto& frame : levels) wanted.append(frame.begin(), frame.end());
    CHECK((bytes_of(folder / "frames.raw") == wanted));
  }
}

TEST_CASE("a solid keeps its size while it turns, about the middle of the box it was placed with") {
  const Folder folder;
  ObjText bar;
  bar.quad({0, 0, 0}, {0, 1, 0}, {4, 1, 0}, {4, 0, 0});
  Scene scene;
  scene.materials = {glowing()};
  scene.objects = {object_at(folder.write("bar.obj", bar.text()), 4e-3, {1e-3, 2e-3, 20e-3})};
  auto world = world_of(scene);
  scene.objects[0].solid_scale = 1;
  scene.objects[0].rotation_deg = {0, 0, 90};
  move_objects(scene, world);
  const auto near = [](dvec3 a, dvec3 b) { return glm::length(a - b) < 1e-15; };
  CHECK(near(world.min_m, dvec3(0.5e-3, 0, 20e-3)));
  CHECK(near(world.max_m, dvec3(1.5e-3, 4e-3, 20e-3)));
  scene.objects[0].solid_scale = 0.5;
  scene.objects[0].position_m = {0, 0, 30e-3};
  move_objects(scene, world);
  CHECK(near(world.min_m, dvec3(-0.25e-3, -1e-3, 30e-3)));
  CHECK(near(world.max_m, dvec3(0.25e-3, 1e-3, 30e-3)));
  // Without, width is the extent after the turn: the bar becomes four times as large
  scene.objects[0].solid_scale.reset();
  move_objects(scene, world);
  CHECK(near(world.max_m - world.min_m, dvec3(4e-3, 16e-3, 0)));
}

TEST_CASE("holograms that share one scale show a light of a quarter at half the amplitude") {
  Desk desk;
  auto scene = load_scene(desk.file("scene.toml"));
  scene.materials[0].ambient = dvec3(0);
  auto bright = scene.lights[0];
  bright.intensity = 4 * bright.intensity;
  for (const auto encoding : {Encoding::double_phase, Encoding::burckhardt}) {
    scene.slm.encoding = encoding;
    for (const auto& device : all_devices()) {
      Renderer renderer(device, scene, world_of(scene));
      const auto dim_alone = renderer.render();
      renderer.set_light(0, bright);
      const auto bright_alone = renderer.render();
      CHECK(std::abs(bright_alone.clip / dim_alone.clip - 2) < 1e-5);
      CHECK((bright_alone.levels == dim_alone.levels));
      renderer.set_clip(bright_alone.clip);
      CHECK((renderer.render().levels == bright_alone.levels));
      renderer.set_light(0, scene.lights[0]);
      const auto dim = renderer.render();
      CHECK((dim.levels != dim_alone.levels));
      CHECK(dim.clip == dim_alone.clip);
      // Twice as bright a light and scale: the same
      renderer.set_light(0, bright);
      renderer.set_clip(2 * bright_alone.clip);
      CHECK((renderer.render().levels == dim.levels));
    }
  }
}

TEST_CASE(
    "an object that moves to where it would be cut is refused with the picture in which it does") {
  Desk desk;
  desk.scene(
      "[animation]\nframes = 5\n[[animation.track]]\nof = \"object.0.position\"\nat = [0, 4]\n"
      "values = [[0, 0, \"8 mm\"], [0, 0, \"-8 mm\"]]\n");
  check_refused(desk.run({"animate", desk.file("scene.toml"), "-o", desk.out(""), "--set",
                          "object.0.cut='5 mm'"}),
                2, "this is in picture 1 of the animation");
  CHECK_FALSE(desk.has_output());
  desk.scene("");
  check_refused(desk.run({"animate", desk.file("scene.toml"), "-o", desk.out("")}), 2,
                "nothing moves: add [animation]");
}

TEST_CASE("what cannot be written is refused by name, and the same command goes on from there") {
  Desk desk;
  desk.scene(moving_lines);
  const std::vector<std::string> line{"animate",    desk.file("scene.toml"), "-o",
                                      desk.out(""), "--no-preview",          "--no-video",
                                      "--json"};
  auto unwritable = line;
  unwritable[3] = "/proc/none";
  check_refused(desk.run(unwritable), 2, "\"/proc/none\": the folder cannot be made");

  fs::create_directories(desk.out("frame_00007.png/in the way"));
  check_refused(desk.run(line), 2, "frame_00007.png\": cannot be written");
  CHECK(fs::exists(desk.out("frame_00006.png")));
  fs::remove_all(desk.out("frame_00007.png"));
  const auto rest = desk.run(line);
  INFO(rest.err);
  CHECK(nlohmann::json::parse(rest.out).at("pictures_found") == 3);
  CHECK(nlohmann::json::parse(rest.out).at("pictures") == 4);
  for (const auto& [name, bytes] : files_of(desk.out("")))
    CHECK(name.find(".tmp") == std::string::npos);
  CHECK(nlohmann::json::parse(desk.run(line).out).at("pictures") == 0);

  // Another scene's holograms stay, unless all are to be made anew.
  auto other = line;
  other.insert(other.end(), {"--set", "sampling.seed=2"});
  check_refused(desk.run(other), 2, "holds holograms of another scene, device or version");
  other.emplace_back("--restart");
  CHECK(nlohmann::json::parse(desk.run(other).out).at("pictures") == 7);
  check_refused(
      desk.run({"reconstruct", desk.out("report.json"), "-z", "8mm", "-o", desk.file("x")}), 2,
      "is of an animation; give holograms of one picture, such as frame_00000.png");
  const auto looked = desk.run({"reconstruct", desk.out("frame_00003.png"), "-z", "8mm", "-o",
                                desk.file("seen"), "--quiet"});
  INFO(looked.err);
  CHECK(looked.code == 0);
}

TEST_CASE("a run is another one once a file that its scene reads has changed, and no other") {
  Gltf bar;
  const nlohmann::json bark{{"baseColorTexture", {{"index", bar.texture_at("bark.tga")}}}};
  bar.add(Gltf::square(1, {0, 0, 0}, bar.material({{"pbrMetallicRoughness", bark}})));
  bar.root["buffers"] = {{{"byteLength", bar.data.size()}, {"uri", "bar.bin"}}};
  auto moved = bar.data;
  moved[3] ^= 1;  // -1 becomes -1/4
  const auto picture = [](std::uint8_t grey) {
    return tga_picture(48, 32,
                       [&](int i, int) { return glm::u8vec4(i == 0 ? grey : std::uint8_t{90}); });
  };
  const auto lut = [](double last) {
    std::string text;
    for (int i = 0; i < 255; ++i) text += std::to_string(i / 255.0) + "\n";
    return text + std::to_string(last) + "\n";
  };
  const auto flat = [](std::uint8_t level) {
    const Folder folder;
    save_picture(folder / "flat.png", 48, 32, std::vector<std::uint8_t>(48 * 32, level));
    return bytes_of(folder / "flat.png");
  };
  struct File {
    std::string name, bytes, changed;
  };
  const std::vector<File> files{{"red.mtl", "newmtl red\nKd 0.5 0 0\n", "newmtl red\nKd 0.6 0 0\n"},
                                {"bar.bin", bar.data, moved},
                                {"bark.tga", picture(10), picture(90)},
                                {"cloth.tga", picture(20), picture(90)},
                                {"sky.tga", picture(30), picture(90)},
                                {"flat.png", flat(40), flat(41)},
                                {"lut.txt", lut(1), lut(1.01)}};
  const std::string object = "[[object]]\nwidth = \"0.05 mm\"\nposition = [0, 0, \"8 mm\"]\n";
  Desk desk, elsewhere;
  for (auto* place : {&desk, &elsewhere}) {
    for (const auto& file : files) place->folder().write(file.name, file.bytes);
    place->folder().write("red.obj", "mtllib red.mtl\nusemtl red\n" + square_obj());
    place->folder().write("bar.gltf", bar.root.dump());
    place->scene(object + "mesh = \"red.obj\"\n" + object + "mesh = \"bar.gltf\"\n" + object +
                 "mesh = \"square.obj\"\nmaterial = \"cloth\"\n"
                 "[materials.cloth]\ntexture = \"cloth.tga\"\n"
                 "[[light]]\ntype = \"environment\"\npicture = \"sky.tga\"\n"
                 "[slm]\nlut = \"lut.txt\"\nflatness = \"flat.png\"\n"
                 "[animation]\nframes = 2\n[[animation.track]]\nof = \"object.0.rotation\"\n"
                 "at = [0, 2]\nvalues = [[0, 0, 0], [0, 0, 90]]\n");
  }
  for (const auto& device : all_devices()) {
    const auto name_in = [&](const Desk& place) {
      return Animator(device, load_scene(place.file("scene.toml")), cl::FftBackend::host)
          .run_name(FrameStorage::pngs);
    };
    const auto name = name_in(desk);
    CHECK(name == name_in(elsewhere));
    for (const auto& file : files) {
      INFO(file.name);
      desk.folder().write(file.name, file.changed);
      CHECK(name != name_in(desk));
      desk.folder().write(file.name, file.bytes);
    }
    CHECK(name == name_in(desk));
  }
  // As users see it
  const std::vector<std::string> line{"animate",    desk.file("scene.toml"), "-o",
                                      desk.out(""), "--no-preview",          "--no-video"};
  REQUIRE(desk.run(line).code == 0);
  desk.folder().write("red.mtl", files[0].changed);
  auto again = line;
  again.emplace_back("--quiet");
  check_refused(desk.run(again), 2, "holds holograms of another scene, device or version");
}

TEST_CASE("PNGs that are not compressed hold their levels, wherever blocks end in their rows") {
  const Folder folder;
  std::vector<std::uint8_t> png;
  // A block has 65535 bytes, a row one byte more than pixels
  for (const glm::ivec2 size : {glm::ivec2(1, 1), glm::ivec2(254, 257), glm::ivec2(3, 16384),
                                glm::ivec2(16383, 5), glm::ivec2(16384, 4), glm::ivec2(1920, 99)}) {
    CAPTURE(size.x, size.y);
    std::vector<std::uint8_t> levels(std::size_t{1} * size.x * size.y);
    std::mt19937 noise(1);
    for (auto& level : levels) level = static_cast<std::uint8_t>(noise());
    uncompressed_png(size.x, size.y, levels, png);
    folder.write("seen.png", {reinterpret_cast<const char*>(png.data()), png.size()});
    const auto read = load_levels(folder / "seen.png", "seen.png");
    REQUIRE(glm::ivec2(read.width, read.height) == size);
    std::size_t others = 0;
    for (std::size_t i = 0; i < levels.size(); ++i)
      others += std::lround(255 * read.pixels[i]) != levels[i];
    CHECK(others == 0);
  }
}

TEST_CASE(
    "a digest is that of the bytes, whichever parts they come in, and tells changes of a bit") {
  std::string bytes;
  for (int i = 0; i < 40; ++i) bytes += static_cast<char>(37 * i);
  const auto digest_in_parts = [&](std::size_t part) {
    Digest digest;
    for (std::size_t i = 0; i < bytes.size(); i += part)
      digest.add(std::string_view(bytes).substr(i, part));
    return digest.text();
  };
  std::set<std::string> digests{hash_name(bytes)};
  for (const std::size_t part : {1, 3, 7, 8, 9, 16}) CHECK(digests.contains(digest_in_parts(part)));
  for (char& byte : bytes) {
    for (int bit = 0; bit < 8; ++bit) {
      byte = static_cast<char>(byte ^ (1 << bit));
      digests.insert(hash_name(bytes));
      byte = static_cast<char>(byte ^ (1 << bit));
    }
  }
  for (std::size_t size = 0; size < bytes.size(); ++size)
    digests.insert(hash_name(bytes.substr(0, size)));
  for (std::size_t zeros = 1; zeros < 20; ++zeros)
    digests.insert(hash_name(bytes + std::string(zeros, 0)));
  CHECK(digests.size() == 1 + 8 * 40 + 40 + 19);
}

TEST_CASE("a run that is refused leaves a finished stream under its name") {
  Desk desk;
  desk.scene(moving_lines);
  std::vector<std::string> line{"animate",  desk.file("scene.toml"), "-o",      desk.out(""),
                                "--stream", "--no-preview",          "--quiet", "--no-video"};
  REQUIRE(desk.run(line).code == 0);
  const auto wanted = files_of(desk.out(""));
  REQUIRE(wanted.contains("frames.raw"));
  line.insert(line.end(), {"--set", "sampling.seed=2"});
  check_refused(desk.run(line), 2, "holds holograms of another scene, device or version");
  CHECK((files_of(desk.out("")) == wanted));
}

TEST_CASE("lines of a report that are damaged are as if they were not there") {
  const Folder folder;
  const std::string run = "this one";
  const std::vector<std::vector<std::uint8_t>> levels{std::vector<std::uint8_t>(6, 7)};
  const auto open = [&] {
    return FrameFiles(folder / "", FrameStorage::pngs, run, {3, 2}).pictures();
  };
  {
    FrameFiles files(folder / "", FrameStorage::pngs, run, {3, 2});
    for (int i = 0; i < 3; ++i) files.add(levels, {{"picture", i}});
  }
  REQUIRE(open() == 3);
  const auto report = bytes_of(folder / "report.jsonl");
  std::istringstream stream(report);
  std::vector<nlohmann::ordered_json> lines;
  for (std::string line; std::getline(stream, line);)
    lines.push_back(nlohmann::ordered_json::parse(line));
  for (const auto* place : {"/picture", "/run", "/holograms", "/holograms/0", "/holograms/0/number",
                            "/holograms/0/digest"}) {
    for (const auto& wrong : {nlohmann::ordered_json(), nlohmann::ordered_json("?"),
                              nlohmann::ordered_json(1e300), nlohmann::ordered_json(-1),
                              nlohmann::ordered_json::array(), nlohmann::ordered_json{{"a", 1}}}) {
      if (std::string(place) == "/run" && wrong.is_string()) continue;  // another run's
      auto damaged = lines;
      damaged[1][nlohmann::ordered_json::json_pointer(place)] = wrong;
      std::string text;
      for (const auto& line : damaged) text += line.dump() + "\n";
      folder.write("report.jsonl", text);
      INFO(damaged[1].dump());
      CHECK(open() == 1);
      CHECK(bytes_of(folder / "report.jsonl") == report.substr(0, report.find('\n') + 1));
    }
  }
}

TEST_CASE("presets that choose other values make other runs, whichever values these are") {
  Desk desk;
  // What is left to them are precision and light from mirrors
  desk.scene(
      "[wrp]\npropagation = \"spectrum\"\nlayers = 1\npadding = 2\n"
      "[animation]\nframes = 1\n[[animation.track]]\nof = \"light.0.intensity\"\nat = [0]\n"
      "values = [1]\n");
  const auto run = [&](const char* preset) {
    return desk.run({"animate", desk.file("scene.toml"), "-o", desk.out(""), "--no-preview",
                     "--no-video", "--quiet", "--preset", preset, "--set", "sampling.cone=1.2",
                     "--set", "sampling.apodization=0.2", "--set", "sampling.frames=1"});
  };
  for (int i = 0; i < 2; ++i) {
    const auto made = run("accurate");
    INFO(made.err);
    REQUIRE(made.code == 0);
  }
  for (const auto* other : {"balanced", "reference"})
    check_refused(run(other), 2, "holds holograms of another scene, device or version");
}

TEST_CASE("videos are made where ffmpeg is, and what it refuses is passed on") {
  Desk desk;
  desk.scene(moving_lines);
  const std::vector<std::string> line{"animate", desk.file("scene.toml"), "-o", desk.out("")};
  const auto without = desk.run(line, {"PATH=/nonexistent"});
  CHECK(without.code == 0);
  CHECK_THAT(without.err, ContainsSubstring("there is no program ffmpeg on PATH: holograms.mkv and "
                                            "preview.mp4 are left out; install ffmpeg"));
  CHECK_FALSE(fs::exists(desk.out("holograms.mkv")));

  fs::create_directory(desk.file("bin"));
  desk.folder().write("bin/ffmpeg", "#!/bin/sh\necho 'no such codec' >&2\nexit 1\n");
  fs::permissions(desk.file("bin/ffmpeg"), fs::perms::owner_all);
  auto quiet = line;
  quiet.emplace_back("--quiet");
  check_refused(desk.run(quiet, {"PATH=" + desk.file("bin")}), 2,
                "ffmpeg has failed: no such codec");
  CHECK_FALSE(fs::exists(desk.out("holograms.mkv")));

  const auto ffmpeg = find_program("ffmpeg");
  if (!ffmpeg) return;  // the rest needs the program itself
  for (const bool stream : {false, true}) {
    auto words = line;
    words.emplace_back("--restart");
    if (stream) words.emplace_back("--stream");
    const auto made = desk.run(words);
    INFO(made.err);
    REQUIRE(made.code == 0);
    CHECK(fs::file_size(desk.out("preview.mp4")) > 500);
    VideoProgram decoder(*ffmpeg,
                         {"-loglevel", "error", "-i", "holograms.mkv", "-f", "rawvideo", "-pix_fmt",
                          "gray", "pipe:1"},
                         desk.out(""), VideoProgram::Held::output);
    std::vector<std::uint8_t> video(14 * 48 * 32);
    decoder.read(video);
    decoder.finish();
    if (!stream) continue;
    const auto raw = bytes_of(desk.out("frames.raw"));
    CHECK((raw == std::string(video.begin(), video.end())));
  }

  // 1300 x 20 pixels: those of the preview are means over four
  desk.scene(std::string(moving_lines) +
             "[animation.camera]\nwindow = [\"5.2 mm\", \"0.08 mm\"]\n");
  auto words = line;
  words.insert(words.end(), {"--restart", "--no-video"});
  const auto made = desk.run(words);
  INFO(made.err);
  REQUIRE(made.code == 0);
  VideoProgram decoder(
      *ffmpeg,
      {"-loglevel", "error", "-i", "preview.mp4", "-f", "rawvideo", "-pix_fmt", "gray", "pipe:1"},
      desk.out(""), VideoProgram::Held::output);
  std::vector<std::uint8_t> preview(7 * 650 * 10);
  decoder.read(preview);
  decoder.finish();
}

const std::string three = "hologram.wavelength=[\"638 nm\", \"520 nm\", \"450 nm\"]";
const std::vector<std::string> laser_names{"638nm", "520nm", "450nm"};

/// A red card beside the desk's square.
const std::string red_lines =
    "[materials.red]\nambient = 0\ndiffuse = [0.8, 0.1, 0.05]\n[[object]]\nmesh = "
    "\"square.obj\"\nwidth = \"0.12 mm\"\nposition = [0, 0, \"9 mm\"]\nmaterial = \"red\"\n";

AnimateResult run_colours(const Animator& animator, const fs::path& folder, FrameStorage storage) {
  FrameFiles files(folder, storage, animator.run_name(storage), animator.stored_size(),
                   animator.laser_names());
  return animator.make_frames(files, {});
}

TEST_CASE("in colour, each laser's holograms are those of an animation of it alone, in turn") {
  Desk desk;
  desk.scene(red_lines +
             "[animation]\nframes = 3\nrate = 10\nsubframes = 2\n[[animation.track]]\n"
             "of = \"object.1.rotation\"\nat = [0, 3]\nvalues = [[0, 0, 0], [0, 20, 90]]\n");
  const std::vector<std::string> keys{three, "slm.encoding=phase"};
  for (const auto& device : all_devices()) {
    const Animator animator(device, load_scenes(desk.file("scene.toml"), keys),
                            cl::FftBackend::host);
    CHECK(animator.laser_names() == laser_names);
    const Folder whole, stream;
    const auto made = run_colours(animator, whole / "", FrameStorage::pngs);
    CHECK(made.pictures == 3);
    CHECK(made.holograms == 3 * 6);
    run_colours(animator, stream / "", FrameStorage::stream);
    const auto wanted = files_of(whole / "");
    REQUIRE(wanted.size() == 3 * 6 + 1);
    const auto raw = bytes_of(stream / "frames.raw");
    REQUIRE(raw.size() == 3 * 6 * 48 * 32);
    for (std::size_t i = 0; i < 3; ++i) {
      auto with = keys;
      with.push_back(std::string("colour.only=") + laser_names[i].substr(0, 3) + " nm");
      const Folder alone;
      run(Animator(device, load_scene(desk.file("scene.toml"), with), cl::FftBackend::host),
          alone / "", FrameStorage::stream);
      const auto of_laser = bytes_of(alone / "frames.raw");
      for (std::size_t j = 0; j < 6; ++j) {
        const auto levels = of_laser.substr(j * 48 * 32, 48 * 32);
        CHECK((raw.substr((3 * j + i) * 48 * 32, 48 * 32) == levels));
        const auto picture =
            load_levels(whole / FrameFiles::png_name(static_cast<int>(j), laser_names[i]), "");
        std::string stored;
        for (const float level : picture.pixels)
          stored.push_back(static_cast<char>(std::lround(level * 255)));
        CHECK((stored == levels));
      }
    }
    // Stopped within picture 1, and gone on with
    const Folder stopped;
    std::istringstream report(wanted.at("report.jsonl"));
    std::string text, line;
    for (int i = 0; i < 1; ++i) {
      std::getline(report, line);
      text += line + "\n";
    }
    stopped.write("report.jsonl", text);
    for (const auto& [name, bytes] : wanted)
      if (name.starts_with("frame_") && name <= FrameFiles::png_name(2, laser_names[0]))
        stopped.write(name, bytes);
    CHECK(run_colours(animator, stopped / "", FrameStorage::pngs).pictures == 2);
    CHECK((files_of(stopped / "") == wanted));
    stopped.write("frame_00002_450nm.png", "no picture");
    CHECK(run_colours(animator, stopped / "", FrameStorage::pngs).pictures == 2);
    CHECK((files_of(stopped / "") == wanted));
    FrameFiles::remove(stopped / "");
    CHECK(files_of(stopped / "").empty());
    // Picture 1 alone
    const Folder part;
    {
      FrameFiles files(part / "", FrameStorage::pngs, animator.run_name(FrameStorage::pngs),
                       animator.stored_size(), laser_names, {1, 2});
      animator.make_frames(files, {}, 2);
    }
    CHECK(files_of(part / "").size() == 6 + 1);
    for (const auto& [name, bytes] : files_of(part / ""))
      CHECK((name == "report.jsonl" ? wanted.at(name).find(bytes) != std::string::npos
                                    : wanted.at(name) == bytes));
  }
}

TEST_CASE("in colour, all lasers and pictures have one brightness, of amplitudes or of powers") {
  Desk desk;
  desk.scene(red_lines +
             "[animation]\nframes = 2\n[[animation.track]]\nof = \"light.0.intensity\"\n"
             "at = [0, 1]\nvalues = [1, 0.25]\n");
  for (const auto& device : all_devices()) {
    for (const std::string how :
         {"slm.encoding=phase", "slm.encoding=double-phase", "refine.views=0"}) {
      CAPTURE(how);
      const bool shows_amplitudes = how == "slm.encoding=double-phase";
      const auto scenes =
          load_scenes(desk.file("scene.toml"), {three, "object.0.material=red", how});
      const Folder folder;
      run_colours(Animator(device, scenes, cl::FftBackend::host), folder / "",
                  FrameStorage::stream);
      const auto raw = bytes_of(folder / "frames.raw");
      const auto still = render(device, scenes, world_of(scenes[0]));
      const auto powers = FrameFiles::powers(folder / "");
      REQUIRE(powers.size() == 2);
      // Where amplitudes are shown, 1 is white of which nothing is clipped
      const double all = powers[0][0] + powers[0][1] + powers[0][2];
      CHECK((shows_amplitudes ? all > 1 && all < 1.3 : std::abs(all - 1) < 1e-4));
      for (std::size_t i = 0; i < 3; ++i) {
        // The first picture is the brightest
        std::size_t differing = 0;
        for (std::size_t at = 0; at < 48 * 32; ++at)
          differing += std::abs(int{still.lasers[i].levels[0][at]} -
                                int{static_cast<std::uint8_t>(raw[i * 48 * 32 + at])}) %
                           255 >
                       1;
        CHECK(differing == 0);
        CHECK(powers[0][i] / all == Catch::Approx(still.powers[i]).epsilon(1e-4));
        // Amplitudes show a light of a quarter themselves. The second picture has other phases
        CHECK(powers[1][i] ==
              Catch::Approx(still.powers[i] * (shows_amplitudes ? 1 : 0.25)).epsilon(0.2));
      }
    }
  }
}

TEST_CASE("animate in colour writes files that are looked at one by one, and videos in colour") {
  Desk desk;
  desk.scene(red_lines +
             "[animation]\nframes = 3\nrate = 10\n[[animation.track]]\n"
             "of = \"light.0.intensity\"\nat = [0, 2]\nvalues = [1, 0.5]\n");
  std::vector<std::string> line{
      "animate", desk.file("scene.toml"), "-o",    desk.out(""),        "--set", three, "--quiet",
      "--set",   "object.0.material=red", "--set", "slm.encoding=phase"};
  const auto made = desk.run(line);
  INFO(made.err);
  REQUIRE(made.code == 0);
  const auto report = nlohmann::json::parse(bytes_of(desk.out("report.json")));
  CHECK(report.at("animation").at("shape") == nlohmann::json({3, 3, 32, 48}));
  CHECK(report.at("colour").at("lasers").at(1).at("files") == "frame_%05d_520nm.png");
  CHECK(desk.run({"reconstruct", desk.out("frame_00001_450nm.png"), "-z", "9mm", "-o",
                  desk.file("seen"), "--quiet"})
            .code == 0);
  check_refused(
      desk.run({"reconstruct", desk.out("report.json"), "-z", "9mm", "-o", desk.file("x")}), 2,
      "is of an animation; give the hologram of one laser");
  // Lasers are no frames whose light adds up
  check_refused(desk.run({"reconstruct", desk.out("frame_00001_638nm.png"),
                          desk.out("frame_00001_520nm.png"), "-z", "9mm", "-o", desk.file("x")}),
                2, "is for 520 nm, and frame_00001_638nm.png for 638 nm; give the pictures of one");
  check_refused(
      desk.run({"reconstruct", desk.out("frame_00001.png"), "-z", "9mm", "-o", desk.file("x")}), 2,
      "is of several lasers; give the file of one: frame_%05d_638nm.png");

  const auto ffmpeg = find_program("ffmpeg");
  if (!ffmpeg) return;  // the rest needs the program itself
  std::string in_order;
  for (int j = 0; j < 3; ++j)
    for (const auto& name : laser_names)
      for (const float level : load_levels(desk.out(FrameFiles::png_name(j, name)), "").pixels)
        in_order.push_back(static_cast<char>(std::lround(level * 255)));
  const auto decoded = [&](const std::vector<std::string>& words, std::size_t bytes) {
    auto all = words;
    all.insert(all.begin(), {"-loglevel", "error", "-i"});
    all.insert(all.end(), {"-f", "rawvideo", "pipe:1"});
    VideoProgram decoder(*ffmpeg, all, desk.out(""), VideoProgram::Held::output);
    std::vector<std::uint8_t> video(bytes);
    decoder.read(video);
    decoder.finish();
    return video;
  };
  for (const bool stream : {false, true}) {
    if (stream) {
      line.insert(line.end(), {"--restart", "--stream"});
      REQUIRE(desk.run(line).code == 0);
      CHECK((bytes_of(desk.out("frames.raw")) == in_order));
    }
    const auto video = decoded({"holograms.mkv", "-pix_fmt", "gray"}, 9 * 48 * 32);
    CHECK((std::string(video.begin(), video.end()) == in_order));
    const auto preview = decoded(
        {"preview.mp4", "-frames:v", "1", "-vf", "scale=16:16", "-pix_fmt", "rgb24"}, 3 * 16 * 16);
    double sums[3] = {};
    for (std::size_t i = 0; i < preview.size(); ++i) sums[i % 3] += preview[i];
    CHECK(sums[0] > 1.3 * sums[1]);
    CHECK(sums[0] > 1.3 * sums[2]);
  }
}

TEST_CASE("a queue that is full makes its caller wait, keeps the order, and passes errors on") {
  std::atomic<int> alive{0}, most{0};
  std::vector<int> order;
  {
    WriteQueue queue(2);
    for (int i = 0; i < 20; ++i) {
      const std::shared_ptr<void> job(nullptr, [&](void*) { --alive; });
      most = std::max<int>(most, ++alive);
      queue.push([job, i, &order] {
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
        order.push_back(i);
      });
    }
    queue.finish();
  }
  for (int i = 0; i < 20; ++i) CHECK(order.at(static_cast<std::size_t>(i)) == i);
  CHECK(most <= 4);  // one at work, two that wait, and the caller's

  WriteQueue failing(1);
  failing.push([] { throw InputError("the disk is full"); });
  CHECK(input_error_of([&] { failing.finish(); }) == "the disk is full");
  CHECK(input_error_of([&] { failing.push([] {}); }) == "the disk is full");
}

}  // namespace
}  // namespace raywave
