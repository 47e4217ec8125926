// SPDX-License-Identifier: Apache-2.0
#include "host/animate/animate.hpp"

#include <signal.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <random>
#include <thread>

#include "host/common/output.hpp"
#include "tests/animate/films.hpp"
#include "tests/support/gltf.hpp"
#include "tests/support/render.hpp"

namespace raywave {
namespace {

using namespace test;
namespace fs = std::filesystem;
using Catch::Matchers::ContainsSubstring;
using glm::dvec3;

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
    // Of a hologram that was damaged, the picture alone is made again
    const Folder damaged;
    run(animator, damaged / "", FrameStorage::pngs);
    const auto wanted = files_of(damaged / "");
    damaged.write(FrameFiles::png_name(5), "no picture");
    CHECK(run(animator, damaged / "", FrameStorage::pngs).pictures == 1);
    CHECK((files_of(damaged / "") == wanted));
  }
}

TEST_CASE("parts, made in any order and stopped anywhere, are together the whole animation") {
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
        const Folder whole, shared;
        run(animator, whole / "", storage);
        const auto made = [&](PictureRange wanted) {
          FrameFiles files(shared / "", storage, animator.run_name(storage), animator.schedule(),
                           animator.stored_size(), {}, wanted);
          return animator.make_frames(files, {}).pictures;
        };
        // Parts that overlap make no picture twice
        CHECK(made({4, 6}) == 2);
        CHECK(made({0, 2}) == 2);
        CHECK(made({1, 5}) == 2);
        CHECK(made({4, 6}) == 0);
        // A line that was cut off is as if it was not there, and spoils none behind it
        auto part = bytes_of(shared / "report_00004_00005.jsonl");
        REQUIRE(std::count(part.begin(), part.end(), '\n') == 2);
        shared.write("report_00004_00005.jsonl", part.substr(0, part.size() - 9));
        CHECK(made({4, 6}) == 1);
        CHECK(made({4, 6}) == 0);
        // Bytes that an earlier run has left behind the end of a stream go
        if (storage == FrameStorage::stream) fs::resize_file(shared / "frames.raw.part", 1 << 20);
        CHECK(run(animator, shared / "", storage).pictures == 1);
        CHECK((files_of(shared / "") == files_of(whole / "")));
        CHECK(made({3, 6}) == 0);
        CHECK((files_of(shared / "") == files_of(whole / "")));
      }
    }
  }
}

