// SPDX-License-Identifier: Apache-2.0
#include "host/geometry/world.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <stdexcept>
#include <utility>

#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/geometry/deform.hpp"
#include "host/scene/vectors.hpp"
#include "host/scene/weld.hpp"

namespace raywave {
glm::dmat3 rotation_xyz(const glm::dvec3& degrees) {
  const auto about = [](double angle_deg, const glm::dvec3& axis) {
    return glm::dmat3(
        glm::rotate(glm::dmat4(1), glm::radians(std::remainder(angle_deg, 360.0)), axis));
  };
  return about(degrees.z, {0, 0, 1}) * about(degrees.y, {0, 1, 0}) * about(degrees.x, {1, 0, 0});
}

namespace {

constexpr double kSmallestObject_m = 1e-10, kLargestObject_m = 1e4;
constexpr std::size_t kMaxTriangles = 500'000'000;
constexpr std::size_t most_area_samples = 1 << 14;

/// The box of an object's vertices after a turn, to a few roundings of its size.
Box turned_box(const World& world, const PlacedObject& placed, const glm::dmat3& turn) {
  std::array<double, 6> largest;
  largest.fill(-INFINITY);
  // On a flat side that faces an axis, boxes promise more by a rounding, everywhere.
  const double least = 0x1p-50 * glm::length(placed.max_m - placed.min_m);
  raise_to_largest(
      placed.tree, placed.own(world.positions), {turn, 1, placed.position_m, glm::dvec3(0), true},
      [](const glm::dvec3& p) { return std::array{p.x, p.y, p.z, -p.x, -p.y, -p.z}; }, least,
      largest);
  return {{-largest[3], -largest[4], -largest[5]}, {largest[0], largest[1], largest[2]}};
}

/// Metres per unit.
///
/// turned     box of the vertices after rotation, in units
/// mesh_unit  how many of them a mesh unit is
double scale_of(const Object& object, const Box& turned, double mesh_unit) {
  const glm::dvec3 size = turned.size_m();
  const double largest = std::max({size.x, size.y, size.z});
  if (object.width_m && size.x <= 1e-9 * largest)
    throw InputError(object.where +
                     ": width cannot be reached, because the mesh has no extent in x after "
                     "rotation; turn it or omit width");
  const double scale = object.width_m ? *object.width_m / size.x : object.unit_m / mesh_unit;
  if (const double largest_m = largest * scale;
      !(largest_m >= kSmallestObject_m && largest_m <= kLargestObject_m))
    throw InputError(object.where + ": the mesh would be " + length_text(largest_m) +
                     " large, and must be " + length_text(kSmallestObject_m) + " to " +
                     length_text(kLargestObject_m) + "; give a width");
  return scale;
}

/// Refuses a place that an object cannot move to: its cut stays as it was placed.
void require_move(const Object& object, const PlacedObject& placed, const Box& box) {
  if (placed.is_cut)
    throw InputError(object.where +
                     ": a part of it is cut away, so that it cannot be moved; give a smaller cut");
  // The box of a turned object is known to a few roundings
  const double roundings = 1e-12 * (glm::length(box.size_m()) + std::abs(box.max_m.z));
  if (object.cut_m > 0 && box.min_m.z < object.cut_m - roundings)
    throw InputError(object.where + ": it cannot be moved to where a part of it would be cut: " +
                     "its z runs from " + length_text(box.min_m.z) + " to " +
                     length_text(box.max_m.z) + ", and must be >= cut, " +
                     length_text(object.cut_m));
}

/// The motion that places an object's vertices, and their bounding box there.
struct Placing {
  Motion motion;
  Box box;
};

/// turned     box of the vertices after `turn` about `from`
/// origin     of the mesh's coordinates, turned alike
/// mesh_unit  how many of the vertices' units a mesh unit is
Placing placing_of(const Object& object, const glm::dmat3& turn, const glm::dvec3& from,
                   const Box& turned, const glm::dvec3& origin, double mesh_unit) {
  const double scale = scale_of(object, turned, mesh_unit);
  const glm::dvec3 anchor = object.anchor == Anchor::origin ? origin : turned.centre_m();
  const auto placed = [&](const glm::dvec3& p) { return object.position_m + (p - anchor) * scale; };
  return {{turn, scale, from, placed(glm::dvec3(0)), true},
          {placed(turned.min_m), placed(turned.max_m)}};
}

/// Triangles that stand for all of an object, drawn by area at even steps through the list; all of
/// them where they are few.
///
/// first, count  of its triangles
std::vector<AreaSample> area_samples_of(std::size_t first, std::size_t count, const World& world) {
  std::vector<AreaSample> samples;
  std::vector<double> area(count, 1);
  double whole = static_cast<double>(count);
  if (count > most_area_samples) {
    whole = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const auto t = world.triangles[first + i];
      const auto& a = world.positions[t.x];
      area[i] = glm::length(glm::cross(world.positions[t.y] - a, world.positions[t.z] - a));
      whole += area[i];
    }
  }
  const auto wanted = std::min(count, most_area_samples);
  const double step = whole / static_cast<double>(wanted);
  double reached = 0;
  std::size_t drawn = 0;
  for (std::size_t i = 0; i < count; ++i) {
    reached += area[i];
    const auto last = std::min(static_cast<std::size_t>(reached / step + 0.5), wanted);
    if (last <= drawn) continue;
    samples.push_back(
        area_sample(world, first + i, static_cast<double>(last - drawn) * step / area[i]));
    drawn = last;
  }
  return samples;
}

/// Share of a mesh's colours that shows in ambient light: all of it, or, where the scene has none,
/// as much as the default material's.
double ambient_share_of(const Scene& scene) {
  return std::any_of(scene.lights.begin(), scene.lights.end(),
                     [](const Light& light) { return light.type == LightType::ambient; })
             ? 1
             : Material{}.ambient.x;
}

/// Adds the materials of an object's mesh, where the object wears them.
///
/// number  of the mesh
/// worn    materials of the object's triangles, which are the world's last
void add_materials(const Scene& scene, const Object& object, const Meshes& meshes,
                   std::size_t number, const std::vector<std::int32_t>& worn, World& world) {
  const auto& mesh = meshes.meshes[number];
  auto& found = world.found.emplace_back();
  found.notes = mesh.notes;
  if (!wears_own_materials(object) || mesh.materials.empty()) {
    found.overridden = mesh.materials.size();
    if (!world.triangle_material.empty())
      world.triangle_material.resize(world.triangles.size(), -1);
    return;
  }
  if (number >= meshes.maps.size() || meshes.maps[number].size() != mesh.materials.size())
    throw std::logic_error("the pictures of the mesh's materials have not been read");
  const auto first = static_cast<std::int32_t>(world.materials.size());
  world.triangle_material.resize(world.triangles.size() - worn.size(), -1);
  std::vector<std::size_t> triangles(mesh.materials.size(), 0);
  for (const auto m : worn) {
    world.triangle_material.push_back(m < 0 ? m : first + m);
    if (m >= 0) ++triangles[static_cast<std::size_t>(m)];
  }
  const int channel = channel_of(scene.hologram.wavelength_m);
  const bool colours_have_alpha = std::any_of(mesh.colours.begin(), mesh.colours.end(),
                                              [](const glm::vec4& c) { return c.a < 1; });
  for (std::size_t i = 0; i < mesh.materials.size(); ++i) {
    const auto& from = mesh.materials[i];
    const auto& maps = meshes.maps[number][i];
    world.materials.push_back(phong_of(from, maps, colours_have_alpha, ambient_share_of(scene),
                                       object.where + ": material " + in_quotes(from.name)));
    world.maps.push_back(maps);
    auto& one = found.materials.emplace_back();
    one.name = one_line(from.name);
    one.description = description_of(from, world.materials.back(), maps, channel);
    one.triangles = triangles[i];
    for (const auto* notes : {&from.notes, &maps.notes})
      for (const auto& note : *notes) one.notes.push_back(one_line(note));
    if (from.look.two_sided == 0 && !meshes.closed[number])
      one.notes.emplace_back("is single-sided and is shown from both sides");
  }
}

/// True where a material of the world, from the first one on, is not there everywhere.
bool has_holes(const World& world, std::size_t first_material) {
  return std::any_of(world.materials.begin() + static_cast<std::ptrdiff_t>(first_material),
                     world.materials.end(),
                     [](const Material& m) { return m.alpha_mode != AlphaMode::opaque; });
}

/// Adds an object's vertices and triangles; positions and normals are set by place().
void add(std::int32_t index, const Object& object, const Mesh& mesh, Channels channels,
         World& world) {
  if (world.triangles.size() + mesh.triangles.size() > kMaxTriangles)
    throw InputError(object.where + ": with it the scene has more than " +
                     std::to_string(kMaxTriangles) + " triangles");
  const auto first = static_cast<glm::uint>(world.positions.size());
  world.positions.resize(first + mesh.positions.size());
  world.normals.resize(world.positions.size());
  world.uvs.insert(world.uvs.end(), mesh.uvs.begin(), mesh.uvs.end());
  if (!mesh.colours.empty() && wears_own_materials(object)) {
    world.colours.resize(first, glm::vec4(1));
    for (const auto& c : mesh.colours)
      world.colours.push_back(channels.all ? c : glm::vec4(glm::vec3(c[channels.first]), c.a));
  }
  if (!world.colours.empty()) world.colours.resize(world.positions.size(), glm::vec4(1));
  for (const glm::uvec3& triangle : mesh.triangles) world.triangles.push_back(triangle + first);
  world.triangle_object.resize(world.triangles.size(), index);
}

/// Where a mesh goes as the scene has its object.
Placing first_placing_of(const Object& object, const Mesh& mesh) {
  const glm::dmat3 rotation = rotation_xyz(object.rotation_deg);
  Box box, turned;
  for (const auto& p : mesh.positions) box.add(p);
  // Differences first: a mesh far from its own origin keeps its shape.
  const auto middle = box.centre_m();
  for (const auto& p : mesh.positions) turned.add(rotation * (p - middle));
  return placing_of(object, rotation, middle, turned, rotation * -middle, 1);
}

/// The part of a mesh that lies beyond Object::cut_m; empty: all of it.
std::optional<Mesh> cut_mesh_of(const Object& object, const Mesh& mesh, Placing& placing) {
  if (object.cut_m == 0 || placing.box.min_m.z >= object.cut_m) return {};
  std::vector<double> depths_m;
  for (const auto& p : mesh.positions) depths_m.push_back(placing.motion(p).z);
  auto part = part_above(mesh, depths_m, object.cut_m);
  if (part.triangles.empty())
    throw InputError(object.where + ": nothing of it lies beyond cut, " +
                     length_text(object.cut_m) + ": its z runs from " +
                     length_text(placing.box.min_m.z) + " to " + length_text(placing.box.max_m.z));
  placing.box = {};
  for (const auto& p : part.positions) placing.box.add(placing.motion(p));
  return part;
}

/// The rest state of an object that deforms: as its vertices are now.
std::shared_ptr<Deforming> rest_of(const World& world, std::size_t object) {
  const auto& placed = world.placed[object];
  const auto positions = placed.own(world.positions);
  const auto normals = placed.own(world.normals);
  auto rest = std::make_shared<Deforming>();
  rest->rest = {{positions.begin(), positions.end()}, {normals.begin(), normals.end()}};
  rest->weld = weld_positions(rest->rest.positions_m);
  rest->closed = world.object_closed[object];
  return rest;
}

/// Adds what an object, the world's last, can become, where place_objects puts it.
///
/// shapes  of Object::shapes
/// mesh    of an object that a glTF file deforms; else null, and so are the file's moves
void add_shapes(const Object& object, const std::vector<MeshShape>& shapes,
                std::shared_ptr<const DeformingMesh> mesh, std::shared_ptr<const GltfMoves> moves,
                const Placing& placing, World& world) {
  if (shapes.empty() && !mesh) return;
  auto& placed = world.placed.back();
  if (placed.is_cut)
    throw InputError(object.where +
                     ": a part of it is cut away, so that it cannot deform; give a smaller cut");
  auto deforming = rest_of(world, world.placed.size() - 1);
  for (const auto& shape : shapes) deforming->keys.push_back(placed_shape(shape, placing.motion));
  deforming->mesh = std::move(mesh);
  deforming->moves = std::move(moves);
  deforming->placing = placing.motion;
  placed.deforming = std::move(deforming);
}

/// Places an object's vertices.
PlacedObject place(const Object& object, const Mesh& mesh, const Placing& placing, bool is_cut,
                   std::size_t first_vertex, World& world) {
  const auto count = mesh.positions.size(), triangles = mesh.triangles.size();
  for (std::size_t i = 0; i < count; ++i) {
    world.positions[first_vertex + i] = placing.motion(mesh.positions[i]);
    world.normals[first_vertex + i] = placing.motion.turn * mesh.normals[i];
  }
  return {.first_vertex = first_vertex,
          .vertices = count,
          .first_triangle = world.triangles.size() - triangles,
          .triangles = triangles,
          .position_m = object.position_m,
          .rotation_deg = object.rotation_deg,
          .width_m = object.width_m,
          .unit_m = placing.motion.scale,
          .min_m = placing.box.min_m,
          .max_m = placing.box.max_m,
          .is_cut = is_cut,
          .tree = build_vertex_tree(std::span(world.positions).subspan(first_vertex, count)),
          .deforming = {},
          .shape = {}};
}

glm::dmat3 turn_from(const PlacedObject& placed, const Object& object) {
  return rotation_xyz(object.rotation_deg) * glm::transpose(rotation_xyz(placed.rotation_deg));
}

/// The motion of an object that moves as a solid, from where it was placed.
Placing solid_placing_of(const Object& object, const World& world, const PlacedObject& placed) {
  const double scale = object.solid_scale.value();
  const bool stays = object.position_m == placed.position_m &&
                     object.rotation_deg == placed.rotation_deg && scale == 1;
  if (placed.is_cut && stays) return {{}, {placed.min_m, placed.max_m}};
  // Others have moved even where they stay: they are instances of their own from the beginning, so
  // that a pose does not depend on those before it
  const auto turn = turn_from(placed, object);
  const auto turned = turned_box(world, placed, turn);
  return {{turn, scale, placed.position_m, object.position_m, true},
          {object.position_m + scale * turned.min_m, object.position_m + scale * turned.max_m}};
}

/// The motion of an object that a scene file describes as it stands.
Placing file_placing_of(const Object& object, const World& world, const PlacedObject& placed) {
  if (object.position_m == placed.position_m && object.rotation_deg == placed.rotation_deg &&
      object.width_m == placed.width_m)
    return {{}, {placed.min_m, placed.max_m}};
  const auto turn = turn_from(placed, object);
  return placing_of(object, turn, placed.position_m, turned_box(world, placed, turn), glm::dvec3(0),
                    placed.unit_m);
}

/// The motion of an object, from where it was placed.
Placing moved_placing_of(const Object& object, const World& world, const PlacedObject& placed) {
  const auto placing = object.solid_scale ? solid_placing_of(object, world, placed)
                                          : file_placing_of(object, world, placed);
  if (placing.motion.moved) require_move(object, placed, placing.box);
  return placing;
}

}  // namespace

