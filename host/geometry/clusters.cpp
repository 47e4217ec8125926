// SPDX-License-Identifier: Apache-2.0
#include "host/geometry/clusters.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <limits>
#include <utility>

#include "host/common/threads.hpp"

namespace raywave {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr int corners_of_box = 8;

struct Vertex {
  float p[3];
  std::uint32_t index;
};

/// Puts neighbours next to each other: all vertices are halved along their longest side, again and
/// again, down to single clusters. All parts but the last have a power of two of clusters, so that
/// groups of clusters are neighbours, too.
void arrange(std::span<Vertex> vertices) {
  if (vertices.size() <= Clusters::size) return;
  float low[3], high[3];
  std::copy_n(vertices[0].p, 3, low);
  std::copy_n(vertices[0].p, 3, high);
  for (const auto& vertex : vertices) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], vertex.p[axis]);
      high[axis] = std::max(high[axis], vertex.p[axis]);
    }
  }
  int longest = 0;
  for (int axis = 1; axis < 3; ++axis) {
    if (high[axis] - low[axis] > high[longest] - low[longest]) longest = axis;
  }
  const auto half = Clusters::size * std::bit_floor((vertices.size() - 1) / Clusters::size);
  std::nth_element(vertices.begin(), vertices.begin() + static_cast<std::ptrdiff_t>(half),
                   vertices.end(),
                   [&](const Vertex& a, const Vertex& b) { return a.p[longest] < b.p[longest]; });
  arrange(vertices.first(half));
  arrange(vertices.subspan(half));
}

std::vector<std::uint32_t> arranged(std::span<const glm::dvec3> positions_m) {
  std::vector<Vertex> vertices;
  vertices.reserve(positions_m.size());
  for (const auto& position_m : positions_m) {
    const glm::vec3 p(position_m - positions_m[0]);
    vertices.push_back({{p.x, p.y, p.z}, static_cast<std::uint32_t>(vertices.size())});
  }
  arrange(vertices);
  std::vector<std::uint32_t> indices;
  indices.reserve(vertices.size());
  for (const auto& vertex : vertices) indices.push_back(vertex.index);
  return indices;
}

/// Axes at right angles, the last along `normal`, of which unit length is not asked.
glm::dmat3 frame_along(glm::dvec3 normal) {
  const double length = glm::length(normal);
  const auto z = length > 0 && std::isfinite(length) ? normal / length : glm::dvec3(0, 0, 1);
  const auto x = glm::normalize(
      glm::cross(std::abs(z.x) < 0.5 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0), z));
  return {x, glm::cross(z, x), z};
}

