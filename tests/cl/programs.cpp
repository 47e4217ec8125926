// SPDX-License-Identifier: Apache-2.0
// Programs built ahead, and runs without a compiler, as on an FPGA.
#include <unistd.h>

#include "cl/compile_ahead.hpp"
#include "cl/program_folder.hpp"
#include "host/common/rehearsal.hpp"
#include "host/evaluate/selftest/selfcheck.hpp"
#include "host/geometry/kernel_options.hpp"
#include "host/render.hpp"
#include "host/view/lens.hpp"
#include "host/view/reconstruct.hpp"
#include "tests/support/devices.hpp"
#include "tests/support/environment.hpp"
#include "tests/support/opencl_spy.hpp"
#include "tests/support/program.hpp"

namespace raywave {
namespace {

using namespace test;

namespace fs = std::filesystem;
using Catch::Matchers::ContainsSubstring;

constexpr const char* variable = "RAYWAVE_PROGRAM_DIR";

/// No kernel is compiled while it lives.
struct NoCompiler {
  NoCompiler() {
    kept_devices().clear();  // what is built already needs none
    opencl_spy().refuse_compiler = true;
  }
  ~NoCompiler() { opencl_spy().refuse_compiler = false; }
};

Scene small_scene(const Folder& folder) {
  Scene scene{.hologram = {{40, 24}, {8 * um, 8 * um}, 638e-9}};
  scene.sampling.pitch_m = 40 * um;
  scene.sampling.frames = 2;
  Material ball{.specular = glm::dvec3(0.4)};
  scene.materials = {ball};
  scene.objects = {object_at(folder.write("ball.obj", ball_obj(6, 4)), 0.2 * mm, {0, 0, 10 * mm})};
  scene.lights = {Light{}};
  return scene;
}

struct Results {
  RenderResult hologram;
  Image shown, seen;
};

Results all_of(const cl::DeviceInfo& info, const Scene& scene) {
  const cl::Device device(info);
  RenderOptions options{.fft = cl::FftBackend::host};
  Results results{render(device, scene, options), {}, {}};
  ReconstructSpec at{.z_m = 10 * mm};
  results.shown = reconstruct(device, options.fft, results.hologram.field, scene.hologram, at);
  LensSpec lens{.z_m = 10 * mm, .points = 2};
  const auto world = build_world(scene);
  const auto& plan = results.hologram.plan;
  results.seen = lens_picture(device, plan, DeviceScene(device, world, plan), lens);
  return results;
}

}  // namespace

TEST_CASE(
    "with every program built ahead and no compiler, holograms and pictures are the same to the "
    "bit") {
  const Folder folder;
  const auto scene = small_scene(folder);
  for (const auto& info : cl::list_devices()) {
    INFO(info.name);
    const auto programs = folder / ("programs-" + info.index);
    const Results usual = [&] {
      const cl::ProgramRecorder recorder(programs);
      const auto results = all_of(info, scene);
      CHECK(recorder.programs().size() >= 5);
      return results;
    }();

    const Environment cache("RAYWAVE_CACHE_DIR", (folder / "no-cache").string());
    const NoCompiler none;
    CHECK_SAYS(device_error_of([&] { all_of(info, scene); }), "does not compile");

    const Environment ahead(variable, programs.string());
    const auto offline = cl::find_device(info.index);
    CHECK_FALSE(offline.online_compiler);
    CHECK(cl::default_backend(offline) == cl::FftBackend::host);
    const auto again = all_of(offline, scene);
    CHECK(again.hologram.field.samples == usual.hologram.field.samples);
    CHECK(again.hologram.levels == usual.hologram.levels);
    CHECK(again.shown.pixels == usual.shown.pixels);
    CHECK(again.seen.pixels == usual.seen.pixels);
  }
}

TEST_CASE(
    "a program that is missing, damaged or no program is an error that names the file and what to "
    "do") {
  const Folder folder;
  for (const auto& info : cl::list_devices()) {
    INFO(info.name);
    const auto programs = folder / ("programs-" + info.index);
    const auto build = [&] {
      cl::Program(cl::Device(info), "kernels/encode/encode.cl", {{option::lanes, "1"}});
    };
    {
      const cl::ProgramRecorder recorder(programs);
      build();
    }
    const Environment ahead(variable, programs.string());
    CHECK_NOTHROW(build());
    const auto missing = device_error_of([&] {
      cl::Program(cl::Device(info), "kernels/encode/encode.cl", {{option::lanes, "4"}});
    });
    CHECK_SAYS(missing, (programs / "encode-").string(), ".bin is missing", "-DRAYWAVE_LANES=4",
               "raywave kernels -o " + programs.string() + " --device " + info.index);

    fs::path binary;
    for (const auto& entry : fs::directory_iterator(programs)) {
      if (entry.path().extension() == ".bin") binary = entry.path();
    }
    REQUIRE_FALSE(binary.empty());
    const auto whole = bytes_of(binary);
    auto damaged = whole;
    damaged[whole.size() / 2] = static_cast<char>(damaged[whole.size() / 2] ^ 1);
    std::ofstream(binary, std::ios::binary) << damaged;
    CHECK_SAYS(device_error_of(build), binary.string(), "damaged");
    std::ofstream(binary, std::ios::binary) << whole;
    CHECK_NOTHROW(build());
    if (info.platform == "rusticl") continue;  // Mesa 22.3 aborts at what is no program
    fs::remove(programs / "manifest.tsv");
    std::ofstream(binary, std::ios::binary) << "no program at all";
    CHECK_SAYS(device_error_of(build), binary.string(), "does not load");
  }
}

TEST_CASE(
    "while a device is open, programs that it has built are there for all that open it, and the "
    "cache has them then") {
  const Folder folder;
  const auto build = [](const cl::Device& on, const char* lanes) {
    cl::Program(on, "kernels/encode/encode.cl", {{option::lanes, lanes}});
  };
  for (const auto& info : cl::list_devices()) {
    INFO(info.name);
    const Environment cache("RAYWAVE_CACHE_DIR", (folder / "none").string());
    std::optional<cl::Device> device(info);
    build(*device, "1");
    const NoCompiler none;
    CHECK_NOTHROW(build(*device, "1"));
    CHECK_NOTHROW(build(cl::Device(info), "1"));
    CHECK_SAYS(device_error_of([&] { build(*device, "8"); }), "does not compile");
    device.reset();
    if (cl::is_pocl(info) && !cl::needs_single_items(info) && !cl::compiles_once(info)) continue;
    CHECK_NOTHROW(build(cl::Device(info), "1"));
  }
}

TEST_CASE(
    "as PoCL 6.0 needs it, kernels run in groups of one item, and programs are linked when loaded "
    "without a compiler") {
  const Folder folder;
  const auto turns = selftest::cos_sin_arguments();
  for (auto info : cl::list_devices()) {
    if (info.platform != "Portable Computing Language") continue;
    INFO(info.name);
    const auto passes = [&] {
      opencl_spy().largest_group = 0;
      CHECK(selftest::cos_sin_error(cl::Device(info), 1, turns) <= selftest::cos_sin_bound);
      return opencl_spy().largest_group;
    };
    if (!info.driver.starts_with("6.")) CHECK(passes() > 1);
    info.driver = "6.0, as a test has it";
    const auto programs = folder / ("programs-" + info.index);
    {
      const cl::ProgramRecorder recorder(programs);
      CHECK(passes() == 1);
    }
    const NoCompiler none;
    CHECK(passes() == 1);  // from the cache
    const Environment ahead(variable, programs.string());
    CHECK(passes() == 1);
  }
}

TEST_CASE(
    "raywave kernels -o makes all that raywave render needs, and without it render says what is "
    "missing") {
  const Desk desk;
  const auto file = [&](const char* name) { return "'" + desk.file(name) + "'"; };
  const auto run = [&](const std::string& line) { return desk.shell(line).code; };
  const std::string program = "$RAYWAVE";
  const std::string offline = "RAYWAVE_PROGRAM_DIR=" + file("programs") +
                              " RAYWAVE_CACHE_DIR=" + file("cache") + " " + program;

  // Without a compiler the host transforms
  CHECK(run(program + " render " + file("scene.toml") + " --fft host -o " + file("usual")) == 0);
  CHECK(run(offline + " render " + file("scene.toml") + " -o " + file("none")) == 3);
  CHECK_SAYS(bytes_of(desk.file("stderr")), ".bin is missing");
  CHECK_FALSE(fs::exists(desk.folder() / "none"));

  CHECK(run(program + " kernels -o " + file("programs") + " " + file("scene.toml")) == 0);
  CHECK(run(offline + " render " + file("scene.toml") + " -o " + file("ahead")) == 0);
  CHECK(bytes_of(desk.folder() / "ahead" / "field.npy") ==
        bytes_of(desk.folder() / "usual" / "field.npy"));
  CHECK(bytes_of(desk.folder() / "ahead" / "hologram.png") ==
        bytes_of(desk.folder() / "usual" / "hologram.png"));
  CHECK(run(offline + " reconstruct " + file("ahead/field.npy") + " -z 10mm -o " + file("ahead")) ==
        0);
  CHECK(run(offline + " lens " + file("scene.toml") + " -z 10mm --lens-points 2 -o " +
            file("ahead")) == 0);
  // Nothing was compiled or planned by a compiler of clFFT's
  CHECK_FALSE(fs::exists(desk.folder() / "cache"));
  CHECK(run(offline + " render " + file("scene.toml") + " --fft clfft -o " + file("none")) == 3);
  CHECK(run(offline + " kernels -o " + file("programs")) == 3);

  const auto lasers =
      file("scene.toml") + " --set 'hologram.wavelength=[\"638 nm\", \"520 nm\", \"450 nm\"]'";
  CHECK(run(program + " kernels -o " + file("of_lasers") + " " + lasers) == 0);
  CHECK(run("RAYWAVE_PROGRAM_DIR=" + file("of_lasers") + " " + program + " render " + lasers +
            " -o " + file("lasers")) == 0);

  // A preset that refines needs others
  const auto refined = file("scene.toml") + " --preset reference --set slm.encoding=phase";
  CHECK(run(offline + " render " + refined + " -o " + file("none")) == 3);
  CHECK(run(program + " kernels -o " + file("of_preset") + " " + refined) == 0);
  CHECK(run("RAYWAVE_PROGRAM_DIR=" + file("of_preset") + " " + program + " render " + refined +
            " -o " + file("refined")) == 0);

  // For a toolchain: one source, of which it makes one binary
  CHECK(run(program + " kernels --target v++ -o " + file("sources") + " " + file("scene.toml")) ==
        0);
  const auto frame = bytes_of(desk.folder() / "sources" / "frame.cl");
  CHECK_SAYS(frame, "#define RAYWAVE_FPGA", "#define RAYWAVE_LANES 8", "gather_compact", "encode");
  CHECK_THAT(frame, !ContainsSubstring("#include"));
  // Stands for the toolchain; it takes what is compiled and linked
  std::ofstream(desk.folder() / "v++") << "#!/bin/sh\necho \"$@\" >> log\n"
                                          "for last; do :; done\n: > \"$last\"\n";
  fs::permissions(desk.folder() / "v++", fs::perms::owner_all);
  const auto make = "cd " + file("sources") + " && PATH=..:$PATH make -s build";
  CHECK(run(make) != 0);  // without a board
  CHECK(run(make + " BOARD=card") == 0);
  CHECK(run(make + " BOARD=card") == 0);  // has nothing to do
  CHECK(bytes_of(desk.folder() / "sources" / "log") ==
        "-c -t hw --platform card -k gather_compact frame.cl -o build/gather_compact.xo\n"
        "-c -t hw --platform card -k encode frame.cl -o build/encode.xo\n"
        "-c -t hw --platform card -k sum_light frame.cl -o build/sum_light.xo\n"
        "-c -t hw --platform card -k sample_amplitudes frame.cl -o build/sample_amplitudes.xo\n"
        "-l -t hw --platform card build/gather_compact.xo build/encode.xo "
        "build/sum_light.xo build/sample_amplitudes.xo -o build/frame.xclbin\n");
  int binaries = 0;
  for (const auto& entry : fs::directory_iterator(desk.folder() / "sources" / "build"))
    binaries += entry.path().extension() == ".bin";
  CHECK(binaries == 2);
  CHECK(run(program + " kernels --target aoc -o " + file("sources") + " " + file("scene.toml")) ==
        2);
  CHECK_SAYS(bytes_of(desk.file("stderr")), "frame.cl", ": is there");
  CHECK(run(program + " kernels --target aoc -o " + file("nothing")) == 2);
  CHECK(run(program + " kernels --preset draft -o " + file("nothing")) == 2);
  CHECK_FALSE(fs::exists(desk.folder() / "nothing"));
}

// Ahead, by a second process

TEST_CASE("after a rehearsal's kernels are compiled, PoCL compiles none for a picture") {
  const auto info = cl::list_devices().front();
  if (!cl::is_pocl(info) || cl::needs_single_items(info)) return;
  // So that nothing is in a cache
  const Environment cold("POCL_EXTRA_BUILD_FLAGS", "-DCOLD=" + std::to_string(getpid()));
  const Folder folder;
  const Environment cache("RAYWAVE_CACHE_DIR", (folder / "").string());
  auto scene = small_scene(folder);
  scene.materials[0].reflectivity = 0.5;
  kept_devices().clear();
  const cl::Device device(info);
  const auto picture = [&] { return render(device, scene, {.keep_field = false}); };
  std::set<std::string> kernels;
  const auto new_kernels = [&] {
    std::set<std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator(cl::pocl_cache_folder()))
      if (entry.path().extension() == ".so" && kernels.insert(entry.path()).second)
        found.insert(entry.path());
    return found;
  };
  new_kernels();
  is_rehearsal = true;
  picture();
  is_rehearsal = false;
  CHECK(new_kernels().empty());
  cl::compile_rehearsed();
  CHECK(new_kernels().size() >= 8);
  CHECK(picture().samples > 0);
  CHECK(new_kernels() == std::set<std::string>{});
}

