// SPDX-License-Identifier: Apache-2.0
// docs/scene.md and docs/slm.md list the keys that scenes have, with their defaults and ranges.
#include <map>
#include <nlohmann/json.hpp>
#include <regex>

#include "host/scene/scene_json.hpp"
#include "host/scene/units.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/files.hpp"
#include "tests/support/scenes.hpp"

using namespace raywave;

namespace {

using Strings = std::vector<std::string>;

/// A row of a table of keys.
struct Row {
  Strings keys;
  std::string otherwise, range;
};

/// The first group of each match.
Strings all_of(const std::string& text, const char* pattern) {
  const std::regex regex(pattern);
  Strings found;
  for (std::sregex_iterator i(text.begin(), text.end(), regex), end; i != end; ++i)
    found.push_back((*i)[1]);
  return found;
}

/// The rows below each heading, such as "## `[wrp]`: ...", by what it names.
void add_rows(const char* page, std::map<std::string, std::vector<Row>>& rows) {
  std::ifstream file(std::string(RAYWAVE_DATA_DIR) + "/../docs/" + page);
  const std::regex cells("\\| (`[^|]*`) \\| ([^|]*) \\| ([^|]*) \\|.*");
  std::string section;
  std::smatch match;
  for (std::string line; std::getline(file, line);) {
    if (line.starts_with("## ")) {
      const auto named = all_of(line, "`\\[+([a-zA-Z_.]*)\\]+`");
      section = named.empty() ? line.substr(3) : named[0];
    } else if (std::regex_match(line, match, cells)) {
      rows[section].push_back({all_of(match[1], "`([^`]*)`"), match[2], match[3]});
    }
  }
}

/// The start of a scene whose only light has other keys.
const std::string kLight = "[[object]]\nmesh = \"a.ply\"\n[[light]]\ntype = ";

const std::string kScene = R"([materials.gold]
[animation]
frames = 2
[animation.camera]
[[animation.track]]
of = "camera.view"
at = [0, 1]
values = [[0, 0], [0, 0]]
[[object]]
mesh = "a.ply"
[[light]]
type = "ambient"
)";

struct Desk {
  Folder folder;
  Desk() {
    folder.write("a.ply", "");
    folder.write("a.exr", "");
  }
  nlohmann::ordered_json json(const Strings& set) const {
    auto told = json_of(load_scene(folder.write("scene.toml", kScene), set));
    told.erase("digest");  // of the text
    return told.flatten();
  }
  void require_same(const Strings& set, const Strings& otherwise) const {
    const auto now = json(set);
    auto before = json(otherwise);
    REQUIRE(now.size() == before.size());
    for (const auto& [key, value] : now.items()) {
      INFO(key << ": " << value << ", " << before[key]);
      if (value.is_number_float())  // "638 nm" to a rounding
        CHECK(value.get<double>() == Catch::Approx(before[key].get<double>()));
      else
        CHECK(value == before[key]);
    }
  }
  std::string refusal(const std::string& text, const Strings& set) const {
    return input_error_of([&] { load_scene(folder.write("scene.toml", text), set); });
  }
  /// Those that the refusal of an unknown one lists.
  std::set<std::string> keys(const std::string& text, const std::string& path,
                             const Strings& set) const {
    auto all = set;
    all.push_back(path + ".unknown=1");
    const auto said = refusal(text, all);
    INFO(path << ": " << said);
    const auto listed = all_of(said, "keys here: ([^)]*)");
    REQUIRE(listed.size() == 1);
    const auto names = all_of(listed[0], "([a-z_]+)");
    return {names.begin(), names.end()};
  }
};

std::set<std::string> keys_of(const std::vector<Row>& rows) {
  std::set<std::string> all;
  for (const auto& row : rows) all.insert(row.keys.begin(), row.keys.end());
  return all;
}

