#pragma once
#include "hm/geometry/pose_graph_3d.hpp"

namespace ceres {
class CostFunction;
}

namespace hm::detail {

/// Creates the cost function of an edge: whitened pose_edge_error of two pose states, with analytic
/// derivatives. Owned by the caller.
ceres::CostFunction* new_pose_edge_cost(const PoseEdge3D& edge);

}  // namespace hm::detail
