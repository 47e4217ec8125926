// SPDX-License-Identifier: Apache-2.0
#include "host/reference/surfaces.hpp"

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numbers>

#include "host/planning/make_plan.hpp"
#include "host/reference/looks.hpp"

namespace raywave::reference {

double uniform(Random& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

glm::dvec3 in_box(Random& random, double half) {
  const double x = uniform(random, -half, half), y = uniform(random, -half, half),
               z = uniform(random, -half, half);
  return {x, y, z};
}

glm::dvec3 unit_vector(Random& random) {
  for (;;) {
    const auto v = in_box(random, 1);
    if (length(v) > 0.1 && length(v) <= 1) return normalize(v);
  }
}

void Surface::triangle(glm::dvec3 a, glm::dvec3 b, glm::dvec3 c) {
  const auto first = static_cast<std::uint32_t>(positions.size());
  positions.insert(positions.end(), {a, b, c});
  triangles.push_back({first, first + 1, first + 2});
}

Surface grid(int columns, int rows, const std::function<glm::dvec3(double s, double t)>& point) {
  Surface g;
  for (int j = 0; j <= rows; ++j)
    for (int i = 0; i <= columns; ++i)
      g.positions.push_back(point(double(i) / columns, double(j) / rows));
  const auto at = [&](int i, int j) { return static_cast<std::uint32_t>(j * (columns + 1) + i); };
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      g.triangles.push_back({at(i, j), at(i, j + 1), at(i + 1, j + 1)});
      g.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i + 1, j)});
    }
  }
  return g;
}

Surface rectangle(glm::dvec3 centre, glm::dvec3 u, glm::dvec3 v) {
  return grid(1, 1, [=](double s, double t) { return centre + (2 * s - 1) * u + (2 * t - 1) * v; });
}