RayTree ray_tree_of(const World& world) {
  return RayTree(world.positions, world.normals, world.triangles, world.triangle_object,
                 world.object_closed.size(), middle_of(world));
}

World place_objects(const Scene& scene, const Meshes& meshes, Textures textures) {
  World world;
  world.textures = std::move(textures);
  const auto moves = scene.animation && scene.animation->gltf
                         ? std::make_shared<const GltfMoves>(*scene.animation->gltf)
                         : nullptr;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const auto number = meshes.of_object[i];
    const auto& whole = meshes.meshes[number];
    auto placing = first_placing_of(scene.objects[i], whole);
    const auto part = cut_mesh_of(scene.objects[i], whole, placing);
    const auto& mesh = part ? *part : whole;
    const auto first_vertex = world.positions.size(), first_triangle = world.triangles.size();
    add(static_cast<std::int32_t>(i), scene.objects[i], mesh, scene.channels(), world);
    const auto first_material = world.materials.size();
    add_materials(scene, scene.objects[i], meshes, number, mesh.triangle_material, world);
    // Through holes of a closed mesh its inner sides are seen
    world.object_closed.push_back(meshes.closed[number] && !part &&
                                  !has_holes(world, first_material));
    world.placed.push_back(
        place(scene.objects[i], mesh, placing, part.has_value(), first_vertex, world));
    world.area_samples.push_back(
        area_samples_of(first_triangle, world.triangles.size() - first_triangle, world));
    if (number < meshes.shapes.size())
      add_shapes(scene.objects[i], meshes.shapes[number],
                 number < meshes.deforming.size() ? meshes.deforming[number] : nullptr, moves,
                 placing, world);
  }
  move_objects(scene, world);
  const auto is_specular = [](const Material& m) { return m.is_specular(); };
  if (std::any_of(world.materials.begin(), world.materials.end(), is_specular) ||
      std::any_of(scene.objects.begin(), scene.objects.end(), [&](const Object& object) {
        const auto material = static_cast<std::size_t>(object.material);
        return material < scene.materials.size() && is_specular(scene.materials[material]);
      }))
    world.ray_tree = std::make_shared<const RayTree>(ray_tree_of(world));
  return world;
}

