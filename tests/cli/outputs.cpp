// SPDX-License-Identifier: Apache-2.0
// What the program reads from pipes and leaves in folders, as a person runs it in a shell.
#include <sys/file.h>

#include <chrono>
#include <csignal>
#include <nlohmann/json.hpp>
#include <thread>

#include "host/common/output.hpp"
#include "tests/support/program.hpp"

namespace raywave {
namespace {

using namespace test;
namespace fs = std::filesystem;

TEST_CASE("a scene may come from a pipe, and names its files from the current folder") {
  const Desk desk;
  const auto plan = desk.run({"plan", desk.file("scene.toml")}).out;
  const auto piped = desk.shell("cat scene.toml | \"$RAYWAVE\" plan /dev/stdin");
  INFO(piped.err);
  CHECK(piped.code == 0);
  CHECK(piped.out == plan);
  const auto fifo = desk.shell(
      "mkfifo pipe.toml; timeout 60 sh -c 'cat scene.toml > pipe.toml' & \"$RAYWAVE\" plan "
      "pipe.toml");
  CHECK(fifo.code == 0);
  CHECK(fifo.out == plan);
  check_refused(desk.shell("\"$RAYWAVE\" plan /dev/stdin < /dev/zero"), 2, "at most 1 MiB");
  check_refused(desk.run({"plan", desk.file("")}), 2, "is a folder");
  check_refused(desk.run({"plan", desk.file("none.toml")}), 2, "there is no such file");
}

TEST_CASE("a full or closed standard output is an error or no matter, never a crash") {
  const Desk desk;
  for (const char* command : {"--help", "plan --help", "devices --json", "plan scene.toml"})
    check_refused(desk.shell(std::string("\"$RAYWAVE\" ") + command + " > /dev/full"), 2,
                  "standard output cannot be written: No space left on device");
  // JSON that is longer than a buffer fails long before the program ends.
  check_refused(desk.shell("\"$RAYWAVE\" render scene.toml -o out --json > /dev/full"), 2,
                "standard output cannot be written: No space left on device");
  fs::remove_all(desk.out(""));
  for (const char* closed : {"<&- >&-", "<&- 2>&-", ">&- 2>&-", "<&- >&- 2>&-"}) {
    INFO(closed);
    const auto outcome =
        desk.shell(std::string("\"$RAYWAVE\" render scene.toml -o out --quiet ") + closed);
    CHECK(outcome.code == 0);
    CHECK(nlohmann::json::parse(bytes_of(desk.out("report.json"))).contains("files"));
    fs::remove_all(desk.out(""));
  }
}

TEST_CASE("a driver that ends the program gets a line, and exit code 3") {
  const Desk desk;
  const auto outcome = desk.shell(
      "LD_PRELOAD=" RAYWAVE_ABORTING_DRIVER
      " ASAN_OPTIONS=verify_asan_link_order=0 \"$RAYWAVE\" render scene.toml -o out --quiet");
  INFO(outcome.err);
  CHECK(outcome.code == 3);
  CHECK_SAYS(outcome.err,
             "OpenCL driver has ended the program while it compiled "
             "or ran kernels/samples/");
  CHECK_SAYS(outcome.err, "raywave devices");
  CHECK(!fs::exists(desk.out("report.json")));
}

TEST_CASE(
    "a cached kernel under another's name is made anew, and compiling is a stage of its own") {
  const Desk desk;
  const std::string render =
      "RAYWAVE_CACHE_DIR=\"$PWD/cache\" \"$RAYWAVE\" render scene.toml -o out --quiet";
  REQUIRE(desk.shell("mkdir cache; " + render).code == 0);
  // Nothing was in the cache, so that drivers took most of the time.
  const auto seconds = nlohmann::json::parse(bytes_of(desk.out("report.json"))).at("seconds");
  double others_s = 0;
  for (const char* stage : {"samples", "trace", "propagate", "encode"})
    others_s += seconds.at(stage).get<double>();
  CHECK(seconds.at("kernels").get<double>() > others_s);
  const auto outcome = desk.shell(
      "first=$(ls cache/kernel* | head -1); for f in cache/kernel*; do "
      "[ $f = $first ] || cp $first $f; done; " +
      render);
  INFO(outcome.err);
  CHECK(outcome.code == 0);
}

TEST_CASE("nothing temporary stays in the cache, with folders in place of files either") {
  const Desk desk;
  const std::string render =
      "RAYWAVE_CACHE_DIR=\"$PWD/cache\" \"$RAYWAVE\" render scene.toml -o out --quiet";
  REQUIRE(desk.shell("mkdir cache; echo >cache/kernel.4194305-0.tmp.bin; " + render).code == 0);
  CHECK(desk.shell("ls cache | grep tmp").code == 1);
  CHECK(desk.shell("cd cache; for f in *; do rm $f; mkdir -p $f/x; done; cd ..; " + render).code ==
        0);
  CHECK(desk.shell("ls cache | grep tmp").code == 1);
}

TEST_CASE("pipes in place of cached files are taken for missing ones") {
  const Desk desk;
  const std::string render =
      "RAYWAVE_CACHE_DIR=\"$PWD/cache\" timeout 60 \"$RAYWAVE\" render scene.toml -o out --quiet";
  REQUIRE(desk.shell("mkdir cache; " + render).code == 0);
  const auto outcome =
      desk.shell("cd cache; for f in *; do rm $f; mkfifo $f; done; cd ..; " + render);
  INFO(outcome.err);
  CHECK(outcome.code == 0);
}

TEST_CASE("holograms of the run before do not stay beside new ones, but all else does") {
  const Desk desk;
  REQUIRE(desk.render({"--quiet", "--set", "sampling.frames=3"}).code == 0);
  desk.folder().write("out/hologram_3.png", "changed");
  desk.folder().write("out/hologram_4.png", bytes_of(desk.out("hologram_2.png")));
  const auto outcome = desk.render({"--no-field"});
  REQUIRE(outcome.code == 0);
  CHECK_SAYS(outcome.err, "had written: hologram_2.png\n");
  CHECK(!fs::exists(desk.out("hologram_2.png")));
  for (const char* name : {"hologram.png", "hologram_3.png", "hologram_4.png", "field.npy"})
    CHECK(fs::exists(desk.out(name)));
  const auto looked =
      desk.succeed({"reconstruct", desk.out("hologram.png"), desk.out("hologram_4.png"), "-z",
                    "10mm", "-o", desk.file("seen")});
  CHECK_SAYS(looked.err, "hologram_4.png: is not in the list");
  CHECK_THAT(looked.err, !Catch::Matchers::ContainsSubstring("hologram.png: is not"));
}

TEST_CASE("report.json tells the pictures of its run from others") {
  const Desk desk;
  REQUIRE(desk.render({"--quiet"}).code == 0);
  const auto first = bytes_of(desk.out("hologram.png"));
  REQUIRE(desk.render({"--quiet", "--set", "sampling.seed=7"}).code == 0);
  const auto report = desk.out("report.json").string();
  const auto files = nlohmann::json::parse(bytes_of(report)).at("files");
  CHECK(files.size() == 2);
  CHECK(files.at("hologram.png") != files.at("field.npy"));
  const std::vector<std::string> look{"reconstruct",     report,   "-z", "10mm", "-o",
                                      desk.file("seen"), "--quiet"};
  desk.succeed(look);
  desk.folder().write("out/hologram.png", first);
  check_refused(desk.run(look), 2, "hologram.png: is not the picture that ");
  auto picture = look;
  picture[1] = desk.out("hologram.png").string();
  desk.succeed(picture);

  for (const auto& line : std::vector<std::vector<std::string>>{
           {"encode", desk.out("field.npy").string(), "-o", desk.file("encoded"), "--format",
            "png16"},
           {"pattern", "blaze", "--size", "32x32", "--pitch", "8um", "--wavelength", "638nm", "-o",
            desk.file("pattern")},
           {"refine", desk.file("scene.toml"), "--iterations", "1", "--no-table", "-o",
            desk.file("refined")}}) {
    const auto outcome = desk.run(line);
    INFO(line[0] << ": " << outcome.err);
    REQUIRE(outcome.code == 0);
    const fs::path folder = line.back() == "png16" ? desk.file("encoded") : line.back();
    const auto named = nlohmann::json::parse(bytes_of(folder / "report.json")).at("files");
    for (const auto& entry : fs::directory_iterator(folder))
      CHECK((entry.path().filename() == "report.json" ||
             named.contains(entry.path().filename().string())));
  }
}

TEST_CASE("one run at a time writes into a folder, and one that is refused leaves none") {
  const Desk desk;
  {
    const HeldFolder held(desk.out(""));
    check_refused(desk.render({"--quiet"}), 2, "another raywave writes into this folder");
  }
  CHECK_FALSE(desk.has_output());
  CHECK(desk.run({"render", desk.file("scene.toml"), "-o", desk.file("a/b/c"), "--quiet", "--set",
                  "wrp.padding=1", "--set", "hologram.resolution=[8192, 8192]", "--set",
                  "sampling.frames=4096"})
            .code == 2);
  CHECK_FALSE(fs::exists(desk.file("a")));
  CHECK(desk.render({"--quiet"}).code == 0);
}

TEST_CASE("temporary files go when a signal ends the program, and at the next run after a kill") {
  const Desk desk;
  REQUIRE(desk.render({"--quiet"}).code == 0);
  desk.folder().write("out/hologram.4194305-0.tmp.png", "left by a program that was killed");
  desk.folder().write("out/hologram.4194306-1.tmp.png", "of one that still lives");
  desk.folder().write("out/my.tmp.png", "the user's own");
  const int alive = open(desk.out("hologram.4194306-1.tmp.png").c_str(), O_RDONLY);
  REQUIRE(flock(alive, LOCK_EX | LOCK_NB) == 0);
  REQUIRE(desk.render({"--quiet"}).code == 0);
  close(alive);
  CHECK_FALSE(fs::exists(desk.out("hologram.4194305-0.tmp.png")));
  CHECK(fs::exists(desk.out("hologram.4194306-1.tmp.png")));
  CHECK(fs::exists(desk.out("my.tmp.png")));

  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    INFO("signal " << signal);
    const pid_t child = fork();
    if (child == 0) {
      // Whatever the test's program does at signals
      std::signal(signal, SIG_DFL);
      const int err = open(desk.file("stderr").c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
      dup2(err, STDERR_FILENO);
      remove_temporaries_at_signals();
      add_to_end_at_signals("; go on so");
      write_whole(desk.out("large.bin"), [&](OutputFile& output) {
        output.write("half of it");
        raise(signal);
      });
      _exit(0);
    }
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    CHECK(WIFSIGNALED(status));
    CHECK(WTERMSIG(status) == signal);
    CHECK_SAYS(bytes_of(desk.file("stderr")), "raywave: stopped", "before stay; go on so\n");
    CHECK_FALSE(fs::exists(desk.out("large.bin")));
    for (const auto& entry : fs::directory_iterator(desk.out("")))
      CHECK_FALSE(entry.path().filename().string().starts_with("large"));
  }
}

TEST_CASE("signals leave no temporary file, however many threads write at that moment") {
  const Desk desk;
  const auto folder = desk.folder() / "many";
  fs::create_directory(folder);
  int left = 0;
  for (int i = 0; i < 60; ++i) {
    const pid_t child = fork();
    if (child == 0) {
      std::signal(SIGTERM, SIG_DFL);
      dup2(open("/dev/null", O_WRONLY), STDERR_FILENO);
      remove_temporaries_at_signals();
      std::vector<std::thread> threads;
      for (int j = 0; j < 6; ++j) {
        threads.emplace_back([&, j] {
          const auto file = folder / (std::to_string(j) + ".bin");
          while (true) write_whole(file, [](OutputFile& output) { output.write("all of it"); });
        });
      }
      for (auto& thread : threads) thread.join();
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10 + i % 7));
    kill(child, SIGTERM);
    int status = 0;
    REQUIRE(waitpid(child, &status, 0) == child);
    CHECK(WTERMSIG(status) == SIGTERM);
    for (const auto& entry : fs::directory_iterator(folder))
      left += entry.path().filename().string().find(".tmp") != std::string::npos;
    fs::remove_all(folder);
    fs::create_directory(folder);
  }
  CHECK(left == 0);
}

TEST_CASE("folders where cached files should be cost time only") {
  const Desk desk;
  const std::vector<std::string> own_cache{"RAYWAVE_CACHE_DIR=" + desk.file("cache")};
  const std::vector<std::string> line{"render", desk.file("scene.toml"), "-o", desk.file("out"),
                                      "--quiet"};
  REQUIRE(desk.run(line, own_cache).code == 0);
  std::size_t files = 0;
  std::vector<fs::path> cached;
  for (const auto& entry : fs::directory_iterator(desk.file("cache"))) {
    if (entry.is_regular_file()) cached.push_back(entry.path());
  }
  for (const auto& file : cached) {
    fs::remove(file);
    files += fs::create_directory(file);
  }
  CHECK(files > 0);
  const auto outcome = desk.run(line, own_cache);
  INFO(outcome.err);
  CHECK(outcome.code == 0);
}

TEST_CASE("objects that slip between the rays, and dark holograms, are said, field or no field") {
  Desk desk;
  desk.folder().write("thread.obj", "v 0 0 0\nv 1 0 0\nv 1 0.01 0\nv 0 0.01 0\nf 1 2 3\nf 1 3 4\n");
  const std::string thread =
      "[[object]]\nmesh = \"thread.obj\"\nwidth = \"0.1 mm\"\n"
      "position = [0, \"0.005 mm\", \"10 mm\"]\n";
  desk.scene(thread);
  const auto both = desk.render();
  CHECK(both.code == 0);
  CHECK_SAYS(both.err, "object 1: about 1 um thin", "rays are 20 um apart");
  CHECK_SAYS(desk.run({"plan", desk.file("scene.toml")}).out, "object 1: about 1 um thin");
  CHECK(desk.render({"--set", "sampling.pitch=0.5 um"}).err.find("thin") == std::string::npos);

  desk.folder().write(
      "scene.toml",
      "[hologram]\nresolution = [48, 32]\npitch = \"4 um\"\n[sampling]\npitch = \"20 um\"\n"
      "[[light]]\ndirection = [0, 0, 1]\n" +
          thread);
  const auto check_dark = [&](const std::string& why) {
    CHECK_SAYS(desk.render().err, "the hologram is dark: " + why);
    CHECK_SAYS(desk.render({"--no-field"}).err, "the hologram is dark: " + why);
  };
  check_dark("no ray of the lattice meets a surface");
  CHECK_SAYS(desk.run({"plan", desk.file("scene.toml")}).out, "they meet parts of it or nothing");
  // Surfaces that no light reaches
  desk.folder().write("scene.toml",
                      "[hologram]\nresolution = [48, 32]\npitch = \"4 um\"\n"
                      "[[light]]\ndirection = [0, 0, 1]\n"
                      "[materials.black]\nambient = 0\ndiffuse = 0\nspecular = 0\n"
                      "[[object]]\nmesh = \"square.obj\"\nwidth = \"0.2 mm\"\n"
                      "position = [0, 0, \"10 mm\"]\nmaterial = \"black\"\n");
  check_dark("no light comes from the scene");
  // No PSNR is predicted of it
  CHECK_SAYS(desk.run({"plan", desk.file("scene.toml")}).out, "pictures  dark");
  CHECK(nlohmann::json::parse(desk.run({"plan", desk.file("scene.toml"), "--json"}).out)
            .at("prediction")
            .at("pictures") == nlohmann::json{{"dark", true}});
}

}  // namespace
}  // namespace raywave