Surface sphere(glm::dvec3 centre, double radius, int rings) {
  Surface s;
  s.closed = true;
  const int sectors = 2 * rings;
  for (int j = 0; j <= rings; ++j) {
    const double a = std::numbers::pi * j / rings, r = j == 0 || j == rings ? 0 : std::sin(a);
    for (int i = 0; i < sectors; ++i) {
      const double b = std::numbers::pi * i / rings;
      const glm::dvec3 n(r * std::cos(b), std::cos(a), r * std::sin(b));
      s.positions.push_back(centre + radius * n);
      s.normals.emplace_back(n);
    }
  }
  const auto at = [&](int i, int j) {
    return static_cast<std::uint32_t>(j * sectors + i % sectors);
  };
  for (int j = 0; j < rings; ++j) {
    for (int i = 0; i < sectors; ++i) {
      if (j > 0) s.triangles.push_back({at(i, j), at(i + 1, j), at(i, j + 1)});
      if (j < rings - 1) s.triangles.push_back({at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return s;
}

Surface torus(double size) {
  constexpr int columns = 48, rows = 24;
  Surface s;
  s.closed = true;
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      const double a = 2 * std::numbers::pi * i / columns, b = 2 * std::numbers::pi * j / rows,
                   r = 0.7 + 0.3 * std::cos(b);
      s.positions.push_back(size * glm::dvec3(r * std::cos(a), r * std::sin(a), 0.3 * std::sin(b)));
    }
  }
  const auto at = [&](int i, int j) {
    return static_cast<std::uint32_t>((j % rows) * columns + i % columns);
  };
  for (int j = 0; j < rows; ++j) {
    for (int i = 0; i < columns; ++i) {
      s.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      s.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  return s;
}

Surface box(glm::dvec3 centre, glm::dvec3 half) {
  Surface b;
  b.closed = true;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      glm::dvec3 n(0), u(0), v(0);
      n[axis] = side * half[axis];
      u[(axis + 1) % 3] = half[(axis + 1) % 3];
      v[(axis + 2) % 3] = side * half[(axis + 2) % 3];
      const auto c = centre + n;
      b.triangle(c - u - v, c + u - v, c + u + v);
      b.triangle(c - u - v, c + u + v, c - u + v);
    }
  }
  return b;
}

Surface flipped(Surface s) {
  for (auto& t : s.triangles) std::swap(t.y, t.z);
  return s;
}

Surface soup(Random& random, int count, double size) {
  Surface s;
  for (int i = 0; i < count; ++i) {
    const auto a = in_box(random, size), b = a + in_box(random, 0.3 * size),
               c = a + in_box(random, 0.3 * size);
    switch (i % 16) {
      case 0:
        s.triangle(a, b, a + (b - a) * 0.4 + in_box(random, 1e-9 * size));
        break;  // sliver
      case 1:
        s.triangle(a, a, a);
        break;
      case 2:
        s.triangle(a, b, b);
        break;
      case 3:
        s.triangle(a, b, a + (b - a) * 0.25);
        break;  // line
      case 4:
        s.triangle(a, b, c);
        s.triangle(a, b, c);
        break;
      default:
        s.triangle(a, b, c);
    }
  }
  return s;
}

std::vector<Ray> random_rays(Random& random, int count, double size) {
  std::vector<Ray> rays;
  for (int i = 0; i < count; ++i) {
    auto d = unit_vector(random);
    if (i % 3 == 0) {
      const int axis = i / 3 % 3;
      d = glm::dvec3(0);
      d[axis] = i % 2 ? 1 : -1;
    }
    const double scale = std::pow(10.0, uniform(random, -3, 3));
    rays.push_back(
        {in_box(random, size) - d * uniform(random, 0, 3 * size), d * scale, 0, 10 * size / scale});
  }
  return rays;
}

std::vector<Ray> rays_at_edges(Random& random, std::span<const Corners> triangles,
                               std::size_t count, double size) {
  std::vector<Ray> rays;
  rays.reserve(count);
  while (rays.size() < count) {
    const auto& t =
        triangles[std::uniform_int_distribution<std::size_t>(0, triangles.size() - 1)(random)];
    const glm::dvec3 a(t.a[0], t.a[1], t.a[2]), b(t.b[0], t.b[1], t.b[2]);
    const auto target = rays.size() % 2 ? a : a + (b - a) * uniform(random, 0, 1);
    const auto origin = 3 * size * unit_vector(random);
    const auto direction = target - origin;
    // Nearly tangential rays may rightly pass outside: the mesh bulges less than the rounding of
    // the ray there.
    const auto outwards = normalize(cross(b - a, glm::dvec3(t.c[0], t.c[1], t.c[2]) - a));
    if (std::abs(dot(outwards, normalize(direction))) < 0.3) continue;
    rays.push_back({origin, direction, 0, 10});
  }
  return rays;
}

std::vector<Ray> as_float(std::vector<Ray> rays) {
  for (auto& r : rays)
    r = {glm::dvec3(glm::vec3(r.origin)), glm::dvec3(glm::vec3(r.direction)),
         double(float(r.t_min)), double(float(r.t_max))};
  return rays;
}

Stage::Stage() {
  scene.hologram = {{96, 80}, {8e-6, 8e-6}, 638e-9};
  scene.sampling.pitch_m = 25e-6;
  scene.sampling.antialias = 0;
  scene.wrp.propagation = WrpPropagation::spectrum;
}

Stage& Stage::add(const Surface& s, const Material& material) {
  const auto first = static_cast<std::uint32_t>(world.positions.size());
  const auto object = static_cast<int>(scene.objects.size());
  std::vector<glm::vec3> normals = s.normals;
  if (normals.empty()) {
    normals.resize(s.positions.size());
    for (const auto& t : s.triangles) {
      const auto n = normalize(
          cross(s.positions[t.y] - s.positions[t.x], s.positions[t.z] - s.positions[t.x]));
      for (int i = 0; i < 3; ++i) normals[t[i]] = glm::vec3(n);
    }
  }
  for (const auto& p : s.positions) {
    if (world.positions.empty()) world.min_m = world.max_m = p;
    world.min_m = min(world.min_m, p);
    world.max_m = max(world.max_m, p);
    world.positions.push_back(p);
  }
  world.normals.insert(world.normals.end(), normals.begin(), normals.end());
  world.uvs.resize(world.positions.size());
  for (const auto& t : s.triangles) world.triangles.push_back(t + first);
  world.triangle_object.resize(world.triangles.size(), object);
  world.object_closed.push_back(s.closed);
  scene.materials.push_back(material);
  Object o;
  o.material = object;
  scene.objects.push_back(o);
  return *this;
}

Stage ball_before_wall(double z_m) {
  Stage stage;
  stage.scene.hologram = {{61, 47}, {8e-6, 10e-6}, 638e-9};
  stage.scene.sampling.pitch_m = 50e-6;
  stage.scene.trace.shadows = true;
  Material shiny;
  shiny.specular = glm::dvec3(2.0);
  shiny.shininess = 20;
  stage.add(sphere({0.05e-3, 0, z_m}, 0.3e-3, 8), shiny);
  stage.add(rectangle({0, 0, z_m + 0.5e-3}, {0.7e-3, 0, 0.1e-3}, {0, 0.6e-3, 0}));
  Light sun, lamp;
  sun.direction = {0.1, -0.2, 1};
  lamp.type = LightType::point;
  lamp.position_m = {0.5e-3, 0.5e-3, z_m - 1e-3};
  lamp.intensity = 0.5;
  stage.scene.lights = {sun, lamp};
  return stage;
}

std::vector<Corners> corners_of(const DeviceTree& tree) {
  const auto positions = tree.positions.read();
  std::vector<Corners> all;
  for (const auto& t : tree.triangles.read()) {
    Corners corners{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      corners.a[axis] = positions[3 * static_cast<std::size_t>(t.corner_a) + axis];
      corners.b[axis] = positions[3 * static_cast<std::size_t>(t.corner_b) + axis];
      corners.c[axis] = positions[3 * static_cast<std::size_t>(t.corner_c) + axis];
    }
    all.push_back(corners);
  }
  return all;
}

Rig::Rig(const cl::Device& device, const Stage& stage, Method method, bool keep_unseen)
    : scene(stage.scene),
      plan(make_plan(scene, stage.world, method)),
      lights(lights_of(scene, stage.world)),
      arrays(device, stage.world, plan),
      table(device, plan, arrays, keep_unseen),
      samples(table.samples.read()),
      first_of_cell(table.first_of_cell.read()),
      visibility_masks(table.visibility_masks.read()),
      lit(table.lit.read()),
      triangles(arrays.tree.triangles.read()),
      corners(corners_of(arrays.tree)) {
  samples.resize(static_cast<std::size_t>(table.count));
  visibility_masks.resize(samples.size() * table.visibility_words());
  lit.resize(samples.size() * arrays.light_words());
}

}  // namespace raywave::reference
