// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader/materials_mtl.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>
#include <utility>

#include "host/scene/reader/mesh_text.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

namespace fs = std::filesystem;

constexpr double kNotGiven = -1;

/// What a material says before all of it is known.
struct Said {
  double d = kNotGiven, tr = kNotGiven, metallic = kNotGiven, roughness = kNotGiven;
  int illumination = 1;
  bool has_diffuse = false;
  std::string diffuse_map, ambient_map;
};

class MtlReader {
public:
  MtlReader(const fs::path& file, std::string_view text, const fs::path& mesh, MeshBuilder& builder,
            std::map<std::string, MeshMaterial>& materials)
      : file_(file),
        lines_(text, file.filename().string()),
        mesh_(mesh),
        builder_(builder),
        materials_(materials) {}

  void read() {
    while (lines_.next_line()) {
      const auto key = lower(lines_.word());
      if (key.empty()) continue;
      if (key == "newmtl") {
        finish();
        material_ = {std::string(lines_.rest()), {}, {}};
        said_ = {};
        is_open_ = true;
      } else if (!is_open_) {
        builder_.notes.add(word_in_quotes(key) + " before any newmtl is ignored", lines_.where());
      } else if (!read_colour(key) && !read_number(key) && !read_map(key)) {
        note(word_in_quotes(key) + " is ignored");
      }
    }
    finish();
  }

private:
  void note(const std::string& what) {
    auto text = what + " (" + lines_.where() + ")";
    text.resize(std::min(text.size(), longest_text));
    if (material_.notes.size() < most_notes_of_file) material_.notes.push_back(std::move(text));
  }

  /// A number within a range; what is none becomes a note, and nothing.
  std::optional<double> number(double low, double high) {
    const auto word = lines_.word();
    double value = 0;
    if (is_number(word, value) && std::isfinite(value)) return std::clamp(value, low, high);
    note(word_in_quotes(word) + " is no number and is ignored");
    return {};
  }

  /// One number stands for all three.
  std::optional<glm::dvec3> colour() {
    if (const auto word = lines_.peek(); word == "spectral" || word == "xyz") {
      note(std::string(word) + " colours are ignored");
      return {};
    }
    const auto red = number(0, 1e30);
    if (!red) return {};
    glm::dvec3 c(*red);
    for (int i = 1; i < 3; ++i) {
      if (lines_.peek().empty()) return c;
      const auto next = number(0, 1e30);
      if (!next) return {};
      c[i] = *next;
    }
    return c;
  }

  bool read_colour(const std::string& key) {
    auto& look = material_.look;
    glm::dvec3* of = key == "kd"   ? &look.base
                     : key == "ka" ? &look.ambient
                     : key == "ks" ? &look.specular
                     : key == "ke" ? &look.emission
                                   : nullptr;
    if (!of && key != "tf") return false;
    const auto c = colour();
    if (c && of) *of = *c;
    if (key == "kd" && c) said_.has_diffuse = true;
    if (key == "tf" && c && *c != glm::dvec3(1)) note("Tf is ignored");
    return true;
  }

  bool read_number(const std::string& key) {
    if (key == "ns") {
      material_.look.shininess = number(0, 1e30).value_or(0);
    } else if (key == "d") {
      if (lines_.peek() == "-halo") {
        lines_.word();
        note("-halo is ignored, and the number behind it taken");
      }
      said_.d = number(0, 1).value_or(1);
    } else if (key == "tr") {
      said_.tr = number(0, 1).value_or(0);
    } else if (key == "illum") {
      said_.illumination = static_cast<int>(number(0, 100).value_or(1));
    } else if (key == "pm") {
      said_.metallic = number(0, 1).value_or(0);
    } else if (key == "pr") {
      said_.roughness = number(0, 1).value_or(1);
    } else if (key == "ps" || key == "pc" || key == "pcr" || key == "aniso" || key == "anisor") {
      if (number(0, 1e30).value_or(0) != 0) note('"' + key + "\" is ignored");
    } else {
      return key == "ni" || key == "sharpness";  // of what Phong's model does not show
    }
    return true;
  }

