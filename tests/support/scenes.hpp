// SPDX-License-Identifier: Apache-2.0
/// Small scenes for tests, and the meshes they need.
#pragma once

#include <array>
#include <cmath>
#include <complex>
#include <filesystem>
#include <glm/geometric.hpp>
#include <numbers>
#include <random>
#include <span>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "host/common/npy.hpp"
#include "host/scene/scene.hpp"

namespace raywave {

/// The scene of a file of one laser.
inline Scene load_scene(const std::filesystem::path& file,
                        const std::vector<std::string>& overrides = {}) {
  const auto scenes = load_scenes(file, overrides);
  if (scenes.size() != 1) throw std::logic_error("a scene of one laser is wanted");
  return scenes[0];
}

}  // namespace raywave

namespace raywave::test {

constexpr double um = 1e-6, mm = 1e-3;

/// A mesh as the text of an OBJ file; corners are not shared.
class ObjText {
public:
  ObjText() { text_.precision(9); }

  void triangle(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) { face({a, b, c}, {}); }

  /// Adds a quad with corners counter-clockwise seen from outside; texture coordinates are uv0 at a
  /// and uv1 at c.
  void quad(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c, glm::dvec3 d, glm::dvec2 uv0 = {0, 0},
            glm::dvec2 uv1 = {1, 1}) {
    face({a, b, c}, {{uv0, {uv1.x, uv0.y}, uv1}});
    face({a, c, d}, {{uv0, uv1, {uv0.x, uv1.y}}});
  }

  std::string text() const { return text_.str(); }

private:
  void face(std::array<glm::dvec3, 3> corners, std::array<glm::dvec2, 3> uvs) {
    for (const auto& p : corners) text_ << "v " << p.x << ' ' << p.y << ' ' << p.z << '\n';
    for (const auto& t : uvs) text_ << "vt " << t.x << ' ' << t.y << '\n';
    text_ << 'f';
    for (int i = 0; i < 3; ++i, ++count_) text_ << ' ' << count_ << '/' << count_;
    text_ << '\n';
  }

  std::ostringstream text_;
  int count_ = 1;
};

/// A square of side 1 in the plane z = 0 that faces the hologram; texture coordinates run from uv0
/// to uv1.
inline std::string square_obj(glm::dvec2 uv0 = {0, 0}, glm::dvec2 uv1 = {1, 1}) {
  ObjText obj;
  obj.quad({-0.5, -0.5, 0}, {-0.5, 0.5, 0}, {0.5, 0.5, 0}, {0.5, -0.5, 0}, uv0, uv1);
  return obj.text();
}

/// A closed ball of diameter 1 with outward winding.
inline std::string ball_obj(int sectors, int rings) {
  const auto at = [&](int i, int j) {
    const double a = 2 * std::numbers::pi * (i % sectors) / sectors,
                 b = std::numbers::pi * j / rings;
    const double r = j == 0 || j == rings ? 0 : 0.5 * std::sin(b);
    return glm::dvec3(r * std::cos(a), 0.5 * std::cos(b), r * std::sin(a));
  };
  ObjText obj;
  for (int j = 0; j < rings; ++j) {
    for (int i = 0; i < sectors; ++i) {
      if (j > 0) obj.triangle(at(i, j), at(i + 1, j), at(i, j + 1));
      if (j + 1 < rings) obj.triangle(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
    }
  }
  return obj.text();
}

/// A glass prism with a right angle in the (x, z) plane; its short faces point to -z and +x, so
/// that it deflects light from -z to +x.
inline std::string prism_obj() {
  const glm::dvec3 corner(0.5, 0, -0.5), left(-0.5, 0, -0.5), back(0.5, 0, 0.5), up(0, 0.5, 0);
  ObjText obj;
  obj.triangle(left + up, corner + up, back + up);
  obj.triangle(left - up, back - up, corner - up);
  obj.quad(left - up, left + up, corner + up, corner - up);
  obj.quad(corner - up, corner + up, back + up, back - up);
  obj.quad(back - up, back + up, left + up, left - up);
  return obj.text();
}

/// A self-luminous material: lights do not change it.
inline Material glowing() { return {.ambient = glm::dvec3(1), .diffuse = glm::dvec3(0)}; }

/// A black material.
inline Material dark() { return {.ambient = glm::dvec3(0), .diffuse = glm::dvec3(0)}; }

/// A material that shows highlights alone.
inline Material shiny(double shininess) {
  return {.ambient = glm::dvec3(0),
          .diffuse = glm::dvec3(0),
          .specular = glm::dvec3(1),
          .shininess = shininess};
}

inline Light lamp_at(glm::dvec3 position_m, double intensity = 1) {
  return {.type = LightType::point, .position_m = position_m, .intensity = intensity};
}

inline SlmSpec by_phase() { return {.encoding = Encoding::phase}; }

inline Object object_at(std::filesystem::path mesh, double width_m, glm::dvec3 position_m,
                        int material = 0) {
  return Object{.mesh = std::move(mesh),
                .width_m = width_m,
                .position_m = position_m,
                .material = material,
                .where = "test object"};
}

/// Samples of modulus 1 and random phases.
inline FieldStack random_phases(glm::ivec2 size, int frames, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> turns(0, 1);
  FieldStack field{size.x, size.y, frames, {}};
  for (int i = 0; i < size.x * size.y * frames; ++i)
    field.samples.emplace_back(std::polar(1.0, 2 * std::numbers::pi * turns(random)));
  return field;
}

/// The relative L2 difference: root of sum |a - b|^2 / sum |b|^2, in double.
template <class A, class B>
double relative_l2(const std::vector<std::complex<A>>& a, const std::vector<std::complex<B>>& b) {
  double difference = 0, norm = 0;
  for (std::size_t i = 0; i < b.size(); ++i) {
    difference += std::norm(std::complex<double>(a[i]) - std::complex<double>(b[i]));
    norm += std::norm(std::complex<double>(b[i]));
  }
  return std::sqrt(difference / norm);
}

inline double energy(const std::vector<std::complex<float>>& field) {
  double sum = 0;
  for (const auto& z : field) sum += std::norm(std::complex<double>(z));
  return sum;
}

/// The correlation |<a, b>| / (|a| |b|)
inline double correlation(const std::vector<std::complex<float>>& a,
                          const std::vector<std::complex<float>>& b) {
  std::complex<double> product = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    product += std::conj(std::complex<double>(a[i])) * std::complex<double>(b[i]);
  return std::abs(product) / std::sqrt(energy(a) * energy(b));
}

inline bool all_finite(std::span<const std::complex<float>> field) {
  for (const auto& z : field) {
    if (!std::isfinite(z.real()) || !std::isfinite(z.imag())) return false;
  }
  return true;
}

}  // namespace raywave::test
