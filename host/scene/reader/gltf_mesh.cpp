// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <numeric>
#include <string_view>

#include "host/common/error.hpp"
#include "host/scene/gltf_motion.hpp"
#include "host/scene/reader/gltf_file.hpp"
#include "host/scene/reader/gltf_materials.hpp"
#include "host/scene/reader/readers.hpp"
#include "host/scene/reader_reply.hpp"
#include "host/scene/vectors.hpp"

namespace raywave {

using nlohmann::json;

std::string name_of_mesh(const GltfFile& gltf, const json& node) {
  const auto& index = member(node, "mesh");
  const auto name = text_or(member(gltf.of("meshes", index), "name"), "").substr(0, 100);
  return "mesh " + (name.empty() ? std::to_string(count_or(index, 0)) : '"' + name + '"');
}

GltfPrimitive::GltfPrimitive(GltfFile& gltf, const json& node, const json& primitive, bool deforms,
                             const DracoMesh* draco)
    : gltf_(gltf),
      json_(primitive),
      deforms_(deforms),
      draco_(draco),
      mesh_(name_of_mesh(gltf, node)) {
  if (!has("POSITION")) refuse("POSITION is missing");
  positions_ = attribute("POSITION", "VEC3");
}

void GltfPrimitive::fail(const std::string& why) const {
  const std::string remedy = "; export the file again";
  throw InputError((why.ends_with(remedy) ? why : why + remedy) +
                   (deforms_ ? ", or without the skin or the morph targets" : ""));
}

void GltfPrimitive::require_count(const std::string& name, std::uint64_t count) const {
  if (positions_.count > 0 && count != positions_.count)
    refuse(name + " is given for " + std::to_string(count) + " vertices, and POSITION for " +
           std::to_string(positions_.count));
}

GltfNumbers GltfPrimitive::numbers(const json& accessor, const char* kind, const std::string& name,
                                   bool whole) const {
  const auto most =
      std::string_view(kind) == "SCALAR" ? most_vertices_of_file : most_deforming_of_file;
  try {
    return gltf_.numbers(accessor, kind, what(name), whole, most);
  } catch (const InputError& error) {
    fail(error.what());
  }
}

GltfNumbers GltfPrimitive::attribute(const std::string& name, const char* kind, bool whole) const {
  const auto& accessor = member(member(json_, "attributes"), name.c_str());
  GltfNumbers made;
  if (draco_ && draco_->attributes.contains(name)) {
    const auto& [bytes, found] = draco_->attributes.at(name);
    made = found;
    made.first = bytes.data();
    made.is_share = !whole || member(gltf_.of("accessors", accessor), "normalized") == json(true);
    if ("VEC" + std::to_string(made.components) != kind) refuse(name + " are no list of " + kind);
  } else {
    made = numbers(accessor, kind, name, whole);
  }
  require_count(name, made.count);
  return made;
}

std::vector<std::uint32_t> GltfPrimitive::corners() const {
  std::vector<std::uint32_t> listed;
  const auto& indices = member(json_, "indices");
  if (draco_) {
    listed = draco_->corners;
  } else if (indices.is_null()) {
    listed.resize(count());
    std::iota(listed.begin(), listed.end(), 0);
  } else {
    const auto all = numbers(indices, "SCALAR", "indices");
    if (all.type == GltfNumbers::floats) refuse("indices are no whole numbers");
    listed.reserve(all.count);
    for (std::uint64_t i = 0; i < all.count; ++i)
      listed.push_back(static_cast<std::uint32_t>(std::max(0.0, all.at(i, 0))));
  }
  for (std::size_t i = 0; i < listed.size(); ++i)
    if (listed[i] >= count())
      refuse("corner " + std::to_string(i) + " names vertex " + std::to_string(listed[i]) +
             ", and there are " + std::to_string(count()));
  const auto mode = count_or(member(json_, "mode"), 4);
  if (mode == 4 || draco_) {
    listed.resize(listed.size() / 3 * 3);
    return listed;
  }
  std::vector<std::uint32_t> corners;
  for (std::size_t i = 0; i + 2 < listed.size(); ++i)
    for (const auto place : mode == 5 ? std::array{i, i + 1 + i % 2, i + 2 - i % 2}
                                      : std::array{i + 1, i + 2, std::size_t{0}})
      corners.push_back(listed[place]);
  return corners;
}

namespace {

class MeshReader {
public:
  MeshReader(GltfFile& gltf, bool wants_nodes)
      : gltf_(gltf), wants_nodes_(wants_nodes), materials_(gltf, mesh_) {}

