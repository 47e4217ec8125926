// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader/gltf_file.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <glm/common.hpp>
#include <limits>
#include <set>
#include <type_traits>

#include "host/common/error.hpp"
#include "host/common/uri.hpp"
#include "host/scene/gltf_motion.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

// Sums of numbers up to this do not overflow
constexpr std::uint64_t most_bytes = std::uint64_t{1} << 40;

std::string base64_decoded(std::string_view text) {
  constexpr std::string_view digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::array<int, 256> value{};
  value.fill(-1);
  for (std::size_t i = 0; i < digits.size(); ++i)
    value[static_cast<unsigned char>(digits[i])] = static_cast<int>(i);
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3 + 3);
  unsigned word = 0;
  int bits = 0;
  for (const char c : text.substr(0, text.find('='))) {
    const int digit = value[static_cast<unsigned char>(c)];
    if (digit < 0) throw InputError("the base64 of a data URI is damaged");
    word = (word << 6 | static_cast<unsigned>(digit)) & 0xffff;
    if ((bits += 6) < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(word >> bits & 255);
  }
  return bytes;
}

/// Text whose bytes that are no UTF-8 are replaced: exporters write names in any encoding.
std::string as_utf8(std::string_view text) {
  const auto quoted = json(text).dump(-1, ' ', false, json::error_handler_t::replace);
  return json::parse(quoted).get<std::string>();
}

/// throws  InputError with the line of what is no JSON
json parsed(std::string_view text) {
  if (auto root = json::parse(text, nullptr, false); !root.is_discarded()) return root;
  const auto repaired = as_utf8(text);
  try {
    return json::parse(repaired);
  } catch (const json::parse_error& error) {
    const auto before = repaired.substr(0, error.byte);
    throw InputError("its JSON is damaged in line " +
                     std::to_string(1 + std::count(before.begin(), before.end(), '\n')) +
                     "; export the file again");
  } catch (const json::exception&) {
    throw InputError("its JSON has a number that is too large; export the file again");
  }
}

template <class T>
double value_at(const char* at, bool is_share) {
  const double number = number_at<T>(at);
  return is_share && std::is_integral_v<T>
             ? std::max(-1.0, number / static_cast<double>(std::numeric_limits<T>::max()))
             : number;
}

/// throws  InputError where a value is there, and of no type that is wanted
bool is_there(const json& value, bool is_sound, const char* wanted) {
  if (!value.is_null() && !is_sound)
    throw InputError("its JSON has " + as_utf8(value.dump().substr(0, 60)) + " where " + wanted +
                     " is wanted; export the file again");
  return !value.is_null();
}

}  // namespace

const json& member(const json& object, const char* name) {
  static const json none;
  if (!is_there(object, object.is_object(), "an object")) return none;
  const auto found = object.find(name);
  return found == object.end() ? none : *found;
}

const json& element(const json& array, const json& index) {
  static const json none;
  const auto number = count_or(index, UINT64_MAX);
  return is_there(array, array.is_array(), "a list") && number < array.size() ? array[number]
                                                                              : none;
}

const json& extension(const json& object, const char* name) {
  return member(member(object, "extensions"), name);
}

double number_or(const json& value, double otherwise) {
  return is_there(value, value.is_number(), "a number") ? value.get<double>() : otherwise;
}

double number_or(const json& value, double otherwise, double low, double high) {
  return std::clamp(number_or(value, otherwise), low, high);
}

std::uint64_t count_or(const json& value, std::uint64_t otherwise) {
  const double number = value.is_number_float() ? value.get<double>() : -1;  // 1.0 is whole, too
  const bool is_whole =
      value.is_number_unsigned() || (number >= 0 && number < 1e15 && number == std::floor(number));
  return is_there(value, is_whole, "a whole number") ? value.get<std::uint64_t>() : otherwise;
}

std::string text_or(const json& value, const std::string& otherwise) {
  return is_there(value, value.is_string(), "a text") ? value.get<std::string>() : otherwise;
}

std::string name_or(const json& value, const std::string& otherwise) {
  auto name = text_or(value, otherwise);
  name.resize(std::min(name.size(), longest_text));
  return name;
}

