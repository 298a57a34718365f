// Rows about places seen again: the house walked through with a Kinect (dissertation 3.3, Fig. 3.11, Table 3.1).
#include <algorithm>
#include <cmath>
#include <memory>

#include "hm/odometry/feature_detection.hpp"
#include "hm/sim/simulation.hpp"
#include "hm/slam/rgbd/place_experiment.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

/// A keyframe when the camera moved or turned so far.
constexpr double kKeyframeDistance_m = 0.3, kKeyframeAngle_rad = 0.35;
/// An edge further from the truth is false.
constexpr double kFalseEdge_m = 0.3, kFalseEdge_rad = 0.1;

struct HouseKeyframes {
  std::vector<std::shared_ptr<const Keyframe>> keyframes;
  std::vector<SE3> truth;
};

/// `count` keyframes evenly chosen... see below.
HouseKeyframes house_keyframes(std::size_t count, std::size_t skip) {
  SimulationParams params;
  params.sensor = SensorPreset::kKinect;
  const Simulation simulation(params);
  FeatureDetector detector({}, simulation.camera(), {});
  HouseKeyframes house;
  SE3 last;
  std::size_t seen = 0;
  for (std::size_t i = 0; i < simulation.frame_count() && house.keyframes.size() < count; ++i) {
    const SE3 pose = simulation.true_pose(i);
    const SE3 since = last.inverse() * pose;
    if (i > 0 && since.translation().norm() < kKeyframeDistance_m && since.angle() < kKeyframeAngle_rad) continue;
    last = pose;
    if (seen++ < skip) continue;
    const RgbdFrame frame = simulation.frame(i);
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->frame_index = i;
    keyframe->stamp = simulation.stamp(i);
    keyframe->T_odom_camera = pose;
    keyframe->features = detector.detect(to_gray(frame.color), frame.depth);
    house.keyframes.push_back(keyframe);
    house.truth.push_back(pose);
  }
  return house;
}

}  // namespace
}  // namespace hm::bench