/// Ends of "1 nm to 10 km" as number or in metres.
std::vector<double> ends_of(const std::string& text) {
  static const std::regex ends("(-?[0-9.e+-]+)( [nmkcu]*m)? to (-?[0-9.e+-]+)( [nmkcu]*m)?");
  std::smatch match;
  if (!std::regex_search(text, match, ends)) return {};
  return {parse_length_m(match[1].str() + match[2].str(), ""),
          parse_length_m(match[3].str() + match[4].str(), "")};
}

}  // namespace

TEST_CASE("the documentation lists each key of a scene, with its default and its range") {
  const Desk desk;
  std::map<std::string, std::vector<Row>> rows;
  add_rows("scene.md", rows);
  rows.erase("slm");
  add_rows("slm.md", rows);
  rows["slm"] = rows["Keys"];
  struct Section {
    std::string heading, path;
    Strings set;
  };
  std::vector<Section> sections{
      {"materials.NAME", "materials.gold", {}},
      {"object", "object.0", {}},
      {"animation.track", "animation.track.0", {}},
      {"viewer", "viewer", {"viewer.eyepiece=0.1"}},
      {"refine", "refine", {"refine={}"}},
      {"colour",
       "colour",
       {"hologram.wavelength=['638 nm', '520 nm', '450 nm']", "colour.only=638 nm"}}};
  for (const char* name : {"hologram", "slm", "illumination", "wrp", "sampling", "trace",
                           "accuracy", "animation", "animation.camera"})
    sections.push_back({name, name, {}});
  int defaults = 0, ranges = 0;
  for (const auto& section : sections) {
    INFO(section.heading);
    auto known = desk.keys(kScene, section.path, section.set);
    if (section.heading == "animation") known.erase("camera"), known.erase("track");
    CHECK(known == keys_of(rows[section.heading]));
    for (const auto& row : rows[section.heading]) {
      const auto path = section.path + "." + row.keys[0];
      INFO(path << ": default " << row.otherwise << ", range " << row.range);
      const auto with = [&](const std::string& value) {
        auto set = section.set;
        set.push_back(path + "=" + value);
        return set;
      };
      if (row.keys[0] == "stop_centre") continue;  // where there is a stop alone
      const bool is_set = row.keys[0] == "only" || row.keys[0] == "eyepiece";  // by section.set
      const auto otherwise = all_of(row.otherwise, "^`([\"[0-9tf-][^`]*)`");
      if (!otherwise.empty() && !is_set) {
        desk.require_same(with(otherwise[0]), section.set);
        ++defaults;
      }
      const auto ends = ends_of(row.range);
      if (ends.empty() || row.range.find("or negative") != std::string::npos) continue;
      std::string said;
      for (const std::string value :
           {"-1e29", "[-1e29, -1e29]", "[-1e29, -1e29, -1e29]", "[-1, -1]"}) {
        said = desk.refusal(kScene, with(value));
        if (!ends_of(said).empty()) break;
      }
      INFO(said);
      const auto own = ends_of(said);
      REQUIRE(own.size() == 2);
      for (std::size_t i = 0; i < 2; ++i) CHECK(own[i] == Catch::Approx(ends[i]));
      ++ranges;
    }
  }
  CHECK(defaults > 50);
  CHECK(ranges > 40);
}

TEST_CASE("the documentation lists the keys of all types of lights") {
  const Desk desk;
  std::map<std::string, std::vector<Row>> rows;
  add_rows("scene.md", rows);
  std::set<std::string> known;
  for (const std::string light : {"\"ambient\"", "\"point\"\nposition = [0, 0, 1]",
                                  "\"spot\"\nposition = [0, 0, 1]\ndirection = [0, 0, 1]",
                                  "\"area\"\nposition = [0, 0, 1]\nedges = [[1, 0, 0], [0, 1, 0]]",
                                  "\"environment\"\npicture = \"a.exr\""})
    known.merge(desk.keys(kLight + light + "\n", "light.0", {}));
  CHECK(known == keys_of(rows["light"]));
}