TEST_CASE(
    "raywave render with empty caches writes what it writes with full ones, and leaves no "
    "process") {
  const Desk desk;
  const auto render = [&](const std::string& out) {
    return desk
        .shell("RAYWAVE_CACHE_DIR='" + desk.file("cache") + "' POCL_CACHE_DIR='" +
               desk.file("pocl") + "' $RAYWAVE render '" + desk.file("scene.toml") + "' -o '" +
               desk.file(out) + "'")
        .code;
  };
  const auto processes = [&] {  // that this scene was given to
    int count = 0;
    for (const auto& entry : fs::directory_iterator("/proc")) {
      std::ifstream stream(entry.path() / "cmdline");
      const std::string words(std::istreambuf_iterator<char>(stream), {});
      count += words.find(desk.file("scene.toml")) != std::string::npos;
    }
    return count;
  };
  fs::create_directory(desk.folder() / "pocl");
  CHECK(render("cold") == 0);
  CHECK(processes() == 0);
  CHECK(render("warm") == 0);
  for (const auto* name : {"hologram.png", "field.npy"})
    CHECK(bytes_of(desk.folder() / "cold" / name) == bytes_of(desk.folder() / "warm" / name));
}

// FPGAs

namespace {

/// The device as one of another kind, with as many lanes as an FPGA.
cl::DeviceInfo as(cl::DeviceKind kind, cl::DeviceInfo info) {
  info.kind = kind;
  info.float_lanes = cl::fpga_lanes;
  info.work = {};
  return info;
}

void check_same(const RenderResult& got, const RenderResult& wanted) {
  REQUIRE(got.levels.size() == wanted.levels.size());
  CHECK(got.levels == wanted.levels);
  CHECK(got.field.samples == wanted.field.samples);
  const auto& levels = got.levels.at(0);
  CHECK(*std::max_element(levels.begin(), levels.end()) >
        *std::min_element(levels.begin(), levels.end()));
}

}  // namespace

