// SPDX-License-Identifier: Apache-2.0
// One command on several devices: here a CPU that PoCL lists twice.
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "cl/device.hpp"
#include "host/common/child_program.hpp"
#include "tests/animate/films.hpp"

namespace raywave {
namespace {

using namespace test;
using Json = nlohmann::json;
using Words = std::vector<std::string>;

/// A desk on which PoCL's device has the indices `first` and `second`.
struct TwoDevices : Desk {
  TwoDevices() {
    for (const auto& device : cl::list_devices())
      if (cl::is_pocl(device)) platform = device.index.substr(0, device.index.find(':'));
    REQUIRE_FALSE(platform.empty());
    first = platform + ":0";
    second = platform + ":1";
    both = first + "," + second;
  }

  Words animate(const std::string& out, const std::string& device, const Words& more = {}) const {
    Words words{"animate", file("scene.toml"), "-o", file(out), "--device", device};
    words.insert(words.end(), {"--no-video", "--no-preview"});
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  Json made(Words words) const {
    words.insert(words.end(), {"--json", "-"});
    const auto outcome = run(words, environment());
    INFO(outcome.err);
    REQUIRE(outcome.code == 0);
    return Json::parse(outcome.out);
  }

  Words environment(const std::string& devices = "pthread pthread") const {
    return {"POCL_DEVICES=" + devices, "RAYWAVE_DEVICE=" + first};
  }

  std::string platform, first, second, both;
};

void film(TwoDevices& desk, int pictures, const std::string& more = "") {
  std::string lines(moving_lines);
  lines.replace(lines.find("frames = 7"), 10, "frames = " + std::to_string(pictures));
  desk.scene(lines + more);
}

int lines_of(const std::filesystem::path& report) {
  int whole = 0;
  std::istringstream lines(bytes_of(report));
  for (std::string line; std::getline(lines, line);)
    whole += Json::parse(line, nullptr, false).is_object() ? 1 : 0;
  return whole;
}

/// The processes that another one has started, by their devices.
std::map<std::string, pid_t> helpers_of(pid_t program) {
  std::map<std::string, pid_t> helpers;
  const auto id = std::to_string(program);
  std::ifstream children("/proc/" + id + "/task/" + id + "/children");
  for (pid_t child = 0; children >> child;) {
    const auto words = bytes_of("/proc/" + std::to_string(child) + "/cmdline");
    const auto device = words.find(std::string("--device") + '\0');
    if (device != std::string::npos) helpers[words.c_str() + device + 9] = child;
  }
  return helpers;
}

TEST_CASE("a film that two devices share is, bit for bit, that of one", "[slow]") {
  TwoDevices desk;
  film(desk, 80);
  desk.made(desk.animate("one", desk.first));
  auto shared = desk.made(desk.animate("shared", desk.both));
  CHECK(shared.at("pictures") == 80);
  // On a busy machine one may be done before the other has begun
  for (int i = 0; i < 10 && (shared.at("by_device").at(desk.first) == 0 ||
                             shared.at("by_device").at(desk.second) == 0);
       ++i)
    shared = desk.made(desk.animate("shared", desk.both, {"--restart"}));
  const int first = shared.at("by_device").at(desk.first),
            second = shared["by_device"].at(desk.second);
  CHECK(first > 0);
  CHECK(second > 0);
  CHECK(first + second == 80);
  CHECK((files_of(desk.file("shared")) == files_of(desk.file("one"))));
  CHECK(desk.made(desk.animate("shared", desk.both)).at("pictures_found") == 80);

  SECTION("as a stream, and part by part") {
    desk.made(desk.animate("stream", desk.first, {"--stream"}));
    CHECK(desk.made(desk.animate("parts", "all", {"--stream", "--pictures", "70..79"}))
              .at("pictures") == 10);
    CHECK(desk.made(desk.animate("parts", "all", {"--stream"})).at("pictures") == 70);
    CHECK((files_of(desk.file("parts")) == files_of(desk.file("stream"))));
  }
  SECTION("of three lasers, anew") {
    const Words three{"--set", R"(hologram.wavelength=["638 nm", "520 nm", "450 nm"])"};
    auto anew = three;
    anew.emplace_back("--restart");
    film(desk, 7);
    desk.made(desk.animate("colour", desk.first, three));
    desk.made(desk.animate("shared", desk.both, anew));
    CHECK((files_of(desk.file("shared")) == files_of(desk.file("colour"))));
  }
}

TEST_CASE("tiles that two devices share are, bit for bit, those of one") {
  TwoDevices desk;
  const auto render = [&](const std::string& out, const std::string& device) {
    return desk.made({"render", desk.file("scene.toml"), "-o", desk.file(out), "--device", device,
                      "--tiles", "all", "--set", "hologram.resolution=[144,96]", "--set",
                      "hologram.tiles=[6,4]"});
  };
  render("one", desk.first);
  const auto shared = render("shared", desk.both);
  CHECK(shared.at("tiles") == 24);
  CHECK(shared.at("processor_seconds").at("trace") > 0);
  CHECK((files_of(desk.file("shared")) == files_of(desk.file("one"))));
}

TEST_CASE("where a device's process dies, whole pictures stay, and the others end, too") {
  TwoDevices desk;
  film(desk, 150);
  desk.made(desk.animate("one", desk.first));
  const auto report = desk.file("shared/report.jsonl");
  const auto words = desk.animate("shared", desk.both, {"--quiet"});

  auto program = desk.start(words, desk.environment());
  REQUIRE(waits_for([&] { return lines_of(report) >= 10; }));
  auto helpers = helpers_of(program);
  REQUIRE(helpers.size() == 2);
  kill(helpers.at(desk.second), SIGKILL);
  check_refused(desk.outcome_of(program), 3, "device " + desk.second + " pthread");
  CHECK_SAYS(bytes_of(desk.file("stderr")), "was ended by signal 9; what was made stays");
  CHECK(kill(helpers.at(desk.first), 0) != 0);
  const int before = lines_of(report);
  CHECK(before < 150);

  // The command itself
  program = desk.start(words, desk.environment());
  REQUIRE(waits_for([&] { return lines_of(report) >= before + 10; }));
  helpers = helpers_of(program);
  REQUIRE(helpers.size() == 2);
  kill(program, SIGTERM);
  CHECK(desk.outcome_of(program).code == -1);
  for (const auto& [device, helper] : helpers)
    CHECK(waits_for([&, id = helper] { return kill(id, 0) != 0; }));
  const int after = lines_of(report);
  CHECK(after < 150);

  CHECK(desk.made(desk.animate("shared", desk.both)).at("pictures_found") == after);
  CHECK((files_of(desk.file("shared")) == files_of(desk.file("one"))));
}

TEST_CASE("devices that cannot share a command are refused in plain words") {
  TwoDevices desk;
  film(desk, 7);
  const auto refused = [&](const Words& words, int code, const std::string& says,
                           const std::string& devices = "pthread pthread") {
    check_refused(desk.run(words, desk.environment(devices)), code, says);
    CHECK_FALSE(std::filesystem::exists(desk.file("out")));
  };
  const auto scene = desk.file("scene.toml"), out = desk.file("out");
  refused(desk.animate("out", desk.first + "," + desk.first), 2, "is named twice");
  refused(desk.animate("out", desk.first + ",," + desk.second), 2, "missing between commas");
  refused(desk.animate("out", desk.first + ",99:0"), 3, "no such device; there are");
  refused(desk.animate("out", desk.both), 2, "differ, and their holograms would", "basic pthread");
  refused(desk.animate("out", desk.both), 3, "no such device", "pthread");
  const auto needs_one = "this needs one device; animate and render --tiles take several";
  refused({"render", scene, "-o", out, "--device", "all"}, 2, needs_one);
  for (const auto& words : {Words{"plan", scene}, {"units", scene}, {"tune"}, {"devices"}}) {
    auto with = words;
    with.insert(with.end(), {"--device", desk.both});
    refused(with, 2, needs_one);
  }
  // A queue of helpers that another program wrote
  const auto numbers = desk.file("numbers");
  std::ofstream(numbers, std::ios::binary) << std::string(64, '\x7f');
  const int queue = ::open(numbers.c_str(), O_RDONLY | O_CLOEXEC);
  ChildProgram helper(RAYWAVE_PROGRAM, {"animate", scene, "-o", out, "--pictures", "-"}, ".",
                      ChildProgram::Held::output, queue);
  ::close(queue);
  const int status = helper.end();
  CHECK(WIFEXITED(status));
  CHECK(WEXITSTATUS(status) == 2);
  CHECK_SAYS(helper.said(), "standard input is no queue of another raywave's pictures");
  // Devices that are unlike the default one are none of `all`
  CHECK(desk.run(desk.animate("out", "all"), desk.environment("pthread basic")).code == 0);
}

}  // namespace
}  // namespace raywave
