#include "hm/odometry/geometry_tracking/geometry_tracker.hpp"

#include <gmock/gmock.h>

#include "hm/odometry/registration/pose_equations.hpp"
#include "hm/odometry/testing/textured_room.hpp"

namespace hm {
namespace {

constexpr double kFollowedPeriod_s = 1.0 / 30, kMaxDepth_m = 5.5;
constexpr int kFollowedFrames = 10;

Vec6 twist(const Vec3& velocity, const Vec3& turn = Vec3::Zero()) {
  Vec6 out;
  out << velocity, turn;
  return out;
}

/// Depth images of a room with the noise of a Kinect, from a camera at constant velocity.
class MovingCamera {
 public:
  MovingCamera(const Vec3& half_size_m, const SE3& T_odom_start, const Vec6& twist_s,
               const DepthNoise& noise = {})
      : T_odom_start_(T_odom_start), twist_s_(twist_s), noise_(noise) {
    room_.half_size_m = half_size_m;
  }
  [[nodiscard]] SE3 truth(int index) const {
    return T_odom_start_ * SE3::exp(index * kFollowedPeriod_s * twist_s_);
  }
  DepthGrid grid(int index) {
    const RgbdFrame frame = render_room(room_, room_camera(), truth(index), {}, {true, 0, noise_}, &rng_);
    return make_depth_grid(frame.depth, room_camera(), DepthNoise{}, kMaxDepth_m);
  }

