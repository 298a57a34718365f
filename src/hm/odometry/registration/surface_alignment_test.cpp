#include "hm/odometry/registration/surface_alignment.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "hm/odometry/testing/textured_room.hpp"

namespace hm {
namespace {

const PinholeCamera kCamera{640, 480, 525, 525, 319.5, 239.5, {}};
const DepthNoise kNoise;

DepthGrid grid_at(const SE3& T, Rng* rng = nullptr) {
  TexturedRoom room;
  room.contrast = 0;
  const RgbdFrame frame = render_room(room, kCamera, T, {}, {rng != nullptr, 0, kNoise}, rng);
  return make_depth_grid(frame.depth, kCamera, kNoise, 10);
}

const SE3 kView(so3_exp(Vec3(0.5, 0.6, 0)), Vec3(0.1, 0.2, -0.3));  // a corner of the room: three planes

TEST(SurfaceGrid, PointsAndNormalsAreThoseOfTheWalls) {
  const SurfaceGrid surface = make_surface_grid(grid_at(kView), kNoise);
  const TexturedRoom room;
  int elements = 0;
  for (const SurfaceElement& element : surface.elements.pixels()) {
    if (element.sigma_m == 0) continue;
    ++elements;
    const Vec3 p = kView * element.point.cast<double>();
    const Vec3 n = kView.rotation() * element.normal.cast<double>();
    EXPECT_LT(n.dot(p - kView.translation()), 0);  // towards the camera
    int axis = 0;
    n.cwiseAbs().maxCoeff(&axis);
    if (std::abs(n[axis]) < 0.99) continue;  // across an edge of the room
    EXPECT_NEAR(std::abs(p[axis]), room.half_size_m[axis], 0.006);
  }
  EXPECT_GT(elements, 15000);
}

TEST(SurfaceGrid, EdgesAndHolesHaveNoSurface) {
  DepthImage depth;
  depth.units = Image<std::uint16_t>(64, 48, 1000);
  for (int y = 0; y < 48; ++y)
    for (int x = 32; x < 64; ++x) depth.units(x, y) = x < 48 ? 3000 : 0;
  const PinholeCamera camera{64, 48, 52, 52, 31.5, 23.5, {}};
  const DepthGrid grid = make_depth_grid(depth, camera, kNoise, 2.0);
  EXPECT_NEAR(grid.depth_m(3, 5), 1, 1e-6);
  EXPECT_EQ(grid.depth_m(10, 5), 0);  // beyond the range
  EXPECT_EQ(grid.depth_m(14, 5), 0);
  const SurfaceGrid surface = make_surface_grid(grid, kNoise);
  EXPECT_GT(surface.elements(4, 6).sigma_m, 0);
  EXPECT_EQ(surface.elements(12, 6).sigma_m, 0);
  EXPECT_EQ(surface.elements(0, 0).sigma_m, 0);
}

/// The gradient is that of the cost, up to this share of its length.
template <class Reference>
void expect_gradient_of_cost(const Reference& reference, const DepthGrid& current, const SE3& T_ref_cur,
                             double ratio) {
  const auto at = [&](const SE3& T) { return surface_equations(reference, current, T, SurfaceMatching{}); };
  const Vec6 gradient = at(T_ref_cur).gradient;
  for (int i = 0; i < 6; ++i) {
    const Vec6 step = 2e-5 * Vec6::Unit(i);
    const double numeric =
        (at(T_ref_cur * SE3::exp(step)).cost - at(T_ref_cur * SE3::exp(-step)).cost) / 4e-5;
    EXPECT_NEAR(gradient[i], numeric, ratio * gradient.norm()) << i;
  }
}

TEST(SurfaceAlignment, GradientIsTheNumericOne) {
  const SurfaceGrid surface = make_surface_grid(grid_at(kView), kNoise);
  const SE3 T_ref_cur = SE3::exp((Vec6() << 0.004, -0.003, 0.002, 0.001, 0.002, -0.001).finished());
  const DepthGrid current = grid_at(kView);
  SurfaceMatching matching;
  const PoseEquations equations = surface_equations(surface, current, T_ref_cur, matching);
  EXPECT_GT(equations.terms, 3000);
  expect_gradient_of_cost(surface, current, T_ref_cur, 0.05);
}

TEST(SurfaceAlignment, SampledElementsSayTheSame) {
  const DepthGrid current = grid_at(kView);
  const std::vector<SurfaceElement> samples = sample_surface(current, kNoise, 2);
  const SE3 T_ref_cur = SE3::exp((Vec6() << 0.004, -0.003, 0.002, 0.001, 0.002, -0.001).finished());
  SurfaceMatching matching;
  const PoseEquations all =
      surface_equations(make_surface_grid(current, kNoise), current, T_ref_cur, matching);
  const PoseEquations equations = surface_equations(samples, current, T_ref_cur, matching);
  EXPECT_GT(equations.terms, 3000);
  EXPECT_LT((equations.information - all.information).norm(), 0.1 * all.information.norm());
  expect_gradient_of_cost(samples, current, T_ref_cur, 0.1);
}

TEST(SurfaceAlignment, FindsTheMotionInACorner) {
  Rng rng(3);
  const SurfaceGrid surface = make_surface_grid(grid_at(kView, &rng), kNoise);
  const SE3 truth = SE3::exp((Vec6() << 0.02, -0.015, 0.02, 0.01, 0.012, -0.008).finished());
  const DepthGrid current = grid_at(kView * truth, &rng);
  SE3 T;
  for (int i = 0; i < 15; ++i) {
    const PoseEquations equations = surface_equations(surface, current, T, {});
    T = T * SE3::exp(-equations.information.ldlt().solve(equations.gradient));
  }
  EXPECT_LT((T.inverse() * truth).translation().norm(), 0.002);
  EXPECT_LT((T.inverse() * truth).angle(), 0.001);
}

TEST(SurfaceAlignment, AWallLeavesWhatItCannotSee) {
  const SE3 wall(Mat3::Identity(), Vec3(0, 0, 0.9));
  TexturedRoom room;
  room.half_size_m = Vec3(9, 9, 2);
  const RgbdFrame frame = render_room(room, kCamera, wall, {});
  const DepthGrid grid = make_depth_grid(frame.depth, kCamera, kNoise, 10);
  const PoseEquations equations = surface_equations(make_surface_grid(grid, kNoise), grid, {}, {});
  const Eigen::SelfAdjointEigenSolver<Mat6> solver(equations.information);
  EXPECT_LT(solver.eigenvalues()[2], 1e-4 * solver.eigenvalues()[3]);  // two translations and a turn
}

}  // namespace
}  // namespace hm
