// SPDX-License-Identifier: Apache-2.0
// OBJ. Libraries and names that are not found leave the default material, with a note.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "host/scene/reader/materials_mtl.hpp"
#include "host/scene/reader/mesh_builder.hpp"
#include "host/scene/reader/mesh_text.hpp"
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader_reply.hpp"
#include "host/scene/vectors.hpp"

namespace raywave {
namespace {

constexpr std::uint32_t kNone = UINT32_MAX;

/// A corner of a face: numbers of position, texture coordinate and normal, counted from 0.
using Corner = std::array<std::uint32_t, 3>;

struct Face {
  std::size_t first = 0;  // of the corners
  std::uint32_t line = 0;
  std::int32_t use = -1;  // of the names behind usemtl
};

class ObjReader {
public:
  ObjReader(const std::filesystem::path& file, std::string_view text)
      : file_(file), lines_(text, "", true) {
    builder_.counted_from = 1;
  }

  Mesh read() {
    while (lines_.next_line()) {
      const auto key = lines_.word();
      if (!key.empty()) read_line(key);
    }
    faces_.push_back({corners_.size()});
    auto material = materials_of_uses();
    if (is_plain_)
      add_positions();
    else
      add_corners();
    std::vector<std::uint32_t> numbers;
    for (std::size_t i = 0; i + 1 < faces_.size(); ++i) {
      numbers.clear();
      for (auto k = faces_[i].first; k < faces_[i + 1].first; ++k)
        numbers.push_back(is_plain_ ? corners_[k][0] : static_cast<std::uint32_t>(k));
      builder_.add_face(numbers, faces_[i].use < 0 ? -1 : material[faces_[i].use],
                        [&] { return line_of(faces_[i]); });
    }
    if (!colours_.empty()) set_colours();
    return builder_.finish();
  }

private:
  static std::string line_of(const Face& face) { return "line " + std::to_string(face.line); }
  void note(const std::string& what) { builder_.notes.add(what, lines_.where()); }

  void read_line(std::string_view key) {
    if (key == "v") {
      read_position();
    } else if (key == "vt" || key == "vn") {
      glm::dvec3 value(0);
      value.x = lines_.number();
      for (int i = 1; i < 3; ++i)
        if (const auto word = lines_.word(); !word.empty() && !is_number(word, value[i]))
          lines_.fail("\"" + std::string(word) + "\" is no number");
      if (key == "vt")
        uvs_.emplace_back(value);
      else
        normals_.push_back(value);
    } else if (key == "f" || key == "fo") {
      read_face();
    } else if (key == "usemtl") {
      uses_.emplace_back(lines_.rest(), lines_.where());
    } else if (key == "mtllib") {
      libraries_.emplace_back(lines_.rest(), lines_.where());
    } else if (key == "p" || key == "l") {
      note("points and lines are left out");
    } else if (key != "g" && key != "o" && key != "s") {
      note(word_in_quotes(key) + " is ignored");
    }
  }

  void read_position() {
    std::array<double, 8> n{};
    std::size_t count = 0;
    for (auto word = lines_.word(); !word.empty() && count < 8; word = lines_.word(), ++count)
      if (!is_number(word, n[count]))
        lines_.fail(word_in_quotes(word) + " is no number" +
                    (word.find(',') == word.npos ? "" : "; decimals need a point"));
    if (count < 3) lines_.fail("a vertex needs three numbers");
    positions_.emplace_back(n[0], n[1], n[2]);
    if (!is_position(positions_.back())) lines_.fail("a vertex is NaN or infinite");
    if (positions_.size() > most_vertices_of_file) throw InputError("has too many vertices");
    if (count == 4 && n[3] != 1) note("the fourth number of vertices is ignored");
    if (count == 5 || count == 8) note("numbers behind x y z are ignored");
    if (count != 6 && count != 7) return;
    colours_.resize(positions_.size() - 1, {1, 1, 1, NAN});
    // The last of six stays away: they have no alpha
    colours_.emplace_back(n[3], n[4], n[5], count == 7 ? n[6] : NAN);
  }

  /// One of the three numbers of a corner; 0 where nothing is there.
  std::uint32_t index_of(std::string_view word, std::size_t count) {
    double number = 0;
    if (word.empty()) return kNone;
    if (!is_number(word, number) || number != std::floor(number) || number == 0 ||
        std::abs(number) > 4e9)
      lines_.fail(word_in_quotes(word) + " is no number of a vertex");
    const double index = number > 0 ? number - 1 : static_cast<double>(count) + number;
    if (index < 0)
      lines_.fail("a face names " + std::string(word.substr(0, 40)) +
                  ", a vertex before the first");
    return static_cast<std::uint32_t>(index);
  }

  void read_face() {
    Face face{corners_.size(), static_cast<std::uint32_t>(lines_.line()),
              static_cast<std::int32_t>(uses_.size()) - 1};
    for (auto word = lines_.word(); !word.empty(); word = lines_.word()) {
      std::array<std::string_view, 3> part;
      for (auto& one : part) {
        const auto slash = std::min(word.find('/'), word.size());
        one = word.substr(0, slash);
        word.remove_prefix(std::min(slash + 1, word.size()));
      }
      const Corner corner{index_of(part[0], positions_.size()), index_of(part[1], uvs_.size()),
                          index_of(part[2], normals_.size())};
      if (corner[0] == kNone || !word.empty())
        lines_.fail("a corner of a face is not v, v/vt, v//vn or v/vt/vn");
      is_plain_ = is_plain_ && corner[1] == kNone && corner[2] == kNone;
      corners_.push_back(corner);
    }
    if (corners_.size() > most_vertices_of_file) throw InputError("has too many faces");
    faces_.push_back(face);
  }

