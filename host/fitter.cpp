// SPDX-License-Identifier: Apache-2.0
#include "host/fitter.hpp"

#include <algorithm>
#include <cmath>

#include "host/device_scene.hpp"

namespace raywave {
namespace {

/// Nodes in runs: the upper part of a subtree, as high as work-items are to go, children first. Those of a pass need earlier passes only.
struct Runs {
  std::vector<std::int32_t> nodes, first_of_run, first_run_of_pass;
};

/// All nodes, from the leftmost leaf on: triangles are then read one after the other.
std::vector<std::size_t> children_first(const Bvh& bvh) {
  // Parents first, from the right, turned round.
  std::vector<std::size_t> order, waiting{0};
  order.reserve(bvh.nodes.size());
  while (!waiting.empty()) {
    const auto n = waiting.back();
    waiting.pop_back();
    order.push_back(n);
    const auto& node = bvh.nodes[n];
    if (node.left_count == 0) waiting.push_back(static_cast<std::size_t>(node.left_child));
    if (node.right_count == 0) waiting.push_back(static_cast<std::size_t>(node.right_child));
  }
  std::reverse(order.begin(), order.end());
  return order;
}

Runs runs_of(const Bvh& bvh, int levels) {
  const auto count = bvh.nodes.size();
  const auto for_children = [&](std::size_t n, auto&& f) {
    const auto& node = bvh.nodes[n];
    if (node.left_count == 0) f(static_cast<std::size_t>(node.left_child));
    if (node.right_count == 0) f(static_cast<std::size_t>(node.right_child));
  };
  // Children come behind their parents.
  std::vector<std::int32_t> pass(count, 0), run(count, -1);  // first as heights over the leaves
  for (auto n = count; n-- > 0;) for_children(n, [&](std::size_t child) { pass[n] = std::max(pass[n], pass[child] + 1); });
  for (auto& p : pass) p /= levels;
  const auto passes = static_cast<std::size_t>(pass[0]) + 1;
  std::vector<std::int32_t> size, pass_of_run;
  Runs runs;
  runs.first_run_of_pass.assign(passes + 1, 0);
  for (std::size_t n = 0; n < count; ++n) {
    if (run[n] < 0) {
      run[n] = static_cast<std::int32_t>(size.size());
      size.push_back(0);
      pass_of_run.push_back(pass[n]);
      ++runs.first_run_of_pass[static_cast<std::size_t>(pass[n]) + 1];
    }
    ++size[static_cast<std::size_t>(run[n])];
    for_children(n, [&](std::size_t child) {
      if (pass[child] == pass[n]) run[child] = run[n];
    });
  }
  for (std::size_t p = 0; p < passes; ++p) runs.first_run_of_pass[p + 1] += runs.first_run_of_pass[p];

  // Runs take their places pass by pass.
  auto next_run = runs.first_run_of_pass;
  std::vector<std::int32_t> place(size.size());
  runs.first_of_run.assign(size.size() + 1, 0);
  for (std::size_t r = 0; r < size.size(); ++r) {
    place[r] = next_run[static_cast<std::size_t>(pass_of_run[r])]++;
    runs.first_of_run[static_cast<std::size_t>(place[r]) + 1] = size[r];
  }
  for (std::size_t r = 0; r < size.size(); ++r) runs.first_of_run[r + 1] += runs.first_of_run[r];
  auto next = runs.first_of_run;
  runs.nodes.resize(count);
  for (const auto n : children_first(bvh)) {
    auto& at = next[static_cast<std::size_t>(place[static_cast<std::size_t>(run[n])])];
    runs.nodes[static_cast<std::size_t>(at++)] = static_cast<std::int32_t>(n);
  }
  return runs;
}

double surface_of(const device::BvhNode& root) {
  double side[3];
  for (int axis = 0; axis < 3; ++axis)
    side[axis] = double{std::max(root.left_max[axis], root.right_max[axis])} - std::min(root.left_min[axis], root.right_min[axis]);
  return side[0] * side[1] + side[1] * side[2] + side[2] * side[0];
}

}  // namespace

Fitter::Fitter(const cl::Device& device) : device_(device), fit_tree_(cl::Program(device, "fit.cl", {}).kernel("fit_tree")) {}

void Fitter::take(const Bvh& bvh, DeviceTree& tree) {
  // CPUs start few work-items, GPUs many.
  const auto runs = runs_of(bvh, lanes_for(device_.info()) > 1 ? 8 : 2);
  cl::put(device_, tree.nodes, bvh.nodes, "tree");
  cl::put(device_, nodes_of_runs_, runs.nodes, "nodes by run");
  cl::put(device_, first_of_run_, runs.first_of_run, "runs of nodes");
  surfaces_ = {device_, runs.first_of_run.size() - 1, "surfaces of boxes"};
  first_run_of_pass_ = runs.first_run_of_pass;
}

double Fitter::fit(DeviceTree& tree, double reach_m, glm::vec3 eye_m) {
  const std::size_t local = lanes_for(device_.info()) > 1 ? 1 : 64;
  const auto margin = static_cast<float>(box_margin_m(reach_m));
  for (std::size_t pass = 0; pass + 1 < first_run_of_pass_.size(); ++pass) {
    const auto first = first_run_of_pass_[pass], runs = first_run_of_pass_[pass + 1] - first;
    fit_tree_.run({static_cast<std::size_t>(runs)}, {local}, tree.nodes, tree.triangles, tree.positions, nodes_of_runs_, first_of_run_,
                  first, runs, margin, eye_m.x, eye_m.y, eye_m.z, surfaces_);
  }
  double sum = 0, whole = 0;
  surfaces_.on_host(
      [&](std::span<const float> surfaces) {
        for (const float s : surfaces) sum += s;
      },
      0, surfaces_.size());
  tree.nodes.on_host([&](std::span<const device::BvhNode> root) { whole = surface_of(root[0]); }, 0, 1);
  return whole > 0 ? sum / whole : 1;
}

}  // namespace raywave
