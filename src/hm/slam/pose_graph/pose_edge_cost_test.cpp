#include "hm/slam/pose_graph/pose_edge_cost.hpp"

#include <ceres/cost_function.h>
#include <ceres/manifold.h>
#include <gtest/gtest.h>

#include <memory>

#include "hm/core/rng.hpp"
#include "hm/slam/pose_graph/pose_manifold.hpp"

namespace hm {
namespace {

SE3 some_pose(Rng& rng, double turn_rad) {
  const Vec3 turn(rng.normal(), rng.normal(), rng.normal());
  return {so3_exp(turn_rad * turn), Vec3(rng.normal(), rng.normal(), rng.normal())};
}

/// The solver's Jacobian, including whitening and manifold, against finite differences: the derivative with
/// respect to the states times the manifold's own.
TEST(PoseEdgeCost, DerivativesAreTheNumericOnes) {
  Rng rng(4);
  const std::unique_ptr<ceres::Manifold> manifold(detail::new_pose_manifold());
  for (int trial = 0; trial < 50; ++trial) {
    PoseEdge3D edge;
    edge.T_from_to = some_pose(rng, 0.5);
    Mat6 root;
    for (double& value : root.reshaped()) value = rng.normal();
    edge.information = root * root.transpose() + Mat6::Identity();
    const SE3 T_from = some_pose(rng, 0.6);
    detail::PoseState states[2] = {detail::pose_state(T_from),
                                   detail::pose_state(T_from * edge.T_from_to * some_pose(rng, 0.2))};
    const std::unique_ptr<ceres::CostFunction> cost(detail::new_pose_edge_cost(edge));
    const auto error = [&](const detail::PoseState& from, const detail::PoseState& to) {
      const double* parameters[] = {from.data(), to.data()};
      Vec6 residuals;
      EXPECT_TRUE(cost->Evaluate(parameters, residuals.data(), nullptr));
      return residuals;
    };
    using Rows = Eigen::Matrix<double, 6, 7, Eigen::RowMajor>;
    Rows by_state[2];
    const double* parameters[] = {states[0].data(), states[1].data()};
    double* jacobians[] = {by_state[0].data(), by_state[1].data()};
    Vec6 residuals;
    ASSERT_TRUE(cost->Evaluate(parameters, residuals.data(), jacobians));
    for (int side = 0; side < 2; ++side) {
      Eigen::Matrix<double, 7, 6, Eigen::RowMajor> by_move;
      ASSERT_TRUE(manifold->PlusJacobian(states[side].data(), by_move.data()));
      const Mat6 analytic = by_state[side] * by_move;
      Mat6 numeric;
      for (int i = 0; i < 6; ++i) {
        Vec6 ends[2];
        for (const int sign : {0, 1}) {
          const Vec6 move = (sign == 0 ? -1e-6 : 1e-6) * Vec6::Unit(i);
          detail::PoseState moved[2] = {states[0], states[1]};
          ASSERT_TRUE(manifold->Plus(states[side].data(), move.data(), moved[side].data()));
          ends[sign] = error(moved[0], moved[1]);
        }
        numeric.col(i) = (ends[1] - ends[0]) / 2e-6;
      }
      EXPECT_LT((analytic - numeric).norm(), 1e-6 * numeric.norm()) << side;
    }
  }
}

}  // namespace
}  // namespace hm
