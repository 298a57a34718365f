// Rows about the default visual odometry: its error on real recordings, its time, its drift on a walk through
// the simulated house and its memory over an hour.
#include <algorithm>
#include <cmath>
#include <functional>
#include <span>

#include "dense/scene_frames.hpp"
#include "hm/core/process_memory.hpp"
#include "hm/core/statistics.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/evaluation/trajectory_error.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/odometry/make_odometry.hpp"
#include "hm/odometry/testing/swinging_camera.hpp"
#include "hm/pipeline/common/sensor_prior.hpp"
#include "measurement.hpp"
#include "rgbd/drawn_people.hpp"

namespace hm::bench {
namespace {

constexpr const char* kRoom = "sevenscenes_a";
constexpr std::size_t kHourOfFrames = 108000;

/// Result of tracking some frames.
struct Run {
  Trajectory truth, estimate;
  std::vector<double> cpu_ms;
  int lost = 0, by_depth = 0;
};

/// What is done to a frame of a camera, by its number, before it is tracked.
using FrameChange = std::function<void(std::size_t number, const PinholeCamera& camera, RgbdFrame& frame)>;

/// Takes the colour away from the frames from `first` to before `end`.
FrameChange darkness(std::size_t first, std::size_t end) {
  return [=](std::size_t number, const PinholeCamera&, RgbdFrame& frame) {
    if (number >= first && number < end) frame.color = {};
  };
}

Result<Run> track_all(FrameSource& source, const OdometryParams& params, const FrameChange& change) {
  Run run;
  const auto odometry = make_visual_odometry(params, source.camera());
  while (true) {
    const auto chunk = source.next_chunk();
    if (!chunk) return forward_error(chunk);
    if (chunk->empty()) return run;
    for (const RgbdFrame& given : *chunk) {
      RgbdFrame frame = given;
      if (change) change(run.cpu_ms.size(), source.camera(), frame);
      const double begin_s = thread_cpu_s();
      const TrackedFrame tracked = odometry->track(frame);
      run.by_depth += tracked.numbers.by_depth ? 1 : 0;
      run.cpu_ms.push_back(1e3 * (thread_cpu_s() - begin_s));
      if (frame.T_world_camera) run.truth.push_back({frame.stamp, *frame.T_world_camera});
      if (tracked.T_odom_camera)
        run.estimate.push_back({frame.stamp, *tracked.T_odom_camera});
      else
        ++run.lost;
    }
  }
}

Result<TrajectoryError> judge(const Run& run, RpeUnit unit) {
  TrajectoryErrorParams params;
  params.rpe_unit = unit;
  return evaluate_trajectory(run.truth, run.estimate, params);
}

JsonValue details_of(const Run& run, const TrajectoryError& error) {
  return JsonValue::object({{"frames", run.cpu_ms.size()},
                            {"lost", run.lost},
                            {"by_depth", run.by_depth},
                            {"path_m", error.truth_path_m},
                            {"ate_cm", error.position_m.rmse * 100},
                            {"rpe_mm", error.relative.translation_m.rmse * 1e3}});
}

/// The parameters with which `hm odometry` tracks recordings of a Kinect.
OdometryParams of_kinect() { return with_kinect_prior({}); }

Result<Run> track_recording(const char* name, std::size_t stride, const BenchOptions& options,
                            const OdometryParams& params = {}, const FrameChange& change = {}) {
  const auto source = open_frames(name, {static_cast<std::size_t>(options.frame_limit), stride, 40});
  if (!source) return forward_error(source);
  return track_all(**source, params, change);
}

/// ATE in cm of a recording that is changed; with its details.
Result<double> ate_of_changed_cm(const char* name, const FrameChange& change, const BenchOptions& options,
                                 JsonValue& details) {
  const auto run = track_recording(name, 1, options, of_kinect(), change);
  if (!run) return forward_error(run);
  const auto error = judge(*run, RpeUnit::kSeconds);
  if (!error) return forward_error(error);
  details = details_of(*run, *error);
  return error->position_m.rmse * 100;
}

double resident_mb() { return static_cast<double>(resident_bytes()) * 1e-6; }

}  // namespace

Result<BenchResult> bench_vo_sevenscenes(const BenchOptions& options) {
  const auto run = track_recording(kRoom, 1, options, of_kinect());
  if (!run) return forward_error(run);
  const auto error = judge(*run, RpeUnit::kSeconds);
  if (!error) return forward_error(error);
  std::vector<double> sorted = run->cpu_ms;
  std::sort(sorted.begin(), sorted.end());
  double sum = 0;
  for (const double ms : sorted) sum += ms;
  BenchResult result;
  result.rows = {{"vo_time", sum / static_cast<double>(sorted.size()), {}},
                 {"vo_time_p99", sorted[sorted.size() * 99 / 100], {}},
                 {"vo_sevenscenes", error->position_m.rmse * 100, {}},
                 {"vo_sevenscenes_rpe", error->relative.translation_m.rmse * 100, {}},
                 {"vo_sevenscenes_lost", static_cast<double>(run->lost), {}}};
  result.details = details_of(*run, *error);
  return result;
}

Result<BenchResult> bench_vo_every_5th(const BenchOptions& options) {
  const auto run = track_recording(kRoom, 5, options, of_kinect());
  if (!run) return forward_error(run);
  const auto error = judge(*run, RpeUnit::kFrames);
  if (!error) return forward_error(error);
  BenchResult result;
  result.rows = {{"vo_every_5th", error->position_m.rmse * 100, {}},
                 {"vo_every_5th_lost", static_cast<double>(run->lost), {}}};
  result.details = details_of(*run, *error);
  return result;
}

Result<BenchResult> bench_vo_tum_xyz(const BenchOptions& options) {
  const auto run = track_recording("tum_fr1_xyz", 1, options, of_kinect());
  if (!run) return forward_error(run);
  const auto error = judge(*run, RpeUnit::kSeconds);
  if (!error) return forward_error(error);
  BenchResult result;
  result.rows = {{"vo_tum_xyz", error->position_m.rmse * 100, {}},
                 {"vo_tum_xyz_rpe", error->relative.translation_m.rmse * 100, {}}};
  result.details = details_of(*run, *error);
  return result;
}

Result<BenchResult> bench_vo_tum_rpy(const BenchOptions& options) {
  const auto run = track_recording("tum_fr1_rpy", 1, options, of_kinect());
  if (!run) return forward_error(run);
  const auto error = judge(*run, RpeUnit::kSeconds);
  if (!error) return forward_error(error);
  BenchResult result;
  result.rows = {{"vo_tum_rpy", error->position_m.rmse * 100, {}},
                 {"vo_tum_rpy_lost", static_cast<double>(run->lost), {}}};
  result.details = details_of(*run, *error);
  return result;
}

Result<BenchResult> bench_vo_depth_only(const BenchOptions& options) {
  BenchResult result;
  const auto without_color =
      ate_of_changed_cm("tum_fr1_xyz", darkness(0, 1u << 20), options, result.details["without_color"]);
  if (!without_color) return forward_error(without_color);
  const auto undisturbed = ate_of_changed_cm(kRoom, {}, options, result.details["undisturbed"]);
  if (!undisturbed) return forward_error(undisturbed);
  // Five seconds of 600 frames at 30 Hz.
  const auto dark = ate_of_changed_cm(kRoom, darkness(225, 375), options, result.details["dark"]);
  if (!dark) return forward_error(dark);
  result.rows = {{"vo_depth_only", *without_color, {}}, {"vo_depth_only_dark", *dark / *undisturbed, {}}};
  return result;
}

Result<BenchResult> bench_vo_people(const BenchOptions& options) {
  struct Case {
    const char *key, *recording;
    DrawnPeople people;
  };
  const std::vector<Case> crossing{{"xyz_one", "tum_fr1_xyz", {1, 1.0, 0.75, 6}},
                                   {"xyz_two", "tum_fr1_xyz", {2, 1.0, 0.75, 5}},
                                   {"xyz_faint", "tum_fr1_xyz", {2, 1.0, 0.75, 5, 0.6}},
                                   {"xyz_in_and_out", "tum_fr1_xyz", {1, 0.8, 1.2, 4}},
                                   {"rpy_two", "tum_fr1_rpy", {2, 1.2, 0.75, 5}}};
  const Case there_first{"from_the_start", "tum_fr1_xyz", {1, 0.9, 0.3, 4}};
  BenchResult result;
  const auto ate_cm = [&](const Case& one) {
    const FrameChange draw = [people = one.people](std::size_t, const PinholeCamera& camera,
                                                   RgbdFrame& frame) mutable { people.draw(camera, frame); };
    return ate_of_changed_cm(one.recording, draw, options, result.details[one.key]);
  };
  double worst_cm = 0;
  for (const Case& one : crossing) {
    const auto found_cm = ate_cm(one);
    if (!found_cm) return forward_error(found_cm);
    worst_cm = std::max(worst_cm, *found_cm);
  }
  const auto first_cm = ate_cm(there_first);
  if (!first_cm) return forward_error(first_cm);
  result.rows = {{"vo_people", worst_cm, {}}, {"vo_people_first", *first_cm, {}}};
  return result;
}

Result<BenchResult> bench_vo_rolling(const BenchOptions&) {
  const SwingingCamera rolling{{0.026, 0.015}, 0.014, 0.008, true};
  SwingingCamera global = rolling;
  global.color = {};
  std::vector<double> ours_mm, peer_mm, off_ms;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const SwingRun with = track_swing(rolling, seed), without = track_swing(global, seed);
    ours_mm.push_back(1e3 * with.rms_m);
    peer_mm.push_back(1e3 * without.rms_m);
    off_ms.push_back(1e3 * std::max(std::abs(with.last.readout_s - rolling.color.readout_s),
                                    std::abs(with.last.color_delay_s - rolling.color.delay_s)));
  }
  const double ours = middle_value(std::span(ours_mm)), peer = middle_value(std::span(peer_mm));
  BenchResult result;
  result.rows = {{"vo_rolling", ours / peer, {}}, {"vo_rolling_times", std::ranges::max(off_ms), {}}};
  result.details = JsonValue::object({{"rolling_mm", ours}, {"global_mm", peer}});
  return result;
}