namespace {

template <class Vector>
Vector numbers_or(const json& array, const Vector& otherwise) {
  if (!is_there(array,
                array.is_array() && array.size() == static_cast<std::size_t>(Vector::length()),
                "a vector"))
    return otherwise;
  Vector v;
  for (int i = 0; i < Vector::length(); ++i)
    v[i] = number_or(array[static_cast<std::size_t>(i)], 0, -1e15, 1e15);
  return v;
}

}  // namespace

glm::dvec3 vector_or(const json& value, glm::dvec3 otherwise) {
  return numbers_or(value, otherwise);
}

glm::dvec3 colour_or(const json& value, glm::dvec3 otherwise) {
  return glm::clamp(vector_or(value, otherwise), 0.0, 1e15);
}

void add_note(std::vector<std::string>& notes, const std::string& note) {
  if (notes.size() < most_notes_of_file &&
      std::find(notes.begin(), notes.end(), note) == notes.end())
    notes.push_back(note.substr(0, longest_text));
}

bool GltfNumbers::set_type(std::uint64_t component_type) {
  struct Kind {
    std::uint64_t type, bytes;
    double (*read)(const char*, bool);
  };
  constexpr std::array<Kind, 6> kinds{{{5120, 1, value_at<std::int8_t>},
                                       {5121, 1, value_at<std::uint8_t>},
                                       {5122, 2, value_at<std::int16_t>},
                                       {5123, 2, value_at<std::uint16_t>},
                                       {5125, 4, value_at<std::uint32_t>},
                                       {floats, 4, value_at<float>}}};
  const auto found = std::find_if(kinds.begin(), kinds.end(),
                                  [&](const Kind& kind) { return kind.type == component_type; });
  if (found == kinds.end()) return false;
  type = found->type, bytes = found->bytes, read = found->read;
  return true;
}

double GltfNumbers::at(std::uint64_t element, std::uint64_t component) const {
  const char* from = first ? first + step * element : nullptr;
  if (!changed.empty()) {
    const auto found = std::lower_bound(changed.begin(), changed.end(), element,
                                        [](const auto& one, auto i) { return one.first < i; });
    if (found != changed.end() && found->first == element) from = found->second;
  }
  return from ? read(from + component * bytes, is_share) : 0;
}

std::unique_ptr<GltfFile> GltfFile::open(const fs::path& file) {
  const auto kind = lower(file.extension().string());
  std::array<char, 4> magic{};
  std::ifstream(file, std::ios::binary).read(magic.data(), magic.size());
  const bool is_binary = std::string_view(magic.data(), magic.size()) == "glTF";
  if (!is_binary && kind != ".gltf" && kind != ".glb") return nullptr;
  std::unique_ptr<GltfFile> gltf(new GltfFile(file));
  gltf->files_.push_back(std::make_unique<MappedFile>(file));
  const auto content = gltf->files_.back()->bytes();
  if (is_binary) {
    const auto word = [&](std::size_t at) {
      return at + 4 <= content.size() ? std::size_t{number_at<std::uint32_t>(&content[at])} : 0;
    };
    if (word(4) == 1) return nullptr;
    constexpr std::size_t text = 0x4e4f534a, binary = 0x004e4942;
    for (std::size_t at = 12; at + 8 <= content.size(); at += 8 + word(at)) {
      if (word(at) > content.size() - at - 8) throw InputError("the file ends too soon");
      const auto chunk = content.substr(at + 8, word(at));
      if (word(at + 4) == text && gltf->root_.is_null()) gltf->root_ = parsed(chunk);
      if (word(at + 4) == binary && !gltf->binary_.data()) gltf->binary_ = chunk;
    }
  } else {
    gltf->root_ = parsed(content);
  }
  const auto& asset = member(gltf->root_, "asset");
  const auto& stated = member(asset, "version");
  const auto version = stated.is_number() ? stated.dump() : text_or(stated, "");
  const bool is_first = member(gltf->root_, "meshes").is_object();  // glTF 1 names its meshes
  if (version.starts_with("1") || is_first) return nullptr;
  const auto least = text_or(member(asset, "minVersion"), "2.0");
  if (!version.starts_with("2") || least != "2.0")
    throw InputError("its asset.version is " + (version.empty() ? "missing" : '"' + version + '"') +
                     (least == "2.0" ? "" : ", of which it needs " + least) +
                     "; export it as glTF 2.0");
  gltf->check_extensions();
  return gltf;
}

