// SPDX-License-Identifier: Apache-2.0
// The program as a person runs it: exit codes, messages, files.
#include <cctype>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>

#include "host/common/npy.hpp"
#include "host/forecast/tuning.hpp"
#include "host/scene/image.hpp"
#include "host/trace/work_shape.hpp"
#include "tests/support/environment.hpp"
#include "tests/support/program.hpp"

namespace raywave {
namespace {

using Catch::Matchers::Matches;
using Catch::Matchers::StartsWith;
using Json = nlohmann::json;
using namespace test;

std::size_t files_in(const std::filesystem::path& folder) {
  return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(folder),
                                                std::filesystem::directory_iterator()));
}

TEST_CASE(
    "a damaged file of what tune has found stops a render and names itself, and reports state the "
    "shape of a sound one") {
  const Desk desk;
  const Folder cache;
  const Environment variable("RAYWAVE_CACHE_DIR", (cache / "").string());
  const auto info = cl::find_device();
  auto shape = work_shape(info);
  shape.tile_rows = 4;
  store_tuning(info, {{info.name, true, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9}, shape});
  REQUIRE(desk.render().code == 0);
  CHECK(Json::parse(bytes_of(desk.out("report.json")))["device"]["work"]["tile_rows"] == 4);

  shape.lanes = 3;
  store_tuning(info, {{info.name, true, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9, 1e-9}, shape});
  check_refused(desk.render(), 2, tuning_file(info).filename().string() + ": work.lanes: must be ");
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

/// What `raywave COMMAND --help` prints; no command: `raywave --help`. Each is asked for once.
const std::string& help_of(const std::string& command) {
  static std::map<std::string, std::string> known;
  const auto [at, is_new] = known.try_emplace(command);
  if (is_new) {
    const auto outcome = command.empty() ? Desk().run({"--help"}) : Desk().run({command, "--help"});
    INFO(outcome.err);
    REQUIRE((outcome.code == 0 && outcome.err.empty()));
    at->second = outcome.out;
  }
  return at->second;
}

/// Names at the beginning of lines of the program's help.
std::vector<std::string> commands() {
  std::vector<std::string> names;
  for (const auto& line : lines_of(help_of(""))) {
    if (line.size() > 2 && line.starts_with("  ") && std::islower(line[2]))
      names.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  return names;
}

/// "-o", "--output", ...: names at the beginning of lines of a help.
std::vector<std::string> options_in(const std::string& help) {
  std::vector<std::string> names;
  for (const auto& line : lines_of(help)) {
    if (!line.starts_with("  -")) continue;
    std::istringstream words(line);
    for (std::string word; words >> word && word.starts_with('-');) {
      const bool more = word.ends_with(',');
      names.push_back(more ? word.substr(0, word.size() - 1) : word);
      if (!more) break;
    }
  }
  return names;
}

TEST_CASE("help lists commands by what they are for, and each command's ends with an example") {
  for (const char* text : {"Make a hologram:", "Look at it:", "Measure:", "Devices:", "Exit codes"})
    CHECK_SAYS(help_of(""), text);
  CHECK(commands().size() == 22);
  for (const auto& command : commands()) {
    const auto& help = help_of(command);
    INFO(help);
    CHECK_SAYS(help, "Usage: raywave " + command + " ");
    CHECK_SAYS(help, "\nOutput:\n");
    const auto example = help.find("\nExample:\n");
    REQUIRE(example != std::string::npos);
    CHECK(help.find("build/raywave " + command, example) != std::string::npos);
    for (const auto& line : lines_of(help)) CHECK(line.size() <= 100);
  }
}

TEST_CASE("every command that reports something takes --json and --quiet") {
  for (const auto& command : commands()) {
    if (command == "completion") continue;
    const auto names = options_in(help_of(command));
    INFO(command);
    for (const char* name : {"--json", "--quiet"})
      CHECK(std::find(names.begin(), names.end(), name) != names.end());
  }
}

TEST_CASE("--json prints JSON alone, and with a file the usual text beside it") {
  const Desk desk;
  const auto scene = desk.file("scene.toml"), field = desk.out("field.npy").string();
  REQUIRE(desk.render({"--quiet"}).code == 0);
  // Not kernels, trade and tune, which take longer.
  const std::vector<std::vector<std::string>> lines{
      {"plan", "--json", scene},
      {"reconstruct", field, "-z", "10mm", "-o", desk.file("views"), "--json"},
      {"lens", scene, "-z", "10mm", "-o", desk.file("views"), "--lens-points", "2", "--json"},
      {"compare", "--json", field, field},
      {"refine", scene, "-z", "10mm", "-o", desk.file("refined"), "--no-table", "--json"},
      {"quality", scene, "-z", "10mm", "-o", desk.file("views"), "--no-views", "--lens-points", "2",
       "--border", "0", "--json"},
      {"bench", "--json", scene, "--quick", "--frames", "1", "--preset", "draft"},
      {"devices", "--json"},
      {"selftest", "--only", "phase ", "--json"}};
  for (const auto& line : lines) {
    const auto outcome = desk.run(line);
    INFO(line[0] << ": " << outcome.out << outcome.err);
    CHECK(outcome.code == 0);
    CHECK(has_notes_alone(outcome.err));
    CHECK(Json::accept(outcome.out));
  }
  const auto text = desk.run({"plan", scene}).out;
  for (const std::vector<std::string>& option :
       {std::vector<std::string>{"--json", desk.file("report.json")},
        {"--json=" + desk.file("report")}}) {
    std::vector<std::string> line{"plan"};
    line.insert(line.end(), option.begin(), option.end());
    line.push_back(scene);
    const auto outcome = desk.succeed(line);
    CHECK(outcome.out == text);
  }
  CHECK(Json::parse(bytes_of(desk.file("report.json"))).contains("plan"));
  CHECK(bytes_of(desk.file("report")) == bytes_of(desk.file("report.json")));
  check_refused(desk.run({"devices", "--quiet", "--json", scene + "/report.json"}), 2, scene);
}

TEST_CASE("bench wants as many holograms a second as a rate of pictures takes") {
  const Desk desk;
  const auto outcome =
      desk.succeed({"bench", "--json", desk.file("scene.toml"), "--quick", "--frames", "1",
                    "--rate", "0.5", "--set", "sampling.frames=3"});
  const auto row = Json::parse(outcome.out)["rows"][0];
  CHECK(row["scene"]["holograms_per_frame"] == 3);
  CHECK(row["required_per_s"] == 1.5);
}

TEST_CASE("refine writes a hologram that reconstruct reads, and goes on where it ended") {
  const Desk desk;
  const auto scene = desk.file("scene.toml"), out = desk.file("out"), more = desk.file("more");
  const auto first = desk.run({"refine", scene, "-o", out, "--set", "sampling.frames=2", "--border",
                               "2", "--lens-points", "3", "--iterations", "6"});
  INFO(first.out << first.err);
  REQUIRE(first.code == 0);
  for (const char* text : {"optimised", "held out", "view", "light", "6 iterations"})
    CHECK_SAYS(first.out, text);
  for (const char* name : {"hologram.png", "hologram_2.png", "refined.npy", "report.json"})
    CHECK(std::filesystem::exists(desk.out(name)));
  CHECK(files_in(out) == 4);
  const auto report = Json::parse(bytes_of(desk.out("report.json")));
  for (const auto& row : report["refine"]["rows"]) {
    if (row["role"] == "optimised") CHECK(row["psnr_db"]["refined"] > row["psnr_db"]["unrefined"]);
  }
  desk.succeed({"reconstruct", out + "/hologram.png", "-z", "10mm", "-o", more});

  // A scene that asks for it, by render
  const auto rendered = desk.render({"--set", "refine.iterations=6", "--quiet"});
  INFO(rendered.err);
  CHECK(rendered.code == 0);
  CHECK(std::filesystem::exists(desk.out("refined.npy")));
  const auto again = desk.run({"encode", desk.out("report.json"), "-o", desk.file("again")});
  CHECK_SAYS(again.err, "refined are encoded");
  CHECK_SAYS(desk.run({"quality", desk.out("report.json").string(), "-o", more, "--no-views",
                       "--lens-points", "1", "--border", "0"})
                 .out,
             "levels by phase\n");
  CHECK(bytes_of(desk.file("again/hologram.png")) == bytes_of(desk.out("hologram.png")));
  CHECK_SAYS(desk.run({"encode", desk.out("field.npy"), "-o", desk.file("again")}).err,
             "before its phases were refined");
  CHECK(Json::parse(bytes_of(desk.out("report.json")))["scene"]["slm"]["encoding"] == "phase");
  desk.succeed({"reconstruct", desk.out("report.json").string(), "-z", "10mm", "-o", more});
  desk.succeed({"refine", scene, "-o", out, "--set", "sampling.frames=2", "--no-table",
                "--iterations", "6", "--quiet"});

  // Further, from the scene and from pictures of a lens
  desk.succeed({"refine", scene, "-o", more, "--set", "sampling.frames=2", "--start",
                out + "/refined.npy", "--no-table", "--budget", "50ms", "--views", "2",
                "--brighter"});
  desk.succeed(
      {"lens", scene, "-z", "9.8mm", "-z", "10mm", "-o", desk.file("lens"), "--lens-points", "3"});
  const auto field = desk.run({"refine", out + "/refined.npy", "--targets", desk.file("lens"), "-o",
                               more, "--border", "2", "--iterations", "3"});
  INFO(field.out << field.err);
  CHECK(field.code == 0);
  CHECK_SAYS(field.out, "9.8 mm");
  CHECK(load_npy(more + "/refined.npy").frames == 2);
}

TEST_CASE("impossible refinements get one line, and nothing is written") {
  const Desk desk;
  const auto scene = desk.file("scene.toml"), none = desk.file("none");
  const auto refused = [&](std::vector<std::string> line, const std::string& says) {
    line.insert(line.begin(), "refine");
    line.insert(line.end(), {"-o", none});
    check_refused(desk.run(line), 2, says);
    CHECK_FALSE(std::filesystem::exists(none));
  };
  REQUIRE(desk.render({"--quiet"}).code == 0);
  const auto field = desk.out("field.npy").string();
  refused({desk.file("none.toml")}, "none.toml");
  refused({field}, "--targets");
  refused({field, "--targets", desk.file("out"), "--border", "0"}, "raywave lens");
  refused({field, "--targets", desk.file("out"), "--views", "3"}, "--views");
  refused({scene, "--targets", desk.file("out")}, "--targets");
  refused({scene, "--iterations", "3", "--budget", "1s"}, "--budget");
  refused({scene, "--iterations", "0"}, "--iterations");
  refused({scene, "--border", "20"}, "border");
  refused({scene, "--set", "sampling.frames=2", "--start", field, "--no-table"}, "1 frame");
}

TEST_CASE("shell completion offers every command and option, and the values that there are") {
  const Desk desk;
  const auto bash = desk.succeed({"completion", "bash"}), zsh = desk.run({"completion", "zsh"});
  CHECK(zsh.code == 0);
  check_refused(desk.run({"completion", "fish"}), 2, "there are bash and zsh");
  desk.folder().write("completion.bash", bash.out);
  std::filesystem::create_directory(desk.file("folder"));

  // One line of `wanted` for each line of the program below: the words typed, and replies.
  std::vector<std::pair<std::string, std::vector<std::string>>> wanted{
      {"raywave ", commands()},
      {"raywave -", options_in(help_of(""))},
      {"raywave rend", {"render"}},
      {"raywave plan --pres", {"--preset"}},
      {"raywave plan --preset ", {"draft", "balanced", "accurate", "reference"}},
      {"raywave plan x.toml --preset=d", {"draft"}},  // readline replaces what follows '='
      {"raywave render --fft ", {"host", "clfft", "vkfft"}},
      {"raywave render --method ", {"wrp", "points", "rays"}},
      {"raywave render sc", {"scene.toml"}},
      {"raywave render ", {"scene.toml", "folder"}},
      {"raywave render x.toml -o ", {"folder"}},
      {"raywave render --set a.b=", {}},
      {"raywave plan --json s", {"scene.toml"}},
      {"raywave compare sq", {"square.obj"}},
      {"raywave completion ", {"bash", "zsh"}},
      {"raywave pattern ", {"lens", "blaze", "checker", "ramp"}},
      {"raywave encode --format rgb", {"rgb-24x1", "rgb-12x2", "rgb-8x3", "rgb-6x4"}},
      {"raywave bench --suite ", {"cpu", "gpu", "paper", "scaling"}}};
  for (const auto& command : commands()) {
    const auto options = options_in(help_of(command));
    wanted.push_back({"raywave " + command + " -", options});
    INFO(command);
    CHECK(options.size() >= 2);
    CHECK_SAYS(zsh.out, "    '" + command + ":");
    const auto from = zsh.out.find("        " + command + ")\n");
    REQUIRE(from != std::string::npos);
    const auto part = zsh.out.substr(from, zsh.out.find(";;", from) - from);
    for (const auto& option : options)
      CHECK((part.find(")" + option + "[") != std::string::npos ||
             part.find(")" + option + "=") != std::string::npos ||
             part.find("*" + option + "[") != std::string::npos ||
             part.find("*" + option + "=") != std::string::npos));
  }

  std::string script = "cd '" + desk.file("") +
                       "' && source ./completion.bash || exit 1\n"
                       "replies() {\n  COMP_LINE=$1 COMP_POINT=${#1}\n  _raywave\n"
                       "  printf '%s ' \"${COMPREPLY[@]}\"\n  echo\n}\n";
  for (const auto& [typed, replies] : wanted) script += "replies '" + typed + "'\n";
  desk.folder().write("replies.bash", script);
  const auto out = desk.file("replies");
  if (std::system("command -v bash >/dev/null") != 0) return;
  REQUIRE(std::system(("bash '" + desk.file("replies.bash") + "' >'" + out + "'").c_str()) == 0);
  const auto lines = lines_of(bytes_of(out));
  REQUIRE(lines.size() == wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    std::istringstream words(lines[i]);
    std::vector<std::string> replies(std::istream_iterator<std::string>(words), {});
    auto [typed, all] = wanted[i];
    std::sort(replies.begin(), replies.end());
    std::sort(all.begin(), all.end());
    INFO(typed);
    CHECK(replies == all);
  }
}

TEST_CASE("render writes the hologram, the field and the report, and nothing else") {
  const Desk desk;
  const auto outcome = desk.render();
  REQUIRE(outcome.code == 0);
  CHECK(has_notes_alone(outcome.err));  // no progress where there is no terminal
  CHECK_SAYS(outcome.out, "48 x 32");
  CHECK_SAYS(outcome.out, "hologram.png");
  CHECK(files_in(desk.out("")) == 3);

  const auto png = bytes_of(desk.out("hologram.png"));
  REQUIRE(png.size() > 26);
  CHECK(png.substr(1, 3) == "PNG");
  CHECK(png[24] == 8);  // bits
  CHECK(png[25] == 0);  // grey
  const auto levels = load_levels(desk.out("hologram.png"), "");
  CHECK(levels.width == 48);
  CHECK(levels.height == 32);

  const auto field = load_npy(desk.out("field.npy"));
  CHECK(field.nx == 48);
  CHECK(field.ny == 32);
  CHECK(field.frames == 1);
  for (const std::size_t i : {std::size_t{0}, std::size_t{777}, field.samples.size() - 1}) {
    // Double phase: at most a quarter of a turn to either side
    const double turns = std::arg(field.samples[i]) / (2 * std::numbers::pi),
                 level = levels.pixels[i] * 255.0;
    CHECK(std::abs(std::remainder(turns * 256 - level, 256)) <= 64.501);
  }

  const auto report = Json::parse(bytes_of(desk.out("report.json")));
  for (const char* key : {"raywave", "scene", "plan", "device", "seed", "seconds", "peak_memory"})
    CHECK(report.contains(key));
  CHECK(report["scene"]["hologram"]["resolution"] == Json{48, 32});
  CHECK(report["scene"]["hologram"]["pitch_m"][0].get<double>() == Catch::Approx(4e-6));
  CHECK(report["seed"] == 1);
  for (const char* key : {"name", "platform", "driver", "version", "fft"})
    CHECK_FALSE(report["device"][key].get<std::string>().empty());
  for (const char* key : {"meshes", "tree", "prepare", "trace", "propagate", "encode"})
    CHECK(report["seconds"][key].get<double>() >= 0);
  CHECK(report["peak_memory"]["host_bytes"].get<double>() > 1e6);
  CHECK(report["peak_memory"]["device_bytes"].get<double>() > 0);
  CHECK(report["accuracy"]["precision"] == "float");
  CHECK(report["accuracy"]["kept"] == true);
  const auto& predicted = report["accuracy"]["predicted_phase_error_turns"];
  CHECK(predicted["float"]["total"].get<double>() > 0);
  CHECK(predicted["double"]["total"].get<double>() <= predicted["float"]["total"].get<double>());
  CHECK(report["plan"]["propagation"] == "compact");
  CHECK(report["plan"]["wrps"].size() == 1);
}

TEST_CASE("render says over how many planes light travelled, and which stages took the time") {
  const Desk desk;
  const auto line_of = [&](const std::vector<std::string>& more) {
    const auto outcome = desk.render(more);
    REQUIRE(outcome.code == 0);
    return outcome.out.substr(0, outcome.out.find('\n'));
  };
  CHECK_THAT(line_of({}), Matches("48 x 32 hologram over 1 virtual plane in [0-9.]+ s "
                                  "\\([a-z]+ [0-9.]+ s(, [a-z]+ [0-9.]+ s)*\\) on .*"));
  CHECK_THAT(line_of({"--set", "wrp.grid=[2,1]", "--set", "wrp.propagation=spectrum"}),
             StartsWith("48 x 32 hologram over "));
  CHECK_THAT(line_of({"--method", "points"}), StartsWith("48 x 32 hologram in "));
}

TEST_CASE("frames and WRPs are written when asked for") {
  const Desk desk;
  REQUIRE(desk.render({"--set", "sampling.frames=2", "--set", "wrp.grid=[2, 1]", "--set",
                       "wrp.propagation=spectrum", "--save-wrps", "--quiet"})
              .code == 0);
  CHECK(load_npy(desk.out("field.npy")).frames == 2);
  for (const char* name :
       {"hologram.png", "hologram_2.png", "wrp_1.npy", "wrp_2.npy", "report.json"})
    CHECK(std::filesystem::exists(desk.out(name)));
  CHECK(bytes_of(desk.out("hologram.png")) != bytes_of(desk.out("hologram_2.png")));
  CHECK(load_npy(desk.out("wrp_2.npy")).frames == 2);
}

TEST_CASE("a hologram in tiles is reported as such, and no field is written where none is wanted") {
  const Desk desk;
  REQUIRE(desk.render({"--set", "hologram.tiles=[2, 3]", "--no-field", "--quiet"}).code == 0);
  CHECK_FALSE(std::filesystem::exists(desk.out("field.npy")));
  CHECK(std::filesystem::exists(desk.out("hologram.png")));
  const auto plan = Json::parse(bytes_of(desk.out("report.json")))["plan"];
  CHECK(plan["tiles"] == Json::array({2, 3}));
  CHECK(plan["why_tiles"] == "given");
  CHECK(plan["wrps"].back()["tile"] == 5);
}

TEST_CASE("--set changes what is computed and what is reported") {
  const Desk desk;
  REQUIRE(desk.render({"--set", "sampling.seed=7", "--set", "wrp.padding=1.5", "--set",
                       "object.0.width=0.1 mm", "--quiet"})
              .code == 0);
  const auto changed = bytes_of(desk.out("field.npy"));
  const auto report = Json::parse(bytes_of(desk.out("report.json")));
  CHECK(report["seed"] == 7);
  CHECK(report["scene"]["wrp"]["padding"] == 1.5);
  CHECK(report["scene"]["objects"][0]["width_m"].get<double>() == Catch::Approx(1e-4));
  REQUIRE(desk.render({"--quiet"}).code == 0);
  CHECK(bytes_of(desk.out("field.npy")) != changed);
}

TEST_CASE("--json prints the report, --quiet prints nothing") {
  const Desk desk;
  const auto json = desk.render({"--json"});
  CHECK(json.code == 0);
  CHECK(has_notes_alone(json.err));
  CHECK(json.out == bytes_of(desk.out("report.json")));
  CHECK(Json::parse(json.out).contains("plan"));
  const auto quiet = desk.render({"--quiet"});
  CHECK(quiet.code == 0);
  CHECK(quiet.out.empty());
  CHECK(quiet.err.empty());
}

TEST_CASE(
    "mistakes in a scene get one line with file and line, exit code 2, and nothing is written") {
  Desk desk;
  const auto scene = desk.file("scene.toml");
  const auto refused = [&](const std::string& more, const std::string& says) {
    desk.scene(more);
    check_refused(desk.render(), 2, says);
    CHECK_FALSE(desk.has_output());
  };
  refused("[wrp]\npading = 2\n", scene + ":13: ");
  refused("[wrp]\npadding = \"much\"\n", scene + ":13: ");
  refused("[wrp]\npadding = -1\n", scene + ":13: ");
  refused("[[object]]\nmesh = \"none.obj\"\n", scene + ":13: ");
  refused("this is no TOML\n", scene + ":12");
  refused(
      "[materials.x]\ntexture = \"none.png\"\n[[object]]\nmesh = \"square.obj\"\nmaterial = "
      "\"x\"\nposition = [0, 0, 1]\n",
      scene + ":13: ");
  desk.folder().write("empty.obj", "# nothing\n");
  refused("[[object]]\nmesh = \"empty.obj\"\n", scene + ":12: ");
  desk.folder().write("nan.obj", "v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  refused("[[object]]\nmesh = \"nan.obj\"\n", scene + ":12: ");
  desk.scene("");
  for (const auto& set : {"hologram.pitch=-1 um", "hologram.wavelength=0", "sampling.nothing=1",
                          "nonsense", "hologram.resolution=[0, 5]"}) {
    check_refused(desk.render({"--set", set}), 2, "--set");
    CHECK_FALSE(desk.has_output());
  }
  check_refused(desk.run({"render", desk.file("none.toml"), "-o", desk.file("out")}), 2,
                "none.toml");
  CHECK_FALSE(desk.has_output());
}

TEST_CASE("mistakes on the command line get one line and exit code 2") {
  const Desk desk;
  const auto alone = desk.succeed({});
  CHECK(alone.out == desk.run({"--help"}).out);
  check_refused(desk.run({"plan", "square.obj"}), 2,
                "square.obj: is a mesh, and a scene is needed: raywave new square.obj");
  for (const auto& [file, what] :
       {std::pair("out/hologram.png", "picture"), {"field.npy", "field"}, {"r.json", "report"}})
    check_refused(desk.run({"plan", file}), 2,
                  std::string(file) + ": is a " + what + ", and a scene is needed");
  check_refused(desk.run({"--nonsense"}), 2, "--nonsense");
  check_refused(desk.run({"render", desk.file("scene.toml")}), 2, "--output");
  check_refused(desk.render({"--nonsense"}), 2, "--nonsense");
  check_refused(desk.render({"second.toml"}), 2, "second.toml");
  check_refused(desk.render({"--rays", "0"}), 2, "--rays");
  check_refused(desk.render({"--method", "magic"}), 2, "magic");
  check_refused(desk.render({"--fft", "magic"}), 2, "magic");
  check_refused(desk.render({"--psnr", "x"}), 2, "--psnr must be 0 to 200, got \"x\"");
  for (const char* text : {"nan", "inf", "-1", ""})
    check_refused(desk.render({"--psnr", text}), 2,
                  "--psnr must be 0 to 200, got \"" + std::string(text) + "\"");
  check_refused(desk.render({"--budget", ""}), 2, "--budget: a value is needed");
  check_refused(desk.render({"-o", "second"}), 2, "--output can be given once, not 2 times");
  check_refused(desk.render({"--budget"}), 2, "--budget needs a value: TIME");
  check_refused(desk.run({"plan", "a\u2028b\u009bc\u202ed\u2066e\u2027f"}), 2,
                "a?b?c?d?e\u2027f: there is no such file");
  check_refused(desk.run({"compare", "a", "b", "--border", "1mm"}), 2,
                "--border must be a number, got \"1mm\"");
  check_refused(desk.run({"compare", "a", "b", "--region", "1,2"}), 2, "--region takes 4 values");
  check_refused(desk.run({"reconstruct", "a.npy", "b.npy", "-z", "1mm", "-o", desk.file("out")}), 2,
                "one field (.npy) at a time");
  CHECK_FALSE(desk.has_output());
}

TEST_CASE("an unknown name is answered with the nearest one that exists") {
  const Desk desk;
  check_refused(desk.run({"rendr"}), 2, "did you mean render?");
  check_refused(desk.render({"--presett", "draft"}), 2, "did you mean --preset?");
  check_refused(desk.render({"--preest=draft"}), 2, "did you mean --preset?");
  check_refused(desk.run({"render", desk.file("scene.toml"), "--ouput", desk.file("out")}), 2,
                "did you mean --output?");
  check_refused(desk.run({"lens", desk.file("scene.toml"), "-z", "0mm", "-o", desk.file("out")}), 2,
                "where a lens in the hologram's plane cannot focus");
  check_refused(desk.run({"bench", "--preset", "draft"}), 2, "goals are for a scene");
  check_refused(desk.run({"lens", desk.file("scene.toml"), "--lens", "3"}), 2,
                "did you mean --lens-points?");
  CHECK_FALSE(desk.has_output());
}

TEST_CASE("a device that is not there gets one line, exit code 3, and nothing is written") {
  const Desk desk;
  check_refused(desk.render({"--device", "no such device"}), 3, "no such device");
  check_refused(desk.render({"--device", "99:0"}), 3, "99:0");
  setenv("RAYWAVE_DEVICE", "not this one", 1);
  check_refused(desk.render(), 3, "not this one");
  unsetenv("RAYWAVE_DEVICE");
  CHECK_FALSE(desk.has_output());
}

TEST_CASE(
    "an output folder that cannot be written gets one line, exit code 2, and nothing is left "
    "half-written") {
  const Desk desk;
  desk.folder().write("taken", "a file");
  const auto before = desk.folder().count();
  check_refused(desk.run({"render", desk.file("scene.toml"), "-o", desk.file("taken")}), 2,
                "taken");
  check_refused(desk.run({"render", desk.file("scene.toml"), "-o", desk.file("taken/sub")}), 2,
                "taken");
  CHECK(bytes_of(desk.folder() / "taken") == "a file");
  CHECK(desk.folder().count() <= before + 2);  // stdout and stderr of the runs
  CHECK_FALSE(desk.has_output());
}

}  // namespace
}  // namespace raywave
