// SPDX-License-Identifier: Apache-2.0
// PLY: text, and binary of both byte orders.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <numbers>
#include <span>
#include <utility>

#include "host/scene/reader/mesh_builder.hpp"
#include "host/scene/reader/mesh_text.hpp"
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

template <class T>
double double_at(const char* place) {
  return static_cast<double>(number_at<T>(place));
}

/// A type of numbers, and its two names.
struct Type {
  std::string_view name, other;
  std::size_t size;
  double (*read)(const char* place);
};

constexpr std::array<Type, 8> types{{{"char", "int8", 1, double_at<std::int8_t>},
                                     {"uchar", "uint8", 1, double_at<std::uint8_t>},
                                     {"short", "int16", 2, double_at<std::int16_t>},
                                     {"ushort", "uint16", 2, double_at<std::uint16_t>},
                                     {"int", "int32", 4, double_at<std::int32_t>},
                                     {"uint", "uint32", 4, double_at<std::uint32_t>},
                                     {"float", "float32", 4, double_at<float>},
                                     {"double", "float64", 8, double_at<double>}}};

struct Property {
  std::string name;
  const Type* type = nullptr;
  const Type* count = nullptr;  // of a list
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;

  bool is_faces() const { return name == "face" || name == "tristrips"; }

  /// The first property of one of these names; -1: there is none.
  int find(std::initializer_list<const char*> names) const {
    for (const std::string one : names)
      for (std::size_t i = 0; i < properties.size(); ++i)
        if (properties[i].name == one) return static_cast<int>(i);
    return -1;
  }
};

/// Where an element's colour stands: red, green, blue and alpha; -1: nowhere.
struct Colour {
  std::array<int, 4> at;
  bool is_there = false, is_bytes = false;

  explicit Colour(const Element& of)
      : at{of.find({"red", "diffuse_red", "r"}), of.find({"green", "diffuse_green", "g"}),
           of.find({"blue", "diffuse_blue", "b"}), of.find({"alpha", "diffuse_alpha", "a"})} {
    is_there = at[0] >= 0 && at[1] >= 0 && at[2] >= 0;
    is_bytes = is_there && of.properties[static_cast<std::size_t>(at[0])].type->name == "uchar";
  }
  float scale_of(std::span<const glm::vec4> found) const {
    return is_bytes ? 255.0f : brightest_of(found);
  }
};

/// What vertices have that are points: a radius, or what Gaussian splats have (Kerbl et al., ACM
/// Trans. Graph. 42, 139 (2023)): logarithms of three half axes, of the opacity's odds, and a
/// colour as the first spherical harmonic. Other harmonics and the turn are ignored.
struct Splats {
  std::array<int, 8> at;

  explicit Splats(const Element& of)
      : at{of.find({"radius"}), of.find({"scale_0"}), of.find({"scale_1"}), of.find({"scale_2"}),
           of.find({"f_dc_0"}), of.find({"f_dc_1"}),  of.find({"f_dc_2"}),  of.find({"opacity"})} {}
  bool have_sizes() const { return at[0] >= 0 || (at[1] >= 0 && at[2] >= 0 && at[3] >= 0); }
  bool have_colours() const { return at[4] >= 0 && at[5] >= 0 && at[6] >= 0; }

  /// value  of a property by its number
  double radius(const auto& value) const {
    return at[0] >= 0 ? value(at[0]) : std::exp((value(at[1]) + value(at[2]) + value(at[3])) / 3);
  }
  glm::vec4 colour(const auto& value) const {
    const auto channel = [&](int i) {
      return std::clamp(0.5 + 0.5 / std::sqrt(std::numbers::pi) * value(i), 0.0, 1.0);
    };
    return {channel(at[4]), channel(at[5]), channel(at[6]),
            at[7] < 0 ? NAN : 1 / (1 + std::exp(-value(at[7])))};
  }
};

class PlyReader {
public:
  PlyReader(std::string_view bytes) : bytes_(bytes), lines_(bytes, "") {}

