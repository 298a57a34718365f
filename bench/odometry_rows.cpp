// Rows about visual odometry on a real recording: ours against OpenCV's dense odometries in the same run.
#include <algorithm>
#include <ctime>
#include <functional>

#include "hm/evaluation/trajectory_error.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/odometry/make_odometry.hpp"
#include "measurement.hpp"
#include "peer_opencv.hpp"
#include "scene_frames.hpp"

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

}  // namespace

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
