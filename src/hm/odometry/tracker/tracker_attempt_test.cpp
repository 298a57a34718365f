#include "hm/odometry/tracker/tracker_attempt.hpp"

#include <gtest/gtest.h>

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
  PinholeCamera camera = room_camera();
  AttemptParams params;
  RgbdFrame first, second;
  SE3 T_second = path_pose(0.1);
  LocalMap map{1000, 10};
  TrackerFrame view;

  OneStep() {
    first = render_room({}, camera, path_pose(0), Time::from_seconds(1));
    second = render_room({}, camera, T_second, Time::from_seconds(1.1));
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