/// Refuses what is required and not read, and notes what is used and not read.
void GltfFile::check_extensions() {
  constexpr std::array read{
      "EXT_mesh_gpu_instancing",    "EXT_meshopt_compression",
      "EXT_texture_webp",           "KHR_draco_mesh_compression",
      "KHR_lights_punctual",        "KHR_materials_emissive_strength",
      "KHR_materials_ior",          "KHR_materials_pbrSpecularGlossiness",
      "KHR_materials_transmission", "KHR_materials_unlit",
      "KHR_mesh_quantization",      "KHR_node_visibility",
      "KHR_texture_transform",      "KHR_xmp_json_ld"};       // says nothing of looks
  constexpr const char* variants = "KHR_materials_variants";  // the first of them is shown
  const auto is_read = [&](const std::string& name) {
    return std::find(read.begin(), read.end(), name) != read.end();
  };
  for (const auto& value : member(root_, "extensionsRequired"))
    if (const auto name = text_or(value, "?"); !is_read(name) && name != variants)
      throw InputError("it requires the extension " + name.substr(0, 100) +
                       ", which raywave does not read; export the file without it");
  for (const auto& value : member(root_, "extensionsUsed")) {
    const auto name = text_or(value, "?");
    // Each material says which it has
    const bool is_of_materials = name.starts_with("KHR_materials_") && name != variants;
    if (!is_read(name) && !is_of_materials)
      add_note(notes_, "the extension " + name + " is ignored");
  }
}

