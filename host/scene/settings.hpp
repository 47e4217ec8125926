// SPDX-License-Identifier: Apache-2.0
/// The keys of a scene's sections, an entry for each: what it is read into, its range, what else it
/// must keep, and what report.json says of it. Defaults are those of the structs. docs/scene.md and
/// docs/slm.md list them for people; a test compares them with these.
#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "host/common/json.hpp"
#include "host/scene/document.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// One key of one struct, which it refers to.
struct Setting {
  using Use = std::function<void(const Value&)>;

  const char* key;
  Use convert;                                    // a value into the struct
  std::function<Json()> json{};                   // what the struct has; null: nothing
  std::string told_as{};                          // name in report.json; empty: it is not told
  const char* word{};                             // in place of a value: what is there stays
  const char* needs{};                            // what to give where the key is missing
  Use then{};                                     // after `convert`
  std::function<Value(const Value&)> of_table{};  // takes the value out of a table of them

  Setting& or_word(const char* text) { return word = text, *this; }
  Setting& or_auto() { return or_word("auto"); }
  Setting& as(const char* name) { return told_as = name, *this; }
  Setting& told_if(bool is_told) { return is_told ? *this : as(""); }
  Setting& needing(const char* what) { return needs = what, *this; }
  Setting& and_then(Use use) { return then = std::move(use), *this; }
  Setting& or_table(std::function<Value(const Value&)> of) {
    return of_table = std::move(of), *this;
  }

  void read(const Value& v) const {
    if (word && v.is(word)) return;
    convert(of_table && v.node->is_table() ? of_table(v) : v);
    if (then) then(v);
  }
};

/// Takes the keys of a struct one after another; a key may depend on what the ones before it set.
using Keys = std::function<void(const Setting&)>;

void keys_of(HologramSpec& spec, const Keys& key);
void keys_of(WrpSpec& spec, const Keys& key);
void keys_of(SamplingSpec& spec, const Keys& key);
void keys_of(TraceSpec& spec, const Keys& key);
void keys_of(AccuracySpec& spec, const Keys& key);
void keys_of(ViewerSpec& spec, const Keys& key);
void keys_of(RefineSettings& spec, const Keys& key);
void keys_of(Light& light, const Keys& key);
/// wavelength_m  of tables by wavelength
void keys_of(Material& material, const Keys& key, double wavelength_m);
/// needs_mesh  it cannot be left out
void keys_of(Object& object, const Keys& key, const HologramSpec& hologram,
             const ViewerSpec& viewer, const std::vector<Material>& materials, bool needs_mesh);
/// wavelength_m  of LUTs by wavelength, it takes the nearest
void keys_of(SlmSpec& slm, const Keys& key, double wavelength_m, int most_bits);

/// Reads the keys of a section, which has no others, into a struct.
template <class Spec, class... More>
Spec read_keys(Section section, Spec spec, const More&... more) {
  const Keys key = [&](const Setting& setting) {
    const auto use = [&](const Value& v) { setting.read(v); };
    if (setting.needs)
      section.require(setting.key, setting.needs, use);
    else
      section.read(setting.key, use);
  };
  keys_of(spec, key, more...);
  section.finish();
  return spec;
}

/// The keys of a struct as report.json tells them, lengths in metres.
template <class Spec, class... More>
Json json_of_keys(Spec spec, const More&... more) {
  auto all = Json::object();
  const Keys key = [&](const Setting& setting) {
    if (setting.told_as.empty()) return;
    if (auto json = setting.json(); !json.is_null())
      all[setting.told_as] = std::move(json);
    else if (setting.word && setting.word == std::string_view("auto"))
      all[setting.told_as] = setting.word;
  };
  keys_of(spec, key, more...);
  return all;
}

/// What report.json says of a value.
template <class T>
Json told(const T& value) {
  return value;
}
template <int N, class T>
Json told(const glm::vec<N, T>& vector) {
  auto all = Json::array();
  for (int i = 0; i < N; ++i) all.push_back(vector[i]);
  return all;
}
inline Json told(const std::filesystem::path& file) { return file.string(); }
template <class T>
Json told(const std::optional<T>& value) {
  return value ? told(*value) : Json();
}

/// A key that is converted by `of`, and told by `tell`.
template <class T, class Of, class Tell>
Setting setting(const char* key, T& member, Of of, Tell tell) {
  return {key, [&member, of](const Value& v) { member = of(v); },
          [&member, tell]() -> Json { return tell(member); }, key};
}
template <class T, class Of>
Setting setting(const char* key, T& member, Of of) {
  return setting(key, member, of, [](const T& value) { return told(value); });
}

/// T is a number, or an optional one.
template <class T>
Setting number(const char* key, T& member, const Range& range) {
  return setting(key, member, [range](const Value& v) { return v.number(range); });
}
template <class T>
Setting length(const char* key, T& member, const Range& range, double doubted_m = least_doubted_m) {
  auto made = setting(key, member, [=](const Value& v) { return v.length_m(range, doubted_m); });
  made.told_as += "_m";
  return made;
}
template <class Integer, class T>
Setting whole(const char* key, T& member, Integer min, Integer max) {
  return setting(key, member, [=](const Value& v) { return v.integer(min, max); });
}
inline Setting flag(const char* key, bool& member) {
  return setting(key, member, [](const Value& v) { return v.boolean(); });
}

/// A word for each value.
template <class T>
using Names = std::vector<std::pair<const char*, T>>;

template <class T>
Setting choice(const char* key, T& member, const Names<T>& names) {
  return setting(
      key, member, [names](const Value& v) { return v.choice(names); },
      [names](const T& now) {
        const auto is = [&](const auto& name) { return name.second == now; };
        return std::find_if(names.begin(), names.end(), is)->first;
      });
}

/// The same of all values of an enumeration.
template <Named T>
Setting choice(const char* key, T& member) {
  Names<T> names;
  for (const char* name : names_of(T{})) names.emplace_back(name, static_cast<T>(names.size()));
  return choice(key, member, names);
}

}  // namespace raywave