/// A box around points that lies flat along `normal`.
void set_box(std::span<const glm::dvec3> points_m, const glm::dvec3& normal, std::size_t lane,
             BoxLanes& boxes) {
  const auto frame = frame_along(normal);
  glm::dvec3 low(infinite), high(-infinite);
  for (const auto& point_m : points_m) {
    const auto p = (point_m - points_m[0]) * frame;
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  boxes.centre.set(lane, points_m[0] + frame * ((low + high) / 2.0));
  for (int side = 0; side < 3; ++side)
    boxes.half[side].set(lane, (high[side] - low[side]) / 2 * frame[side]);
}

/// The corners of boxes after a motion: those of all boxes' first corner, of their second, ...
std::array<Places, corners_of_box> corners_of(BoxLanes boxes, const Motion& motion) {
  boxes.centre.move(motion);
  const Motion direction{motion.turn, motion.scale, {}, {}, motion.moved};
  for (auto& half : boxes.half) half.move(direction);
  std::array<Places, corners_of_box> corners;
  for (int corner = 0; corner < corners_of_box; ++corner) {
    const double sign[3] = {corner & 1 ? 1.0 : -1.0, corner & 2 ? 1.0 : -1.0,
                            corner & 4 ? 1.0 : -1.0};
    for (int axis = 0; axis < 3; ++axis) {
      auto& to = corners[static_cast<std::size_t>(corner)].at_m[axis];
      for (std::size_t i = 0; i < Lanes::count; ++i)
        to.v[i] = boxes.centre.at_m[axis].v[i] + sign[0] * boxes.half[0].at_m[axis].v[i] +
                  sign[1] * boxes.half[1].at_m[axis].v[i] + sign[2] * boxes.half[2].at_m[axis].v[i];
    }
  }
  return corners;
}

std::span<const std::uint32_t> vertices_of(const Clusters& clusters, std::size_t cluster) {
  const auto first = cluster * Clusters::size;
  return std::span(clusters.vertices)
      .subspan(first, std::min(Clusters::size, clusters.vertices.size() - first));
}

constexpr std::size_t groups_of(std::size_t count, std::size_t size) {
  return (count + size - 1) / size;
}

/// What a box is to hold.
struct Content {
  std::array<glm::dvec3, std::max<std::size_t>(Clusters::size, Lanes::count* corners_of_box)>
      points_m;
  std::size_t count = 0;
  glm::dvec3 normal{0};  // sum over the vertices
};

/// A level of boxes; content_of(i) is what the i-th of them holds.
///
/// normals  of the boxes
template <class F>
std::vector<BoxLanes> boxes_around(std::size_t count, const F& content_of,
                                   std::vector<glm::dvec3>& normals) {
  std::vector<BoxLanes> boxes(groups_of(count, Lanes::count));
  normals.resize(count);
  auto& threads = cl::Threads::shared();
  threads.for_each(threads.count(), boxes.size(), 16, [&](std::size_t, std::size_t group) {
    for (std::size_t lane = 0; lane < Lanes::count; ++lane) {
      const auto box = std::min(group * Lanes::count + lane, count - 1);
      const Content content = content_of(box);
      set_box(std::span(content.points_m).first(content.count), content.normal, lane, boxes[group]);
      normals[box] = content.normal;
    }
  });
  return boxes;
}

/// Looks for the largest values among an object's vertices, from the boxes around all of them
/// downwards.
class Search {
public:
  Search(const Clusters& clusters, std::span<const glm::dvec3> positions_m, const Motion& motion,
         const RaiseInPlaces& raise, double least, std::span<double> largest)
      : clusters_(clusters),
        positions_m_(positions_m),
        motion_(motion),
        raise_(raise),
        least_(least),
        largest_(largest),
        reached_(largest.size()),
        bounds_(clusters.levels.size() * largest.size()) {}

  void run() {
    // The most promising first: few others then promise more.
    for (std::size_t function = 0; function < largest_.size(); ++function) follow(function);
    look_below(clusters_.levels.size() - 1, 0);
  }

private:
  /// What the boxes of a group promise, until the next call for their level.
  std::span<const Lanes> bounds_of(std::size_t level, std::size_t group) {
    const auto bounds = std::span(bounds_).subspan(level * largest_.size(), largest_.size());
    std::fill(bounds.begin(), bounds.end(), Lanes(-infinite));
    raise_(corners_of(clusters_.levels[level][group], motion_), bounds);
    return bounds;
  }

  void follow(std::size_t function) {
    std::size_t box = 0;
    for (auto level = clusters_.levels.size(); level-- > 0;) {
      const auto& promised = bounds_of(level, box)[function].v;
      const auto best =
          static_cast<std::size_t>(std::max_element(promised, promised + Lanes::count) - promised);
      if (!(promised[best] > largest_[function] + least_)) return;
      box = std::min(box * Lanes::count + best, box_count(level) - 1);
    }
    look_at(box);
  }

  void look_below(std::size_t level, std::size_t group) {
    const auto bounds = bounds_of(level, group);
    const auto first = group * Lanes::count,
               count = std::min(Lanes::count, box_count(level) - first);
    for (std::size_t i = 0; i < count; ++i) {
      const auto promises_more = [&](std::size_t function) {
        return bounds[function].v[i] > largest_[function] + least_;
      };
      bool worth_it = false;
      for (std::size_t function = 0; function < largest_.size(); ++function)
        worth_it = worth_it || promises_more(function);
      if (!worth_it) continue;
      if (level == 0)
        look_at(first + i);
      else
        look_below(level - 1, first + i);
    }
  }

  void look_at(std::size_t cluster) {
    const auto vertices = vertices_of(clusters_, cluster);
    std::array<Places, groups_of(Clusters::size, Lanes::count)> room;
    const auto places = side_by_side(
        vertices.size(), [&](std::size_t i) { return positions_m_[vertices[i]]; }, room);
    for (auto& p : places) p.move(motion_);
    std::fill(reached_.begin(), reached_.end(), Lanes(-infinite));
    raise_(places, reached_);
    for (std::size_t function = 0; function < largest_.size(); ++function)
      largest_[function] = std::max(largest_[function], reached_[function].largest());
  }

  std::size_t box_count(std::size_t level) const {
    return level == 0 ? groups_of(clusters_.vertices.size(), Clusters::size)
                      : clusters_.levels[level - 1].size();
  }

  const Clusters& clusters_;
  std::span<const glm::dvec3> positions_m_;
  const Motion& motion_;
  const RaiseInPlaces& raise_;
  double least_;
  std::span<double> largest_;
  std::vector<Lanes> reached_, bounds_;
};

}  // namespace

Clusters clusters_of(std::span<const glm::dvec3> positions_m, std::span<const glm::vec3> normals) {
  Clusters clusters;
  clusters.vertices = arranged(positions_m);
  std::vector<glm::dvec3> normals_below;
  clusters.levels.push_back(boxes_around(
      groups_of(clusters.vertices.size(), Clusters::size),
      [&](std::size_t cluster) {
        Content content;
        for (const auto i : vertices_of(clusters, cluster)) {
          content.points_m[content.count++] = positions_m[i];
          content.normal += glm::dvec3(normals[i]);
        }
        return content;
      },
      normals_below));
  while (clusters.levels.back().size() > 1) {
    const auto& below = clusters.levels.back();
    std::vector<glm::dvec3> of_groups;
    auto boxes = boxes_around(
        below.size(),
        [&](std::size_t group) {
          Content content;
          for (const auto& corners : corners_of(below[group], {})) {
            for (std::size_t lane = 0; lane < Lanes::count; ++lane)
              content.points_m[content.count++] = corners.get(lane);
          }
          for (auto i = group * Lanes::count;
               i < std::min((group + 1) * Lanes::count, normals_below.size()); ++i)
            content.normal += normals_below[i];
          return content;
        },
        of_groups);
    normals_below = std::move(of_groups);
    clusters.levels.push_back(std::move(boxes));
  }
  return clusters;
}

void raise_to_largest(const Clusters& clusters, std::span<const glm::dvec3> positions_m,
                      const Motion& motion, const RaiseInPlaces& raise, double least,
                      std::span<double> largest) {
  Search(clusters, positions_m, motion, raise, least, largest).run();
}

}  // namespace raywave
