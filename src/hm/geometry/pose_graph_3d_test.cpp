#include "hm/geometry/pose_graph_3d.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

Vec6 random_vector(Rng& rng, double size_m, double size_rad) {
  Vec6 v;
  for (int i = 0; i < 6; ++i) v[i] = rng.normal(0, i < 3 ? size_m : size_rad);
  return v;
}

SE3 random_pose(Rng& rng) { return SE3::exp(random_vector(rng, 3, 1)); }

TEST(PoseGraph3D, ErrorIsTheMoveFromTheMeasuredPose) {
  Rng rng(1);
  for (int trial = 0; trial < 100; ++trial) {
    const SE3 from = random_pose(rng);
    PoseEdge3D edge;
    edge.T_from_to = random_pose(rng);
    const Vec6 move = random_vector(rng, 1, 0.5);
    EXPECT_LT((pose_edge_error(edge, from, moved_by(from * edge.T_from_to, move)) - move).norm(), 1e-9);
  }
}

TEST(PoseGraph3D, Chi2IsTheWeightedSquare) {
  PoseGraph3D graph;
  graph.T_map_node = {SE3(), SE3(Mat3(Mat3::Identity()), Vec3(1, 0, 0))};
  PoseEdge3D edge;
  edge.to = 1;
  edge.information.diagonal() << 1, 2, 3, 4, 5, 6;
  edge.T_from_to = SE3(so3_exp(Vec3(0, 0, 0.1)), Vec3(0.5, 0, 0));
  graph.edges = {edge, edge};
  // The place beyond the measured one, in its axes: (0.5, 0, 0) turned by -0.1 about z.
  const double x = 0.5 * std::cos(0.1), y = -0.5 * std::sin(0.1);
  EXPECT_NEAR(pose_edge_chi2(edge, graph), x * x + 2 * y * y + 6 * 0.01, 1e-12);
  EXPECT_NEAR(pose_graph_chi2(graph), 2 * pose_edge_chi2(edge, graph), 1e-12);
}

/// Covariances of products and inverses against samples.
TEST(PoseGraph3D, CovariancesAgainstMonteCarlo) {
  Rng rng(2);
  const SE3 T_a_b = random_pose(rng), T_b_c = random_pose(rng);
  Vec6 sigma_ab, sigma_bc;
  sigma_ab << 0.01, 0.02, 0.03, 0.01, 0.005, 0.02;
  sigma_bc << 0.02, 0.01, 0.01, 0.004, 0.01, 0.005;
  Mat6 sum = Mat6::Zero(), inverse = Mat6::Zero();
  constexpr int kSamples = 20000;
  const auto move_of = [](const SE3& expected, const SE3& sample) {
    PoseEdge3D edge;
    edge.T_from_to = expected;
    return pose_edge_error(edge, SE3(), sample);
  };
  for (int s = 0; s < kSamples; ++s) {
    const SE3 ab = moved_by(T_a_b, random_vector(rng, 1, 1).cwiseProduct(sigma_ab));
    const SE3 bc = moved_by(T_b_c, random_vector(rng, 1, 1).cwiseProduct(sigma_bc));
    const Vec6 e = move_of(T_a_b * T_b_c, ab * bc), i = move_of(T_a_b.inverse(), ab.inverse());
    sum += e * e.transpose() / kSamples;
    inverse += i * i.transpose() / kSamples;
  }
  const Mat6 ab = sigma_ab.cwiseAbs2().asDiagonal(), bc = sigma_bc.cwiseAbs2().asDiagonal();
  EXPECT_LT((compose_covariance(ab, T_b_c, bc) - sum).norm(), 0.05 * sum.norm());
  EXPECT_LT((inverse_covariance(T_a_b, ab) - inverse).norm(), 0.05 * inverse.norm());
}

}  // namespace
}  // namespace hm