  /// The numbers behind an option: at most three, and the last word is a file's name.
  std::vector<double> option_numbers() {
    std::vector<double> values;
    for (double value = 0; values.size() < 3; values.push_back(value)) {
      const auto before = lines_;
      const bool is_one = is_number(lines_.word(), value) && std::isfinite(value);
      auto behind = lines_;
      if (is_one && !behind.rest().empty()) continue;
      lines_ = before;
      break;
    }
    return values;
  }

  /// Reads the options before a file's name. Returns the factor of bumps.
  double read_options(MapPlace& place) {
    std::array<double, 2> scale{1, 1}, offset{0, 0};
    double bump = 1;
    for (;;) {
      const auto before = lines_;
      const auto option = lower(lines_.word());
      if (option == "-s" || option == "-o" || option == "-t") {
        const auto values = option_numbers();
        for (std::size_t i = 0; i < std::min<std::size_t>(values.size(), 2); ++i) {
          if (option == "-s") scale[i] = std::clamp(values[i], -1e6, 1e6);
          if (option == "-o") offset[i] = std::clamp(values[i], -1e6, 1e6);
        }
        const auto is_zero = [](double v) { return v == 0; };
        if (option == "-t" && !std::all_of(values.begin(), values.end(), is_zero))
          note("turbulence of a picture (-t) is ignored");
      } else if (option == "-bm") {
        if (const auto values = option_numbers(); !values.empty()) bump = values[0];
      } else if (option == "-clamp") {
        if (lower(lines_.word()) == "on") place.wrap_u = place.wrap_v = Wrap::clamp;
      } else if (option == "-mm" || option == "-boost" || option == "-texres") {
        option_numbers();
        note('"' + option + "\" is ignored");
      } else if (option == "-cc" || option == "-imfchan" || option == "-type") {
        lines_.word();
        note('"' + option + "\" is ignored");
      } else if (option == "-blendu" || option == "-blendv") {
        lines_.word();  // of mipmaps
      } else {
        lines_ = before;
        break;
      }
    }
    place.across = {scale[0], 0, offset[0]};
    place.up = {0, scale[1], offset[1]};
    return bump;
  }

  /// A picture's name as the mesh would write it; empty, with a note: there is no such file.
  std::string picture_name(std::string name) {
    if (name.size() > 1 && name.front() == '"' && name.back() == '"')
      name = name.substr(1, name.size() - 2);
    auto beside = file_beside(file_, name);
    if (!beside) beside = file_beside(mesh_, name);
    if (!beside) note("picture \"" + name + "\" is ignored: there is no such file");
    return beside ? beside->lexically_relative(mesh_.parent_path()).string() : "";
  }

  bool read_map(const std::string& key) {
    static const std::map<std::string, const char*> ignored{{"map_ka", ""},
                                                            {"map_ks", "specular map"},
                                                            {"map_ns", "shininess map"},
                                                            {"map_bump", "bump map"},
                                                            {"bump", "bump map"},
                                                            {"disp", "displacement map"},
                                                            {"map_disp", "displacement map"},
                                                            {"refl", "reflection map"},
                                                            {"map_refl", "reflection map"},
                                                            {"decal", "decal"},
                                                            {"map_pm", "metalness map"},
                                                            {"map_pr", "roughness map"},
                                                            {"map_ps", "sheen map"},
                                                            {"map_aat", ""}};
    auto& look = material_.look;
    MeshMap* const map = key == "map_kd"                      ? &look.base_map
                         : key == "map_ke"                    ? &look.emission_map
                         : key == "map_d" || key == "map_tr"  ? &look.alpha_map
                         : key == "norm" || key == "map_norm" ? &look.normal_map
                                                              : nullptr;
    const auto other = ignored.find(key);
    if (!map && other == ignored.end()) return false;
    if (key == "map_aat") return true;  // smooth edges of pictures
    MapPlace place;
    auto kept = std::move(material_.notes);
    material_.notes.clear();
    const double bump = read_options(place);
    if (map) kept.insert(kept.end(), material_.notes.begin(), material_.notes.end());
    material_.notes = std::move(kept);
    const std::string written(lines_.rest());
    if (key == "map_ka") said_.ambient_map = written;
    if (map == nullptr) {
      if (*other->second != 0) note(std::string(other->second) + " is ignored");
      return true;
    }
    if (key == "map_kd") said_.diffuse_map = written;
    if (key == "map_tr") note("map_Tr is taken as map_d");
    if (map == &look.normal_map) look.normal_scale = std::clamp(bump, -1e6, 1e6);
    const auto name = picture_name(written);
    if (name.empty()) return true;
    const auto number = add_picture(builder_.mesh, name);
    if (number < 0) note("picture \"" + name + "\" is ignored: there are too many");
    *map = {number, 0, place};
    return true;
  }

