// SPDX-License-Identifier: Apache-2.0
/// Materials that meshes bring, as Phong materials (docs/materials.md).
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "host/scene/read_data.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// A channel of a picture on a surface, or its red, green and blue, linear; `image` is null where
/// there is none. Copies share the pixels.
struct SurfaceMap {
  std::shared_ptr<const Image> image{};
  MapPlace place{};

  explicit operator bool() const { return image != nullptr; }
};

/// All pictures of a material, for the hologram's wavelength.
struct MaterialMaps {
  SurfaceMap colour;               // times ambient and diffuse, or the base colour
  SurfaceMap alpha, opacity;       // times Material::alpha
  SurfaceMap emission;             // times Material::emission
  SurfaceMap roughness, metallic;  // times those of MetallicRoughness
  // Of the normal, 0 to 1 for -1 to 1: along u, along v upwards, and out of the surface
  std::array<SurfaceMap, 3> normal;

  std::vector<std::string> notes;  // pictures that cannot be had

  std::array<const SurfaceMap*, 9> all() const {
    return {&colour,   &alpha,     &opacity,   &emission, &roughness,
            &metallic, &normal[0], &normal[1], &normal[2]};
  }
};

/// Exponents below this make highlights so wide that they are counted as diffuse light.
inline constexpr double least_shininess = 1;  // roughness 0.76

/// Phong's exponent whose highlight is as wide as that of a microfacet surface of this roughness:
/// 1 / (2 roughness^4) - 1/2, at most 10000.
double shininess_of(double roughness);

/// Strength of a highlight that carries the share `reflectance` of the light on a surface that
/// faces light and viewer: reflectance (shininess + 2) / 2.
double specular_of(double reflectance, double shininess);

/// The material as a scene file could have it, but for what meshes alone bring.
///
/// maps                its pictures: they decide means
/// colours_have_alpha  the mesh has colours of vertices, and not all of their alphas are 1
/// ambient_share       of its colour that ambient light shows
/// where               the start of messages about it
Material phong_of(const MeshMaterial& material, const MaterialMaps& maps, bool colours_have_alpha,
                  double ambient_share, const std::string& where);

/// The pictures of a mesh's materials, decoded.
///
/// file     of the mesh; names of pictures are relative to its folder
/// channels  of colours that the hologram sees
/// throws   InputError, starting with `where`, when a picture is there and cannot be used; one that
///          is missing is noted
std::vector<MaterialMaps> load_maps(const Mesh& mesh, const std::filesystem::path& file,
                                    Channels channels, const std::string& where);

/// A line about a material for `raywave plan`: "metallic 0, roughness 0.5, colour map 512 x 512 ->
/// diffuse 0.8, specular 0.19, shininess 7.5".
///
/// channel  of colours that the hologram sees
std::string description_of(const MeshMaterial& from, const Material& material,
                           const MaterialMaps& maps, int channel);

}  // namespace raywave
