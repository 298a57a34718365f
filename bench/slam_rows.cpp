// Row about loops: the Intel lab against relations that people verified.
#include <chrono>
#include <filesystem>

#include "hm/evaluation/relation_error.hpp"
#include "hm/io/laser_recording.hpp"
#include "hm/io/relations_file.hpp"
#include "hm/laser/scan_projection.hpp"
#include "hm/sensors/wheel_odometry.hpp"
#include "hm/slam/loop_closer.hpp"
#include "measurement.hpp"
#include "scene_frames.hpp"

namespace hm::bench {
namespace {

using Clock = std::chrono::steady_clock;

struct Drive {
  Trajectory odometry, corrected;
  double seconds = 0;
  ScanGraphStatistics loops;
};

/// Scan matching with degraded wheel odometry as prediction, and loops closed on top of it.
Drive drive(const LaserRecording& recording, const WheelNoiseParams& noise) {
  const LaserStream& laser = recording.lasers.front();
  const Trajectory wheels = degrade_to_wheel_odometry(recording.truth, noise);
  LaserRig rig;
  rig.T_base_laser = laser.T_base_laser;
  ScanProjector projector(rig);
  ScanOdometry odometry;
  LoopCloser closer;
  Drive result;
  SE2 last;
  const auto begin = Clock::now();
  for (std::size_t i = 0; i < laser.scans.size() && i < wheels.size(); ++i) {
    const SE2 now = SE2::from_se3(wheels[i].T_world_base);
    const PlanarScan scan = projector.project(laser.scans[i]).scan;
    MotionPrediction prediction;
    prediction.T_last_now = last.inverse() * now;
    last = now;
    const OdometryStep step = odometry.process(scan, prediction);
    closer.add(scan, step);
    if (step.T_odom_base) result.odometry.push_back({scan.stamp, step.T_odom_base->to_se3()});
  }
  closer.finish();
  result.corrected = closer.graph().corrected(result.odometry);
  result.seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  result.loops = closer.graph().statistics();
  return result;
}

}  // namespace

Result<BenchResult> bench_intel_relations(const BenchOptions&) {
  const auto folder = data_folder() / "laser";
  const auto recording = open_laser_recording(folder / "flirt_intel-lab.log");
  if (!recording) return forward_error(recording);
  auto list = read_relations(folder / "intel.relations");
  if (!list) return forward_error(list);
  mend_relations(list->relations, recording->mended_stamps);
  constexpr int kSeeds = 5;
  double matching_m = 0, loops_m = 0, seconds = 0;
  JsonValue seeds = JsonValue::array();
  for (int seed = 1; seed <= kSeeds; ++seed) {
    WheelNoiseParams noise;
    noise.seed = seed;
    const Drive run = drive(*recording, noise);
    // Relations between two scans of the log; a pose between scans would have to be interpolated.
    const auto matching = evaluate_relations(run.odometry, list->relations, {0, 0});
    if (!matching) return forward_error(matching);
    const auto loops = evaluate_relations(run.corrected, list->relations, {0, 0});
    if (!loops) return forward_error(loops);
    matching_m += matching->translation_m.mean / kSeeds;
    loops_m += loops->translation_m.mean / kSeeds;
    seconds += run.seconds / kSeeds;
    seeds.push_back(JsonValue::object({{"matching_m", matching->translation_m.mean},
                                       {"loops_m", loops->translation_m.mean},
                                       {"loops_std_m", loops->translation_std_m},
                                       {"loops_rad", loops->rotation_rad.mean},
                                       {"relations", loops->errors.size()},
                                       {"loop_candidates", run.loops.candidates},
                                       {"loops_accepted", run.loops.accepted}}));
  }
  BenchResult result;
  result.rows = {{"intel_relations", matching_m, {}}, {"intel_relations_loops", loops_m, {}}};
  result.details = JsonValue::object({{"seconds", seconds}});
  result.details["seeds"] = std::move(seeds);
  return result;
}

}  // namespace hm::bench