  /// Makes a material of what has been said.
  void finish() {
    if (!is_open_) return;
    auto& look = material_.look;
    look.two_sided = 1;
    // What a file does not say is a light grey
    if (!said_.has_diffuse) look.base = glm::dvec3(look.base_map.picture < 0 ? 0.6 : 1);
    if (look.emission_map.picture >= 0 && look.emission == glm::dvec3(0))
      look.emission = glm::dvec3(1);
    look.alpha = said_.d != kNotGiven ? said_.d : said_.tr != kNotGiven ? 1 - said_.tr : 1;
    if (said_.d != kNotGiven && said_.tr != kNotGiven && std::abs(said_.d + said_.tr - 1) > 1e-3)
      note("Tr is ignored: it says another opacity than d");
    if (look.alpha < 1 || look.alpha_map.picture >= 0) look.alpha_mode = AlphaMode::blend;
    if (!said_.ambient_map.empty() && said_.ambient_map != said_.diffuse_map)
      note("ambient map is ignored");
    if (said_.metallic != kNotGiven || said_.roughness != kNotGiven) {
      look.model = LookModel::metallic_roughness;
      look.metallic = std::max(said_.metallic, 0.0);
      look.roughness = said_.roughness == kNotGiven ? 1 : said_.roughness;
    } else {
      read_illumination();
    }
    const auto where = lines_.where();
    if (auto name = material_.name; !materials_.try_emplace(name, std::move(material_)).second)
      builder_.notes.add("material \"" + name + "\" is there twice: the first is shown", where);
    is_open_ = false;
  }

  void read_illumination() {
    auto& look = material_.look;
    const auto illum = "illum " + std::to_string(said_.illumination);
    if (said_.illumination == 0) look.model = LookModel::unlit;
    if (said_.illumination < 2) {
      if (look.specular != glm::dvec3(0))
        note(illum + ", as also no illum is read, shows no highlights: illum 2 shows those of Ks");
      look.specular = glm::dvec3(0);
    }
    if (said_.illumination > 2)
      note(illum + " is taken as illum 2: Phong's model, without reflection and refraction");
  }

  const fs::path& file_;
  LineScanner lines_;
  const fs::path& mesh_;
  MeshBuilder& builder_;
  std::map<std::string, MeshMaterial>& materials_;
  MeshMaterial material_;
  Said said_;
  bool is_open_ = false;
};

}  // namespace

std::optional<fs::path> file_beside(const fs::path& file, std::string name) {
  if (name.empty() || name.find('\0') != std::string::npos) return {};
  const auto folder = file.parent_path();
  std::error_code error;
  if (fs::is_regular_file(folder / name, error)) return folder / name;
  std::replace(name.begin(), name.end(), '\\', '/');
  for (const auto& candidate : {folder / name, folder / fs::path(name).filename()})
    if (fs::is_regular_file(candidate, error)) return candidate;
  return {};
}

void read_mtl(const fs::path& file, const fs::path& mesh, MeshBuilder& builder,
              std::map<std::string, MeshMaterial>& materials) {
  const MappedFile bytes(file);
  MtlReader(file, bytes.bytes(), mesh, builder, materials).read();
}

}  // namespace raywave
