// SPDX-License-Identifier: Apache-2.0

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <nlohmann/json.hpp>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/evaluate/bench/bench.hpp"
#include "host/evaluate/built_in_meshes.hpp"

extern char** environ;

namespace raywave {
namespace {

std::string grid_text(glm::ivec2 grid) {
  return std::to_string(grid.x) + "x" + std::to_string(grid.y);
}
std::string wrps_text(glm::ivec2 grid) {
  return grid == glm::ivec2(1) ? "1 WRP" : grid_text(grid) + " WRPs";
}

/// Target rates for coarse and for fine samples; each on 1 WRP and on 2 x 2 WRPs.
struct Targets {
  BenchTarget coarse[2], fine[2];
};

/// Frames over virtual planes. Plain FFTW's two transforms of one WRP tell how fast the machine is.
void add_compact(const std::filesystem::path& data, BenchSuite& suite) {
  struct Row {
    const char* name;
    const char* file;
    std::vector<std::string> set;
    double at_most, aim;
  };
  const Row rows[] = {{"teapot, 1 WRP, p 100 um", "teapot.toml", {"wrp.grid=[1, 1]"}, 0.25, 0.16},
                      {"teapot, 2x2 WRPs, p 100 um", "teapot.toml", {"wrp.grid=[2, 2]"}, 0.3, 0.2},
                      {"teapot, 2x2 WRPs, p 25 um",
                       "teapot.toml",
                       {"wrp.grid=[2, 2]", "sampling.pitch=25 um"},
                       1.5,
                       1},
                      {"teapot 20 mm, p 100 um", "teapot_20mm.toml", {}, 0.45, 0.3}};
  for (auto row : rows) {
    BenchCase c;
    c.group = "frames";
    c.name = std::string(row.name) + ", compact";
    row.set.push_back("wrp.propagation=compact");
    c.scenes = load_scenes(data / row.file, row.set);
    suite.ratios.push_back(
        {c.name + ", over plain FFTW", c.name, "plain FFTW 2-D, 1 WRP", row.at_most, row.aim});
    suite.cases.push_back(std::move(c));
  }
}

/// The teapot, 12.5 mm wide, with 1 WRP and with 2 x 2 WRPs.
BenchSuite frames_suite(const std::string& name, const std::filesystem::path& data,
                        const Targets& targets) {
  BenchSuite suite{name, {}, {}, {}};
  for (const double pitch_m : {1e-4, 25e-6}) {
    for (const double padding : {2.0, 1.25}) {
      std::vector<std::string> names;
      for (const int side : {1, 2}) {
        BenchCase c;
        c.group = "frames";
        c.scenes = load_scenes(data / "teapot.toml");
        c.scenes[0].wrp.grid = glm::ivec2(side);
        c.scenes[0].wrp.padding = padding;
        c.scenes[0].sampling.pitch_m = pitch_m;
        c.name = "teapot, " + wrps_text(glm::ivec2(side)) + ", p " + length_text(pitch_m) +
                 ", padding " + number_text(padding);
        c.target = (pitch_m < 5e-5 ? targets.fine : targets.coarse)[side - 1];
        names.push_back(c.name);
        suite.cases.push_back(std::move(c));
      }
      suite.ratios.push_back(
          {"2x2 over 1 WRP, p " + length_text(pitch_m) + ", padding " + number_text(padding),
           names[1], names[0], 3, 2.5});
    }
  }
  add_compact(data, suite);
  for (const int side : {1, 2}) {
    const auto wrps = wrps_text(glm::ivec2(side)), peer = "Embree + FFTW, " + wrps;
    const std::string file = (data / "teapot.toml").string(),
                      set = "wrp.grid=[" + std::to_string(side) + ", " + std::to_string(side) + "]";
    suite.peers.push_back({peer,
                           "peer_embree_fftw",
                           {file, "--set", set, "--name", peer},
                           5,
                           2,
                           load_scenes(file, {set}).front()});
    for (const char* padding : {"2", "1.25"})
      suite.ratios.push_back({"raywave over " + peer + ", padding " + padding,
                              "teapot, " + wrps + ", p 100 um, padding " + padding, peer, 1.0 / 3,
                              1.0 / 6});
  }
  suite.peers.push_back({"propagation", "bench_propagation", {"--json"}, 21, 5});
  for (const char* wrps : {"1 WRP", "4 WRPs"}) {
    for (const char* padding : {"2", "1.25"}) {
      suite.ratios.push_back({std::string("propagation, ") + wrps + ", padding " + padding +
                                  ", over plain FFTW's at 2",
                              std::string("propagation, ") + wrps + ", padding " + padding,
                              std::string("plain FFTW 2-D, ") + wrps,
                              padding[1] ? 1.0 / 5 : 1.0 / 2, 0});
    }
  }
  return suite;
}

/// The cases of Table 2, Fig. 8 and Fig. 9 of the paper.
BenchSuite paper_suite(const std::filesystem::path& data) {
  BenchSuite suite{"paper", {}, {}, {}};
  const std::vector<std::pair<std::string, std::string>> objects{
      {"plane", "plane"}, {"animal", "animal"}, {"teapot", "teapot"}};
  for (const auto& object : objects) {
    const auto &name = object.first, &file = object.second;
    BenchCase c;
    c.group = "methods";
    c.scenes = load_scenes(data / (file + ".toml"), {"object.0.width=12.5 mm", "wrp.grid=[2, 2]"});
    const auto add = [&](const std::string& what, Method method, int share, SamplingMode mode,
                         WrpPropagation propagation) {
      c.name = name + ", " + what;
      c.method = method;
      c.share = share;
      c.scenes[0].sampling.mode = mode;
      c.scenes[0].wrp.propagation = propagation;
      suite.cases.push_back(c);
    };
    using enum WrpPropagation;
    add("point by point", Method::points, 8, SamplingMode::aimed, spectrum);
    add("rays without WRP", Method::rays, 120, SamplingMode::aimed, spectrum);
    add("2x2 WRPs, the paper's fans", Method::wrp, 1, SamplingMode::fan, spectrum);
    add("2x2 WRPs, raywave", Method::wrp, 1, SamplingMode::aimed, spectrum);
    add("virtual planes, raywave", Method::wrp, 1, SamplingMode::aimed, compact);
    for (const std::string ours : {"2x2 WRPs", "virtual planes"}) {
      for (const char* base : {"point by point", "rays without WRP", "2x2 WRPs, the paper's fans"})
        suite.ratios.push_back({name + ", raywave over " + ours + " over " + base,
                                name + ", " + ours + ", raywave", name + ", " + base});
    }
  }
  const std::vector<std::pair<std::string, std::string>> wide{{"teapot 20 mm", "teapot_20mm"},
                                                              {"animal 20 mm", "animal_20mm"},
                                                              {"plane 20 mm", "plane"},
                                                              {"plane 100 mm", "plane_100mm"}};
  for (const auto& [name, file] : wide) {
    for (const auto grid : {glm::ivec2(1, 1), glm::ivec2(2, 1), glm::ivec2(3, 1), glm::ivec2(2, 2),
                            glm::ivec2(3, 2), glm::ivec2(4, 2), glm::ivec2(3, 3)}) {
      BenchCase c;
      c.group = "grids";
      c.scenes = load_scenes(data / (file + ".toml"));
      c.scenes[0].wrp.grid = grid;
      c.name = name + ", " + wrps_text(grid);
      c.scenes[0].wrp.propagation = WrpPropagation::spectrum;
      suite.cases.push_back(c);
      c.name = name + " over virtual planes, " + wrps_text(grid);
      c.scenes[0].wrp.propagation = WrpPropagation::compact;
      suite.cases.push_back(std::move(c));
    }
  }
  return suite;
}

/// The cost of a frame for growing scenes, sample numbers and holograms.
BenchSuite scaling_suite(const std::filesystem::path& data) {
  BenchSuite suite{"scaling", {}, {}, {}};
  BenchCase base;
  base.scenes = load_scenes(data / "teapot.toml", {"wrp.grid=[1, 1]", "wrp.padding=1.25"});
  const auto add = [&](const std::string& group, const std::string& name, auto&& change) {
    auto c = base;
    c.group = group;
    c.name = name;
    change(c);
    suite.cases.push_back(std::move(c));
  };
  for (const int triangles : {1000, 4000, 16000, 64000, 256000, 1000000}) {
    add("triangles", "sphere of " + std::to_string(triangles) + " triangles", [&](BenchCase& c) {
      c.scenes[0].objects[0].mesh = c.name;
      const int rings = std::max(2, static_cast<int>(std::lround(std::sqrt(triangles / 4.0))));
      const Mesh mesh = unit_sphere(rings);
      c.meshes = std::make_shared<const Meshes>(Meshes{{mesh}, {is_closed(mesh)}, {0}});
    });
  }
  suite.ratios.push_back({"1 million triangles over 16 thousand", "sphere of 1000000 triangles",
                          "sphere of 16000 triangles", 1.5});
  for (const double pitch_m : {2e-4, 1e-4, 5e-5, 2.5e-5})
    add("sample pitch", "p " + length_text(pitch_m),
        [&](BenchCase& c) { c.scenes[0].sampling.pitch_m = pitch_m; });
  for (const int width : {960, 1920, 3840, 7680}) {
    const glm::ivec2 size(width, width * 9 / 16);
    add("hologram", grid_text(size) + " pixels",
        [&](BenchCase& c) { c.scenes[0].hologram.resolution = size; });
  }
  for (const int frames : {1, 2, 4, 8, 16})
    add("frames together", std::to_string(frames) + " with phases of their own",
        [&](BenchCase& c) { c.scenes[0].sampling.frames = frames; });
  return suite;
}

/// Runs a program and returns its standard output.
std::string output_of(const std::string& program, const std::vector<std::string>& arguments) {
  std::vector<std::string> words{program};
  words.insert(words.end(), arguments.begin(), arguments.end());
  std::vector<char*> pointers;
  for (auto& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);

  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw InputError(program + ": no pipe to it");
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  pid_t child = 0;
  const int failed =
      posix_spawn(&child, program.c_str(), &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  std::string printed;
  std::array<char, 4096> chunk;
  for (ssize_t got = 0; failed == 0 && ((got = read(ends[0], chunk.data(), chunk.size())) > 0 ||
                                        (got < 0 && errno == EINTR));)
    printed.append(chunk.data(), static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
  close(ends[0]);
  if (failed != 0) throw InputError(program + ": cannot be started");
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) throw InputError(program + ": failed");
  return printed;
}

}  // namespace

BenchSuite bench_suite(const std::string& name, const std::filesystem::path& data) {
  if (name == "cpu") return frames_suite(name, data, {{{20, 60}, {9.8, 20}}, {{5, 15}, {2, 6}}});
  if (name == "gpu") return frames_suite(name, data, {{{370, 1000}, {98, 400}}, {}});
  if (name == "paper") return paper_suite(data);
  if (name == "scaling") return scaling_suite(data);
  throw InputError("--suite " + one_line(name) +
                   ": unknown; there are cpu, gpu, paper and scaling");
}

std::string peer_json(const std::vector<BenchRow>& rows) {
  Json json = Json::array();
  for (const auto& row : rows) {
    Json frames = Json::array();
    for (const auto& f : row.frames)
      frames.push_back(
          {{"wall_s", f.wall_s}, {"processor_s", f.processor_s}, {"stages_s", f.stages_s}});
    json.push_back({{"name", row.name}, {"frames", frames}});
  }
  return json.dump() + "\n";
}

std::vector<BenchRow> run_peer(const std::filesystem::path& program,
                               const std::vector<std::string>& arguments) {
  const auto printed = output_of(program.string(), arguments);
  try {
    std::vector<BenchRow> rows;
    for (const auto& json : Json::parse(printed)) {
      BenchRow row;
      row.group = "peer";
      row.peer = true;
      row.name = json.at("name").get<std::string>();
      for (const auto& f : json.at("frames")) {
        row.frames.push_back({f.at("wall_s").get<double>(), f.at("processor_s").get<double>(),
                              f.at("stages_s").get<std::map<std::string, double>>()});
      }
      rows.push_back(std::move(row));
    }
    return rows;
  } catch (const nlohmann::json::exception& error) {
    throw InputError(program.string() + ": printed no rows: " + json_reason(error));
  }
}

}  // namespace raywave
