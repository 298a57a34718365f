// Rows about visual odometry: on a real recording, ours against OpenCV's dense odometries in the same run; on
// a simulated one of 5 Hz, with an IMU and without.
#include <algorithm>
#include <array>
#include <ctime>
#include <functional>

#include "dense/scene_frames.hpp"
#include "hm/evaluation/trajectory_error.hpp"
#include "hm/odometry/interface/inertial_hints.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/odometry/make_odometry.hpp"
#include "hm/sim/recording/simulation.hpp"
#include "measurement.hpp"
#include "rgbd/peer_opencv.hpp"

namespace hm::bench {
namespace {

constexpr const char* kRecording = "sevenscenes_a";

/// A method that is run over the recording: a pose for a frame, or none.
struct Method {
  std::string name;
  std::function<std::optional<SE3>(const RgbdFrame&)> track;
  Trajectory estimate = {};
  double cpu_ms = 0;
  int frames = 0;
};

/// How it did: metres, radians, milliseconds of CPU time a frame.
struct Outcome {
  std::string name;
  double ate_m = 0, rpe_frame_m = 0, rpe_second_m = 0, rpe_second_rad = 0, cpu_ms = 0;
  int lost = 0;
};

double process_cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

Method our_method(OdometryMethod kind, const PinholeCamera& camera) {
  OdometryParams params;
  params.method = kind;
  const std::shared_ptr<VisualOdometry> odometry = make_visual_odometry(params, camera);
  return {std::string(kOdometryMethodNames[static_cast<std::size_t>(kind)]),
          [odometry](const RgbdFrame& frame) { return odometry->track(frame).T_odom_camera; }};
}

Method opencv_method(OpencvMethod kind, const PinholeCamera& camera) {
  const auto odometry = std::make_shared<OpencvOdometry>(kind, camera);
  return {kind == OpencvMethod::kRgbd ? "opencv_rgbd" : "opencv_rgbd_icp",
          [odometry](const RgbdFrame& frame) -> std::optional<SE3> { return odometry->track(frame); }};
}

Result<Outcome> judge(const Method& method, const Trajectory& truth) {
  TrajectoryErrorParams params;
  const auto by_frame = evaluate_trajectory(truth, method.estimate, params);
  if (!by_frame) return forward_error(by_frame);
  params.rpe_unit = RpeUnit::kSeconds;
  const auto by_second = evaluate_trajectory(truth, method.estimate, params);
  if (!by_second) return forward_error(by_second);
  return Outcome{method.name,
                 by_frame->position_m.rmse,
                 by_frame->relative.translation_m.rmse,
                 by_second->relative.translation_m.rmse,
                 by_second->relative.rotation_rad.rmse,
                 method.cpu_ms / method.frames,
                 method.frames - static_cast<int>(method.estimate.size())};
}

/// Every method on every frame, in turn, so that a busy machine slows all of them alike.
Result<std::vector<Outcome>> run(std::vector<Method>& methods, FrameSource& source) {
  Trajectory truth;
  while (true) {
    const auto chunk = source.next_chunk();
    if (!chunk) return forward_error(chunk);
    if (chunk->empty()) break;
    for (const RgbdFrame& frame : *chunk) {
      if (frame.T_world_camera) truth.push_back({frame.stamp, *frame.T_world_camera});
      for (Method& method : methods) {
        const double begin = process_cpu_ms();
        const auto pose = method.track(frame);
        method.cpu_ms += process_cpu_ms() - begin;
        ++method.frames;
        if (pose) method.estimate.push_back({frame.stamp, *pose});
      }
    }
  }
  std::vector<Outcome> outcomes;
  for (const Method& method : methods) {
    auto outcome = judge(method, truth);
    if (!outcome) return forward_error(outcome);
    outcomes.push_back(std::move(*outcome));
  }
  return outcomes;
}

JsonValue to_json(const std::vector<Outcome>& outcomes) {
  JsonValue list = JsonValue::array();
  for (const Outcome& o : outcomes) {
    list.push_back(JsonValue::object({{"method", o.name},
                                      {"ate_m", o.ate_m},
                                      {"rpe_frame_m", o.rpe_frame_m},
                                      {"rpe_second_m", o.rpe_second_m},
                                      {"rpe_second_rad", o.rpe_second_rad},
                                      {"cpu_ms", o.cpu_ms},
                                      {"lost", o.lost}}));
  }
  return list;
}

Result<std::unique_ptr<FrameSource>> open(const BenchOptions& options) {
  return open_frames(kRecording, {static_cast<std::size_t>(options.frame_limit), 1, 40});
}

constexpr int kTangoSeed = 101;  // constants were chosen on seeds 1 and 2 (recordings.json)

/// The walk through the house with a use of the IMU: from the true pose on, without alignment.
struct TangoWalk {
  ImuUse use = ImuUse::kOff;
  std::unique_ptr<VisualOdometry> odometry = nullptr;
  std::unique_ptr<InertialHints> hints = nullptr;
  int frames = 0, lost = 0, bridged = 0, submaps = 1;
  double path_m = 0, final_m = 0, worst_m = 0, cpu_ms = 0;

