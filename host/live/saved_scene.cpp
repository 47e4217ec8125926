// SPDX-License-Identifier: Apache-2.0
#include "host/live/saved_scene.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <nlohmann/json.hpp>
#include <regex>
#include <string_view>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/output.hpp"
#include "host/common/text.hpp"
#include "host/scene/document.hpp"
#include "host/scene/settings.hpp"

namespace raywave {
namespace {

/// Keys whose values, or parts of them, may be names of files.
constexpr std::array<std::string_view, 8> of_files{"mesh",    "texture",  "picture", "lut",
                                                   "profile", "flatness", "gltf",    "values"};

/// more  of keys_of
template <class Spec, class... More>
void add_changes(const std::string& section, const Spec& from, Spec to,
                 std::vector<std::string>& changes, const More&... more) {
  const auto before = json_of_keys(from, more...);
  keys_of(
      to,
      [&](const Setting& setting) {
        const auto now = setting.told_as.empty() ? Json() : setting.json();
        if (!now.is_null() && before.value(setting.told_as, Json()) != now)
          changes.push_back(section + "." + setting.key + "=" + now.dump());
      },
      more...);
}

/// Makes names that hold from one folder hold from another.
void move_names(toml::node& node, bool is_name, const std::filesystem::path& from,
                const std::filesystem::path& to) {
  if (auto* table = node.as_table()) {
    for (auto&& [key, value] : *table)
      move_names(value, is_name || std::ranges::find(of_files, key.str()) != of_files.end(), from,
                 to);
  } else if (auto* array = node.as_array()) {
    for (auto& one : *array) move_names(one, is_name, from, to);
  } else if (auto* text = node.as_string(); text && is_name) {
    std::error_code error;
    const std::filesystem::path name(text->get());
    if (name.is_relative() && std::filesystem::is_regular_file(from / name, error))
      *text =
          std::filesystem::proximate(std::filesystem::absolute(from / name), to).generic_string();
  }
}

/// Writes 0.08 for 0.080000000000000002.
std::string with_short_numbers(const std::string& text) {
  static const std::regex numbers("[0-9]+\\.[0-9]{15,}(e[+-]?[0-9]+)?");
  std::string written;
  auto rest = text.begin();
  for (std::sregex_iterator found(text.begin(), text.end(), numbers), end; found != end; ++found) {
    double value = 0;
    const auto digits = found->str();
    std::from_chars(digits.data(), digits.data() + digits.size(), value);
    written.append(rest, (*found)[0].first).append(Json(value).dump());
    rest = (*found)[0].second;
  }
  return written.append(rest, text.end());
}

}  // namespace

std::vector<std::string> overrides_between(const Scene& from, const Scene& to) {
  std::vector<std::string> changes;
  add_changes("hologram", from.hologram, to.hologram, changes);
  add_changes("slm", from.slm, to.slm, changes, 0.0, 10);
  add_changes("wrp", from.wrp, to.wrp, changes);
  add_changes("sampling", from.sampling, to.sampling, changes);
  add_changes("trace", from.trace, to.trace, changes);
  add_changes("accuracy", from.accuracy, to.accuracy, changes);
  if (to.refine && !from.refine && !to.refine->iterations)
    changes.emplace_back("refine.iterations=auto");
  if (to.refine) add_changes("refine", from.refine.value_or(RefineSettings{}), *to.refine, changes);
  for (std::size_t i = 0; i < to.lights.size(); ++i)
    add_changes("light." + std::to_string(i), from.lights.at(i), to.lights[i], changes);
  for (std::size_t i = 0; i < to.objects.size(); ++i)
    add_changes("object." + std::to_string(i), from.objects.at(i), to.objects[i], changes,
                to.hologram, to.viewer, to.materials, false);
  return changes;
}

void save_scene(const std::filesystem::path& file, const SceneText& text,
                const std::vector<std::string>& overrides) {
  const auto folder = std::filesystem::absolute(file).parent_path();
  auto document = parse_document(text, overrides);
  move_names(document.root, false, text.folder, folder);
  auto root = text_stream();
  root << document.root;
  const auto written = "# " + one_line(text.file.string()) + " as raywave view showed it, " +
                       today() + "\n\n" + with_short_numbers(root.str()) + "\n";
  std::error_code error;
  std::filesystem::create_directories(folder, error);  // from which its files are looked for
  parse_scenes({written, file, folder});
  write_text(file, written);
}

}  // namespace raywave
