#include <gtest/gtest.h>

#include "hm/core/rng.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/geometry/triangle_mesh.hpp"

namespace hm {
namespace {

Vec6 random_twist(Rng& rng, double rotation) {
  Vec6 twist;
  for (int i = 0; i < 6; ++i) twist[i] = rng.uniform(-1, 1) * (i < 3 ? 3.0 : rotation);
  return twist;
}

TEST(SE3, GroupLaws) {
  Rng rng(1);
  for (int i = 0; i < 200; ++i) {
    const double rotation = i % 3 == 0 ? 1e-8 : 1.7;
    const Vec6 twist = random_twist(rng, rotation);
    const SE3 a = SE3::exp(twist), b = SE3::exp(random_twist(rng, rotation));
    EXPECT_TRUE(a.log().isApprox(twist, 1e-9)) << a.log().transpose() << "\n" << twist.transpose();
    EXPECT_TRUE((a * a.inverse()).matrix().isApprox(Mat4::Identity(), 1e-12));
    EXPECT_TRUE((a * b).matrix().isApprox(a.matrix() * b.matrix(), 1e-12));
    EXPECT_TRUE(is_rigid(a * b));
    const Vec3 p(1, -2, 3);
    EXPECT_TRUE(((a * b) * p).isApprox(a * (b * p), 1e-12));
    EXPECT_TRUE(interpolate(a, b, 0).matrix().isApprox(a.matrix(), 1e-9));
    EXPECT_TRUE(interpolate(a, b, 1).matrix().isApprox(b.matrix(), 1e-9));
  }
}

TEST(SE3, LogNearHalfTurn) {
  for (const double angle : {3.14159, 3.1415926}) {
    const Vec3 w = angle * Vec3(1, 2, -2).normalized();
    EXPECT_TRUE(so3_log(so3_exp(w)).isApprox(w, 1e-6));
  }
}

TEST(SE3, FromMatrixRefusesWhatIsNotRigid) {
  Mat4 m = Mat4::Identity();
  m(0, 1) = 2e-4;
  const auto nearly = SE3::from_matrix(m);
  ASSERT_TRUE(nearly);
  EXPECT_TRUE(is_rigid(*nearly));
  m(0, 1) = 0.5;
  EXPECT_FALSE(SE3::from_matrix(m));
  m = Mat4::Identity();
  m(2, 2) = -1;
  EXPECT_FALSE(SE3::from_matrix(m));
  m(2, 2) = std::nan("");
  EXPECT_FALSE(SE3::from_matrix(m));
  EXPECT_FALSE(SE3::from_matrix(Mat4::Zero()));
}

TEST(PinholeCamera, ProjectAndUnprojectAreInverse) {
  Rng rng(2);
  for (const double fy : {516.0, -480.0}) {
    PinholeCamera camera{640, 480, 517, fy, 318.6, 255.3, {0.26, -0.95, -0.005, 0.0026, 1.16}};
    ASSERT_TRUE(check_camera(camera));
    for (int i = 0; i < 100; ++i) {
      const Vec2 pixel(rng.uniform(40, 600), rng.uniform(40, 440));
      const double depth = rng.uniform(0.3, 5);
      const Vec3 p = camera.unproject(pixel, depth);
      EXPECT_DOUBLE_EQ(p.z(), depth);
      EXPECT_LT((camera.project(p) - pixel).norm(), 1e-4);
      const Vec3 straight = camera.without_distortion().unproject(pixel, depth);
      EXPECT_LT((camera.without_distortion().project(straight) - pixel).norm(), 1e-9);
    }
  }
}

TEST(PinholeCamera, ScalingKeepsTheRay) {
  const PinholeCamera camera{640, 480, 585, 585, 320, 240, {}};
  const PinholeCamera half = camera.scaled(0.5);
  EXPECT_EQ(half.width, 320);
  // The middle of four full pixels is the middle of one half pixel.
  const Vec3 p = camera.unproject({100.5, 60.5}, 2.0);
  EXPECT_LT((half.project(p) - Vec2(50, 30)).norm(), 1e-12);
}

TEST(PinholeCamera, RefusesImpossibleValues) {
  EXPECT_FALSE(check_camera({0, 480, 500, 500, 320, 240, {}}));
  EXPECT_FALSE(check_camera({640, 480, -500, 500, 320, 240, {}}));
  EXPECT_FALSE(check_camera({640, 480, 500, 0, 320, 240, {}}));
  EXPECT_FALSE(check_camera({640, 480, 500, std::nan(""), 320, 240, {}}));
}

TriangleMesh cube() {
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) mesh.vertices.emplace_back(float(i & 1), float((i >> 1) & 1), float(i >> 2));
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

TEST(TriangleMesh, CubeInClosedForm) {
  TriangleMesh mesh = cube();
  EXPECT_NEAR(surface_area(mesh), 6.0, 1e-12);
  EXPECT_NEAR(enclosed_volume(mesh), 1.0, 1e-12);
  EXPECT_TRUE(open_edges(mesh).empty());
  compute_normals(mesh);
  EXPECT_LT(mesh.normals[0].x(), 0);
  EXPECT_GT(mesh.normals[7].x(), 0);
  mesh.triangles.pop_back();
  EXPECT_EQ(open_edges(mesh).size(), 3u);
}

TEST(Trajectory, InterpolatesWithinGapsOnly) {
  const Trajectory trajectory{{Time::from_seconds(1), SE3(Mat3::Identity(), Vec3(0, 0, 0))},
                              {Time::from_seconds(2), SE3(Mat3::Identity(), Vec3(1, 0, 0))},
                              {Time::from_seconds(9), SE3(Mat3::Identity(), Vec3(2, 0, 0))}};
  const auto gap = Duration::from_seconds(1.5);
  EXPECT_NEAR(pose_at(trajectory, Time::from_seconds(1.25), gap)->translation().x(), 0.25, 1e-12);
  EXPECT_FALSE(pose_at(trajectory, Time::from_seconds(5), gap));
  EXPECT_FALSE(pose_at(trajectory, Time::from_seconds(0.9), gap));
  EXPECT_TRUE(pose_at(trajectory, Time::from_seconds(0.9), gap, Duration::from_seconds(0.2)));
  EXPECT_EQ(path_length(trajectory), 2.0);
}

TEST(PathLength, DoesNotGrowWithTheNoiseOfManyPoses) {
  // 4 m at 0.5 m/s, once exact at 200 Hz, once at 40 Hz with 2 mm of noise on each axis.
  Rng rng(1);
  std::vector<Vec3> exact, noisy;
  for (int i = 0; i <= 1600; ++i) exact.emplace_back(0.0025 * i, 0, 1);
  for (int i = 0; i <= 320; ++i)
    noisy.emplace_back(0.0125 * i + rng.normal(0, 0.002), rng.normal(0, 0.002), 1 + rng.normal(0, 0.002));
  EXPECT_NEAR(path_length(exact), 4, 1e-9);
  EXPECT_NEAR(path_length(noisy), 4, 0.06);
}

TEST(PathLength, CountsWhatIsShorterThanAStepAtTheEnd) {
  EXPECT_EQ(path_length(std::vector<Vec3>{}), 0);
  EXPECT_EQ(path_length(Trajectory{{Time(), SE3()}}), 0);
  const std::vector<Vec3> positions{{0, 0, 0}, {0.019, 0, 0}, {0.03, 0, 0}, {0.041, 0, 0}};
  EXPECT_NEAR(path_length(positions), 0.041, 1e-12);
}

}  // namespace
}  // namespace hm
