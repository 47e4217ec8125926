// SPDX-License-Identifier: Apache-2.0
/// Welding: equal numbers for exactly equal tuples.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory_resource>
#include <unordered_map>
#include <vector>

namespace raywave {

/// Numbers distinct tuples 0, 1, 2 ... in the order of their first appearance. Zero equals minus
/// zero; nothing may be NaN.
template <std::size_t N>
class Welder {
public:
  explicit Welder(std::size_t expected) { ids_.reserve(expected); }

  std::uint32_t id(std::array<double, N> tuple) {
    for (double& x : tuple) x += 0.0;  // turns -0 into +0, which hash alike
    return ids_.try_emplace(tuple, static_cast<std::uint32_t>(ids_.size())).first->second;
  }

private:
  struct Hash {
    std::size_t operator()(const std::array<double, N>& tuple) const {
      std::uint64_t hash = 0;
      for (const double x : tuple) {  // one round of splitmix64 for each number
        hash = (hash ^ std::bit_cast<std::uint64_t>(x)) * 0xbf58476d1ce4e5b9u;
        hash ^= hash >> 32;
      }
      return hash;
    }
  };
  std::pmr::monotonic_buffer_resource memory_;  // millions of small pieces, freed together
  std::pmr::unordered_map<std::array<double, N>, std::uint32_t, Hash> ids_{&memory_};
};

/// Returns an index for each position; equal positions share one.
inline std::vector<std::uint32_t> weld_positions(const std::vector<glm::dvec3>& positions) {
  Welder<3> welder(positions.size());
  std::vector<std::uint32_t> ids;
  ids.reserve(positions.size());
  for (const glm::dvec3& p : positions) ids.push_back(welder.id({p.x, p.y, p.z}));
  return ids;
}

}  // namespace raywave