 private:
  TexturedRoom room_;
  SE3 T_odom_start_;
  Vec6 twist_s_;
  DepthNoise noise_;
  Rng rng_{7};
};

/// The last attempt after a third of a second; the velocity at the start is believed to be `believed_s`.
GeometryAttempt follow(MovingCamera& camera, const std::optional<Vec6>& believed_s) {
  GeometryTracker tracker{DepthNoise{}};
  const DepthGrid first = camera.grid(0);
  const SurfaceReference keyframe{1, camera.truth(0), Mat6::Zero(), &first};
  const GeometryStart start{camera.truth(0), believed_s, Mat6::Zero()};
  GeometryAttempt attempt;
  for (int i = 1; i <= kFollowedFrames; ++i) {
    const DepthGrid grid = camera.grid(i);
    const GeometryFrame frame{&grid, static_cast<std::size_t>(i), kFollowedPeriod_s, {}, 0};
    attempt = tracker.attempt(start, frame, {&keyframe, 1});
    EXPECT_EQ(attempt.refusal, "") << i;
    if (!attempt.refusal.empty()) break;
    tracker.accept(attempt, frame);
  }
  return attempt;
}

Vec6 error_in_camera(const GeometryAttempt& attempt, const SE3& truth) {
  return (truth.inverse() * attempt.T_odom_camera).log();
}

Vec6 sigmas_in_camera(const GeometryAttempt& attempt) {
  const Mat6 to_camera = adjoint(attempt.T_odom_camera.inverse());
  return (to_camera * attempt.covariance * to_camera.transpose()).diagonal().cwiseSqrt();
}

TEST(GeometryTracker, ACornerHoldsTheCamera) {
  const SE3 T_start(so3_exp(Vec3(0, 0.75, 0)) * so3_exp(Vec3(-0.5, 0, 0)), Vec3::Zero());
  MovingCamera camera(Vec3(1.8, 1.2, 1.6), T_start, twist(Vec3(0.2, -0.1, 0.15), Vec3(0.2, -0.3, 0.1)));
  const GeometryAttempt last = follow(camera, {});
  const Vec6 error = error_in_camera(last, camera.truth(kFollowedFrames)), sigma = sigmas_in_camera(last);
  for (int i = 0; i < 6; ++i) {
    EXPECT_LT(std::abs(error[i]), 0.006) << i;
    EXPECT_LT(std::abs(error[i]), 4 * sigma[i]) << i;
    EXPECT_LT(sigma[i], 0.006) << i;
  }
}

/// Along a corridor the camera is believed to go on at 0.3 m/s: no wall says that it has stopped.
TEST(GeometryTracker, ACorridorLeavesItsDirectionToThePrediction) {
  const Vec3 believed(0.1, 0.05, 0.3), true_velocity(0.1, 0.05, 0);
  MovingCamera camera(Vec3(1.0, 1.2, 100), {}, twist(true_velocity, Vec3(0, 0.1, 0)));
  const GeometryAttempt last = follow(camera, twist(believed, Vec3(0, 0.1, 0)));
  const Vec6 error = error_in_camera(last, camera.truth(kFollowedFrames)), sigma = sigmas_in_camera(last);
  EXPECT_NEAR(error[2], 0.3 * kFollowedFrames * kFollowedPeriod_s, 0.015);
  EXPECT_GT(sigma[2], 0.035);
  EXPECT_LT(std::abs(error[2]), 3 * sigma[2]);
  for (const int i : {0, 1, 3, 4, 5}) {
    EXPECT_LT(std::abs(error[i]), 0.006) << i;
    EXPECT_LT(sigma[i], 0.006) << i;
  }
}

/// A wall holds its distance and two rotations.
TEST(GeometryTracker, APlaneLeavesThreeDirectionsToThePrediction) {
  const Vec6 believed = twist(Vec3(0.25, -0.2, 0), Vec3(0, 0, 0.4));
  MovingCamera camera(Vec3(30, 30, 2), {}, twist(Vec3(0, 0, 0.2), Vec3(0.05, -0.1, 0)));
  const GeometryAttempt last = follow(camera, believed);
  const Vec6 error = error_in_camera(last, camera.truth(kFollowedFrames)), sigma = sigmas_in_camera(last);
  const double duration_s = kFollowedFrames * kFollowedPeriod_s;
  for (const int i : {0, 1, 5}) {
    EXPECT_NEAR(error[i], believed[i] * duration_s, 0.02) << i;
    EXPECT_GT(sigma[i], 0.035) << i;
    EXPECT_LT(std::abs(error[i]), 3 * sigma[i]) << i;
  }
  for (const int i : {2, 3, 4}) {
    EXPECT_LT(std::abs(error[i]), 0.006) << i;
    EXPECT_LT(sigma[i], 0.01) << i;
  }
}

/// Depth four times as noisy as it is taken for: normals that err by degrees seem to hold the camera along
/// the wall, at rest.
TEST(GeometryTracker, ANoisyPlaneHoldsNoMore) {
  const Vec6 believed = twist(Vec3(0.25, -0.2, 0), Vec3(0, 0, 0.4));
  DepthNoise noise;
  for (double* part : {&noise.quadratic_per_m, &noise.linear_ratio, &noise.constant_m}) *part *= 4;
  MovingCamera camera(Vec3(30, 30, 2), {}, believed, noise);
  const GeometryAttempt last = follow(camera, believed);
  const Vec6 error = error_in_camera(last, camera.truth(kFollowedFrames)), sigma = sigmas_in_camera(last);
  for (const int i : {0, 1, 5}) {
    EXPECT_NEAR(error[i], 0, 0.02) << i;
    EXPECT_GT(sigma[i], 0.04) << i;
  }
}

TEST(GeometryTracker, ALongTimeBeforeAPlaneIsRefused) {
  MovingCamera camera(Vec3(30, 30, 2), {}, Vec6::Zero());
  GeometryTracker tracker{DepthNoise{}};
  const DepthGrid first = camera.grid(0);
  tracker.begin({{}, Vec6::Zero(), Mat6::Zero()}, {&first, 0, 0, {}, 0});
  for (int i = 1; i < 90; ++i) {
    const DepthGrid grid = camera.grid(i);
    const GeometryFrame frame{&grid, static_cast<std::size_t>(i), kFollowedPeriod_s, {}, 0};
    const GeometryAttempt attempt = tracker.attempt({}, frame, {});
    if (!attempt.refusal.empty()) {
      EXPECT_THAT(attempt.refusal, testing::HasSubstr("uncertain"));
      EXPECT_GT(i, 15);
      return;
    }
    tracker.accept(attempt, frame);
  }
  FAIL() << "never refused";
}

TEST(GeometryTracker, OtherSurfacesAreRefusedAndLeaveNoTrace) {
  MovingCamera here(Vec3(1.8, 1.2, 1.6), SE3(so3_exp(Vec3(0, 0.75, 0)), Vec3::Zero()), Vec6::Zero());
  MovingCamera there(Vec3(1.2, 2.2, 3.1), SE3(so3_exp(Vec3(0.4, -0.3, 0.2)), Vec3(0.3, 0.4, -0.9)),
                     Vec6::Zero());
  const GeometryTracker tracker{DepthNoise{}};
  const DepthGrid first = here.grid(0), other = there.grid(0);
  const SurfaceReference keyframe{1, here.truth(0), Mat6::Zero(), &first};
  const GeometryAttempt attempt = tracker.attempt({here.truth(0), {}, Mat6::Zero()},
                                                  {&other, 1, kFollowedPeriod_s, {}, 0}, {&keyframe, 1});
  EXPECT_THAT(attempt.refusal, testing::HasSubstr("depth image"));
  EXPECT_EQ(tracker.memory_bytes(), 0u);
  EXPECT_FALSE(tracker.is_active());
}

}  // namespace
}  // namespace hm
