#include "hm/odometry/tracker/tracker_attempt.hpp"

#include <gtest/gtest.h>

#include <functional>

#include "hm/odometry/testing/textured_room.hpp"
#include "hm/odometry/tracker/tracker_keyframes.hpp"

namespace hm {
namespace {

TrackerFrame view_of(const RgbdFrame& frame, const PinholeCamera& camera, const DepthNoise& noise) {
  TrackerFrame view;
  view.frame = &frame;
  view.pyramid = ImagePyramid(to_gray(frame.color), 5);
  view.grid = make_depth_grid(frame.depth, camera, noise, 5.5);
  return view;
}

/// Model of one keyframe, and the next frame.
struct OneStep {
  using Change = std::function<void(RgbdFrame& before, RgbdFrame& after)>;
  PinholeCamera camera = room_camera();
  AttemptParams params;
  RgbdFrame first, second;
  SE3 T_second = path_pose(0.1);
  LocalMap map{1000, 10};
  TrackerFrame view;

  explicit OneStep(const Change& change = {}) {
    first = render_room({}, camera, path_pose(0), Time::from_seconds(1));
    second = render_room({}, camera, T_second, Time::from_seconds(1.1));
    if (change) change(first, second);
    FeatureDetector detector({}, camera, {5.5, 0.05});
    const TrackerFrame anchor = view_of(first, camera, params.registration.noise);
    insert_keyframe(map,
                    {&anchor,
                     detector.detect(anchor.pyramid.level(0), first.depth),
                     {},
                     path_pose(0),
                     Mat6::Zero(),
                     Mat6::Zero(),
                     0},
                    camera, params.registration, params.matching.limit);
    view = view_of(second, camera, params.registration.noise);
  }
};

/// Somebody in patterned clothes a metre in front of the camera, in place of the room behind.
void draw_person(double middle_m, RgbdFrame& frame) {
  constexpr double kPersonDepth_m = 1, kHalfWidth_m = 0.22;
  const PinholeCamera camera = room_camera();
  const SE3& T_world_camera = *frame.T_world_camera;
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const Vec3 ray = T_world_camera.rotation() * camera.unproject(Vec2(x, y), 1.0);
      const double z = (kPersonDepth_m - T_world_camera.translation().z()) / ray.z();
      const Vec3 p = T_world_camera.translation() + z * ray - Vec3(middle_m, 0, 0);
      if (std::abs(p.x()) > kHalfWidth_m) continue;
      frame.color(x, y) = gray_pixel(texture_level({.seed = 77}, p));
      frame.depth.units(x, y) = static_cast<std::uint16_t>(std::lround(z * 5000));
    }
}

/// Somebody steps aside by 15 cm between the model's keyframe and the next frame. The room has been seen five
/// times, the person once.
struct StepAside : OneStep {
  static constexpr double kStep_m = 0.15;
  /// If the person had not moved.
  SE3 T_with_person = SE3(Mat3::Identity(), Vec3(-kStep_m, 0, 0)) * T_second;

  StepAside()
      : OneStep([](RgbdFrame& before, RgbdFrame& after) {
          draw_person(0, before);
          draw_person(kStep_m, after);
        }) {
    for (std::size_t i = 0; i < map.landmark_count(); ++i)
      map.landmark(i).sightings = map.landmark(i).p_odom.z() > 1.2 ? 5 : 1;
  }
  [[nodiscard]] double error_m(const Attempt& attempt) const {
    return (attempt.registration.T_odom_camera.translation() - T_second.translation()).norm();
  }
};

/// A guess that follows the person is confirmed by what is seen of him; the room, which is better known,
/// decides.
TEST(TrackerAttempt, TheRoomIsKeptWhenSomebodyStepsAside) {
  const StepAside step;
  Attempt attempt = attempt_pose(step.map, step.view, step.T_with_person, step.camera, step.params);
  ASSERT_TRUE(attempt.refusal.empty()) << attempt.refusal;
  ASSERT_GT(step.error_m(attempt), 0.1) << "this guess misleads nobody";
  attempt_again(step.map, step.view, step.T_second, step.camera, step.params, attempt);
  EXPECT_LT(step.error_m(attempt), 0.003);
  // The other way round, the person takes nothing away.
  attempt_again(step.map, step.view, step.T_with_person, step.camera, step.params, attempt);
  EXPECT_LT(step.error_m(attempt), 0.003);
}

/// With a guess wrong by nine pixels most patches are not found; the found ones determine a better pose.
TEST(TrackerAttempt, LooksAgainFromWhereTheFirstOnesPutTheCamera) {
  const OneStep step;
  const Attempt good = attempt_pose(step.map, step.view, step.T_second, step.camera, step.params);
  ASSERT_TRUE(good.refusal.empty()) << good.refusal;
  for (const double turn_rad : {-0.036, 0.036}) {
    const SE3 T_guess = step.T_second * SE3(so3_exp(Vec3(0, turn_rad, 0)), Vec3::Zero());
    std::vector<std::size_t> looked_for;
    auto matches =
        match_landmarks(step.map, step.view, T_guess, step.camera, step.params.matching, looked_for);
    const Registration once =
        register_frame(step.map, step.view, matches, T_guess, step.camera, step.params.registration);
    EXPECT_LT(once.inliers, good.registration.inliers / 3) << "this guess misleads nobody";
    const Attempt attempt = attempt_pose(step.map, step.view, T_guess, step.camera, step.params);
    EXPECT_TRUE(attempt.refusal.empty()) << attempt.refusal;
    EXPECT_GT(attempt.registration.inliers, 0.9 * good.registration.inliers);
    EXPECT_LT((attempt.registration.T_odom_camera.translation() - step.T_second.translation()).norm(), 0.002);
  }
}

/// A model of another room: rejected with numbers, for any result of the first search.
TEST(TrackerAttempt, RefusesWithNumbers) {
  OneStep step;
  TexturedRoom other;
  other.seed = 99;
  const RgbdFrame elsewhere = render_room(other, step.camera, step.T_second, Time::from_seconds(2));
  step.view = view_of(elsewhere, step.camera, step.params.registration.noise);
  const Attempt attempt = attempt_pose(step.map, step.view, step.T_second, step.camera, step.params);
  EXPECT_NE(attempt.refusal.find("matches agree"), std::string::npos) << attempt.refusal;
}

}  // namespace
}  // namespace hm