Result<BenchResult> bench_vo_icl(const BenchOptions& options) {
  const auto run = track_recording("icl_of_kt3", 1, options);
  if (!run) return forward_error(run);
  const auto error = judge(*run, RpeUnit::kFrames);
  if (!error) return forward_error(error);
  BenchResult result;
  result.rows = {{"vo_icl", error->position_m.rmse * 100, {}}};
  result.details = details_of(*run, *error);
  return result;
}

Result<BenchResult> bench_vo_hour(const BenchOptions& options) {
  const auto source = open_frames(kRoom, {200, 1, 200});
  if (!source) return forward_error(source);
  const auto frames = (*source)->next_chunk();
  if (!frames) return forward_error(frames);
  const std::size_t count =
      options.frame_limit ? static_cast<std::size_t>(options.frame_limit) : kHourOfFrames;
  const auto odometry = make_visual_odometry({}, (*source)->camera());
  std::size_t early_bytes = 0, late_bytes = 0;
  double early_mb = 0;
  int lost = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t turn = i % (2 * frames->size() - 2);  // forth and back
    RgbdFrame frame = (*frames)[turn < frames->size() ? turn : 2 * frames->size() - 2 - turn];
    frame.stamp = frame.color_stamp = Time::from_seconds(static_cast<double>(i) / 30);
    lost += odometry->track(frame).T_odom_camera ? 0 : 1;
    (i < count / 4 ? early_bytes : late_bytes) =
        std::max(i < count / 4 ? early_bytes : late_bytes, odometry->memory_bytes());
    if (i == count / 4) early_mb = resident_mb();
  }
  BenchResult result;
  const double growth = static_cast<double>(late_bytes) / static_cast<double>(early_bytes) - 1;
  result.rows = {{"vo_hour", 100 * growth, {}}, {"vo_hour_process", resident_mb() - early_mb, {}}};
  result.details =
      JsonValue::object({{"frames", count},
                         {"lost", lost},
                         {"peak_mb", static_cast<double>(std::max(early_bytes, late_bytes)) / 1e6}});
  return result;
}

}  // namespace hm::bench
