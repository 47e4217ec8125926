// SPDX-License-Identifier: Apache-2.0
#include "host/scene/reader/gltf_buffers.hpp"

#include <algorithm>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <string_view>

#include "host/common/error.hpp"
#include "host/scene/reader/gltf_json.hpp"

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

/// How numbers are stored.
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

template <class T>
double number(const char* at) {
  T value;
  std::memcpy(&value, at, sizeof value);
  return value;
}

/// whole  whole numbers count as they are
Numbers numbers_of(const json& type, bool whole, const std::string& what) {
  switch (static_cast<int>(number_or(type, 0))) {
    case 5120:
      return {1, whole ? number<std::int8_t> : share<std::int8_t>};
    case 5121:
      return {1, whole ? number<std::uint8_t> : share<std::uint8_t>};
    case 5122:
      return {2, whole ? number<std::int16_t> : share<std::int16_t>};
    case 5123:
      return {2, whole ? number<std::uint16_t> : share<std::uint16_t>};
    case 5125:
      if (whole) return {4, number<std::uint32_t>};
      break;
    case 5126:
      return {4, number<float>};
    default:
      break;
  }
  throw InputError(what + " are of a type that glTF does not have there");
}

}  // namespace

std::uint64_t count_or(const json& value, std::uint64_t otherwise) {
  return value.is_number_unsigned() ? value.get<std::uint64_t>() : otherwise;
}

std::vector<double> GltfBuffers::numbers(const json& index, const std::string& type,
                                         const std::string& what, bool whole) {
  const auto& accessor = element(member(root_, "accessors"), index);
  const auto count = count_or(member(accessor, "count"), 0);
  if (text_or(member(accessor, "type"), "") != type || count == 0)
    throw InputError(what + " are no list of " + type);
  if ((left_ -= std::min(left_, count)) == 0)
    throw InputError("more than " + std::to_string(most_) + " " + what);
  const std::uint64_t size = type == "SCALAR" ? 1 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 16;
  const auto& normalized = member(accessor, "normalized");
  const auto stored =
      numbers_of(member(accessor, "componentType"),
                 whole && !(normalized.is_boolean() && normalized.get<bool>()), what);
  if (size == 16 && stored.bytes != 4) throw InputError(what + " are no floats");
  const auto read = [&](const View& view, std::uint64_t from, std::uint64_t to,
                        std::vector<double>& all) {
    for (std::uint64_t k = 0; k < size; ++k)
      all[to * size + k] = stored.read(view.first + view.step * from + k * stored.bytes);
  };

  const auto& sparse = member(accessor, "sparse");
  std::vector<double> all;
  if (!member(accessor, "bufferView").is_null() || sparse.is_null()) {
    const auto view = view_of(accessor, count, size * stored.bytes, what);
    all.resize(size * count);
    for (std::uint64_t i = 0; i < count; ++i) read(view, i, i, all);
  }
  if (sparse.is_null()) return all;
  const auto& indices = member(sparse, "indices");
  const auto changed = count_or(member(sparse, "count"), 0);
  if (changed == 0 || changed > count)
    throw InputError("a sparse part of " + what + " has no count that fits");
  const auto named = numbers_of(member(indices, "componentType"), true, what);
  const auto places = view_of(indices, changed, named.bytes, what),
             values = view_of(member(sparse, "values"), changed, size * stored.bytes, what);
  all.resize(size * count);
  for (std::uint64_t i = 0; i < changed; ++i) {
    const double place = named.read(places.first + places.step * i);
    if (!(place >= 0 && place < static_cast<double>(count)))
      throw InputError("a sparse part of " + what + " names an element that is not there");
    read(values, i, static_cast<std::uint64_t>(place), all);
  }
  return all;
}

/// Elements of `each` bytes: all of them lie in their view, and the view in its buffer.
///
/// where  names the view and the place in it
GltfBuffers::View GltfBuffers::view_of(const json& where, std::uint64_t count, std::uint64_t each,
                                       const std::string& what) {
  const auto& view = element(member(root_, "bufferViews"), member(where, "bufferView"));
  if (!view.is_object()) throw InputError(what + " are in no buffer that can be read");
  const auto& bytes = buffer(count_or(member(view, "buffer"), 0), what);
  constexpr std::uint64_t most = std::uint64_t{1} << 40;
  const auto step = count_or(member(view, "byteStride"), each),
             first = count_or(member(view, "byteOffset"), 0),
             length = count_or(member(view, "byteLength"), 0),
             in_view = count_or(member(where, "byteOffset"), 0);
  if (first > most || length > most || in_view > most || step > most || step < each ||
      first + length > bytes.size() || in_view + step * (count - 1) + each > length)
    throw InputError(what + " lie beyond the end of their buffer");
  return {bytes.data() + first + in_view, step};
}

const std::string& GltfBuffers::buffer(std::uint64_t index, const std::string& what) {
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
    throw InputError(what + " are in a buffer that is not there");
  }
  return known->second;
}

}  // namespace raywave