void set_vertices(World& world, std::size_t object, std::span<const glm::dvec3> positions_m,
                  std::span<const glm::vec3> normals) {
  auto& placed = world.placed.at(object);
  const auto name = "object " + std::to_string(object) + ": ";
  if (positions_m.size() != placed.vertices || normals.size() != placed.vertices)
    throw InputError(name + "it has " + std::to_string(placed.vertices) + " vertices, and " +
                     std::to_string(positions_m.size()) + " positions and " +
                     std::to_string(normals.size()) + " normals are given");
  const auto is_sound = [](const auto& v) { return is_finite(v); };
  if (!std::all_of(positions_m.begin(), positions_m.end(), is_sound) ||
      !std::all_of(normals.begin(), normals.end(), is_sound))
    throw InputError(name + "a position or a normal is NaN or infinite");
  if (placed.is_cut) throw InputError(name + "a part of it is cut away, so that it cannot deform");
  if (!placed.deforming) placed.deforming = rest_of(world, object);
  std::copy(positions_m.begin(), positions_m.end(), placed.own(world.positions).begin());
  std::copy(normals.begin(), normals.end(), placed.own(world.normals).begin());
  ++placed.version;
  placed.shape.reset();
  placed.seams_hold = are_together(positions_m, placed.deforming->weld);
  world.object_closed[object] = placed.deforming->closed && placed.seams_hold;
  refit(placed.tree, positions_m);
  placed.min_m = placed.tree.nodes[0].min_m;
  placed.max_m = placed.tree.nodes[0].max_m;
  if (!world.area_samples.empty())
    world.area_samples[object] = area_samples_of(placed.first_triangle, placed.triangles, world);
  if (world.ray_tree) {
    auto tree = std::make_shared<RayTree>(*world.ray_tree);
    tree->refit(object, world.positions, world.normals, world.triangles);
    world.ray_tree = std::move(tree);
  }
}

