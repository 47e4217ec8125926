// SPDX-License-Identifier: Apache-2.0
/// Scenes, from files or from memory.
#pragma once

#include <filesystem>
#include <memory>
#include <raywave/error.hpp>
#include <raywave/types.hpp>

namespace RAYWAVE_NAMESPACE {

/// A scene as its file describes it (docs/scene.md lists every key), and meshes from memory. Copies
/// are cheap: they share what is equal. Meshes and textures are read from their files once, when
/// something is first computed of them.
///
/// One Scene may be read from several threads at a time; set, set_mesh and set_pose change only the
/// copy that they are called on.
class RAYWAVE_API Scene {
public:
  struct State;

  explicit Scene(std::shared_ptr<const State> state);

  std::array<int, 2> resolution() const;  // pixels of the hologram, x and y
  // Of the hologram. Several lasers have no wavelength in common: it is 0, which no function takes
  Pixels pixels() const;
  std::vector<double> wavelengths_m() const;  // one, or those of several lasers (docs/colour.md)
  int frames() const;
  std::size_t objects() const;

  /// Notes for the user, one line each: lengths without a unit, LUTs that are not taken as they
  /// are.
  std::vector<std::string> notes() const;

  /// The scene with every default filled in, lengths in metres. Of several lasers,
  /// hologram.wavelength_m is a list.
  std::string json() const;

  /// What parse_scene makes it of again, but for meshes from memory and poses: the text of its
  /// file, the folder of the files that this names, the overrides since, and its name. Of the scene
  /// of a plan that is the scene that was planned.
  std::string toml() const;
  std::filesystem::path folder() const;
  std::vector<std::string> overrides() const;
  std::string name() const;
  bool is_planned() const;

  /// Changes keys, as `raywave --set` does: "section.key=value", the value as TOML or a bare string
  /// ("wrp.padding=1.25", "hologram.pitch=8 um", "object.0.width=9 mm").
  ///
  /// throws  InputError for a key or value that is not possible, and for the scene of a plan, whose
  ///         values are chosen; the scene then stays as it was
  void set(const std::vector<std::string>& overrides);

  /// Gives an object a mesh that no file holds. Its axes are the object's; `width`, `normals` and
  /// the pose apply as to a file's mesh. Materials that a file brought go with the file; where the
  /// object names no material, it wears the mesh's colours times its texture. It stays until
  /// `mesh`, or objects with their files, are set.
  ///
  /// throws  InputError when there is no such object, a vertex is not finite, a face names no
  ///         vertex, a colour is not 0 to 1, or no face has an area
  void set_mesh(std::size_t object, const MeshView& mesh);

  /// The place of an object's anchor (the centre of its bounding box unless the scene says
  /// otherwise), and its rotation about x, then y, then z. The object of a glTF scene is the last.
  /// A pose stays until position, rotation or all objects are set, for a glTF scene's object until
  /// a key of [scene] is set.
  Vec3 position_m(std::size_t object) const;
  Vec3 rotation_deg(std::size_t object) const;
  void set_pose(std::size_t object, const Vec3& position_m, const Vec3& rotation_deg);

  const State& state() const { return *state_; }

private:
  std::shared_ptr<const State> state_;
};

/// Reads and checks a scene file.
///
/// overrides  as Scene::set takes them; applied before checks
/// throws     InputError: one line with file and line, and what would be right
RAYWAVE_API Scene load_scene(const std::filesystem::path& file,
                             const std::vector<std::string>& overrides = {});

/// Reads a scene from the text of such a file. Objects may lack `mesh`: Scene::set_mesh gives it.
///
/// folder  of the files that the text names
/// name    of the text, for messages
RAYWAVE_API Scene parse_scene(const std::string& toml, const std::filesystem::path& folder = ".",
                              const std::vector<std::string>& overrides = {},
                              const std::string& name = "scene");

/// How an SLM gets its picture: section [slm] of a scene file (docs/slm.md).
class RAYWAVE_API Slm {
public:
  struct State;

  /// A phase-only SLM of 256 levels to a turn.
  Slm();
  /// The SLM of a scene. That of a scene of several lasers is for these wavelengths alone.
  explicit Slm(const Scene& scene);
  explicit Slm(std::shared_ptr<const State> state);

  /// Notes for the user on what is read for a wavelength, one line each: LUTs that are not taken as
  /// they are. Those on the SLM of a scene are notes of the scene.
  std::vector<std::string> notes(double wavelength_m) const;

  const State& state() const { return *state_; }

private:
  std::shared_ptr<const State> state_;
};

/// Reads a file with section [slm] and nothing else. Other than in a scene, levels may have 10
/// bits.
///
/// throws  InputError, here for what no wavelength could repair, else where the Slm is used
RAYWAVE_API Slm load_slm(const std::filesystem::path& file,
                         const std::vector<std::string>& overrides = {});

/// The same from the text of such a file.
RAYWAVE_API Slm parse_slm(const std::string& toml, const std::filesystem::path& folder = ".",
                          const std::vector<std::string>& overrides = {});

}  // namespace RAYWAVE_NAMESPACE
