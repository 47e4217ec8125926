// SPDX-License-Identifier: Apache-2.0
/// Work of gathering on virtual planes.
#pragma once

#include "host/plan/front_view.hpp"
#include "host/plan/plan.hpp"

namespace raywave {

/// Nodes of the profiles of the front view's cells, one sample in each, and other work in units of
/// these. They depend neither on the sampling pitch nor on the frames.
struct Nodes {
  double nodes = 0, frame_nodes = 0;  // `frame`: for each frame beyond the first
};
Nodes nodes_of(const VirtualPlanes& planes, const Plan& plan, const FrontView& view);

}  // namespace raywave