  Mesh read() {
    for (const auto& text : gltf_.notes()) note(text);
    if (!member(gltf_.root(), "animations").empty() && !wants_nodes_)
      note("animations are ignored");
    if (const auto scenes = member(gltf_.root(), "scenes").size(); scenes > 1)
      note("of " + std::to_string(scenes) + " scenes only the file's default is shown");
    std::vector<std::pair<const json*, std::int32_t>> shown;
    const auto fault = gltf_.for_each_node([&](const json& node, std::int32_t number, std::int32_t,
                                               const glm::dmat4& pose, bool is_shown) {
      poses_.emplace(number, pose);
      if (is_shown && !member(node, "mesh").is_null()) shown.emplace_back(&node, number);
    });
    if (!fault.empty()) throw InputError(fault + "; export the file again");
    for (const auto& [node, number] : shown) add_node(*node, number);
    if (mesh_.materials.empty()) mesh_.triangle_material.clear();
    return std::move(mesh_);
  }

private:
  void note(const std::string& text) { add_note(mesh_.notes, text); }

  void add_node(const json& node, std::int32_t number) {
    const auto& mesh = gltf_.of("meshes", member(node, "mesh"));
    if (!mesh.is_object())
      throw InputError("node " + std::to_string(number) + ": its mesh is not there");
    const auto wearer = wearer_of(gltf_, node, number);
    const bool deforms = !wearer.joints.empty() || !wearer.weights.empty();
    const auto instances = instances_of(node, number, !wearer.joints.empty());
    for (const auto& primitive : member(mesh, "primitives")) {
      if (count_or(member(primitive, "mode"), 4) < 4) {
        note(name_of_mesh(gltf_, node) + ": points and lines are not shown");
        continue;
      }
      const GltfPrimitive from(gltf_, node, primitive, deforms, draco_of(primitive, node));
      const auto corners = from.corners();
      for (const auto& instance : instances) {
        require_at_most(mesh_.triangles.size() + corners.size() / 3, most_triangles_of_file,
                        "triangles");
        append(from, corners, node, wearer, instance, deforms);
      }
    }
    if (wants_nodes_) mesh_.triangle_node.resize(mesh_.triangles.size(), number);
  }

  const DracoMesh* draco_of(const json& primitive, const json& node) {
    const auto& how = extension(primitive, "KHR_draco_mesh_compression");
    if (!how.is_object()) return nullptr;
    const auto [known, is_new] = draco_.try_emplace(&primitive);
    if (is_new) {
      const auto what = name_of_mesh(gltf_, node) + ": ";
      const auto bytes = gltf_.view(member(how, "bufferView"), what + "its Draco data");
      try {
        known->second = decode_draco(bytes, member(how, "attributes"));
      } catch (const InputError& error) {
        throw InputError(what + error.what() + "; export the file again");
      }
    }
    return &known->second;
  }