DEVICE_TEST(
    "as on an FPGA, one work-item computes the bits that a launch of an item for each packet "
    "does") {
  const Folder folder;
  auto scene = small_scene(folder);
  auto& spy = opencl_spy();
  const std::map<WrpPropagation, std::set<std::string>> kernels{
      {WrpPropagation::compact, {"gather_compact", "finish", "encode"}},
      {WrpPropagation::spectrum, {"gather", "pad", "multiply_add", "crop", "encode"}}};
  for (const auto& [way, names] : kernels) {
    INFO(name_of(way));
    scene.wrp.propagation = way;
    RenderOptions options;
    options.fft = cl::FftBackend::vkfft;
    const auto wanted = render(cl::Device(as(cl::DeviceKind::gpu, device.info())), scene, options);
    CHECK((wanted.plan.virtual_planes() != nullptr) == (way == WrpPropagation::compact));
    spy.launched_alone.clear();
    check_same(render(cl::Device(as(cl::DeviceKind::accelerator, device.info())), scene, options),
               wanted);
    for (const auto& name : names) {
      INFO(name);
      CHECK(spy.launched_alone.contains(name));
    }
  }
}

DEVICE_TEST(
    "two devices, the second with the binary of one source alone, compute what one device does") {
  const Folder folder;
  auto scene = small_scene(folder);
  scene.sampling.frames = 1;
  auto info = device.info();
  info.float_lanes = cl::fpga_lanes;
  const auto other = as(cl::DeviceKind::accelerator, info);
  RenderOptions options{.fft = cl::FftBackend::host, .keep_field = false};
  const auto wanted = render(cl::Device(info), scene, options);
  REQUIRE(wanted.plan.virtual_planes());

  info.compiles_always = true;
  const auto shared = [&] {
    options.waves_device.emplace(other);
    return render(cl::Device(info), scene, options);
  };
  const auto programs = folder / "programs";
  fs::create_directory(programs);
  {
    const cl::ProgramRecorder recorder;
    check_same(shared(), wanted);
    REQUIRE(recorder.programs().size() == 2);
    const ::cl::Program frame(device.context(), cl::one_source(recorder.programs()));
    frame.build("-cl-std=CL1.2 -cl-kernel-arg-info -w");
    const auto binary = frame.getInfo<CL_PROGRAM_BINARIES>().at(0);
    for (const auto& program : recorder.programs())
      std::ofstream(programs / (program.name() + ".bin"), std::ios::binary)
          .write(reinterpret_cast<const char*>(binary.data()),
                 static_cast<std::streamsize>(binary.size()));
  }
  const Environment ahead(variable, programs.string());
  const auto got = shared();
  check_same(got, wanted);
  CHECK_SAYS(got.notes.back(), "of samples crossed, and", "to the host's FFT and back");

  scene.wrp.propagation = WrpPropagation::spectrum;
  CHECK_THROWS_WITH(shared(), ContainsSubstring("need virtual planes"));
}

}  // namespace raywave