TEST_CASE("animate --pictures makes parts, which the same command without it puts together") {
  Desk desk;
  desk.scene(moving_lines);
  const auto words = [&](const std::string& out, std::vector<std::string> more) {
    more.insert(more.begin(), {"animate", desk.file("scene.toml"), "-o", desk.file(out)});
    return more;
  };
  const auto made = [&](const std::string& out, std::vector<std::string> more) {
    const auto outcome = desk.run(words(out, std::move(more)), {"PATH=/nonexistent"});
    INFO(outcome.out << outcome.err);
    REQUIRE(outcome.code == 0);
    return outcome;
  };
  made("whole", {"--no-video", "--no-preview"});
  const auto one = made("one", {"--pictures", "5"});
  CHECK_SAYS(one.out, "pictures 5 to 5, of 0 to 6; videos are made of all of them");
  CHECK_THAT(one.err, !ContainsSubstring("ffmpeg"));
  for (const auto* name : {"frame_00010.png", "frame_00011.png", "report.json"})
    CHECK(bytes_of(desk.file(std::string("one/") + name)) ==
          bytes_of(desk.file(std::string("whole/") + name)));
  desk.succeed({"reconstruct", desk.file("one/frame_00011.png"), "-z", "9mm", "-o",
                desk.file("seen"), "--quiet"});

  // Of machines that share no folder
  made("a", {"--pictures", "0..2"});
  made("b", {"--pictures", "3..6"});
  REQUIRE(desk.shell("cp b/* a/").code == 0);
  const auto finished = made("a", {"--no-preview"});
  CHECK_SAYS(finished.out, "7 pictures were there");
  CHECK_SAYS(finished.err, "holograms.mkv are left out");
  CHECK((files_of(desk.file("a")) == files_of(desk.file("whole"))));
  // A part of what is whole changes nothing
  made("a", {"--pictures", "0..4"});
  CHECK((files_of(desk.file("a")) == files_of(desk.file("whole"))));
  check_refused(
      desk.run(words("a", {"--pictures", "0", "--quiet", "--set", "light.0.intensity=2"})), 2,
      "holds holograms of another scene");

  check_refused(desk.run(words("a", {"--pictures", "0", "--quiet", "--restart"})), 2,
                "without --pictures");
  CHECK((files_of(desk.file("a")) == files_of(desk.file("whole"))));

  // Side by side in one folder, where a part is made once and the whole waits for its end
  const auto first = desk.start(words("c", {"--pictures", "0..3", "--quiet"}));
  made("c", {"--pictures", "4..6", "--quiet"});
  CHECK(desk.outcome_of(first).code == 0);
  // What they share may be damaged, and is found again
  auto damaged = nlohmann::json::parse(bytes_of(desk.file("c/shared.json")));
  for (const auto& wrong : {nlohmann::json(), nlohmann::json("?"), nlohmann::json{{99}}}) {
    damaged["poses"] = wrong;
    desk.folder().write("c/shared.json", damaged.dump());
    made("c", {"--pictures", "4..6", "--quiet"});
  }
  {
    const HeldFolder held(desk.file("c"), true);
    check_refused(desk.run(words("c", {"--quiet"})), 2, "another raywave writes into this folder");
    made("c", {"--pictures", "4..6", "--quiet"});
  }
  made("c", {"--no-preview", "--no-video"});
  CHECK((files_of(desk.file("c")) == files_of(desk.file("whole"))));

  for (const auto& [text, says] : {std::pair("7", "are 7 pictures, 0 to 6"),
                                   {"3..9", "are 7 pictures, 0 to 6"},
                                   {"99999999999", "are 7 pictures, 0 to 6"},
                                   {"4..2", "comes before the first"},
                                   {"-1", "a number, or two with .."},
                                   {"1..", "a number, or two with .."},
                                   {"1..2..3", "a number, or two with .."},
                                   {" 1", "a number, or two with .."}})
    check_refused(desk.run({"animate", desk.file("scene.toml"), "-o", desk.file("x"),
                            std::string("--pictures=") + text}),
                  2, says);
}

