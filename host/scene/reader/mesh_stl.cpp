// SPDX-License-Identifier: Apache-2.0
// STL, binary (with the colours of Magics and of VisCAM) and text.
#include <algorithm>
#include <array>

#include "host/scene/reader/mesh_builder.hpp"
#include "host/scene/reader/mesh_text.hpp"
#include "host/scene/reader/readers.hpp"

namespace raywave {
namespace {

constexpr std::size_t kHeader = 84, kFacet = 50;

glm::dvec3 vector_at(const char* place) { return number_at<glm::vec3>(place); }

glm::vec4 colour_of(std::uint16_t attribute, bool red_is_low) {
  const auto part = [&](int shift) { return static_cast<float>(attribute >> shift & 31) / 31; };
  return {part(red_is_low ? 0 : 10), part(5), part(red_is_low ? 10 : 0), 1};
}

Mesh read_binary(std::string_view bytes, std::uint64_t count) {
  MeshBuilder builder;
  const auto mark = bytes.substr(0, 80).find("COLOR=");
  const bool is_magics = mark != std::string_view::npos && mark + 10 <= 80;
  glm::vec4 general(1);
  for (std::size_t i = 0; i < 3 && is_magics; ++i)
    general[static_cast<int>(i)] = number_at<std::uint8_t>(&bytes[mark + 6 + i]) / 255.0f;
  bool has_attributes = false, has_colours = is_magics;
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto attribute = number_at<std::uint16_t>(&bytes[kHeader + kFacet * i + 48]);
    has_attributes |= attribute != 0;
    has_colours |= (attribute & 0x8000) != 0;
  }
  std::vector<glm::vec4> colours;
  builder.reserve_vertices(3 * count);
  for (std::uint64_t i = 0; i < count; ++i) {
    const auto* place = &bytes[kHeader + kFacet * i];
    std::array<std::uint32_t, 3> corners{};
    const auto where = [&] { return "facet " + std::to_string(i); };
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = builder.add_vertex(vector_at(place + 12 * (k + 1)), vector_at(place),
                                      glm::dvec2(0), where);
    builder.add_face(corners, -1, where);
    // Magics' bit is set where a facet has the general colour, VisCAM's where it has its own
    const auto attribute = number_at<std::uint16_t>(place + 48);
    const bool is_own = has_attributes && ((attribute & 0x8000) != 0) != is_magics;
    if (has_colours)
      colours.insert(colours.end(), 3, is_own ? colour_of(attribute, is_magics) : general);
  }
  if (has_colours) builder.set_colours(std::move(colours), 1);
  if (bytes.size() > kHeader + kFacet * count)
    builder.notes.add(std::to_string(bytes.size() - kHeader - kFacet * count) +
                          " bytes behind the last facet are ignored",
                      "");
  return builder.finish();
}

Mesh read_text(std::string_view bytes) {
  MeshBuilder builder;
  LineScanner lines(bytes, "");
  glm::dvec3 normal(0);
  std::vector<std::uint32_t> corners;
  bool is_open = false;
  const auto where = [&] { return lines.where(); };
  while (lines.next_line()) {
    const auto key = lower(lines.word());
    if (key == "facet") {
      is_open = true;
      corners.clear();
      normal = glm::dvec3(0);
      if (lower(lines.word()) != "normal") continue;
      for (int i = 0; i < 3; ++i)
        if (double value = 0; is_number(lines.word(), value)) normal[i] = value;
    } else if (key == "vertex") {
      const double x = lines.number(), y = lines.number(), z = lines.number();
      corners.push_back(builder.add_vertex({x, y, z}, normal, glm::dvec2(0), where));
    } else if (key == "endfacet" || key == "end") {
      if (is_open) builder.add_face(corners, -1, where);
      is_open = false;
    } else if (!key.empty() && key != "solid" && key != "outer" && key != "endloop" &&
               key != "endsolid" && key != "loop") {
      lines.fail(word_in_quotes(key) + " is no word of an STL file");
    }
  }
  if (is_open) lines.fail("the file ends within a facet");
  return builder.finish();
}

}  // namespace

Mesh read_stl(const std::filesystem::path& file) {
  const MappedFile mapped(file);
  const auto bytes = mapped.bytes();
  const std::uint64_t count = bytes.size() < kHeader ? 0 : number_at<std::uint32_t>(&bytes[80]);
  const auto size = kHeader + kFacet * count;
  const auto start = lower(bytes.substr(0, 1000));
  const bool is_text =
      start.substr(std::min(start.find_first_not_of(" \t\r\n\xef\xbb\xbf"), start.size()))
          .starts_with("solid") &&
      start.find('\0') == std::string::npos;
  if (bytes.size() >= kHeader && (bytes.size() == size || (!is_text && bytes.size() > size)))
    return read_binary(bytes, count);
  if (is_text) return read_text(bytes);
  throw InputError("is no STL: it starts with no \"solid\", and has not the size of " +
                   std::to_string(count) + " facets");
}

}  // namespace raywave
