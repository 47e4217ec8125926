// SPDX-License-Identifier: Apache-2.0
/// What readers of files return: a mesh with its materials, a picture.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>
#include <span>
#include <string>
#include <vector>

namespace raywave {

/// How a picture goes on beyond its edges.
enum class Wrap : std::int32_t { repeat, mirror, clamp };

/// Where a picture lies on a surface: the place (u, v) of the mesh shows the place
/// (across . (u, v, 1), up . (u, v, 1)) of the picture, whose bottom left is (0, 0).
struct MapPlace {
  std::array<double, 3> across{1, 0, 0}, up{0, 1, 0};
  Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;

  bool operator==(const MapPlace&) const = default;
  /// A repeated picture, as the mesh's coordinates say.
  bool is_plain() const { return *this == MapPlace{}; }
};

/// A picture that a material of a mesh wears.
struct MeshMap {
  std::int32_t picture = -1;  // of Mesh::pictures; -1: none
  std::int32_t padding = 0;   // readers send these structs byte by byte
  MapPlace place;
};

/// What alpha does with a surface.
enum class AlphaMode : std::int32_t {
  opaque,
  mask,  // the surface is there where alpha is at least MeshMaterial::alpha_cutoff
  blend  // the surface is there with the probability alpha
};

/// How the numbers of a mesh's material are meant.
enum class LookModel : std::int32_t {
  phong,               // diffuse, specular and shininess
  metallic_roughness,  // glTF 2.0
  specular_roughness,  // a diffuse colour, a specular reflectance, and roughness
  unlit                // shows its base colour whatever light there is
};

/// The numbers of a material as a mesh file gives them (docs/materials.md). Colours are linear.
struct MeshLook {
  glm::dvec3 base{1};  // base colour, or diffuse
  double alpha = 1;
  glm::dvec3 specular{0};
  double shininess = 0;
  glm::dvec3 ambient{0};
  double metallic = 0;  // 0 to 1
  glm::dvec3 emission{0};
  double roughness = 1;  // 0 to 1
  double alpha_cutoff = 0.5;
  double transmission = 0;  // 0 to 1
  double ior = 1.5;         // >= 1
  double normal_scale = 1;  // of the normal map's slopes
  LookModel model = LookModel::phong;
  AlphaMode alpha_mode = AlphaMode::opaque;
  std::int32_t vertex_colours = 0;  // 1: colours of the vertices multiply base and alpha
  std::int32_t two_sided = 0;
  MeshMap base_map;      // times base; its alpha times alpha
  MeshMap metallic_map;  // green times roughness, blue times metallic
  MeshMap emission_map;  // times emission
  MeshMap normal_map;
  MeshMap alpha_map;  // its first channel times alpha
};

struct MeshMaterial {
  std::string name;
  MeshLook look;
  std::vector<std::string> notes;  // what of it is approximated or ignored: "clearcoat is ignored"
};

/// A picture that a mesh file names, or holds.
struct MeshPicture {
  std::string name;         // of the file as the mesh writes it, or of the picture in it
  std::vector<char> bytes;  // of a picture file inside the mesh's file; empty: another file
};

/// Vertices of a mesh of a glTF file that morph targets or the joints of a skin move
/// (host/scene/gltf_motion.hpp). All vectors of a vertex are in the order of Mesh::positions.
struct DeformingPart {
  std::int32_t node = 0;           // number of the node that wears it
  std::uint32_t first_vertex = 0;  // of Mesh::positions
  // Of the skin: numbers of nodes, and joint from mesh (the inverse bind matrices). Without a skin
  // the node itself, and the identity
  std::vector<std::int32_t> joints{};
  std::vector<glm::dmat4> joint_from_mesh{};
  std::vector<glm::vec3> positions{},
      normals{};  // of the mesh at weights of zero; normals may be 0
  // So many of `joints` for each vertex, and their weights; 0: all vertices follow the first joint
  std::uint32_t influences = 0;
  std::vector<std::uint16_t> joint_of{};
  std::vector<float> weight_of{};  // >= 0; their sum counts as 1
  // Of the morph targets at rest; what a target adds at a weight of 1, target after target. Normals
  // may be empty
  std::vector<double> weights{};
  std::vector<glm::vec3> target_positions{}, target_normals{};
};

/// Triangles that index vertices. `normals` and `uvs` are empty or as long as `positions`, and so
/// are `colours`; `triangle_material` is empty or as long as `triangles`.
struct Mesh {
  std::vector<glm::dvec3> positions{};
  std::vector<glm::dvec3> normals{};
  std::vector<glm::dvec2> uvs{};  // (0, 0) is the bottom left of the texture
  std::vector<glm::uvec3> triangles{};
  std::vector<glm::vec4> colours{};  // linear red, green, blue, and alpha
  // Of `materials`; -1, or empty: the file has none for this triangle
  std::vector<std::int32_t> triangle_material{};
  // Number of the glTF node that places a triangle, where a reader was asked for it; else empty
  std::vector<std::int32_t> triangle_node{};
  std::vector<MeshMaterial> materials{};
  std::vector<MeshPicture> pictures{};
  std::vector<std::string> notes{};  // what else of the file is left out: "animations are ignored"
  std::vector<DeformingPart> deforming{};  // with triangle_node: what of it deforms
};

/// What of a mesh changes where it deforms.
struct MeshShape {
  std::vector<glm::dvec3> positions, normals;  // of Mesh::positions
};

/// A camera of a glTF file: it looks along its -z, and y is up.
struct GltfCamera {
  std::string name;
  glm::dmat4 world_from_camera{1};
  double near = 0;  // distance below which it sees nothing; in the file's units, as places are
};

/// A light of a glTF file (KHR_lights_punctual). It shines along its -z.
struct GltfLight {
  enum class Type : std::int32_t { directional, point, spot };
  Type type = Type::directional;
  std::int32_t padding = 0;
  glm::dmat4 world_from_light{1};
  glm::dvec3 colour{1};
  double intensity = 1;                  // lux of directional lights, candela of others
  double inner_deg = 0, outer_deg = 45;  // of spots, angles to the direction
};

/// What stands around the meshes of a glTF file.
struct GltfSet {
  std::vector<GltfCamera> cameras;
  std::vector<GltfLight> lights;
  std::vector<std::string> notes;  // what of them is left out
};

/// A node of a glTF file, where the file puts it. Readers send it byte by byte.
struct GltfNode {
  std::int32_t number = 0;   // in the file
  std::int32_t parent = -1;  // of GltfMotion::nodes, before this one; -1: none
  std::int32_t has_mesh = 0;
  std::int32_t light = -1;      // of GltfSet::lights
  std::int32_t camera = -1;     // of GltfSet::cameras
  std::int32_t has_matrix = 0;  // in place of the three
  glm::dvec3 translation{0};
  glm::dvec4 rotation{0, 0, 0, 1};  // a quaternion of unit length: x, y, z, w
  glm::dvec3 scale{1};
  glm::dmat4 matrix{1};
};

/// Keys of one value of a node of a glTF file; of weights, those of up to four morph targets.
struct GltfChannel {
  enum class Path : std::int32_t { translation, rotation, scale, weights };
  enum class Steps : std::int32_t { step, linear, cubic };
  std::int32_t node = 0;  // of GltfMotion::nodes
  Path path = Path::translation;
  Steps steps = Steps::linear;
  std::vector<double> times_s;  // ascending
  // One for each time; of cubic steps three: the slope before it, the value, the slope behind it.
  // Translations and scales have three numbers, rotations are x, y, z, w
  std::vector<glm::dvec4> values;
  std::int32_t target = 0;  // of weights: the first of the four
};

struct GltfAnimation {
  std::string name;
  std::vector<GltfChannel> channels;
};

/// A node of a glTF file whose mesh has a skin or morph targets.
struct GltfWearer {
  std::int32_t node = 0;             // of GltfMotion::nodes, as joints are
  std::vector<std::int32_t> joints;  // empty: it has no skin
  std::vector<double> weights;       // of its morph targets at rest
};

/// How the nodes of a glTF file move.
struct GltfMotion {
  std::vector<GltfNode> nodes;     // those of its scene, parents first
  std::vector<std::string> names;  // of the nodes
  std::vector<GltfAnimation> animations;
  std::vector<std::string> notes;  // what of them is left out
  std::vector<GltfWearer> wearers;
};

/// One channel of a picture, linear light, row-major; or its red, green and blue, one after the
/// other.
struct Image {
  int width = 0, height = 0;
  std::vector<float> pixels;
  int channels = 1;

  /// The texels of a channel; of the only one where there is one.
  std::span<const float> channel(int number) const {
    const auto size = pixels.size() / static_cast<std::size_t>(channels);
    return std::span(pixels).subspan(channels == 1 ? 0 : static_cast<std::size_t>(number) * size,
                                     size);
  }
};

}  // namespace raywave