TEST_CASE("twenty kills at random times cost no picture that was whole, and change no bit",
          "[slow]") {
  constexpr int pictures = 400;
  Desk desk;
  std::string film(moving_lines);
  film.replace(film.find("frames = 7"), 10, "frames = " + std::to_string(pictures));
  desk.scene(film);
  const auto start = [&](const std::string& out, std::vector<std::string> more) {
    more.insert(more.begin(), {"animate", desk.file("scene.toml"), "-o", desk.file(out), "--quiet",
                               "--no-video", "--no-preview"});
    return desk.start(more);
  };
  const auto lines = [&] {
    int whole = 0;
    for (const auto* name :
         {"shared/report_00000_00199.jsonl", "shared/report_00200_00399.jsonl"}) {
      std::istringstream report(bytes_of(desk.file(name)));
      for (std::string line; std::getline(report, line);)
        whole += nlohmann::json::parse(line, nullptr, false).is_object() ? 1 : 0;
    }
    return whole;
  };
  REQUIRE(desk.outcome_of(start("whole", {})).code == 0);
  std::mt19937 random(1);
  int most = 0;
  for (int i = 0; i < 10; ++i) {
    const std::array programs{start("shared", {"--pictures", "0..199"}),
                              start("shared", {"--pictures", "200..399"})};
    // Some time after they have begun to make pictures, where any is missing
    for (int wait = 0; wait < 2000 && most < pictures && lines() == most; ++wait)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    for (const auto program : programs) {
      std::this_thread::sleep_for(
          std::chrono::microseconds(std::uniform_int_distribution(0, 20'000)(random)));
      kill(program, SIGKILL);
      CHECK(desk.outcome_of(program).code <= 0);
    }
    CHECK((lines() > most || most == pictures));
    most = lines();
  }
  const auto last = desk.outcome_of(start("shared", {"--json", "-"}));
  REQUIRE(last.code == 0);
  CHECK(nlohmann::json::parse(last.out).at("pictures_found") == most);
  CHECK((files_of(desk.file("shared")) == files_of(desk.file("whole"))));
}

TEST_CASE("units divides an animation into parts that together are all of it, once each") {
  Desk desk;
  std::string lines(moving_lines);
  lines.replace(lines.find("frames = 7"), 10, "frames = 70");
  desk.scene(lines);
  const auto units = [&](const std::string& each) {
    const auto outcome =
        desk.run({"units", desk.file("scene.toml"), "--each", each, "--set", "sampling.seed=3",
                  "--json", "-", "--openjd", desk.file("job.json")});
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    CHECK_SAYS(outcome.err, "to begin", "each picture");
    return nlohmann::json::parse(outcome.out);
  };
  const auto small = units("1ms");
  CHECK(small.at("units").size() == 70);
  const auto large = units("3600s");
  CHECK(large.at("units").size() == 1);
  CHECK(large["units"][0].at("part") == "0..69");
  const double begin_s = small.at("begin_s"), picture_s = small.at("picture_s");
  CHECK(begin_s > 0);
  CHECK(picture_s > 0);
  const auto middle = units(std::to_string(begin_s + 20 * picture_s) + "s");
  int next = 0;
  for (const auto& unit : middle.at("units")) {
    int first = -1, last = -1;
    REQUIRE(std::sscanf(unit.at("part").get<std::string>().c_str(), "%d..%d", &first, &last) == 2);
    CHECK(first == next);
    CHECK(last >= first);
    CHECK(unit.at("holograms") == nlohmann::json({2 * first, 2 * last + 1}));
    next = last + 1;
  }
  CHECK(next == 70);
  const auto job = nlohmann::json::parse(bytes_of(desk.file("job.json")));
  const auto& parts = job.at("steps").at(0);
  const auto& range = parts.at("parameterSpace").at("taskParameterDefinitions").at(0).at("range");
  REQUIRE(range.size() == middle["units"].size());
  for (std::size_t i = 0; i < range.size(); ++i) CHECK(range[i] == middle["units"][i]["part"]);
  CHECK(job["steps"][1]["dependencies"][0]["dependsOn"] == parts.at("name"));
  const auto args = parts.at("script").at("actions").at("onRun").at("args");
  CHECK(std::count(args.begin(), args.end(), "sampling.seed=3") == 1);
  CHECK(middle.at("command").at(1) == "animate");

  check_refused(desk.run({"units", desk.file("scene.toml"), "--each", "soon"}), 2, "--each");
  desk.scene("[animation]\nframes = 3\n");
  check_refused(desk.run({"units", desk.file("scene.toml"), "--quiet"}), 2, "too few");
  desk.scene("");
  check_refused(desk.run({"units", desk.file("scene.toml"), "--quiet"}), 2, "hologram.tiles");
}

TEST_CASE(
    "holograms of a scene that rests are the frames that render makes of it, on a device or two") {
  Desk desk;
  // An encoding of phases alone: holograms of amplitudes share a scale, frames of render do not
  desk.scene("[slm]\nencoding = \"phase\"\n[animation]\nframes = 3\nrate = 24\nslm_rate = 60\n");
  const auto scene = load_scene(desk.file("scene.toml"));
  auto still = scene;
  still.sampling.frames = 8;  // 3 + 2 + 3
  for (const auto& device : all_devices()) {
    std::string wanted;
    for (const auto& frame : rendered(device, still).levels)
      wanted.append(frame.begin(), frame.end());
    for (const auto& waves : {std::optional<cl::DeviceInfo>(), std::optional(device.info())}) {
      const Folder folder;
      run(Animator(device, {scene}, cl::FftBackend::host, {}, waves), folder / "",
          FrameStorage::stream);
      CHECK((bytes_of(folder / "frames.raw") == wanted));
    }
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

TEST_CASE("pictures of a hologram one pixel wide are renders of their poses, also with no light") {
  Desk desk;
  const std::vector<std::string> narrow{"hologram.resolution=[1, 48]", "slm.encoding=phase"};
  desk.scene(
      "[animation]\nframes = 3\n[[animation.track]]\nof = \"object.0.position\"\nat = [0, 2]\n"
      "values = [[0, 0, \"10 mm\"], [\"1 mm\", 0, \"10 mm\"]]\n");
  const auto moving = load_scene(desk.file("scene.toml"), narrow);
  desk.scene("");
  for (const auto& device : all_devices()) {
    const Folder made;
    run(Animator(device, moving, cl::FftBackend::host), made / "", FrameStorage::stream);
    const auto all = bytes_of(made / "frames.raw");
    REQUIRE(all.size() == 3 * 48);
    for (int picture = 0; picture < 3; ++picture) {
      auto set = narrow;
      set.push_back("object.0.position=['" + std::to_string(500 * picture) + " um', 0, '10 mm']");
      set.push_back("sampling.seed=" + std::to_string(picture + 1));
      const auto posed =
          render(device, load_scene(desk.file("scene.toml"), set), {.fft = cl::FftBackend::host});
      CHECK((posed.samples == 0) == (picture == 2));
      std::complex<double> alike = 0;
      for (std::size_t i = 0; i < 48; ++i) {
        const int apart = posed.levels[0][i] - std::uint8_t(all[48 * std::size_t(picture) + i]);
        alike += std::polar(1.0 / 48, apart * std::numbers::pi / 128);
      }
      CHECK(alike.real() > 0.999);
    }
  }
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
  desk.succeed({"reconstruct", desk.out("frame_00003.png"), "-z", "8mm", "-o", desk.file("seen"),
                "--quiet"});
  CHECK(fs::exists(desk.file("seen/reconstruction_00003_8mm.png")));
}

TEST_CASE("a run is another one once a file that its scene reads has changed, and no other",
          "[slow]") {
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
  desk.succeed(line);
  desk.folder().write("red.mtl", files[0].changed);
  auto again = line;
  again.emplace_back("--quiet");
  check_refused(desk.run(again), 2, "holds holograms of another scene, device or version");
}

TEST_CASE("a run that is refused leaves a finished stream under its name") {
  Desk desk;
  desk.scene(moving_lines);
  std::vector<std::string> line{"animate",  desk.file("scene.toml"), "-o",      desk.out(""),
                                "--stream", "--no-preview",          "--quiet", "--no-video"};
  desk.succeed(line);
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
  Animation animation;
  animation.pictures = 3;
  const Schedule schedule(animation, 1);
  const auto open = [&] {
    const FrameFiles files(folder / "", FrameStorage::pngs, run, schedule, {3, 2});
    return std::array{files.has(0), files.has(1), files.has(2)};
  };
  {
    FrameFiles files(folder / "", FrameStorage::pngs, run, schedule, {3, 2});
    for (int i = 0; i < 3; ++i) files.add(i, levels, {{"picture", i}});
  }
  REQUIRE(open() == std::array{true, true, true});
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
      CHECK(open() == std::array{true, false, true});
    }
  }
}

TEST_CASE("presets that choose other values make other runs, whichever values these are",
          "[slow]") {
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

}  // namespace
}  // namespace raywave
