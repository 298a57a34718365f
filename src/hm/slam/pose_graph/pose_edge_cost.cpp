#include "hm/slam/pose_graph/pose_edge_cost.hpp"

#include <ceres/sized_cost_function.h>

#include "hm/slam/pose_graph/graph_problem.hpp"
#include "hm/slam/pose_graph/pose_graph_3d_solver.hpp"
#include "hm/slam/pose_graph/pose_manifold.hpp"

namespace hm::detail {
namespace {

/// root * pose_edge_error, with derivatives with respect to perturbations (moved_by).
class EdgeCost : public ceres::SizedCostFunction<6, 7, 7> {
 public:
  explicit EdgeCost(const PoseEdge3D& edge) : edge_(edge), root_(information_root(edge.information)) {}

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const SE3 T_map_from = pose_of(parameters[0]), T_map_to = pose_of(parameters[1]);
    Eigen::Map<Vec6>(residuals, 6) = root_ * pose_edge_error(edge_, T_map_from, T_map_to);
    if (jacobians == nullptr) return true;
    const Eigen::Matrix<double, 6, 12> jacobian = root_ * pose_edge_jacobian(edge_, T_map_from, T_map_to);
    for (int side = 0; side < 2; ++side)
      if (jacobians[side] != nullptr) write_by_move<6>(jacobian.middleCols<6>(6 * side), jacobians[side]);
    return true;
  }

 private:
  PoseEdge3D edge_;
  Mat6 root_;
};

}  // namespace

ceres::CostFunction* new_pose_edge_cost(const PoseEdge3D& edge) { return new EdgeCost(edge); }

}  // namespace hm::detail