  /// The files that a mtllib line names: one whose name has blanks, or several.
  void read_libraries(std::map<std::string, MeshMaterial>& materials) {
    std::set<std::filesystem::path> known;
    for (const auto& [names, where] : libraries_) {
      std::vector<std::string> list{names};
      if (!file_beside(file_, names)) {
        list.clear();
        LineScanner words(names, "");
        words.next_line();
        for (auto word = words.word(); !word.empty(); word = words.word()) list.emplace_back(word);
      }
      for (const auto& name : list) {
        const auto library = file_beside(file_, name);
        if (!library)
          builder_.notes.add("library \"" + name + "\" is not there: what it holds is shown with " +
                                 "the default material",
                             where);
        else if (known.insert(*library).second)
          read_mtl(*library, file_, builder_, materials);
      }
    }
  }

  /// Number in the mesh of the material of each usemtl line; -1: the default.
  std::vector<std::int32_t> materials_of_uses() {
    std::map<std::string, MeshMaterial> materials;
    read_libraries(materials);
    std::vector<std::int32_t> numbers(uses_.size(), -1);
    std::map<std::string, std::int32_t> worn;
    std::size_t last = 0;
    for (std::size_t i = 0; i + 1 < faces_.size(); ++i) {
      const auto use = faces_[i].use;
      if (use < 0 || static_cast<std::size_t>(use) + 1 == last) continue;
      last = static_cast<std::size_t>(use) + 1;
      const auto& [name, where] = uses_[last - 1];
      const auto [known, is_new] = worn.try_emplace(name, -1);
      if (const auto found = materials.find(name); is_new && found != materials.end()) {
        known->second = add_material(builder_.mesh, found->second);
      } else if (is_new) {
        builder_.notes.add(
            "material \"" + name + "\" is in no library: the default material is shown", where);
      }
      numbers[last - 1] = known->second;
    }
    if (const auto note = keep_visible(builder_.mesh.materials, "Tr 1 or d 0"); !note.empty())
      builder_.notes.add(note, "");
    return numbers;
  }

  /// Vertices as the file counts them, where faces name nothing but positions.
  void add_positions() {
    for (const auto& p : positions_)
      builder_.add_vertex(p, glm::dvec3(0), glm::dvec2(0), [] { return std::string(); });
    positions_ = {};
  }

  /// A vertex for each corner.
  void add_corners() {
    builder_.reserve_vertices(corners_.size());
    std::size_t face = 0;
    for (std::size_t k = 0; k < corners_.size(); ++k) {
      while (k >= faces_[face + 1].first) ++face;
      const auto [v, vt, vn] = corners_[k];
      const auto where = [&] { return line_of(faces_[face]); };
      if (v >= positions_.size())
        throw InputError(where() + ": a face names vertex " + std::to_string(v + std::size_t{1}) +
                         " of " + std::to_string(positions_.size()));
      if (vt != kNone && vt >= uvs_.size())
        builder_.notes.add("a texture coordinate that is not there counts as 0 0", where());
      if (vn != kNone && vn >= normals_.size())
        builder_.notes.add("a normal that is not there is that of the face", where());
      builder_.add_vertex(positions_[v], vn < normals_.size() ? normals_[vn] : glm::dvec3(0),
                          vt < uvs_.size() ? uvs_[vt] : glm::dvec2(0), where);
    }
  }

  /// Colours behind positions: r g b, r g b a, or w r g b. A red of 1 everywhere is w where what
  /// would be alpha differs, or is 0, or others reach 255.
  void set_colours() {
    bool is_weight = true, is_alpha = brightest_of(colours_) == 1;
    double last = NAN;
    for (const auto& c : colours_) {
      if (std::isnan(c.w)) continue;
      is_weight = is_weight && c.x == 1;
      is_alpha = is_alpha && c.w != 0 && (std::isnan(last) || c.w == last);
      last = c.w;
    }
    if (is_weight && !is_alpha)
      for (auto& c : colours_) c = std::isnan(c.w) ? c : glm::vec4(c.y, c.z, c.w, NAN);
    const float scale = brightest_of(colours_);
    colours_.resize(std::max(colours_.size(), positions_.size()), glm::vec4(scale));
    if (!is_plain_) {
      std::vector<glm::vec4> all;
      for (const auto& corner : corners_) all.push_back(colours_[corner[0]]);
      colours_ = std::move(all);
    }
    builder_.set_colours(std::move(colours_), scale);
  }

  const std::filesystem::path& file_;
  LineScanner lines_;
  MeshBuilder builder_;
  std::vector<glm::dvec3> positions_, normals_;
  std::vector<glm::dvec2> uvs_;
  std::vector<glm::vec4> colours_;  // of positions; alpha is NaN where there is none
  std::vector<Corner> corners_;
  std::vector<Face> faces_;  // at the end one more, without corners
  bool is_plain_ = true;     // faces name positions alone
  std::vector<std::pair<std::string, std::string>> uses_, libraries_;  // names, and their lines
};

}  // namespace

Mesh read_obj(const std::filesystem::path& file) {
  const MappedFile bytes(file);
  return ObjReader(file, bytes.bytes()).read();
}

}  // namespace raywave
