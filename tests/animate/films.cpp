// SPDX-License-Identifier: Apache-2.0
/// Films: PNGs, videos, several lasers; digests of files, and the queue that writes them.
#include "tests/animate/films.hpp"

#include <atomic>
#include <nlohmann/json.hpp>

#include "host/animate/frame_files.hpp"
#include "host/animate/videos.hpp"
#include "host/common/cache.hpp"
#include "host/common/child_program.hpp"
#include "tests/support/render.hpp"

namespace raywave {
namespace {

using namespace test;
namespace fs = std::filesystem;
using Catch::Matchers::ContainsSubstring;

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

TEST_CASE("no PNG of holograms is compressed, however large") {
  std::vector<std::uint8_t> png;
  for (const int rows : {8, 8200}) {  // 32 KiB, and 33.6 million pixels
    uncompressed_png(4096, rows, std::vector<std::uint8_t>(std::size_t{4096} * rows), png);
    CHECK(png.size() > std::size_t{4096} * rows);
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

TEST_CASE("videos are made where ffmpeg is, and what it refuses is passed on") {
  Desk desk;
  desk.scene(moving_lines);
  const std::vector<std::string> line{"animate", desk.file("scene.toml"), "-o", desk.out("")};
  const auto without = desk.run(line, {"PATH=/nonexistent"});
  CHECK(without.code == 0);
  CHECK_SAYS(without.err,
             "there is no program ffmpeg on PATH: holograms.mkv and "
             "preview.mp4 are left out; install ffmpeg");
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
    desk.succeed(words);
    CHECK(fs::file_size(desk.out("preview.mp4")) > 500);
    ChildProgram decoder(*ffmpeg,
                         {"-loglevel", "error", "-i", "holograms.mkv", "-f", "rawvideo", "-pix_fmt",
                          "gray", "pipe:1"},
                         desk.out(""), ChildProgram::Held::output);
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
  desk.succeed(words);
  ChildProgram decoder(
      *ffmpeg,
      {"-loglevel", "error", "-i", "preview.mp4", "-f", "rawvideo", "-pix_fmt", "gray", "pipe:1"},
      desk.out(""), ChildProgram::Held::output);
  std::vector<std::uint8_t> preview(7 * 650 * 10);
  decoder.read(preview);
  decoder.finish();
  // An eye makes out 19 of the samples' pixels here, and hence no single ones
  int largest = 0, step = 0;
  for (std::size_t i = 1; i < 650; ++i) {
    largest = std::max<int>(largest, preview[i]);
    step = std::max(step, std::abs(int{preview[i]} - int{preview[i - 1]}));
  }
  CHECK(largest > 100);
  CHECK(step < largest / 4);
}

TEST_CASE("a video that is damaged is made anew, and none of other pictures stays") {
  Desk desk;
  desk.scene(moving_lines);
  fs::create_directory(desk.file("bin"));
  const auto ffmpeg = [&](const std::string& does) {
    desk.folder().write("bin/ffmpeg", "#!/bin/sh\n" + does + "\n");
    fs::permissions(desk.file("bin/ffmpeg"), fs::perms::owner_all);
  };
  const auto animate = [&](std::vector<std::string> more) {
    more.insert(more.begin(),
                {"animate", desk.file("scene.toml"), "-o", desk.out(""), "--no-preview"});
    const auto outcome = desk.run(more, {"PATH=" + desk.file("bin") + ":/usr/bin:/bin"});
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    return outcome.err;
  };
  const auto video = desk.out("holograms.mkv");
  ffmpeg("for last; do :; done; echo video > \"${last#file:}\"");
  animate({});
  fs::resize_file(video, 3);
  animate({});
  CHECK(bytes_of(video) == "video\n");
  ffmpeg("exit 1");  // is not asked
  CHECK_THAT(animate({"--pictures", "2"}) + animate({}), !ContainsSubstring("removed"));
  CHECK(bytes_of(video) == "video\n");
  desk.folder().write("out/frame_00003.png", "no picture");
  CHECK_SAYS(animate({"--no-video"}), "removed holograms.mkv: damaged, or of other pictures");
  CHECK_FALSE(fs::exists(video));
}

TEST_CASE("parts of a film say once what each of them would") {
  Desk desk;
  desk.folder().write("square.obj", "mtllib none.mtl\n" + square_obj());
  desk.scene(moving_lines);
  const auto says = [&](std::vector<std::string> more) {
    more.insert(more.begin(), {"animate", desk.file("scene.toml"), "-o", desk.out(""), "--no-video",
                               "--no-preview"});
    return desk.run(more).err;
  };
  CHECK_SAYS(says({"--pictures", "0..2"}), "library \"none.mtl\"", "sampling.pitch 20 um is finer");
  CHECK(says({"--pictures", "3"}).empty());
  CHECK_SAYS(says({}), "library \"none.mtl\"", "sampling.pitch 20 um is finer");
}

const std::string three = "hologram.wavelength=[\"638 nm\", \"520 nm\", \"450 nm\"]";
const std::vector<std::string> laser_names{"638nm", "520nm", "450nm"};

/// A red card beside the desk's square.
const std::string red_lines =
    "[materials.red]\nambient = 0\ndiffuse = [0.8, 0.1, 0.05]\n[[object]]\nmesh = "
    "\"square.obj\"\nwidth = \"0.12 mm\"\nposition = [0, 0, \"9 mm\"]\nmaterial = \"red\"\n";

AnimateResult run_colours(const Animator& animator, const fs::path& folder, FrameStorage storage) {
  FrameFiles files(folder, storage, animator.run_name(storage), animator.schedule(),
                   animator.stored_size(), animator.laser_names());
  return animator.make_frames(files, {});
}

DEVICE_TEST("in colour, each laser's holograms are those of an animation of it alone, in turn") {
  Desk desk;
  desk.scene(red_lines +
             "[animation]\nframes = 3\nrate = 10\nsubframes = 2\n[[animation.track]]\n"
             "of = \"object.1.rotation\"\nat = [0, 3]\nvalues = [[0, 0, 0], [0, 20, 90]]\n");
  const std::vector<std::string> keys{three, "slm.encoding=phase"};
  const Animator animator(device, load_scenes(desk.file("scene.toml"), keys), cl::FftBackend::host);
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
  CHECK(run_colours(animator, stopped / "", FrameStorage::pngs).pictures == 1);
  CHECK((files_of(stopped / "") == wanted));
  FrameFiles::remove(stopped / "");
  CHECK(files_of(stopped / "").empty());
  // Picture 1 alone
  const Folder part;
  {
    FrameFiles files(part / "", FrameStorage::pngs, animator.run_name(FrameStorage::pngs),
                     animator.schedule(), animator.stored_size(), laser_names, PictureRange{1, 2});
    animator.make_frames(files, {});
  }
  CHECK(files_of(part / "").size() == 6 + 1);
  for (const auto& [name, bytes] : files_of(part / ""))
    CHECK((name == "report_00001_00001.jsonl"
               ? wanted.at("report.jsonl").find(bytes) != std::string::npos
               : wanted.at(name) == bytes));
}

DEVICE_TEST("in colour, all lasers and pictures have one brightness, of amplitudes or of powers") {
  Desk desk;
  desk.scene(red_lines +
             "[animation]\nframes = 2\n[[animation.track]]\nof = \"light.0.intensity\"\n"
             "at = [0, 1]\nvalues = [1, 0.25]\n");
  for (const std::string how :
       {"slm.encoding=phase", "slm.encoding=double-phase", "refine.views=0"}) {
    CAPTURE(how);
    const bool shows_amplitudes = how == "slm.encoding=double-phase";
    const auto scenes = load_scenes(desk.file("scene.toml"), {three, "object.0.material=red", how});
    const Folder folder;
    run_colours(Animator(device, scenes, cl::FftBackend::host), folder / "", FrameStorage::stream);
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

TEST_CASE("animate in colour writes files that are looked at one by one, and videos in colour") {
  Desk desk;
  desk.scene(red_lines +
             "[animation]\nframes = 3\nrate = 10\n[[animation.track]]\n"
             "of = \"light.0.intensity\"\nat = [0, 2]\nvalues = [1, 0.5]\n");
  std::vector<std::string> line{
      "animate", desk.file("scene.toml"), "-o",    desk.out(""),        "--set", three, "--quiet",
      "--set",   "object.0.material=red", "--set", "slm.encoding=phase"};
  desk.succeed(line);
  const auto report = nlohmann::json::parse(bytes_of(desk.out("report.json")));
  CHECK(report.at("animation").at("shape") == nlohmann::json({3, 3, 32, 48}));
  CHECK(report.at("colour").at("lasers").at(1).at("files") == "frame_%05d_520nm.png");
  desk.succeed({"reconstruct", desk.out("frame_00001_450nm.png"), "-z", "9mm", "-o",
                desk.file("seen"), "--quiet"});
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
    ChildProgram decoder(*ffmpeg, all, desk.out(""), ChildProgram::Held::output);
    std::vector<std::uint8_t> video(bytes);
    decoder.read(video);
    decoder.finish();
    return video;
  };
  for (const bool stream : {false, true}) {
    if (stream) {
      line.insert(line.end(), {"--restart", "--stream"});
      desk.succeed(line);
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
