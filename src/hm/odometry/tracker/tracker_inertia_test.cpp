#include "hm/odometry/tracker/tracker_inertia.hpp"

#include <gtest/gtest.h>

#include "hm/odometry/testing/textured_room.hpp"
#include "hm/odometry/tracker/tracker.hpp"
#include "hm/sensors/imu.hpp"

namespace hm {
namespace {

constexpr double kCarriedFrame_s = 1.0 / 30;
constexpr int kInertialFrames = 75;

/// Specific force on the path through the room, whose y axis points down.
Vec3 force_at(double t) {
  constexpr double h = 0.01;
  const Vec3 a =
      (path_pose(t + h).translation() - 2 * path_pose(t).translation() + path_pose(t - h).translation()) /
      (h * h);
  return path_pose(t).rotation().transpose() * (a - kGravity_m_s2 * Vec3::UnitY());
}

const std::vector<RgbdFrame>& frames() {
  static const std::vector<RgbdFrame> kRendered = [] {
    std::vector<RgbdFrame> rendered;
    for (int i = 0; i < kInertialFrames; ++i)
      rendered.push_back(render_room({}, room_camera(), path_pose(i * kCarriedFrame_s),
                                     Time::from_seconds(1 + i * kCarriedFrame_s)));
    return rendered;
  }();
  return kRendered;
}

struct Walked {
  double worst_m = 0, worst_rad = 0;
  int used = 0, rejected = 0, turns = 0, lost = 0;
};

template <class Hint>
Walked walk(const Hint& hint_at) {
  const auto odometry = make_tracker({}, room_camera(), path_pose(0));
  Walked walked;
  for (int i = 0; i < kInertialFrames; ++i) {
    const double t = i * kCarriedFrame_s;
    const TrackedFrame tracked = odometry->track(frames()[static_cast<std::size_t>(i)], hint_at(t));
    walked.used += tracked.numbers.gravity == GravityUse::kUsed;
    walked.rejected += tracked.numbers.gravity == GravityUse::kRejected;
    walked.turns += tracked.numbers.turn_given;
    walked.lost += !tracked.T_odom_camera;
    if (!tracked.T_odom_camera) continue;
    const SE3 error = tracked.T_odom_camera->inverse() * path_pose(t);
    walked.worst_m = std::max(walked.worst_m, error.translation().norm());
    walked.worst_rad = std::max(walked.worst_rad, error.angle());
  }
  return walked;
}

MotionHint felt(const Vec3& force) {
  MotionHint hint;
  hint.force_camera_m_s2 = force;
  return hint;
}

TEST(TrackerInertia, GravityIsUsedOnceItIsKnown) {
  const Walked walked = walk([](double t) { return felt(force_at(t)); });
  EXPECT_EQ(walked.lost, 0);
  EXPECT_GT(walked.used, 20);
  EXPECT_EQ(walked.rejected, 0);
  EXPECT_LT(walked.worst_m, 0.003);
  EXPECT_LT(walked.worst_rad, 0.002);
}

/// Wrong mounting, constant readings or permanent vibration: the path is as accurate as without IMU.
TEST(TrackerInertia, WrongReadingsDoNoHarm) {
  Rng rng(3);
  const Walked sideways = walk([](double t) { return felt(so3_exp(Vec3(0, 0, 1.57)) * force_at(t)); });
  const Walked stuck = walk([](double) { return felt(Vec3(0, -kGravity_m_s2, 0)); });
  const Walked shaken = walk([&](double t) {
    return felt(force_at(t) + Vec3(rng.normal(0, 20), rng.normal(0, 20), rng.normal(0, 20)));
  });
  for (const Walked& walked : {sideways, stuck, shaken}) {
    EXPECT_EQ(walked.lost, 0);
    EXPECT_LT(walked.worst_m, 0.003);
    EXPECT_LT(walked.worst_rad, 0.002);
  }
}

TEST(TrackerInertia, AWrongGyroscopeDoesNoHarm) {
  MotionHint hint;
  hint.R_last_current = so3_exp(Vec3(0.2, -0.3, 0.5));
  const Walked walked = walk([&](double) { return hint; });
  EXPECT_EQ(walked.turns, kInertialFrames - 1);
  EXPECT_EQ(walked.lost, 0);
  EXPECT_LT(walked.worst_m, 0.003);
}

/// Rotations of frames without a pose are accumulated, unless one of them is unknown.
TEST(TrackerInertia, TurnsAddUpUntilThereIsAPose) {
  TrackerInertia inertia(0.02);
  MotionHint turn;
  turn.R_last_current = so3_exp(Vec3(0, 0.1, 0));
  inertia.begin_frame(turn);
  EXPECT_FALSE(inertia.R_posed_current());  // the start of the interval is unknown
  inertia.end_frame({}, {}, TrackingStatus::kStarted, {});
  for (const TrackingStatus status :
       {TrackingStatus::kSkipped, TrackingStatus::kLost, TrackingStatus::kTracked}) {
    inertia.begin_frame(turn);
    if (status == TrackingStatus::kTracked) {
      ASSERT_TRUE(inertia.R_posed_current());
      EXPECT_LT((*inertia.R_posed_current() - so3_exp(Vec3(0, 0.3, 0))).norm(), 1e-12);
    }
    inertia.end_frame({}, turn, status, {});
  }
  EXPECT_LT((*inertia.R_posed_current() - Mat3::Identity()).norm(), 1e-12);
  inertia.begin_frame({});
  inertia.end_frame({}, {}, TrackingStatus::kLost, {});
  inertia.begin_frame(turn);
  EXPECT_FALSE(inertia.R_posed_current());
}

}  // namespace
}  // namespace hm
