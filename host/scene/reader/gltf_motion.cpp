// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "host/common/error.hpp"
#include "host/scene/reader/gltf_json.hpp"
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader_reply.hpp"

namespace raywave {
namespace {

using nlohmann::json;
namespace fs = std::filesystem;

std::string bytes_of_file(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw InputError("its buffer " + file.filename().string() + " cannot be read");
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

/// The bytes of a GLB file's second chunk.
std::string binary_part(const fs::path& file) {
  const auto all = bytes_of_file(file);
  const auto word = [&](std::uint64_t at) {
    std::uint32_t value = 0;
    if (at + 4 <= all.size()) std::memcpy(&value, all.data() + at, 4);
    return std::uint64_t{value};
  };
  const auto at = 20 + word(12), size = word(at);
  constexpr std::uint32_t binary = 0x004e4942;
  if (word(at + 4) != binary || at + 8 + size > all.size())
    throw InputError("it has no binary part");
  return all.substr(at + 8, size);
}

std::string base64_decoded(std::string_view text) {
  constexpr std::string_view digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t word = 0;
  int bits = 0;
  for (const char c : text.substr(0, text.find('='))) {
    const auto digit = digits.find(c);
    if (digit == std::string_view::npos) throw InputError("a buffer's base64 is damaged");
    word = word << 6 | static_cast<std::uint32_t>(digit);
    if ((bits += 6) < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(word >> bits & 255);
  }
  return bytes;
}

/// "a%20b" as files are called.
std::string without_escapes(std::string_view uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    constexpr std::string_view digits = "0123456789abcdefABCDEF";
    const bool is_escape = uri[i] == '%' && i + 2 < uri.size() &&
                           uri.substr(i + 1, 2).find_first_not_of(digits) == uri.npos;
    text += is_escape ? static_cast<char>(std::stoi(std::string(uri.substr(i + 1, 2)), nullptr, 16))
                      : uri[i];
    if (is_escape) i += 2;
  }
  return text;
}

/// How an accessor's numbers are stored.
struct Numbers {
  std::size_t bytes = 0;
  double (*read)(const char*) = nullptr;
};

/// A whole number that stands for -1 to 1, or 0 to 1.
template <class Integer>
double share(const char* at) {
  Integer value;
  std::memcpy(&value, at, sizeof value);
  return std::max(-1.0, static_cast<double>(value) / std::numeric_limits<Integer>::max());
}

double number(const char* at) {
  float value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

Numbers numbers_of(const json& accessor) {
  switch (static_cast<int>(number_or(member(accessor, "componentType"), 0))) {
    case 5120:
      return {1, share<std::int8_t>};
    case 5121:
      return {1, share<std::uint8_t>};
    case 5122:
      return {2, share<std::int16_t>};
    case 5123:
      return {2, share<std::uint16_t>};
    case 5126:
      return {4, number};
    default:
      throw InputError("keys of an animation are of a type that glTF does not have there");
  }
}

/// A whole number, >= 0; `otherwise` where there is none.
std::uint64_t count_or(const json& value, std::uint64_t otherwise) {
  return value.is_number_unsigned() ? value.get<std::uint64_t>() : otherwise;
}

/// The numbers in a file's buffers.
class Buffers {
public:
  Buffers(const json& root, const fs::path& file) : root_(root), file_(file) {}

  /// Vectors of up to four numbers.
  std::vector<glm::dvec4> vectors(const json& index, const char* type, int size) {
    const auto& accessor = element(member(root_, "accessors"), index);
    const auto count = count_or(member(accessor, "count"), 0);
    if (text_or(member(accessor, "type"), "") != type || count == 0)
      throw InputError(std::string("keys of an animation are no list of ") + type);
    if ((left_ -= std::min(left_, count)) == 0)
      throw InputError("more than " + std::to_string(most_keys_of_file) + " keys of animations");
    if (!member(accessor, "sparse").is_null())
      throw InputError("keys of an animation are in a sparse accessor, which is not read");
    const auto numbers = numbers_of(accessor);
    const auto& view = element(member(root_, "bufferViews"), member(accessor, "bufferView"));
    if (!view.is_object())
      throw InputError("keys of an animation are in no buffer that can be read");
    const auto& bytes = buffer(count_or(member(view, "buffer"), 0));

    // All numbers lie in the view, and the view in the buffer
    constexpr std::uint64_t most = std::uint64_t{1} << 40;
    const auto each = static_cast<std::uint64_t>(size) * numbers.bytes,
               step = count_or(member(view, "byteStride"), each),
               first = count_or(member(view, "byteOffset"), 0),
               length = count_or(member(view, "byteLength"), 0),
               in_view = count_or(member(accessor, "byteOffset"), 0);
    if (first > most || length > most || in_view > most || step > most ||
        first + length > bytes.size() || in_view + step * (count - 1) + each > length)
      throw InputError("keys of an animation lie beyond the end of their buffer");
    std::vector<glm::dvec4> all(count, glm::dvec4(0));
    for (std::uint64_t i = 0; i < count; ++i)
      for (int k = 0; k < size; ++k)
        all[i][k] = numbers.read(bytes.data() + first + in_view + step * i +
                                 static_cast<std::uint64_t>(k) * numbers.bytes);
    return all;
  }

private:
  const std::string& buffer(std::uint64_t index) {
    const auto [known, is_new] = buffers_.try_emplace(index);
    if (!is_new) return known->second;
    const auto& made = element(member(root_, "buffers"), json(index));
    const auto uri = text_or(member(made, "uri"), "");
    constexpr std::string_view base64 = ";base64,";
    if (uri.empty() && index == 0 && lower_extension(file_) == ".glb") {
      known->second = binary_part(file_);
    } else if (uri.starts_with("data:")) {
      const auto at = uri.find(base64);
      if (at == std::string::npos) throw InputError("a buffer is no base64");
      known->second = base64_decoded(std::string_view(uri).substr(at + base64.size()));
    } else if (!uri.empty() && uri.find('\0') == std::string::npos) {
      std::error_code error;
      const auto beside = file_.parent_path() / uri;
      known->second = bytes_of_file(
          fs::is_regular_file(beside, error) ? beside : file_.parent_path() / without_escapes(uri));
    } else {
      throw InputError("keys of an animation are in a buffer that is not there");
    }
    return known->second;
  }

  const json& root_;
  const fs::path& file_;
  std::map<std::uint64_t, std::string> buffers_;
  std::uint64_t left_ = most_keys_of_file;
};

std::string cut(std::string text) {
  text.resize(std::min(text.size(), longest_text));
  return text;
}

class MotionReader {
public:
  MotionReader(const json& root, const fs::path& file) : root_(root), buffers_(root, file) {}

  GltfMotion read() {
    int cameras = 0, lights = 0;
    for_each_node(
        root_, [&](const json& node, std::int32_t number, std::int32_t parent, const glm::dmat4&) {
          if (motion_.nodes.size() >= most_nodes_of_file)
            throw InputError("more than " + std::to_string(most_nodes_of_file) + " nodes");
          place_.emplace(number, static_cast<std::int32_t>(motion_.nodes.size()));
          auto& made = motion_.nodes.emplace_back(gltf_place_of(node));
          made.number = number;
          made.parent = parent;
          made.has_mesh = member(node, "mesh").is_number_unsigned();
          if (camera_of(root_, node).is_object()) made.camera = cameras++;
          if (light_of(root_, node).is_object()) made.light = lights++;
          motion_.names.push_back(cut(text_or(member(node, "name"), "")));
          if (made.has_mesh && member(node, "skin").is_number_unsigned())
            note("meshes with a skin move with their node, and not with its joints");
        });
    const auto& animations = member(root_, "animations");
    for (std::size_t i = 0; animations.is_array() && i < animations.size(); ++i) {
      if (i >= most_animations_of_file)
        throw InputError("more than " + std::to_string(most_animations_of_file) + " animations");
      read_animation(animations[i]);
    }
    return std::move(motion_);
  }

private:
  void note(const char* what) {
    if (std::find(motion_.notes.begin(), motion_.notes.end(), what) == motion_.notes.end())
      motion_.notes.emplace_back(what);
  }

  void read_animation(const json& animation) {
    auto& made = motion_.animations.emplace_back();
    made.name = cut(text_or(member(animation, "name"), ""));
    for (const auto& channel : member(animation, "channels")) {
      const auto& target = member(channel, "target");
      const auto path = text_or(member(target, "path"), "");
      if (path == "weights") note("weights of morph targets do not change");
      if (path == "pointer") note("only nodes are moved (KHR_animation_pointer is ignored)");
      const auto found = place_.find(static_cast<std::int32_t>(
          std::min<std::uint64_t>(count_or(member(target, "node"), INT32_MAX), INT32_MAX)));
      constexpr std::array<const char*, 3> paths{"translation", "rotation", "scale"};
      const auto known = std::find(paths.begin(), paths.end(), path);
      if (known == paths.end() || found == place_.end()) continue;
      if (++channels_ > most_moves_of_file)
        throw InputError("more than " + std::to_string(most_moves_of_file) +
                         " values are animated");
      const auto& sampler = element(member(animation, "samplers"), member(channel, "sampler"));
      made.channels.push_back(read_channel(sampler, found->second,
                                           static_cast<GltfChannel::Path>(known - paths.begin())));
    }
  }

  GltfChannel read_channel(const json& sampler, std::int32_t node, GltfChannel::Path path) {
    const auto steps = text_or(member(sampler, "interpolation"), "LINEAR");
    GltfChannel channel;
    channel.node = node;
    channel.path = path;
    channel.steps = steps == "STEP"          ? GltfChannel::Steps::step
                    : steps == "CUBICSPLINE" ? GltfChannel::Steps::cubic
                                             : GltfChannel::Steps::linear;
    if (motion_.nodes[static_cast<std::size_t>(node)].has_matrix != 0)
      throw InputError("a node that is animated has a matrix");
    for (const auto& t : buffers_.vectors(member(sampler, "input"), "SCALAR", 1)) {
      if (!(t.x >= 0 && t.x <= 1e15) ||
          (!channel.times_s.empty() && !(t.x > channel.times_s.back())))
        throw InputError("times of an animation do not ascend from 0");
      channel.times_s.push_back(t.x);
    }
    const bool is_turn = path == GltfChannel::Path::rotation;
    channel.values =
        buffers_.vectors(member(sampler, "output"), is_turn ? "VEC4" : "VEC3", is_turn ? 4 : 3);
    const std::size_t each = channel.steps == GltfChannel::Steps::cubic ? 3 : 1;
    if (channel.values.size() != each * channel.times_s.size())
      throw InputError("an animation has not as many values as times");
    for (std::size_t i = 0; i < channel.values.size(); ++i) {
      auto& v = channel.values[i];
      for (int k = 0; k < 4; ++k)
        if (!(std::abs(v[k]) <= 1e15)) throw InputError("a value of an animation is no number");
      if (!is_turn || i % each != each / 2) continue;
      const double length = std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z + v.w * v.w);
      if (!(length > 1e-6)) throw InputError("a rotation of an animation is zero");
      v /= length;
    }
    return channel;
  }

  const json& root_;
  Buffers buffers_;
  GltfMotion motion_;
  std::map<std::int32_t, std::int32_t> place_;  // of a node in motion_.nodes, by its number
  std::size_t channels_ = 0;
};

}  // namespace

GltfMotion read_gltf_motion(const fs::path& file) {
  const json root = gltf_json(file);
  if (!is_gltf2(root)) throw InputError("it is no glTF of version 2");
  return MotionReader(root, file).read();
}

}  // namespace raywave