  /// Where a node shows its mesh: node from mesh (EXT_mesh_gpu_instancing).
  std::vector<glm::dmat4> instances_of(const json& node, std::int32_t number, bool has_skin) {
    const auto& attributes = member(extension(node, "EXT_mesh_gpu_instancing"), "attributes");
    if (!attributes.is_object() || attributes.empty()) return {glm::dmat4(1)};
    const auto what = "node " + std::to_string(number) + ": its instances";
    if (has_skin) {
      note(what + " are ignored: a skin puts all of them at one place");
      return {glm::dmat4(1)};
    }
    std::array<GltfNumbers, 3> found;
    std::uint64_t count = 0;
    const std::array names{"TRANSLATION", "ROTATION", "SCALE"};
    for (std::size_t i = 0; i < names.size(); ++i) {
      const auto& accessor = member(attributes, names[i]);
      if (accessor.is_null()) continue;
      found[i] =
          gltf_.numbers(accessor, i == 1 ? "VEC4" : "VEC3", what, i != 1, most_nodes_of_file);
      if (count > 0 && found[i].count != count)
        throw InputError(what + " differ in number; export the file again");
      count = found[i].count;
    }
    if (count == 0) throw InputError(what + " have no places; export the file again");
    std::vector<glm::dmat4> instances;
    for (std::uint64_t i = 0; i < count; ++i) {
      GltfNode place;
      if (found[0].count > 0) place.translation = found[0].vector_at(i);
      if (found[2].count > 0) place.scale = found[2].vector_at(i);
      if (found[1].count > 0) {
        const glm::dvec4 q(found[1].vector_at(i), found[1].at(i, 3));
        const double length = glm::length(q);
        if (length > 0) place.rotation = q / length;
      }
      instances.push_back(matrix_of(place));
    }
    return instances;
  }

  /// Appends an instance of a primitive, of whose vertices those that triangles use. Normals stay
  /// zero where the file has none.
  void append(const GltfPrimitive& from, std::vector<std::uint32_t> corners, const json& node,
              const GltfWearer& wearer, const glm::dmat4& instance, bool deforms) {
    constexpr std::uint32_t none = UINT32_MAX;
    const auto first = static_cast<std::uint32_t>(mesh_.positions.size());
    if (place_.size() < from.count()) place_.resize(from.count(), none);
    std::vector<std::uint32_t> order;
    for (const auto corner : corners) {
      if (place_[corner] == none) order.push_back(corner);
      place_[corner] = 0;
    }
    if (order.size() < from.count())
      std::sort(order.begin(), order.end());
    else
      std::iota(order.begin(), order.end(), 0);
    for (std::uint32_t i = 0; i < order.size(); ++i) place_[order[i]] = first + i;
    for (auto& corner : corners) corner = place_[corner];
    for (const auto vertex : order) place_[vertex] = none;

    append_looks(from, order);
    bool is_mirrored_now = false;
    if (deforms) {
      auto made = deforming_part(gltf_, from, node, wearer, poses_, instance, order, left_);
      is_mirrored_now = is_mirrored(made.part, made.world_from_mesh);
      append_deformed(from, std::move(made), order);
    } else {
      const auto world_from_mesh = poses_.at(wearer.node) * instance;
      is_mirrored_now = glm::determinant(glm::dmat3(world_from_mesh)) < 0;
      append_placed(from, world_from_mesh, is_mirrored_now ? -1 : 1, order);
    }
    for (std::size_t i = 0; i < corners.size(); i += 3) {
      mesh_.triangles.emplace_back(corners[i], corners[i + 1], corners[i + 2]);
      auto& triangle = mesh_.triangles.back();
      if (is_mirrored_now) std::swap(triangle.y, triangle.z);  // a mirror turns them inside out
    }
    mesh_.triangle_material.resize(mesh_.triangles.size(), material_);
  }

  void append_placed(const GltfPrimitive& from, const glm::dmat4& world_from_mesh,
                     double orientation, const std::vector<std::uint32_t>& order) {
    const auto& positions = from.positions();
    const auto cofactor = cofactor_of(glm::dmat3(world_from_mesh));
    for (const auto vertex : order) {
      const glm::dvec3 p(world_from_mesh * glm::dvec4(positions.vector_at(vertex), 1));
      if (!is_position(p)) from.refuse("vertex " + std::to_string(vertex) + " is NaN or infinite");
      mesh_.positions.push_back(p);
    }
    if (from.has("NORMAL")) {
      const auto normals = from.attribute("NORMAL", "VEC3");
      for (const auto vertex : order)
        mesh_.normals.push_back(unit_or_zero(orientation * (cofactor * normals.vector_at(vertex))));
    }
    mesh_.normals.resize(mesh_.positions.size(), glm::dvec3(0));
  }