namespace {

/// Gives an object the vertices that the scene has for it.
void show_shape(const Object& object, std::size_t index, World& world) {
  if (object.shape == world.placed[index].shape) return;
  const auto deforming = world.placed[index].deforming;
  if (!deforming || (object.shape && !deforming->has_shapes()))
    throw std::logic_error("the shapes of an object have not been read");
  const auto shape_of_scene = [&] {
    try {
      return object.shape ? shape_at(*deforming, *object.shape) : deforming->rest;
    } catch (const InputError& error) {
      throw InputError(object.where + ": " + error.what());
    }
  };
  const auto vertices = shape_of_scene();
  for (const auto& p : vertices.positions_m)
    if (!(std::max({std::abs(p.x), std::abs(p.y), std::abs(p.z)}) <= kLargestObject_m))
      throw InputError(object.where + ": a vertex goes farther than " +
                       length_text(kLargestObject_m) + "; look for a scale that grows too large");
  set_vertices(world, index, vertices.positions_m, vertices.normals);
  world.placed[index].shape = object.shape;
}

}  // namespace

void move_objects(const Scene& scene, World& world) {
  Box all;
  world.motions.clear();
  for (std::size_t i = 0; i < world.placed.size(); ++i) {
    show_shape(scene.objects[i], i, world);
    const auto placing = moved_placing_of(scene.objects[i], world, world.placed[i]);
    world.motions.push_back(placing.motion);
    all.add(placing.box);
  }
  world.min_m = all.min_m;
  world.max_m = all.max_m;
}

