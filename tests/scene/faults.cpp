// SPDX-License-Identifier: Apache-2.0
// The program's answers to damaged files, absurd claims, small or missing devices, and to signals
// that kill it.
#include <csignal>
#include <thread>

#include "host/evaluate/report.hpp"
#include "host/scene/read_slm.hpp"
#include "tests/support/forked_reader.hpp"
#include "tests/support/program.hpp"

namespace raywave {
namespace {

using namespace test;
namespace fs = std::filesystem;

using Snapshot = std::map<std::string, std::string>;  // file name -> bytes, of one folder

Snapshot snapshot(const fs::path& folder) {
  Snapshot files;
  for (const auto& entry : fs::directory_iterator(folder))
    files[entry.path().filename().string()] = bytes_of(entry.path());
  return files;
}

std::vector<fs::path> demo_files() {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(RAYWAVE_DATA_DIR)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

/// Calls the reader that the program uses for files of this extension.
void read_as_the_program_does(const fs::path& file) {
  const auto kind = file.extension();
  if (kind == ".toml" && file.filename() == "bench.toml") load_slm(file, 638e-9);
  if (kind == ".toml" && file.filename() != "bench.toml") load_scenes(file);
  if (kind == ".ply" || kind == ".glb") load_mesh(file, Normals::smooth, "here");
  if (kind == ".npy") load_npy(file);
  if (kind == ".json") hologram_of_report(file);
  if (kind == ".png" || kind == ".exr") load_texture_in_fork(file, 1);
}

/// Reads damaged copies of the demo's scenes, meshes, textures and results: `cuts` and `flips` per
/// file (for_damaged), a fifth of them for large files.
void check_damaged_demo_files(int cuts, int flips) {
  const Desk desk;
  // Scenes name their meshes beside them.
  for (const auto& file : demo_files()) fs::copy(file, desk.folder() / file.filename().string());
  REQUIRE(desk.render({"--save-wrps", "--quiet", "--set", "sampling.frames=2"}).code == 0);
  desk.succeed(
      {"reconstruct", desk.out("field.npy"), "-z", "10mm", "-o", desk.file("out"), "--quiet"});
  std::vector<fs::path> files = demo_files();
  for (const auto& entry : fs::directory_iterator(desk.out(""))) files.push_back(entry.path());
  int kinds = 0;
  for (const auto& file : files) {
    const auto kind = file.extension();
    if (kind == ".md" || kind == ".txt") continue;
    INFO(file.filename().string());
    CHECK_NOTHROW(read_as_the_program_does(file));
    const int share = fs::file_size(file) > 100'000 ? 5 : 1;
    const auto [accepted, refused] =
        read_damaged(desk.folder(), file, cuts / share, flips / share,
                     [](const auto& damaged) { read_as_the_program_does(damaged); });
    CHECK(refused > 0);
    ++kinds;
  }
  CHECK(kinds > 25);
}

}  // namespace

TEST_CASE(
    "damaged demo files, and damaged results of a demo run, are read or refused in one line") {
  check_damaged_demo_files(10, 20);
}

TEST_CASE("damaged demo files, many more", "[.long]") { check_damaged_demo_files(100, 300); }

TEST_CASE(
    "on any damaged file the program ends with code 0, or with 2, one line and untouched outputs") {
  Desk desk;
  const fs::path data(RAYWAVE_DATA_DIR);
  for (const char* name : {"square.ply", "checker.png"})
    fs::copy(data / name, desk.folder() / name);
  const std::string textured =
      "[materials.x]\ntexture = \"checker.png\"\n[[object]]\nmesh = \"square.ply\"\nwidth = \"0.1 "
      "mm\"\nmaterial = \"x\"\n"
      "position = [0, 0, \"9 mm\"]\n";
  desk.scene(textured);
  REQUIRE(desk.render({"--quiet"}).code == 0);
  desk.succeed(
      {"reconstruct", desk.out("field.npy"), "-z", "10mm", "-o", desk.file("out"), "--quiet"});
  fs::copy(desk.out(""), desk.folder() / "whole");

  const auto check = [&](const std::string& name, const std::vector<std::string>& arguments,
                         int cuts, int flips) {
    const auto file = desk.folder() / name;
    const auto whole = bytes_of(file);
    int accepted = 0, refused = 0;
    for_damaged(whole, cuts, flips, [&](const std::string& bytes) {
      std::ofstream(file, std::ios::binary) << bytes;
      const auto before = snapshot(desk.out(""));
      const auto outcome = desk.run(arguments);
      INFO(name << ", exit code " << outcome.code << ", stderr: " << outcome.err);
      CHECK((outcome.code == 0 || outcome.code == 2));
      CHECK((outcome.code == 0 ? outcome.err.empty() : is_one_line(outcome.err)));
      if (outcome.code != 0) CHECK(snapshot(desk.out("")) == before);
      ++(outcome.code == 0 ? accepted : refused);
    });
    INFO(name);
    CHECK(refused > 0);
    std::ofstream(file, std::ios::binary) << whole;
  };
  const std::vector<std::string> render{"render", desk.file("scene.toml"), "-o", desk.file("out"),
                                        "--quiet"};
  // Loading the OpenCL driver takes most of a run, so the test above damages far more copies. A
  // damaged scene may be a valid scene that takes hours to render, so `plan` reads those.
  check("scene.toml", {"plan", desk.file("scene.toml")}, 10, 15);
  check("square.ply", render, 1, 1);
  check("square.obj", render, 1, 1);
  check("checker.png", render, 1, 1);
  const std::vector<std::string> reconstruct{"-z", "10mm", "-o", desk.file("out"), "--quiet"};
  for (const char* name : {"whole/field.npy", "whole/hologram.png"}) {
    std::vector<std::string> arguments{"reconstruct", desk.file(name)};
    arguments.insert(arguments.end(), reconstruct.begin(), reconstruct.end());
    check(name, arguments, 1, 1);
    if (name == std::string("whole/field.npy")) check("whole/report.json", arguments, 2, 2);
  }
  check("whole/reconstruction_10mm.exr",
        {"compare", desk.file("whole/reconstruction_10mm.exr"), desk.out("reconstruction_10mm.exr"),
         "-o", desk.file("out")},
        1, 1);
}

TEST_CASE("files that claim absurd sizes are refused before memory is taken") {
  Desk desk;
  const auto little = [](auto value) {
    return std::string(reinterpret_cast<const char*>(&value), sizeof value);
  };
  const std::string element = "ply\nformat binary_little_endian 1.0\nelement vertex ",
                    xyz = "\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string face = "property list uchar int vertex_indices\nend_header\n";
  const std::map<std::string, std::string> meshes{
      {"vertices.ply",
       element + "2147483648" + xyz + "element face 1\n" + face + std::string(100, 'x')},
      {"more.ply",
       element + "4294967295" + xyz + "element face 1\n" + face + std::string(100, 'x')},
      {"faces.ply",
       element + "3" + xyz + "element face 2147483647\n" + face + std::string(100, '\0')},
      {"ascii.ply", "ply\nformat ascii 1.0\nelement vertex 2000000000" + xyz +
                        "element face 2000000000\n" + face + "0 0 0\n"},
      {"list.ply", element + "3" + xyz +
                       "element face 1\nproperty list uint int vertex_indices\nend_header\n" +
                       std::string(36, '\0') + little(0xffffffffu)},
      {"many.stl", std::string(80, ' ') + little(0x7fffffffu) + std::string(50, '\0')},
      {"corners.off", "OFF\n353535235358 6 0\n-0.5 -0.5 0.5\n"},
      {"far.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 2147483647\n"},
  };
  const auto check = [&](const std::string& name, const std::vector<std::string>& arguments) {
    const auto outcome = desk.run(arguments);
    INFO(name << " took " << (outcome.peak_bytes >> 20) << " MiB");
    check_refused(outcome, 2, name);
#ifndef __SANITIZE_ADDRESS__
    // A render of the small scene takes 190 MiB, most of it in the driver.
    CHECK(outcome.peak_bytes < std::uint64_t{400} << 20);
#endif
  };
  for (const auto& [name, bytes] : meshes) {
    desk.folder().write(name, bytes);
    desk.scene("[[object]]\nmesh = \"" + name + "\"\nposition = [0, 0, 1]\n");
    check(name, {"plan", desk.file("scene.toml")});
  }

  // Each PNG has a valid header and checksum; only its size is absurd.
  const auto png = [&](std::uint32_t width, std::uint32_t height) {
    const auto big = [](std::uint32_t v) {
      return std::string{static_cast<char>(v >> 24), static_cast<char>(v >> 16),
                         static_cast<char>(v >> 8), static_cast<char>(v)};
    };
    const std::string header = "IHDR" + big(width) + big(height) + std::string("\10\0\0\0\0", 5);
    std::uint32_t crc = ~0u;
    for (const char c : header) {
      crc ^= static_cast<unsigned char>(c);
      for (int i = 0; i < 8; ++i) crc = crc & 1 ? crc >> 1 ^ 0xedb88320u : crc >> 1;
    }
    return "\x89PNG\r\n\x1a\n" + big(13) + header + big(~crc) + big(4) + "IDATxxxxyyyy";
  };
  const std::map<std::string, std::string> pictures{
      {"wide.png", png(1'000'000, 1'000'000)},
      {"wider.png", png(2147483647, 2147483647)},
      {"wide.pgm", "P5\n1000000 1000000\n255\nx"},
      {"wide.pfm", "Pf\n1000000 1000000\n-1.0\nx"},
      {"wide.bmp", "BM" + little(std::uint32_t{58}) + little(std::uint32_t{0}) +
                       little(std::uint32_t{54}) + little(std::uint32_t{40}) + little(1'000'000) +
                       little(1'000'000) + little(std::uint16_t{1}) + little(std::uint16_t{24}) +
                       std::string(24, '\0') + "xxxx"},
  };
  for (const auto& [name, bytes] : pictures) {
    desk.folder().write(name, bytes);
    desk.scene("[materials.x]\ntexture = \"" + name +
               "\"\n[[object]]\nmesh = \"square.obj\"\nmaterial = \"x\"\nwidth = 2e-5\nposition = "
               "[0, 0, 0.01]\n");
    check(name, {"render", desk.file("scene.toml"), "-o", desk.file("out")});
  }

  int i = 0;
  for (const std::string shape :
       {"65536, 1048576, 1048576", "1048576, 1048576", "4294967296, 4294967296",
        "9223372036854775807, 4", "18446744073709551615, 18446744073709551615", "2147483648, 2"}) {
    const std::string header =
                          "{'descr': '<c8', 'fortran_order': False, 'shape': (" + shape + "), }\n",
                      name = std::to_string(i++) + ".npy";
    desk.folder().write(name, "\x93NUMPY\1" + std::string(1, '\0') +
                                  little(static_cast<std::uint16_t>(header.size())) + header +
                                  std::string(64, '\0'));
    check(name, {"compare", desk.file(name), desk.file(name)});
  }
  CHECK_FALSE(desk.has_output());
}

namespace {

/// A folder of results, all of which a failing run must leave as they are.
struct Kept {
  Desk desk;
  Snapshot before;
  Kept() {
    REQUIRE(desk.render({"--quiet"}).code == 0);
    before = snapshot(desk.out(""));
  }
  /// Checks for exit code 3 and one line that holds every text of `says`.
  void check_refused_by_device(const std::vector<std::string>& more,
                               const std::vector<std::string>& environment,
                               const std::vector<std::string>& says) const {
    std::vector<std::string> arguments{"render", desk.file("scene.toml"), "-o", desk.file("out"),
                                       "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto outcome = desk.run(arguments, environment);
    for (const auto& part : says) check_refused(outcome, 3, part);
    CHECK(snapshot(desk.out("")) == before);
  }
};

}  // namespace

TEST_CASE(
    "without any OpenCL device the program says which package to install, and keeps old outputs") {
  const Kept kept;
  fs::create_directory(kept.desk.folder() / "nothing");
  const std::vector<std::string> nowhere{"OCL_ICD_VENDORS=" + kept.desk.file("nothing")};
  kept.check_refused_by_device({}, nowhere, {"no OpenCL device found", "pocl-opencl-icd"});
  check_refused(kept.desk.run({"devices"}, nowhere), 3, "OCL_ICD_VENDORS is set to \"");
  if (cl::list_devices().size() == 1 && cl::find_device().platform == "Portable Computing Language")
    kept.check_refused_by_device({}, {"POCL_DEVICES=none-of-its-own"},
                                 {"POCL_DEVICES is set to \"none-of-its-own\", which gives none"});
  // Planning needs no device.
  CHECK(kept.desk.run({"plan", kept.desk.file("scene.toml")}, nowhere).code == 0);
}

TEST_CASE("where PATH lacks the linker that PoCL needs, the message names both", "[slow]") {
  const Kept kept;
  if (cl::find_device().platform != "Portable Computing Language") return;
  for (const auto& path : {std::string("PATH"), "PATH=" + kept.desk.file("nothing")}) {
    fs::remove_all(kept.desk.file("cold"));
    const auto cold = kept.desk.file("cold");
    const auto outcome =
        kept.desk.run({"render", kept.desk.file("scene.toml"), "-o", kept.desk.file("out")},
                      {path, "POCL_CACHE_DIR=" + cold + "/pocl", "RAYWAVE_CACHE_DIR=" + cold});
    INFO(outcome.err);
    CHECK(outcome.code == 3);
    CHECK_SAYS(outcome.err, "PoCL links kernels with ld, which no folder of PATH has");
  }
}

TEST_CASE(
    "where no cache can be written, a temporary folder stands in, or the message names the "
    "variable",
    "[slow]") {
  const Kept kept;
  if (cl::find_device().platform != "Portable Computing Language") return;
  // A name alone takes the variable away.
  std::vector<std::string> nowhere{"POCL_CACHE_DIR", "RAYWAVE_CACHE_DIR", "XDG_CACHE_HOME",
                                   "HOME=/dev/null/nowhere", "TMPDIR=" + kept.desk.file("")};
  const std::vector<std::string> render{"render", kept.desk.file("scene.toml"), "-o",
                                        kept.desk.file("other"), "--quiet"};
  const auto outcome = kept.desk.run(render, nowhere);
  INFO(outcome.err);
  CHECK(outcome.code == 0);
  CHECK(outcome.err.empty());
  const auto stand_in = "raywave-cache-" + std::to_string(geteuid());
  CHECK(fs::exists(kept.desk.folder() / stand_in / "pocl"));
  CHECK(fs::status(kept.desk.folder() / stand_in).permissions() == fs::perms::owner_all);

  // Another's folder of this name is not used: what it holds would run in the user's name.
  fs::permissions(kept.desk.folder() / stand_in, fs::perms::all);
  kept.check_refused_by_device(
      {}, nowhere, {"no OpenCL device found", "/dev/null/nowhere/.cache/pocl", "POCL_CACHE_DIR"});
  fs::permissions(kept.desk.folder() / stand_in, fs::perms::owner_all);

  nowhere[0] = "POCL_CACHE_DIR=/dev/null/pocl";
  kept.check_refused_by_device({}, nowhere,
                               {"no OpenCL device found", "POCL_CACHE_DIR=/dev/null/pocl"});
}

TEST_CASE(
    "a kernel that does not compile is reported with device, driver, options and the compiler's "
    "log") {
  const Kept kept;
  // Only PoCL takes further options from the environment.
  if (cl::find_device().platform != "Portable Computing Language") return;
  const auto outcome = kept.desk.run(
      {"render", kept.desk.file("scene.toml"), "-o", kept.desk.file("out"), "--quiet"},
      {"POCL_EXTRA_BUILD_FLAGS=-Dfloat=(", "RAYWAVE_CACHE_DIR=" + kept.desk.file("cache")});
  INFO(outcome.err);
  CHECK(outcome.code == 3);
  CHECK(outcome.out.empty());
  const auto message =
      // The driver may print something first.
      outcome.err.substr(std::min(outcome.err.find("raywave: "), outcome.err.size()));
  const auto first_line = message.substr(0, message.find('\n'));
  const auto info = cl::find_device();
  CHECK_SAYS(first_line, "does not compile", info.name, "driver " + info.driver,
             "options -cl-std=CL1.2");
  CHECK_SAYS(message.substr(first_line.size()), "error: ");
  CHECK(snapshot(kept.desk.out("")) == kept.before);
}

TEST_CASE(
    "a request beyond the device's memory is refused with its size, the limit and the setting "
    "that helps") {
  const Kept kept;
  // Only PoCL can be limited to less memory.
  if (cl::find_device().platform != "Portable Computing Language") return;
  // In GiB; one buffer may take a quarter of it
  const std::vector<std::string> small{"POCL_MEMORY_LIMIT=1"};
  const auto set = [](const std::vector<std::string>& values) {
    std::vector<std::string> arguments;
    for (const auto& value : values) arguments.insert(arguments.end(), {"--set", value});
    return arguments;
  };
  const auto in_one_piece = [&](std::vector<std::string> values) {
    values.insert(values.end(), {"hologram.tiles=[1, 1]", "wrp.propagation=spectrum"});
    auto arguments = set(values);
    // VkFFT keeps padded planes on the device.
    arguments.insert(arguments.end(), {"--fft", "vkfft"});
    return arguments;
  };
  kept.check_refused_by_device(in_one_piece({"hologram.resolution=[3000, 3000]"}), small,
                               {"padded plane: 274.7 MiB asked in one buffer", "allows 256.0 MiB",
                                "wrp.padding", "hologram.tiles"});
  kept.check_refused_by_device(
      in_one_piece({"hologram.resolution=[8192, 8192]", "wrp.padding=1"}), small,
      {"512.0 MiB asked in one buffer", "allows 256.0 MiB", "hologram.resolution"});
  kept.check_refused_by_device(set({"sampling.pitch=20 nm", "hologram.pitch=0.7 um"}), small,
                               {"sample lattice", "allows 256.0 MiB", "a larger sampling.pitch"});
  // Too little host memory is an error of the scene, not of the device.
  check_refused(kept.desk.run({"render", kept.desk.file("scene.toml"), "-o", kept.desk.file("out"),
                               "--quiet", "--set", "hologram.resolution=[4096, 4096]", "--set",
                               "wrp.padding=1", "--set", "sampling.frames=4096"}),
                2, "give fewer sampling.frames");

  // Each buffer fits alone; together they do not.
  kept.check_refused_by_device(
      in_one_piece({"hologram.resolution=[5760, 5760]", "wrp.padding=1", "sampling.pitch=1 mm",
                    "wrp.grid=[1, 1]"}),
      small, {"GiB of device memory asked", "has 1.0 GiB", "a smaller hologram.resolution"});
}

TEST_CASE(
    "killed at any moment, the program leaves every output file either old or new and complete, "
    "and the next run succeeds",
    "[slow]") {
  const Desk desk;
  const auto arguments = [&](int seed, const std::string& out) {
    return std::vector<std::string>{"render",
                                    desk.file("scene.toml"),
                                    "-o",
                                    desk.file(out),
                                    "--quiet",
                                    "--set",
                                    "hologram.resolution=[512, 512]",
                                    "--set",
                                    "sampling.seed=" + std::to_string(seed)};
  };
  desk.succeed(arguments(1, "old"));
  desk.succeed(arguments(2, "new"));
  auto old_files = snapshot(desk.folder() / "old"), new_files = snapshot(desk.folder() / "new");
  fs::copy(desk.folder() / "old", desk.folder() / "out");

  const auto start = std::chrono::steady_clock::now();
  desk.succeed(arguments(2, "out"));
  const auto whole_run = std::chrono::steady_clock::now() - start;

  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(0, 1);
  int killed = 0;
  for (int i = 0; i < 12; ++i) {
    // SIGKILL leaves temporary files until the next run writes, and that one may end before
    for (const auto& [name, bytes] : snapshot(desk.out(""))) fs::remove(desk.out(name));
    for (const auto& [name, bytes] : old_files)
      std::ofstream(desk.out(name), std::ios::binary) << bytes;
    const pid_t program = desk.start(arguments(2, "out"));
    // Most kills come near the end of a run, when files are written.
    const double share = i % 3 == 0 ? anywhere(random) : 0.8 + anywhere(random) / 3;
    std::this_thread::sleep_for(share * whole_run);
    kill(program, i % 2 ? SIGKILL : SIGTERM);
    int status = 0;
    REQUIRE(waitpid(program, &status, 0) == program);
    killed += WIFSIGNALED(status);
    for (const auto& [name, bytes] : old_files) {
      INFO(name << " after a kill at " << share << " of the run");
      const auto found = bytes_of(desk.out(name));
      // The report holds times, which differ from run to run.
      if (name == "report.json")
        CHECK((found == bytes || (found.starts_with('{') && found.ends_with("}\n") &&
                                  found.find("\"seed\": 2") != std::string::npos)));
      else
        CHECK((found == bytes || found == new_files.at(name)));
    }
    const bool may_leave = i % 2 != 0;  // SIGKILL
    for (const auto& [name, bytes] : snapshot(desk.out(""))) {
      INFO(name << " after kill " << i << " at " << share << " of the run");
      CHECK((old_files.contains(name) || (may_leave && name.find(".tmp.") != std::string::npos)));
    }
    // The report is of the picture beside it, or that is said.
    const auto seen = desk.run(
        {"reconstruct", desk.out("report.json"), "-z", "10mm", "-o", desk.file("seen"), "--quiet"});
    const bool is_mixed = bytes_of(desk.out("report.json")) == old_files.at("report.json") &&
                          bytes_of(desk.out("hologram.png")) != old_files.at("hologram.png");
    CHECK(seen.code == (is_mixed ? 2 : 0));
  }
  CHECK(killed > 0);

  std::ofstream(desk.out("hologram.4194305-0.tmp.png")) << "left by a program that was killed";
  desk.succeed(arguments(2, "out"));
  CHECK(snapshot(desk.out("")).size() == old_files.size());
  for (const char* name : {"field.npy", "hologram.png"})
    CHECK(bytes_of(desk.out(name)) == new_files.at(name));
}

}  // namespace raywave