  void append_deformed(const GltfPrimitive& from, GltfPart made,
                       const std::vector<std::uint32_t>& order) {
    auto& part = made.part;
    part.first_vertex = static_cast<std::uint32_t>(mesh_.positions.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
      const auto [position, normal] = deformed_vertex(part, made.world_from_mesh, part.weights, i);
      if (!(glm::length(position) <= 1e30))
        from.refuse("vertex " + std::to_string(order[i]) +
                    " is nowhere; look at the scales of its joints");
      mesh_.positions.push_back(position);
      mesh_.normals.push_back(normal);
    }
    if (wants_nodes_) mesh_.deforming.push_back(std::move(part));
  }

  /// Texture coordinates and colours, and the material that uses them.
  void append_looks(const GltfPrimitive& from, const std::vector<std::uint32_t>& order) {
    const bool has_colours = from.has("COLOR_0");
    const GltfMaterials::Worn* worn = nullptr;
    try {
      worn = &materials_.of(from.object(), has_colours);
    } catch (const InputError& error) {
      throw InputError(from.what(error.what()));
    }
    material_ = worn->material;
    const auto count = mesh_.positions.size() + order.size();
    const auto uv_name = "TEXCOORD_" + std::to_string(worn->uvs.value_or(0));
    if (from.has(uv_name)) {
      const auto uvs = from.attribute(uv_name, "VEC2");
      for (const auto vertex : order) {
        const glm::dvec2 uv(uvs.at(vertex, 0), 1 - uvs.at(vertex, 1));
        const bool is_usable = std::isfinite(uv.x) && std::isfinite(uv.y);
        mesh_.uvs.push_back(is_usable ? uv : glm::dvec2(0));
      }
    } else if (worn->uvs) {
      note(from.what(uv_name + " is missing: maps show one place of their pictures"));
    }
    mesh_.uvs.resize(count, glm::dvec2(0));
    if (from.has("COLOR_1")) note(from.what("COLOR_1 is ignored"));
    if (has_colours) append_colours(from, order);
    if (!mesh_.colours.empty()) mesh_.colours.resize(count, glm::vec4(1));
  }

  void append_colours(const GltfPrimitive& from, const std::vector<std::uint32_t>& order) {
    mesh_.colours.resize(mesh_.positions.size(), glm::vec4(1));
    const auto& accessor =
        gltf_.of("accessors", member(member(from.object(), "attributes"), "COLOR_0"));
    const bool has_alpha = text_or(member(accessor, "type"), "") == "VEC4";
    const auto colours = from.attribute("COLOR_0", has_alpha ? "VEC4" : "VEC3", false);
    if (colours.type != GltfNumbers::floats && member(accessor, "normalized") != json(true))
      note(
          from.what("COLOR_0 is of whole numbers that are not normalized: the largest is taken "
                    "as 1"));
    for (const auto vertex : order) {
      glm::vec4 colour(1);
      for (int i = 0; i < (has_alpha ? 4 : 3); ++i)
        colour[i] = static_cast<float>(
            std::clamp(colours.at(vertex, static_cast<std::uint64_t>(i)), 0.0, i < 3 ? 1e6 : 1.0));
      const bool is_usable = std::isfinite(colour.r + colour.g + colour.b + colour.a);
      mesh_.colours.push_back(is_usable ? colour : glm::vec4(1));
    }
  }

  GltfFile& gltf_;
  bool wants_nodes_;
  Mesh mesh_;
  GltfMaterials materials_;
  std::map<std::int32_t, glm::dmat4> poses_;  // of the nodes, by their numbers
  std::map<const json*, DracoMesh> draco_;    // by the primitive
  std::vector<std::uint32_t> place_;  // of a primitive's vertices in mesh_, while one is read
  std::int32_t material_ = -1;        // of the last primitive
  std::uint64_t left_ = most_deforming_of_file;
};

}  // namespace

std::optional<Mesh> read_gltf_mesh(const std::filesystem::path& file, bool wants_nodes) {
  const auto gltf = GltfFile::open(file);
  if (!gltf) return {};
  return MeshReader(*gltf, wants_nodes).read();
}

}  // namespace raywave