void require_pose(const World& world, std::size_t index, const Object& object) {
  moved_placing_of(object, world, world.placed.at(index));
}

std::array<glm::dvec3, 3> World::corners_m(std::size_t triangle) const {
  const auto corners = triangles[triangle];
  const auto motion = motion_of(triangle_object[triangle]);
  return {motion(positions[corners.x]), motion(positions[corners.y]), motion(positions[corners.z])};
}

bool lies_before(const World& world, std::size_t object) {
  if (world.min_m.z > 0 || world.max_m.z < 0) return world.max_m.z < 0;
  const auto motion = world.motion_of(static_cast<std::int32_t>(object));
  if (!world.placed.empty())
    return motion(world.positions[world.placed[object].first_vertex]).z < 0;
  const auto first = std::find(world.triangle_object.begin(), world.triangle_object.end(),
                               static_cast<std::int32_t>(object));
  return first != world.triangle_object.end() &&
         world.corners_m(static_cast<std::size_t>(first - world.triangle_object.begin()))[0].z < 0;
}

double closest_m(const World& world) {
  if (world.min_m.z > 0) return world.min_m.z;
  if (world.max_m.z < 0) return -world.max_m.z;
  for (std::size_t i = 0; i < world.triangles.size(); ++i) {
    const auto [a, b, c] = world.corners_m(i);
    if (std::min({a.z, b.z, c.z}) <= 0 && std::max({a.z, b.z, c.z}) >= 0) return 0;
  }
  double closest = std::numeric_limits<double>::infinity();
  for (const auto& p_m : positions_now(world)) closest = std::min(closest, std::abs(p_m.z));
  return closest;
}