  Mesh read() {
    read_header();
    struct Early {
      const Element& element;
      LineScanner lines;
      std::size_t at;
    };
    std::vector<Early> early;  // faces that stand before their vertices
    for (auto one = elements_.begin(); one != elements_.end(); ++one) {
      const bool waits = one->is_faces() && std::any_of(one, elements_.end(), [](const auto& e) {
                           return e.name == "vertex";
                         });
      if (waits) early.push_back({*one, lines_, at_});
      read_element(*one, waits);
    }
    for (const auto& [element, lines, at] : early) {
      lines_ = lines;
      at_ = at;
      read_element(element, false);
    }
    if (!vertex_colours_.empty())
      builder_.set_colours(std::move(vertex_colours_), scale_);
    else if (!face_colours_.empty())
      builder_.set_triangle_colours(std::move(face_colours_), scale_);
    const bool has_faces = std::any_of(elements_.begin(), elements_.end(), [](const auto& one) {
      return one.is_faces() && one.count > 0;
    });
    if (!has_faces && !builder_.mesh.positions.empty())
      builder_.notes.add(cover_points(builder_.mesh, std::move(radii_)), "");
    return builder_.finish();
  }

private:
  using Values = std::vector<std::vector<double>>;  // of each property of an element

  const Type* type_of(std::string_view word) const {
    for (const auto& type : types)
      if (word == type.name || word == type.other) return &type;
    lines_.fail(word_in_quotes(word) + " is no type of a property");
  }

  void read_header() {
    if (!lines_.next_line() || lines_.word() != "ply")
      throw InputError("is no PLY: it starts with no \"ply\"");
    std::string format;
    for (;;) {
      if (!lines_.next_line()) throw InputError("its header has no \"end_header\"");
      const auto key = lines_.word();
      if (key == "end_header") break;
      if (key == "format") {
        format = lines_.word();
      } else if (key == "comment" || key == "obj_info") {
        if (lines_.word() == "TextureFile") texture_ = lines_.rest();
      } else if (key == "element") {
        elements_.emplace_back().name = lines_.word();
        const double count = lines_.number();
        if (!(count >= 0 && count <= 1e12) || count != std::floor(count))
          lines_.fail("an element needs a number of its kind");
        elements_.back().count = static_cast<std::uint64_t>(count);
      } else if (key == "property") {
        if (elements_.empty()) lines_.fail("a property of no element");
        Property property;
        auto type = lines_.word();
        if (type == "list") {
          property.count = type_of(lines_.word());
          type = lines_.word();
        }
        property.type = type_of(type);
        property.name = lines_.word();
        elements_.back().properties.push_back(std::move(property));
      } else if (!key.empty()) {
        builder_.notes.add(word_in_quotes(key) + " in the header is ignored", lines_.where());
      }
    }
    is_text_ = format == "ascii";
    is_swapped_ = (format == "binary_big_endian") != (std::endian::native == std::endian::big);
    if (!is_text_ && format != "binary_little_endian" && format != "binary_big_endian")
      throw InputError("its format is none of ascii, binary_little_endian, binary_big_endian");
    // A first byte of 0x0A belongs to the data, unless all lines end with \r\n
    at_ = lines_.end();
    const auto first = bytes_.find_first_of("\r\n");
    if (bytes_[first] == '\r' && bytes_[first + 1] != '\n' && bytes_[at_ - 1] == '\n') --at_;
  }

  double value(const Type& type) {
    if (is_text_) return lines_.number();
    if (bytes_.size() - at_ < type.size) throw InputError(place() + ": the file ends too soon");
    std::array<char, 8> b{};
    std::memcpy(b.data(), bytes_.data() + at_, type.size);
    at_ += type.size;
    if (is_swapped_) std::reverse(b.begin(), b.begin() + static_cast<std::ptrdiff_t>(type.size));
    return type.read(b.data());
  }

  std::string place() const {
    return is_text_ ? lines_.where() : element_->name + ' ' + std::to_string(number_);
  }

