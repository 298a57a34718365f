#include "hm/odometry/inertial/inertial_tracking.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "hm/geometry/state_bytes.hpp"
#include "hm/odometry/interface/inertial_hints.hpp"
#include "hm/odometry/make_odometry.hpp"
#include "hm/odometry/testing/carried_device.hpp"
#include "hm/odometry/testing/textured_room.hpp"

namespace hm {
namespace {

constexpr double kFrame_s = 0.1;
constexpr int kFrames = 70;
constexpr double kBegin_s = 1;

double time_s(int frame) { return frame * kFrame_s; }
Time stamp_of(int frame) { return Time::from_seconds(kBegin_s + time_s(frame)); }

const std::vector<RgbdFrame>& pictures() {
  static const std::vector<RgbdFrame> kRendered = [] {
    std::vector<RgbdFrame> rendered;
    for (int i = 0; i < kFrames; ++i) {
      rendered.push_back(render_room({}, room_camera(), path_pose(time_s(i)), stamp_of(i)));
      rendered.back().index = static_cast<std::size_t>(i);
    }
    return rendered;
  }();
  return kRendered;
}

/// Readings of an IMU in the camera on the path through the room, whose y axis points down.
std::shared_ptr<CarriedImu> readings(const std::function<void(ImuSample&)>& spoil = [](ImuSample&) {}) {
  auto imu = std::make_shared<CarriedImu>();
  imu->has_gyroscope = true;
  Rng rng(7);
  constexpr double kHalf_s = 0.002;
  for (int i = -40; i < 200 * 8; ++i) {
    const double t = i / 200.0;
    const SE3 before = path_pose(t - kHalf_s), now = path_pose(t), after = path_pose(t + kHalf_s);
    const Vec3 a = (after.translation() - 2 * now.translation() + before.translation()) / (kHalf_s * kHalf_s);
    ImuSample sample;
    sample.stamp = Time::from_seconds(kBegin_s + t);
    sample.angular_velocity_rad_s =
        so3_log(before.rotation().transpose() * after.rotation()) / (2 * kHalf_s) +
        Vec3(0.002, -0.003, 0.001);
    sample.specific_force_m_s2 =
        now.rotation().transpose() * (a - kGravity_m_s2 * Vec3::UnitY()) + Vec3(0.05, 0.02, -0.04);
    for (int k = 0; k < 3; ++k) {
      sample.angular_velocity_rad_s[k] += rng.normal(0, 0.003);
      sample.specific_force_m_s2[k] += rng.normal(0, 0.03);
    }
    spoil(sample);
    imu->samples.push_back(sample);
  }
  return imu;
}

struct TrackedRun {
  std::vector<TrackedFrame> frames;
  int used = 0, bridged = 0, lost = 0;
  double worst_m = 0, worst_sigmas = 0;
};

/// Frames from `dark` to `light` are black.
TrackedRun track(const std::shared_ptr<CarriedImu>& imu, int dark = kFrames, int light = kFrames) {
  const auto odometry = make_visual_odometry({}, room_camera(), path_pose(0));
  InertialHints hints(imu, imu ? ImuUse::kAuto : ImuUse::kOff);
  TrackedRun run;
  for (int i = 0; i < kFrames; ++i) {
    RgbdFrame frame = pictures()[static_cast<std::size_t>(i)];
    if (i >= dark && i < light) {
      frame.color = Image<Rgb8>(frame.color.width(), frame.color.height());
      frame.depth.units = Image<std::uint16_t>(frame.depth.units.width(), frame.depth.units.height());
    }
    const TrackedFrame tracked = odometry->track(frame, hints.next(frame.stamp));
    run.used += tracked.numbers.inertial == InertialUse::kUsed;
    run.bridged += tracked.status == TrackingStatus::kBridged;
    run.lost += !tracked.T_odom_camera;
    if (tracked.T_odom_camera) {
      const double error_m =
          (tracked.T_odom_camera->translation() - path_pose(time_s(i)).translation()).norm();
      run.worst_m = std::max(run.worst_m, error_m);
      const double variance_m2 = tracked.covariance.topLeftCorner<3, 3>().trace();
      if (variance_m2 > 0) run.worst_sigmas = std::max(run.worst_sigmas, error_m / std::sqrt(variance_m2));
    }
    run.frames.push_back(tracked);
  }
  return run;
}

TEST(InertialTracking, IsUsedAfterSomeSecondsAndDoesNoHarm) {
  const TrackedRun with = track(readings()), without = track(nullptr);
  EXPECT_EQ(with.lost, 0);
  EXPECT_GT(with.used, 35);
  EXPECT_EQ(without.used, 0);
  EXPECT_LT(with.worst_m, 0.004);
  EXPECT_LT(with.worst_m, 1.2 * without.worst_m + 0.001);
}

/// 1.5 seconds without any picture: the readings alone, and their uncertainty.
TEST(InertialTracking, BridgesTheDark) {
  const TrackedRun with = track(readings(), 45, 60), without = track(nullptr, 45, 60);
  EXPECT_EQ(without.lost, 15);
  EXPECT_EQ(with.lost, 0);
  EXPECT_EQ(with.bridged, 15);
  EXPECT_LT(with.worst_m, 0.10);
  EXPECT_LT(with.worst_sigmas, 4);
  const auto sigma = [&](int i) {
    return with.frames[static_cast<std::size_t>(i)].covariance.topLeftCorner<3, 3>().trace();
  };
  EXPECT_GT(sigma(59), 10 * sigma(44));
  EXPECT_LT(sigma(65), sigma(59) / 10);
  EXPECT_EQ(with.frames[65].submap, 0);
}

/// Wrong axes, stamps, units or scale: never trusted, and the bits are those without readings.
TEST(InertialTracking, WrongReadingsChangeNothing) {
  const TrackedRun without = track(nullptr);
  const std::vector<std::function<void(ImuSample&)>> spoilers{
      [](ImuSample& s) {
        const Mat3 R = so3_exp(Vec3(0, 0, 1.5707963));
        s.angular_velocity_rad_s = R * s.angular_velocity_rad_s;
        s.specific_force_m_s2 = R * s.specific_force_m_s2;
      },
      [](ImuSample& s) { s.stamp = s.stamp + Duration::from_seconds(0.3); },
      [](ImuSample& s) { s.angular_velocity_rad_s *= 57.3; },
      [](ImuSample& s) { s.angular_velocity_rad_s *= -1; },
      [](ImuSample& s) { s.specific_force_m_s2 /= kGravity_m_s2; },
      [](ImuSample& s) { s.specific_force_m_s2 *= -1; },
      [](ImuSample& s) { s.specific_force_m_s2.setZero(); }};
  for (std::size_t k = 0; k < spoilers.size(); ++k) {
    const TrackedRun run = track(readings(spoilers[k]));
    EXPECT_EQ(run.used, 0) << k;
    for (std::size_t i = 0; i < run.frames.size(); ++i) {
      ASSERT_TRUE(run.frames[i].T_odom_camera) << k;
      EXPECT_EQ(run.frames[i].T_odom_camera->matrix(), without.frames[i].T_odom_camera->matrix()) << k;
    }
  }
}

/// Once they are used, a stretch in which constant velocity is as good by chance (here: exact, while images
/// err by 1 mm) does not end that.
TEST(InertialTracking, AreUsedOnWhereTheMotionIsSteady) {
  InertialTracking tracking;
  Rng rng(3);
  const VisualPose start{CarriedPath::pose(0), Mat6::Identity() * 1e6, Vec6::Zero()};
  const auto readings = carried_readings(-0.2, 8.1, 200, {{}, {}, 1e-3, 1e-2, 0}, &rng);
  std::size_t fed = 0;
  for (int i = 0; i <= 80; ++i) {
    const double t_s = 0.1 * i;
    std::vector<ImuSample> until;
    while (fed < readings.size() && readings[fed].stamp.seconds() <= t_s + 0.02)
      until.push_back(readings[fed++]);
    tracking.feed(until);
    if (i == 0) {
      tracking.begin(Time::from_seconds(0), start);
      continue;
    }
    VisualPose seen = start;
    const Vec3 error = test::drawn<3>([&] { return rng.normal(0, 0.001); });
    seen.T_odom_camera = SE3(Mat3::Identity(), error) * CarriedPath::pose(t_s);
    const bool is_steady = i > 40;
    const SE3 T_by_velocity =
        is_steady ? seen.T_odom_camera : SE3(Mat3::Identity(), Vec3(0.1, 0, 0)) * seen.T_odom_camera;
    tracking.add(Time::from_seconds(t_s), seen, T_by_velocity);
    if (i > 30) {
      ASSERT_EQ(tracking.use(), InertialUse::kUsed) << i;
    }
  }
}

/// The device is knocked: its readings turn by 20 degrees for good. Some frames are 10 cm off until images
/// prevail, and trust goes when most of the last comparisons say so; tracking does not.
TEST(InertialTracking, ADeviceThatIsKnockedLosesItsTrust) {
  const TrackedRun run = track(readings([](ImuSample& s) {
    if (s.stamp < stamp_of(45)) return;
    const Mat3 R = so3_exp(Vec3(0.35, 0, 0));
    s.angular_velocity_rad_s = R * s.angular_velocity_rad_s;
    s.specific_force_m_s2 = R * s.specific_force_m_s2;
  }));
  EXPECT_EQ(run.lost, 0);
  EXPECT_NE(run.frames.back().numbers.inertial, InertialUse::kUsed);
  EXPECT_LT(run.worst_m, 0.15);
  EXPECT_LT(
      (run.frames.back().T_odom_camera->translation() - path_pose(time_s(kFrames - 1)).translation()).norm(),
      0.02);
}

TEST(InertialTracking, ARestoredRunGoesOnWithTheSameBits) {
  const auto imu = readings();
  const auto one = make_visual_odometry({}, room_camera(), path_pose(0));
  auto other = make_visual_odometry({}, room_camera(), path_pose(0));
  InertialHints hints(imu, ImuUse::kAuto);
  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  constexpr int kStop = 50;
  for (int i = 0; i < kFrames; ++i) {
    const RgbdFrame& frame = pictures()[static_cast<std::size_t>(i)];
    const MotionHint hint = hints.next(frame.stamp);
    const TrackedFrame expected = one->track(frame, hint);
    if (expected.new_keyframe) keyframes.push_back(expected.new_keyframe);
    if (i == kStop) {
      StateWriter state;
      ASSERT_TRUE(one->save(state));
      StateReader reader(state.bytes());
      const auto read = [](std::size_t k) -> Result<RgbdFrame> { return pictures()[k]; };
      ASSERT_TRUE(other->restore(reader, {read, keyframes}));
    }
    if (i <= kStop) continue;
    const TrackedFrame again = other->track(frame, hint);
    EXPECT_EQ(again.numbers.inertial, InertialUse::kUsed);
    ASSERT_TRUE(again.T_odom_camera);
    EXPECT_EQ(again.T_odom_camera->matrix(), expected.T_odom_camera->matrix());
    EXPECT_EQ(again.covariance, expected.covariance);
  }
}

/// An accelerometer alone: `inertial` uses gravity, `auto` nothing.
TEST(InertialTracking, AnAccelerometerAloneGivesGravity) {
  const auto imu = readings();
  imu->has_gyroscope = false;
  EXPECT_EQ(InertialHints(imu, ImuUse::kInertial).use(), ImuUse::kGravity);
  EXPECT_EQ(InertialHints(imu, ImuUse::kAuto).use(), ImuUse::kOff);
  EXPECT_EQ(InertialHints(nullptr, ImuUse::kInertial).next(stamp_of(1)).readings.size(), 0U);
  InertialHints hints(imu, ImuUse::kInertial);
  (void)hints.next(stamp_of(0));
  const MotionHint hint = hints.next(stamp_of(1));
  EXPECT_TRUE(hint.force_camera_m_s2);
  EXPECT_TRUE(hint.readings.empty());
}

}  // namespace
}  // namespace hm
