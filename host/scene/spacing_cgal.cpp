// SPDX-License-Identifier: Apache-2.0
#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>
#include <CGAL/Simple_cartesian.h>

#include <algorithm>
#include <cmath>

#include "host/scene/points.hpp"

namespace raywave {

std::vector<double> distances_to_fifth(std::span<const glm::dvec3> points) {
  using Kernel = CGAL::Simple_cartesian<double>;
  using Search = CGAL::Orthogonal_k_neighbor_search<CGAL::Search_traits_3<Kernel>>;
  constexpr unsigned nearest = 6;  // with the point itself
  Search::Tree tree;
  for (const auto& p : points) tree.insert({p.x, p.y, p.z});
  std::vector<double> distances;
  for (const auto& p : points) {
    double farthest = 0;  // squared
    for (const auto& [point, squared] : Search(tree, {p.x, p.y, p.z}, nearest))
      farthest = std::max(farthest, squared);
    distances.push_back(std::sqrt(farthest));
  }
  return distances;
}

}  // namespace raywave