  /// Reads the next of an element, all of its properties.
  void read_one(const Element& element, Values& values) {
    if (is_text_) {
      std::string_view first;
      do {
        if (!lines_.next_line()) throw InputError(place() + ": the file ends too soon");
        auto ahead = lines_;
        first = ahead.rest();
      } while (first.empty());
    }
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const auto& property = element.properties[i];
      const double count = property.count ? value(*property.count) : 1;
      if (!(count >= 0 && count <= static_cast<double>(bytes_.size())))
        throw InputError(place() + ": a list of " + std::to_string(count) + " numbers");
      values[i].clear();
      for (auto left = static_cast<std::uint64_t>(count); left > 0; --left)
        values[i].push_back(value(*property.type));
    }
    if (is_text_ && !lines_.word().empty())
      throw InputError(place() + ": has more numbers than the header says");
  }

  /// Notes what of an element nobody reads.
  void note_others(const Element& element, std::vector<int> known) {
    std::string names;
    for (std::size_t i = 0; i < element.properties.size(); ++i)
      if (std::find(known.begin(), known.end(), static_cast<int>(i)) == known.end())
        names += (names.empty() ? "" : ", ") + element.properties[i].name;
    if (!names.empty() && element.count > 0)
      builder_.notes.add("of each " + element.name + " is ignored: " + names, "");
  }

  void read_element(const Element& element, bool skips) {
    element_ = &element;
    number_ = 0;
    std::size_t least = 0;
    for (const auto& one : element.properties)
      least += is_text_ ? 2 : (one.count ? one.count : one.type)->size;
    const auto left = bytes_.size() - (is_text_ ? lines_.end() : at_);
    if (element.count > (left + 1) / std::max<std::size_t>(least, 1))
      throw InputError("holds fewer of \"" + element.name +
                       "\" than its header says: " + std::to_string(element.count));
    if (element.name == "vertex") return read_vertices(element);
    if (element.is_faces() && !skips) return read_faces(element);
    if (element.count > 0 && !skips)
      builder_.notes.add("element \"" + element.name + "\" is ignored", "");
    Values values(element.properties.size());
    for (; number_ < element.count; ++number_) read_one(element, values);
  }

  static double one_of(const Values& values, int at, double otherwise = 0) {
    return at < 0 || values[static_cast<std::size_t>(at)].empty()
               ? otherwise
               : values[static_cast<std::size_t>(at)][0];
  }

  static glm::vec4 colour_of(const Values& values, const Colour& colour) {
    return {one_of(values, colour.at[0]), one_of(values, colour.at[1]),
            one_of(values, colour.at[2]), one_of(values, colour.at[3], NAN)};
  }

  void read_vertices(const Element& element) {
    const int x = element.find({"x"}), y = element.find({"y"}), z = element.find({"z"});
    if (x < 0 || y < 0 || z < 0) throw InputError("its vertices have no x, y and z");
    const int nx = element.find({"nx"}), ny = element.find({"ny"}), nz = element.find({"nz"}),
              u = element.find({"s", "u", "texture_u", "texture_s", "tex_u"}),
              v = element.find({"t", "v", "texture_v", "texture_t", "tex_v"});
    Colour colour(element);
    const Splats splats(element);
    const auto& c = colour.at;
    std::vector<int> known{x, y, z, nx, ny, nz, u, v, c[0], c[1], c[2], c[3]};
    known.insert(known.end(), splats.at.begin(), splats.at.end());
    note_others(element, known);
    builder_.reserve_vertices(element.count);
    Values values(element.properties.size());
    for (; number_ < element.count; ++number_) {
      read_one(element, values);
      const glm::dvec3 normal(one_of(values, nx), one_of(values, ny), one_of(values, nz));
      builder_.add_vertex({one_of(values, x), one_of(values, y), one_of(values, z)}, normal,
                          {one_of(values, u), one_of(values, v)}, [&] { return place(); });
      if (colour.is_there)
        vertex_colours_.push_back(colour_of(values, colour));
      else if (splats.have_colours())
        vertex_colours_.push_back(splats.colour([&](int at) { return one_of(values, at); }));
      if (splats.have_sizes())
        radii_.push_back(splats.radius([&](int at) { return one_of(values, at); }));
    }
    scale_ = colour.scale_of(vertex_colours_);
  }

  void read_faces(const Element& element) {
    const int corners = element.find({"vertex_indices", "vertex_index", "vertex_indexes"}),
              places = element.find({"texcoord", "texcoords"}),
              picture = element.find({"texnumber"});
    if (corners < 0 && element.count > 0) throw InputError("its faces have no \"vertex_indices\"");
    Colour colour(element);
    const auto& c = colour.at;
    note_others(element, {corners, places, picture, c[0], c[1], c[2], c[3]});
    if (colour.is_there && !vertex_colours_.empty()) {
      builder_.notes.add("colours of faces are ignored: vertices have colours", "");
      colour.is_there = false;
    }
    auto& mesh = builder_.mesh;
    std::int32_t material = -1;
    if (!texture_.empty()) {
      material = add_material(mesh, white_material(texture_));
      mesh.materials.back().look.base_map.picture = add_picture(mesh, texture_);
    }
    const auto shared = mesh.positions.size();
    Values values(element.properties.size());
    std::vector<std::uint32_t> numbers;
    for (; number_ < element.count; ++number_) {
      read_one(element, values);
      numbers.clear();
      for (const double index : values[static_cast<std::size_t>(corners)]) {
        const bool ends_strip = element.name == "tristrips" && index < 0;
        if (!ends_strip && !(index >= 0 && index < static_cast<double>(shared)))
          throw InputError(place() + ": names vertex " + std::to_string(std::llround(index)) +
                           ", and there are " + std::to_string(shared));
        numbers.push_back(ends_strip ? UINT32_MAX : static_cast<std::uint32_t>(index));
      }
      if (element.name == "tristrips") {
        add_strips(numbers);
        continue;
      }
      if (places >= 0) set_apart(numbers, values[static_cast<std::size_t>(places)]);
      builder_.add_face(numbers, material, [&] { return place(); });
      if (colour.is_there) face_colours_.resize(mesh.triangles.size(), colour_of(values, colour));
    }
    if (colour.is_there) scale_ = colour.scale_of(face_colours_);
  }

  /// Gives the corners of a face vertices of their own, with its texture coordinates.
  void set_apart(std::vector<std::uint32_t>& numbers, const std::vector<double>& places) {
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      const auto from = numbers[i];
      const glm::dvec3 position = builder_.mesh.positions[from],
                       normal = builder_.mesh.normals[from];
      const auto uv = 2 * i + 1 < places.size() ? glm::dvec2(places[2 * i], places[2 * i + 1])
                                                : builder_.mesh.uvs[from];
      numbers[i] = builder_.add_vertex(position, normal, uv, [&] { return place(); });
      if (!vertex_colours_.empty()) vertex_colours_.push_back(glm::vec4(vertex_colours_[from]));
    }
  }

  void add_strips(const std::vector<std::uint32_t>& numbers) {
    std::size_t first = 0;
    for (std::size_t i = 0; i < numbers.size(); ++i) {
      if (numbers[i] == UINT32_MAX) first = i + 1;
      if (i < first + 2) continue;
      const bool turned = (i - first) % 2 != 0;
      const std::array<std::uint32_t, 3> corners{numbers[i - 2], numbers[turned ? i : i - 1],
                                                 numbers[turned ? i - 1 : i]};
      builder_.add_face(corners, -1, [&] { return place(); });
    }
  }

  std::string_view bytes_;
  LineScanner lines_;
  MeshBuilder builder_;
  std::vector<Element> elements_;
  std::string texture_;
  bool is_text_ = false, is_swapped_ = false;
  std::size_t at_ = 0;
  const Element* element_ = nullptr;  // that is read, and of it the number
  std::uint64_t number_ = 0;
  std::vector<glm::vec4> vertex_colours_, face_colours_;
  std::vector<double> radii_;  // of points
  float scale_ = 1;
};

}  // namespace

Mesh read_ply(const std::filesystem::path& file) {
  const MappedFile bytes(file);
  return PlyReader(bytes.bytes()).read();
}

}  // namespace raywave
