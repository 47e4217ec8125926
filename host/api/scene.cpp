// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "host/api/state.hpp"
#include "host/common/error.hpp"
#include "host/common/text.hpp"
#include "host/scene/points.hpp"
#include "host/scene/scene_json.hpp"

namespace raywave::v0 {
namespace {

constexpr double largest_coordinate = 1e30;  // as all numbers of a scene

/// Whether both scenes read the same from the same files.
bool reads_the_same(const Scene::State& a, const Scene::State& b) {
  const auto same_object = [](const raywave::Object& x, const raywave::Object& y) {
    return x.mesh == y.mesh && x.normals == y.normals &&
           wears_own_materials(x) == wears_own_materials(y);
  };
  const auto same_texture = [](const raywave::Material& x, const raywave::Material& y) {
    return x.texture == y.texture;
  };
  const auto same_picture = [](const raywave::Light& x, const raywave::Light& y) {
    return (x.type == LightType::environment) == (y.type == LightType::environment) &&
           x.picture == y.picture;
  };
  const auto all = [](const auto& x, const auto& y, const auto& same) {
    return std::equal(x.begin(), x.end(), y.begin(), y.end(), same);
  };
  const auto &of_a = a.scene(), &of_b = b.scene();
  return of_a.channels() == of_b.channels() && a.meshes == b.meshes &&
         all(of_a.objects, of_b.objects, same_object) &&
         all(of_a.materials, of_b.materials, same_texture) &&
         all(of_a.lights, of_b.lights, same_picture);
}

/// Puts what is not of the text's into a scene that was parsed: meshes from memory, and poses.
void apply_changes(Scene::State& state) {
  state.meshes.resize(state.scene().objects.size());
  for (auto& scene : state.scenes) {
    auto& objects = scene.objects;
    for (std::size_t i = 0; i < objects.size(); ++i) {
      if (state.meshes[i]) objects[i].mesh = in_memory;
      if (const auto found = state.poses.find(i); found != state.poses.end()) {
        const auto& pose = found->second;
        objects[i].position_m = pose.position_m.value_or(objects[i].position_m);
        objects[i].rotation_deg = pose.rotation_deg.value_or(objects[i].rotation_deg);
      }
    }
  }
}

/// Drops meshes from memory and poses in whose place an override puts another.
///
/// state  with its scene as the overrides have it
void drop_replaced(Scene::State& state, const std::string& override_text) {
  const auto path = override_text.substr(0, override_text.find('='));
  const auto& objects = state.scene().objects;
  if (path == "object") {
    state.poses.clear();
    for (std::size_t i = 0; i < objects.size(); ++i)
      if (!objects[i].mesh.empty()) state.meshes[i] = nullptr;
  } else if (path.starts_with("object.")) {
    const auto dot = path.find('.', 7);
    const auto index = std::stoul(path.substr(7, dot - 7));
    const auto key = path.substr(dot + 1);
    if (key == "mesh") state.meshes.at(index) = nullptr;
    if (key == "position") state.poses[index].position_m.reset();
    if (key == "rotation") state.poses[index].rotation_deg.reset();
  } else if (path == "scene" || path.starts_with("scene.")) {
    // The glTF file's object comes after all others
    const auto first = objects.size() - state.scene().given.count("scene.gltf");
    state.poses.erase(state.poses.lower_bound(first), state.poses.end());
    if (path == "scene" || path == "scene.gltf") state.meshes.resize(first);
  }
}

Scene scene_of(SceneText text, const std::vector<std::string>& overrides) {
  auto state = std::make_shared<Scene::State>();
  state->text = std::move(text);
  state->overrides = overrides;
  state->scenes = raywave::parse_scenes(state->text, overrides);
  apply_changes(*state);
  return Scene(std::move(state));
}

/// White, as files have it that bring colours of vertices alone.
MeshMaterial look_of(const MeshView& view) {
  auto white = white_material("colours of the mesh in memory");
  white.look.alpha_mode = AlphaMode::blend;
  white.look.vertex_colours = view.colours.empty() ? 0 : 1;
  if (!view.texture.empty()) white.look.base_map.picture = 0;
  return white;
}

Mesh mesh_of(const MeshView& view) {
  const auto fail = [](const std::string& what) { throw InputError(what); };
  const auto require_finite = [&](const auto& vectors, const char* name) {
    for (const auto& vector : vectors)
      for (const double x : vector)
        if (!(std::abs(x) <= largest_coordinate))
          fail(std::string(name) + ": holds a number that is NaN, infinite or beyond 1e30");
  };
  const auto vertices = view.vertices.size();
  if (vertices == 0) fail("vertices: there are none");
  if (view.faces.empty() && view.radii.empty())
    fail("faces: there are none; vertices that are points have radii");
  if (vertices > UINT32_MAX / 4) fail("vertices: there are more than raywave takes");
  if (view.faces.size() > INT32_MAX / 4) fail("faces: there are more than raywave takes");
  const auto require_each = [&](const auto& values, const char* name) {
    if (!values.empty() && values.size() != vertices)
      fail(std::string(name) + ": there are " + std::to_string(values.size()) + " for " +
           std::to_string(vertices) + " vertices");
  };
  require_each(view.uvs, "uv");
  require_each(view.normals, "normals");
  require_finite(view.vertices, "vertices");
  require_finite(view.uvs, "uv");
  require_finite(view.normals, "normals");
  require_each(view.colours, "colours");
  for (const auto& colour : view.colours)
    for (const float x : colour)
      if (!(x >= 0 && x <= 1)) fail("colours: must be 0 to 1, got " + number_text(double{x}));
  if (!view.texture.empty() && view.uvs.empty())
    fail("texture: needs uv, which tell where it lies");

  Mesh mesh;
  mesh.normals.resize(vertices, glm::dvec3(0));
  mesh.uvs.resize(vertices, glm::dvec2(0));
  for (std::size_t i = 0; i < vertices; ++i) {
    mesh.positions.push_back(vector_of(view.vertices[i]));
    if (!view.normals.empty()) {
      const auto normal = vector_of(view.normals[i]);
      const double length = std::hypot(normal.x, normal.y, normal.z);
      mesh.normals[i] = length > 0 ? normal / length : glm::dvec3(0);
    }
    if (!view.uvs.empty()) mesh.uvs[i] = vector_of(view.uvs[i]);
  }
  for (std::size_t i = 0; i < view.faces.size(); ++i) {
    const auto& face = view.faces[i];
    for (const auto corner : face)
      if (corner >= vertices)
        fail("faces: face " + std::to_string(i) + " names vertex " + std::to_string(corner) +
             ", there are " + std::to_string(vertices) + ", counted from 0");
    mesh.triangles.emplace_back(face[0], face[1], face[2]);
  }
  if (!view.radii.empty() && (view.radii.size() != vertices || !view.faces.empty()))
    fail("radii: belong to points, one each, without faces");
  for (const double radius : view.radii)
    if (!(radius >= 0 && radius <= largest_coordinate))
      fail("radii: must be 0 or more, got " + number_text(radius));
  for (const auto& c : view.colours) mesh.colours.emplace_back(c[0], c[1], c[2], c[3]);
  if (view.faces.empty()) {
    if (!view.texture.empty()) fail("texture: points have none");
    mesh.notes.push_back(cover_points(mesh, {view.radii.begin(), view.radii.end()}));
  } else if (!view.colours.empty() || !view.texture.empty()) {
    mesh.materials.push_back(look_of(view));
    mesh.triangle_material.assign(mesh.triangles.size(), 0);
  }
  if (!view.texture.empty())
    mesh.pictures.push_back({"texture", {view.texture.begin(), view.texture.end()}});
  if (finish_mesh(mesh, Normals::flat).triangles.empty()) fail("faces: none has an area");
  return mesh;
}

}  // namespace

const SceneFiles& Scene::State::read_files() const {
  const std::lock_guard lock(files->mutex);
  if (!files->loaded) {
    auto loaded = load_meshes(scene(), meshes);
    files->loaded = SceneFiles{std::move(loaded), load_textures(scene())};
  }
  return *files->loaded;
}

Scene::Scene(std::shared_ptr<const State> state) : state_(std::move(state)) {}

std::array<int, 2> Scene::resolution() const {
  const auto size = state_->scene().hologram.resolution;
  return {size.x, size.y};
}

Pixels Scene::pixels() const {
  const auto& hologram = state_->scene().hologram;
  return {{hologram.pitch_m.x, hologram.pitch_m.y},
          state_->scenes.size() > 1 ? 0 : hologram.wavelength_m};
}

std::vector<double> Scene::wavelengths_m() const {
  std::vector<double> all;
  for (const auto& scene : state_->scenes) all.push_back(scene.hologram.wavelength_m);
  return all;
}

int Scene::frames() const { return state_->scene().sampling.frames; }
std::size_t Scene::objects() const { return state_->scene().objects.size(); }
std::vector<std::string> Scene::notes() const { return state_->scene().notes; }

std::string Scene::toml() const { return state_->text.toml; }
std::filesystem::path Scene::folder() const { return state_->text.folder; }
std::vector<std::string> Scene::overrides() const { return state_->overrides; }
std::string Scene::name() const { return state_->text.file.string(); }
bool Scene::is_planned() const { return state_->is_planned; }

std::string Scene::json() const {
  auto json = json_of(state_->scene());
  if (state_->scenes.size() > 1) json["hologram"]["wavelength_m"] = wavelengths_m();
  return json.dump();
}

void Scene::set(const std::vector<std::string>& overrides) {
  if (state_->is_planned)
    throw InputError(
        "the scene of a plan has its values chosen: set them in the scene that was planned");
  auto next = std::make_shared<State>(*state_);
  next->overrides.insert(next->overrides.end(), overrides.begin(), overrides.end());
  next->scenes = raywave::parse_scenes(next->text, next->overrides);
  for (const auto& one : overrides) {
    next->meshes.resize(next->scene().objects.size());
    drop_replaced(*next, one);
  }
  apply_changes(*next);
  if (!reads_the_same(*next, *state_)) next->files = std::make_shared<Files>();
  state_ = std::move(next);
}

void Scene::set_mesh(std::size_t object, const MeshView& mesh) {
  require_one_of("object", object, objects());
  auto next = std::make_shared<State>(*state_);
  next->meshes.at(object) = std::make_shared<const Mesh>(mesh_of(mesh));
  next->files = std::make_shared<Files>();
  apply_changes(*next);
  state_ = std::move(next);
}

Vec3 Scene::position_m(std::size_t object) const {
  const auto p = state_->scene().objects.at(object).position_m;
  return {p.x, p.y, p.z};
}

Vec3 Scene::rotation_deg(std::size_t object) const {
  const auto r = state_->scene().objects.at(object).rotation_deg;
  return {r.x, r.y, r.z};
}

void Scene::set_pose(std::size_t object, const Vec3& position_m, const Vec3& rotation_deg) {
  require_pose(object, objects(), position_m, rotation_deg);
  auto next = std::make_shared<State>(*state_);
  next->poses[object] = {vector_of(position_m), vector_of(rotation_deg)};
  apply_changes(*next);
  state_ = std::move(next);
}

Scene load_scene(const std::filesystem::path& file, const std::vector<std::string>& overrides) {
  auto text = read_scene_text(file);
  text.needs_meshes = true;
  return scene_of(std::move(text), overrides);
}

Scene parse_scene(const std::string& toml, const std::filesystem::path& folder,
                  const std::vector<std::string>& overrides, const std::string& name) {
  return scene_of({toml, name, folder, false}, overrides);
}

Slm::Slm() {
  auto state = std::make_shared<State>();
  state->specs.emplace_back().encoding = Encoding::phase;
  state_ = std::move(state);
}

Slm::Slm(const Scene& scene) {
  auto state = std::make_shared<State>();
  for (const auto& one : scene.state().scenes) state->specs.push_back(one.slm);
  if (state->specs.size() > 1) state->wavelengths_m = scene.wavelengths_m();
  state_ = std::move(state);
}

Slm::Slm(std::shared_ptr<const State> state) : state_(std::move(state)) {}

std::vector<std::string> Slm::notes(double wavelength_m) const {
  return state_->specs.empty() ? state_->at(wavelength_m).notes : std::vector<std::string>();
}

namespace {

/// Checks all but what depends on the wavelength.
Slm slm_of(SceneText text, const std::vector<std::string>& overrides) {
  auto state = std::make_shared<Slm::State>();
  state->text = std::move(text);
  state->overrides = overrides;
  state->at(raywave::HologramSpec{}.wavelength_m);
  return Slm(std::move(state));
}

}  // namespace

Slm load_slm(const std::filesystem::path& file, const std::vector<std::string>& overrides) {
  return slm_of(read_scene_text(file), overrides);
}

Slm parse_slm(const std::string& toml, const std::filesystem::path& folder,
              const std::vector<std::string>& overrides) {
  return slm_of({toml, "slm", folder, false}, overrides);
}

}  // namespace raywave::v0
