#pragma once
#include "hm/geometry/pose_graph_3d.hpp"

namespace ceres {
class CostFunction;
}

namespace hm::detail {

/// The whitened pose_edge_error of two pose states, with analytic derivatives. The caller owns it.
ceres::CostFunction* new_pose_edge_cost(const PoseEdge3D& edge);

}  // namespace hm::detail