GltfNumbers GltfFile::numbers(const json& index, const std::string& kind, const std::string& what,
                              bool whole, std::uint64_t most) {
  const auto& accessor = of("accessors", index);
  GltfNumbers made;
  made.count = count_or(member(accessor, "count"), 0);
  if (text_or(member(accessor, "type"), "") != kind || made.count == 0)
    throw InputError(what + " are no list of " + kind);
  require_at_most(made.count, most, what);
  made.components = kind == "SCALAR" ? 1 : kind == "MAT4" ? 16 : kind[3] - '0';
  made.is_share = !whole || member(accessor, "normalized") == json(true);
  if (!made.set_type(count_or(member(accessor, "componentType"), 0)) ||
      (made.type == 5125 && made.is_share))
    throw InputError(what + " are of a type that glTF does not have there");
  const auto each = made.components * made.bytes;
  if (kind == "MAT4" && made.type != GltfNumbers::floats) throw InputError(what + " are no floats");
  const auto& sparse = member(accessor, "sparse");
  if (!member(accessor, "bufferView").is_null() || sparse.is_null())
    made.first = elements(accessor, made.count, each, made.step, what);
  if (sparse.is_null()) return made;

  const auto& indices = member(sparse, "indices");
  const auto changed = count_or(member(sparse, "count"), 0);
  if (changed == 0 || changed > made.count)
    throw InputError("a sparse part of " + what + " has no count that fits");
  GltfNumbers places;
  if (!places.set_type(count_or(member(indices, "componentType"), 0)))
    throw InputError("a sparse part of " + what + " has no numbers of elements");
  places.first = elements(indices, changed, places.bytes, places.step, what);
  std::uint64_t step = 0;
  const char* values = elements(member(sparse, "values"), changed, each, step, what);
  for (std::uint64_t i = 0; i < changed; ++i) {
    const double place = places.at(i, 0);
    if (!(place >= 0 && place < static_cast<double>(made.count)))
      throw InputError("a sparse part of " + what + " names an element that is not there");
    made.changed.emplace_back(static_cast<std::uint64_t>(place), values + step * i);
  }
  std::stable_sort(made.changed.begin(), made.changed.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  return made;
}

/// Elements of `each` bytes: all of them lie in their view, and the view in its buffer.
///
/// where  names the view and the place in it
/// step   set to the bytes between them
const char* GltfFile::elements(const json& where, std::uint64_t count, std::uint64_t each,
                               std::uint64_t& step, const std::string& what) {
  const auto& index = member(where, "bufferView");
  const auto bytes = view(index, what);
  step = count_or(member(of("bufferViews", index), "byteStride"), each);
  const auto first = count_or(member(where, "byteOffset"), 0);
  if (first > most_bytes || step > most_bytes || count > most_bytes || step < each ||
      (count - 1) > most_bytes / step || first + step * (count - 1) + each > bytes.size())
    throw InputError(what + " lie beyond the end of their buffer");
  return bytes.data() + first;
}

std::string_view GltfFile::view(const json& index, const std::string& what) {
  const auto& view = of("bufferViews", index);
  if (!view.is_object()) throw InputError(what + " are in no buffer that can be read");
  const auto slice = [&](const json& where) {
    const auto bytes = buffer(count_or(member(where, "buffer"), 0), what);
    const auto first = count_or(member(where, "byteOffset"), 0),
               length = count_or(member(where, "byteLength"), 0);
    if (first > bytes.size() || length > bytes.size() - first)
      throw InputError(what + " lie beyond the end of their buffer");
    return bytes.substr(first, length);
  };
  const auto& how = extension(view, "EXT_meshopt_compression");
  if (!how.is_object()) return slice(view);
  const auto [known, is_new] = decompressed_.try_emplace(index.get<std::uint64_t>());
  if (is_new) {
    const auto bytes = slice(how);
    const auto count = count_or(member(how, "count"), 0),
               step = count_or(member(how, "byteStride"), 0);
    const auto mode = text_or(member(how, "mode"), ""),
               filter = text_or(member(how, "filter"), "NONE");
    const bool is_list = mode == "ATTRIBUTES",
               is_sound = is_list ? step > 0 && step % 4 == 0 && step <= 256
                                  : (step == 2 || step == 4) && filter == "NONE" &&
                                        (mode == "INDICES" || mode == "TRIANGLES") &&
                                        (mode == "INDICES" || count % 3 == 0);
    const bool is_filter = filter == "NONE" ||
                           (filter == "OCTAHEDRAL" && (step == 4 || step == 8)) ||
                           (filter == "QUATERNION" && step == 8) || filter == "EXPONENTIAL";
    if (!is_sound || !is_filter || count == 0 || count > most_bytes / 256)
      throw InputError(what + " are compressed by no way of EXT_meshopt_compression");
    auto& plain = known->second;
    plain.resize(count * step);
    const auto* from = reinterpret_cast<const unsigned char*>(bytes.data());
    const int failed =
        is_list ? meshopt_decodeVertexBuffer(plain.data(), count, step, from, bytes.size())
        : mode == "TRIANGLES"
            ? meshopt_decodeIndexBuffer(plain.data(), count, step, from, bytes.size())
            : meshopt_decodeIndexSequence(plain.data(), count, step, from, bytes.size());
    if (failed != 0) throw InputError(what + " are damaged (EXT_meshopt_compression)");
    if (filter == "OCTAHEDRAL") meshopt_decodeFilterOct(plain.data(), count, step);
    if (filter == "QUATERNION") meshopt_decodeFilterQuat(plain.data(), count, step);
    if (filter == "EXPONENTIAL") meshopt_decodeFilterExp(plain.data(), count, step);
  }
  return known->second;
}

std::string_view GltfFile::buffer(std::uint64_t index, const std::string& what) {
  if (const auto known = buffers_.find(index); known != buffers_.end()) return known->second;
  const auto& made = of("buffers", json(index));
  const auto uri = text_or(member(made, "uri"), "");
  if (uri.empty() && index == 0 && binary_.data()) return binary_;
  if (uri.empty()) throw InputError(what + " are in a buffer that is not there");
  auto found = resource(uri);
  if (!found.is_file) {
    root_["buffers"][index]["uri"] = nullptr;  // its memory is wanted
    return buffers_.emplace(index, decoded_.emplace_back(std::move(found.bytes))).first->second;
  }
  if (!found.is_there)
    throw InputError("its buffer " + found.name.substr(0, 100) +
                     " cannot be read: put it where the glTF file says");
  files_.push_back(std::make_unique<MappedFile>(file_.parent_path() / found.name));
  return buffers_.emplace(index, files_.back()->bytes()).first->second;
}

GltfResource GltfFile::resource(const std::string& uri) const {
  if (uri.starts_with("data:")) {
    const auto comma = uri.find(',');
    if (comma == std::string::npos) throw InputError("a data URI has no data");
    const bool is_base64 = std::string_view(uri).substr(0, comma).ends_with(";base64");
    const auto data = std::string_view(uri).substr(comma + 1);
    return {"", is_base64 ? base64_decoded(data) : without_escapes(data), false, true};
  }
  // Names that were never escaped, or have the signs of a query, are common
  const auto plain = without_escapes(uri);
  for (const auto& name : {plain, uri, without_escapes(uri.substr(0, uri.find_first_of("?#")))}) {
    std::error_code error;
    if (name.find('\0') == std::string::npos &&
        fs::is_regular_file(file_.parent_path() / name, error))
      return {name, "", true, true};
  }
  return {plain.substr(0, plain.find('\0')), "", true, false};
}

GltfNode gltf_place_of(const json& node) {
  GltfNode place;
  const auto& matrix = member(node, "matrix");
  if (matrix.is_array() && matrix.size() == 16) {
    place.has_matrix = 1;
    for (int i = 0; i < 16; ++i)
      place.matrix[i / 4][i % 4] = number_or(matrix[static_cast<std::size_t>(i)], 0, -1e15, 1e15);
    return place;
  }
  place.translation = vector_or(member(node, "translation"), glm::dvec3(0));
  place.scale = vector_or(member(node, "scale"), glm::dvec3(1));
  const auto q = numbers_or(member(node, "rotation"), glm::dvec4(0, 0, 0, 1));
  const double length = std::sqrt(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w);
  if (length > 0) place.rotation = {q.x / length, q.y / length, q.z / length, q.w / length};
  return place;
}

/// Numbers of the nodes at the top of the file's scene; without scenes, of those that are in no
/// other node.
std::vector<json> GltfFile::top_nodes() const {
  const auto &chosen = member(root_, "scene"), &scenes = member(root_, "scenes");
  if (!chosen.is_null() || (scenes.is_array() && !scenes.empty())) {
    const auto& scene = element(scenes, chosen.is_null() ? json(0u) : chosen);
    if (!scene.is_object())
      throw InputError("its scene " + chosen.dump().substr(0, 20) + " is not there");
    const auto& nodes = member(scene, "nodes");
    return nodes.is_array() ? nodes.get<std::vector<json>>() : std::vector<json>{};
  }
  const auto& nodes = member(root_, "nodes");
  std::set<std::uint64_t> inner;
  for (const auto& node : nodes)
    for (const auto& child : member(node, "children")) inner.insert(count_or(child, 0));
  std::vector<json> top;
  for (std::size_t i = 0; nodes.is_array() && i < nodes.size(); ++i)
    if (!inner.contains(i)) top.emplace_back(i);
  return top;
}

std::string GltfFile::for_each_node(const Visit& visit) const {
  struct Pending {
    json index;
    std::int32_t parent;
    glm::dmat4 world_from_parent;
    bool is_shown;
  };
  std::string fault;
  std::set<std::uint64_t> seen;
  std::vector<Pending> pending;
  for (const auto& index : top_nodes()) pending.push_back({index, -1, glm::dmat4(1), true});
  std::reverse(pending.begin(), pending.end());  // the last one is visited first
  for (std::int32_t visited = 0; !pending.empty();) {
    const auto next = pending.back();
    pending.pop_back();
    const auto& node = of("nodes", next.index);
    if (!node.is_object() || !seen.insert(next.index.get<std::uint64_t>()).second) {
      fault = "node " + next.index.dump().substr(0, 20) +
              (node.is_object() ? " is in several places; give each a node of its own"
                                : " is not there");
      continue;
    }
    const auto pose = next.world_from_parent * matrix_of(gltf_place_of(node));
    for (int i = 0; i < 4; ++i)
      for (int j = 0; j < 4; ++j)
        if (!(std::abs(pose[i][j]) <= 1e30)) throw InputError("a node is nowhere");
    const bool is_shown =
        next.is_shown && member(extension(node, "KHR_node_visibility"), "visible") != json(false);
    visit(node, next.index.get<std::int32_t>(), next.parent, pose, is_shown);
    const auto& children = member(node, "children");
    for (auto child = children.rbegin(); children.is_array() && child != children.rend(); ++child)
      pending.push_back({*child, visited, pose, is_shown});
    ++visited;
  }
  return fault;
}

}  // namespace raywave