AreaSample area_sample(const World& world, std::size_t triangle, double share) {
  const auto t = world.triangles[triangle];
  const auto &a = world.positions[t.x], &b = world.positions[t.y], &c = world.positions[t.z];
  return {triangle, share, glm::cross(b - a, c - a), a + b + c};
}

std::vector<std::string> material_notes(const Scene& scene, const World& world) {
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < world.found.size(); ++i) {
    const auto& found = world.found[i];
    const auto start = "object " + std::to_string(i) + " (" +
                       one_line(scene.objects[i].mesh.filename().string()) + "): ";
    for (const auto& note : found.notes) lines.push_back(start + one_line(note));
    for (const auto& material : found.materials)
      for (const auto& note : material.notes)
        lines.push_back(start + "material " + in_quotes(material.name) + ": " + note);
  }
  return lines;
}

glm::dvec3 middle_of(const World& world) { return (world.min_m + world.max_m) / 2.0; }

std::vector<glm::dvec3> positions_now(const World& world) {
  auto positions = world.positions;
  for (std::size_t i = 0; i < world.placed.size(); ++i) {
    for (auto& p : world.placed[i].own(positions)) p = world.motions[i](p);
  }
  return positions;
}

std::vector<glm::vec3> normals_now(const World& world) {
  auto normals = world.normals;
  for (std::size_t i = 0; i < world.placed.size(); ++i) {
    if (!world.motions[i].moved) continue;
    for (auto& n : world.placed[i].own(normals)) n = world.motions[i].turn * glm::dvec3(n);
  }
  return normals;
}

World build_world(const Scene& scene) {
  auto files = load_files(scene);
  return place_objects(scene, files.meshes, std::move(files.textures));
}

}  // namespace raywave
