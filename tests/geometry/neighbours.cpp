// SPDX-License-Identifier: Apache-2.0
#include "host/geometry/normal_cones.hpp"
#include "host/reference/surfaces.hpp"
#include "tests/support/catch.hpp"

using namespace raywave;
using glm::dvec3;
using glm::uvec3;

TEST_CASE("neighbours share an edge in opposite directions; equal positions are one corner") {
  // A square of two triangles that share no vertex number
  const std::vector<dvec3> square{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  const std::vector<uvec3> two{{0, 1, 2}, {3, 4, 5}};
  CHECK(neighbours_of(square, two) == std::vector<std::int32_t>{-1, -1, 1, 0, -1, -1});

  // The other winding, or a third triangle at the edge: no neighbours
  CHECK(neighbours_of(square, {{0, 1, 2}, {4, 3, 5}}) == std::vector<std::int32_t>(6, -1));
  auto fin = square;
  fin.push_back({0, 0, 1});
  CHECK(neighbours_of(fin, {{0, 1, 2}, {3, 4, 5}, {0, 2, 6}}) == std::vector<std::int32_t>(9, -1));

  // A triangle with two equal corners has no neighbour beyond the edge between them.
  CHECK(neighbours_of(square, {{0, 3, 1}}) == std::vector<std::int32_t>(3, -1));
  CHECK(neighbours_of(square, {}).empty());
}

TEST_CASE("every edge of a closed mesh has a neighbour, which has it too") {
  const auto ball = reference::sphere({0, 0, 0}, 1, 12);
  const auto neighbours = neighbours_of(ball.positions, ball.triangles);
  REQUIRE(neighbours.size() == 3 * ball.triangles.size());
  int wrong = 0;
  for (std::size_t place = 0; place < neighbours.size(); ++place) {
    const auto other = neighbours[place];
    const auto self = static_cast<std::int32_t>(place / 3);
    std::multiset<std::int32_t> back;
    for (std::size_t i = 0; i < 3 && other >= 0; ++i)
      back.insert(neighbours[3 * static_cast<std::size_t>(other) + i]);
    wrong += back.count(self) != 1;
  }
  CHECK(wrong == 0);
}