  void take(const RgbdFrame& frame, const Vec3& p_truth) {
    const double begin_ms = process_cpu_ms();
    const TrackedFrame tracked = odometry->track(frame, hints->next(frame.stamp));
    cpu_ms += process_cpu_ms() - begin_ms;
    ++frames;
    bridged += tracked.status == TrackingStatus::kBridged;
    submaps = std::max(submaps, tracked.submap + 1);
    if (!tracked.T_odom_camera) {
      ++lost;
      return;
    }
    final_m = (tracked.T_odom_camera->translation() - p_truth).norm();
    worst_m = std::max(worst_m, final_m);
  }
  [[nodiscard]] JsonValue details() const {
    return JsonValue::object({{"use_imu", std::string(kImuUseNames[static_cast<std::size_t>(use)])},
                              {"frames", frames},
                              {"lost", lost},
                              {"bridged", bridged},
                              {"submaps", submaps},
                              {"path_m", path_m},
                              {"final_m", final_m},
                              {"worst_m", worst_m},
                              {"cpu_ms", cpu_ms / std::max(frames, 1)}});
  }
};

}  // namespace

Result<BenchResult> bench_vio_tango(const BenchOptions& options) {
  SimulationParams scene;
  scene.seed = kTangoSeed;
  scene.frame_limit = options.frame_limit;
  const Simulation simulation(scene);
  auto imu = std::make_shared<CarriedImu>();
  imu->has_gyroscope = true;
  imu->samples = simulation.imu();
  for (ImuSample& sample : imu->samples) {
    sample.angular_velocity_rad_s = R_camera_tablet_imu() * sample.angular_velocity_rad_s;
    sample.specific_force_m_s2 = R_camera_tablet_imu() * sample.specific_force_m_s2;
  }
  std::array<TangoWalk, 2> walks{TangoWalk{ImuUse::kInertial}, TangoWalk{ImuUse::kOff}};
  for (TangoWalk& walk : walks) {
    walk.odometry = make_visual_odometry({}, simulation.camera(), simulation.true_pose(0));
    walk.hints = std::make_unique<InertialHints>(imu, walk.use);
  }
  for (std::size_t i = 0; i < simulation.frame_count(); ++i) {
    const RgbdFrame frame = simulation.frame(i);
    const Vec3 p = simulation.true_pose(i).translation();
    for (TangoWalk& walk : walks) {
      if (i > 0) walk.path_m += (p - simulation.true_pose(i - 1).translation()).norm();
      walk.take(frame, p);
    }
  }
  const auto percent = [](const TangoWalk& walk) { return 100 * walk.worst_m / walk.path_m; };
  BenchResult result;
  result.rows = {{"vio_tango", percent(walks[0]), percent(walks[1])},
                 {"vio_tango_lost", static_cast<double>(walks[0].lost), static_cast<double>(walks[1].lost)}};
  JsonValue list = JsonValue::array();
  for (const TangoWalk& walk : walks) list.push_back(walk.details());
  result.details = JsonValue::object({{"walks", list}});
  return result;
}

Result<BenchResult> bench_vo_vs_opencv(const BenchOptions& options) {
  const auto source = open(options);
  if (!source) return forward_error(source);
  const PinholeCamera camera = (*source)->camera();
  std::vector<Method> methods{our_method(OdometryMethod::kTracker, camera),
                              opencv_method(OpencvMethod::kRgbd, camera),
                              opencv_method(OpencvMethod::kRgbdIcp, camera)};
  const auto outcomes = run(methods, **source);
  if (!outcomes) return forward_error(outcomes);
  const Outcome &ours = (*outcomes)[0], &rgbd = (*outcomes)[1], &icp = (*outcomes)[2];
  BenchResult result;
  result.rows = {
      {"vo_vs_opencv", ours.cpu_ms, std::min(rgbd.cpu_ms, icp.cpu_ms)},
      {"vo_vs_opencv_ate", ours.ate_m * 100, std::min(rgbd.ate_m, icp.ate_m) * 100},
      {"vo_vs_opencv_rpe", ours.rpe_second_m * 100, std::min(rgbd.rpe_second_m, icp.rpe_second_m) * 100},
      {"vo_vs_opencv_rpe_frame", ours.rpe_frame_m * 1e3, std::min(rgbd.rpe_frame_m, icp.rpe_frame_m) * 1e3}};
  result.details = JsonValue::object({{"methods", to_json(*outcomes)}});
  return result;
}

}  // namespace hm::bench
