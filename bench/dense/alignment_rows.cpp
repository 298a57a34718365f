// Rows about dense alignment: poses disturbed in scenes in closed form, and visual odometry corrected by it.
#include <array>
#include <cmath>

#include "dense/scene_frames.hpp"
#include "hm/core/angle.hpp"
#include "hm/core/rng.hpp"
#include "hm/core/statistics.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/evaluation/trajectory_error.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"
#include "hm/odometry/make_odometry.hpp"
#include "hm/tsdf/alignment/trajectory_aligner.hpp"
#include "hm/tsdf/integration/integrator.hpp"
#include "hm/tsdf/testing/analytic_scene.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

constexpr double kShift_m = 0.02, kTurn_rad = 1.0 * kRadiansPerDegree;

Vec3 random_direction(Rng& rng) { return Vec3(rng.normal(), rng.normal(), rng.normal()).normalized(); }

/// The pose moved by 2 cm and turned by 1 degree in random directions.
SE3 disturbed(const SE3& pose, Rng& rng) {
  return {so3_exp(kTurn_rad * random_direction(rng)) * pose.rotation(),
          pose.translation() + kShift_m * random_direction(rng)};
}

/// Remainder of the disturbances.
struct Left {
  std::vector<double> shift_mm, turn_deg, ms;
  std::size_t accepted = 0, tried = 0, not_fully_seen = 0;

  void add(const AlignmentResult& result, const SE3& truth) {
    ++tried;
    ms.push_back(result.milliseconds);
    if (result.status != AlignmentStatus::kAccepted) return;
    ++accepted;
    if (result.unobservable_directions > 0) {
      ++not_fully_seen;
      return;
    }
    const SE3 error = truth.inverse() * result.T_world_camera;
    shift_mm.push_back(error.translation().norm() * 1e3);
    turn_deg.push_back(error.angle() / kRadiansPerDegree);
  }
  [[nodiscard]] JsonValue json() const {
    const Summary shift = summarise(shift_mm), turn = summarise(turn_deg);
    return JsonValue::object({{"tried", tried},
                              {"accepted", accepted},
                              {"of_them_not_all_directions_seen", not_fully_seen},
                              {"shift_mm_median", shift.median},
                              {"shift_mm_p95", shift.p95},
                              {"shift_mm_max", shift.max},
                              {"turn_deg_median", turn.median},
                              {"turn_deg_p95", turn.p95},
                              {"turn_deg_max", turn.max},
                              {"ms_median", summarise(ms).median}});
  }
};

/// The room with a Kinect: a map from every 10th frame, views in between disturbed.
Left disturb_room(const SensorEffects& effects, const BenchOptions& options) {
  SimulationParams scene;
  scene.world = WorldKind::kRoom;
  scene.sensor = SensorPreset::kKinect;
  scene.effects = effects;
  const Simulation simulation(scene);
  const ParallelLoop loop(options.threads);
  const TsdfParams tsdf;
  const DepthNoise noise = simulation.sensor().noise;
  Integrator integrator(tsdf, noise, simulation.camera(), loop);
  VolumeGrid grid = Integrator::make_grid(tsdf);
  for (std::size_t i = 0; i < simulation.frame_count(); i += 10)
    integrator.integrate(grid, simulation.frame(i, loop));
  DenseAligner aligner({}, tsdf, noise, simulation.camera());
  Left left;
  Rng rng(5);
  const std::size_t step = simulation.frame_count() / 200;
  for (std::size_t i = 5; i < simulation.frame_count(); i += step) {
    const RgbdFrame frame = simulation.frame(i, loop);
    left.add(aligner.align(grid, frame.depth, {disturbed(*frame.T_world_camera, rng)}),
             *frame.T_world_camera);
  }
  return left;
}

/// Rounds a depth image as a Kinect would: noise along the ray, disparity in whole steps.
void make_noisy(DepthImage& depth, const DepthNoise& noise, Rng& rng) {
  constexpr double kStep_per_m = 2.85e-3;
  for (std::uint16_t& units : depth.units.pixels()) {
    if (units == 0) continue;
    const double z = units * depth.unit_m, noisy = z + rng.normal(0, noise.sigma_m(z));
    units = static_cast<std::uint16_t>(
        std::lround(1.0 / (std::round(1.0 / noisy / kStep_per_m) * kStep_per_m) / depth.unit_m));
  }
}

struct Corridor {
  double along_mm = 0, across_mm = 0;  ///< largest motion along the axis, largest error across it
  int tried = 0, found_free = 0;       ///< alignments, of which the axis was found not to be seen
};

/// A corridor without an end: the axis is free, whatever disturbs the pose.
Corridor disturb_corridor() {
  const AnalyticScene scene{
      {{Vec3(0, 1, 0), -1.0}, {Vec3(0, -1, 0), -1.1}, {Vec3(0, 0, 1), -1.2}, {Vec3(0, 0, -1), -1.4}}, {}};
  const PinholeCamera camera{640, 480, 525, 525, 319.5, 239.5, {}};
  const TsdfParams tsdf;
  const DepthNoise noise;
  const ParallelLoop loop;
  Integrator integrator(tsdf, noise, camera, loop);
  VolumeGrid grid = Integrator::make_grid(tsdf);
  Rng rng(9);
  for (int i = 0; i < 20; ++i) {
    RgbdFrame frame = scene.render(camera, looking_along_x(Vec3(0.05 * i, 0.1 * std::sin(i), 0)));
    make_noisy(frame.depth, noise, rng);
    integrator.integrate(grid, frame);
  }
  DenseAligner aligner({}, tsdf, noise, camera);
  Corridor result;
  for (int i = 0; i < 40; ++i) {
    const SE3 truth = looking_along_x(Vec3(0.02 * i, 0.05 * std::cos(i), 0.02 * std::sin(i)));
    RgbdFrame frame = scene.render(camera, truth);
    make_noisy(frame.depth, noise, rng);
    const SE3 prior = disturbed(truth, rng);
    const AlignmentResult found = aligner.align(grid, frame.depth, {prior});
    ++result.tried;
    result.found_free += found.unobservable_directions > 0 ? 1 : 0;
    const Vec3 motion = found.T_world_found.translation() - prior.translation();
    const Vec3 error = found.T_world_found.translation() - truth.translation();
    result.along_mm = std::max(result.along_mm, std::abs(motion.x()) * 1e3);
    result.across_mm = std::max(result.across_mm, error.tail<2>().norm() * 1e3);
  }
  return result;
}

/// Paths through a recording: as visual odometry tells it, and corrected frame by frame.
struct Run {
  Trajectory truth, odometry, aligned;
  std::vector<double> ms;
  std::size_t accepted = 0, lost = 0;
};

Result<Run> follow(FrameSource& source, const TsdfParams& tsdf, const BenchOptions& options) {
  const PinholeCamera camera = source.camera();
  const ParallelLoop loop(options.threads);
  Integrator integrator(tsdf, {}, camera, loop);
  VolumeGrid grid = Integrator::make_grid(tsdf);
  TrajectoryAligner aligner({}, tsdf, {}, camera);
  std::unique_ptr<VisualOdometry> odometry;
  Run run;
  while (true) {
    const auto chunk = source.next_chunk();
    if (!chunk) return forward_error(chunk);
    if (chunk->empty()) return run;
    for (const RgbdFrame& frame : *chunk) {
      if (!frame.T_world_camera) continue;
      const SE3 truth = *frame.T_world_camera;
      if (!odometry) odometry = make_visual_odometry({}, camera, truth);
      const TrackedFrame tracked = odometry->track(frame);
      if (!tracked.T_odom_camera) {
        ++run.lost;
        continue;
      }
      const AlignmentResult found =
          aligner.align(grid, frame.depth, *tracked.T_odom_camera, tracked.covariance);
      if (found.status == AlignmentStatus::kAccepted) ++run.accepted;
      run.ms.push_back(found.milliseconds);
      run.truth.push_back({frame.stamp, truth});
      run.odometry.push_back({frame.stamp, *tracked.T_odom_camera});
      run.aligned.push_back({frame.stamp, found.T_world_camera});
      integrator.integrate(grid, {frame, found.T_world_camera});
    }
  }
}

Result<Run> follow(const std::string& recording, const TsdfParams& tsdf, const BenchOptions& options) {
  const auto source = open_frames(recording, {static_cast<std::size_t>(options.frame_limit), 1, 20});
  if (!source) return forward_error(source);
  return follow(**source, tsdf, options);
}

/// The beginning of a walk through a simulated world with a Kinect.
Result<Run> follow(WorldKind world, const TsdfParams& tsdf, const BenchOptions& options) {
  SimulationParams scene;
  scene.world = world;
  scene.sensor = SensorPreset::kKinect;
  const Simulation simulation(scene);
  const auto source = simulated_frames(simulation, {300, 1, 20});
  return follow(*source, tsdf, options);
}

Result<JsonValue> errors_of(const Run& run, double& aligned_ate_cm) {
  TrajectoryErrorParams params;
  params.rpe_unit = RpeUnit::kSeconds;
  const auto odometry = evaluate_trajectory(run.truth, run.odometry, params);
  if (!odometry) return forward_error(odometry);
  const auto aligned = evaluate_trajectory(run.truth, run.aligned, params);
  if (!aligned) return forward_error(aligned);
  aligned_ate_cm = aligned->position_m.rmse * 100;
  return JsonValue::object({{"frames", run.aligned.size()},
                            {"lost", run.lost},
                            {"aligned", run.accepted},
                            {"ate_cm_odometry", odometry->position_m.rmse * 100},
                            {"ate_cm_aligned", aligned->position_m.rmse * 100},
                            {"rpe_second_cm_odometry", odometry->relative.translation_m.rmse * 100},
                            {"rpe_second_cm_aligned", aligned->relative.translation_m.rmse * 100},
                            {"ms_median", summarise(run.ms).median},
                            {"ms_p99", summarise(run.ms).p99}});
}

}  // namespace

Result<BenchResult> bench_align_room(const BenchOptions& options) {
  const Left kinect = disturb_room({}, options), perfect = disturb_room(SensorEffects::none(), options);
  const Corridor corridor = disturb_corridor();
  BenchResult result;
  result.rows = {{"align_room", summarise(kinect.shift_mm).median, {}},
                 {"align_room_turn", summarise(kinect.turn_deg).median, {}},
                 {"align_corridor", corridor.along_mm, {}}};
  result.details = JsonValue::object({{"kinect", kinect.json()},
                                      {"perfect_sensor", perfect.json()},
                                      {"corridor_tried", corridor.tried},
                                      {"corridor_axis_found_free", corridor.found_free},
                                      {"corridor_across_mm_max", corridor.across_mm}});
  return result;
}

Result<BenchResult> bench_align_sevenscenes(const BenchOptions& options) {
  TsdfParams tsdf;
  tsdf.color = false;
  BenchResult result;
  double ate_cm = 0, other_cm = 0;
  const auto scenes = follow("sevenscenes_a", tsdf, options);
  if (!scenes) return forward_error(scenes);
  auto errors = errors_of(*scenes, ate_cm);
  if (!errors) return forward_error(errors);
  result.details["sevenscenes_a"] = std::move(*errors);
  result.rows = {{"align_sevenscenes", ate_cm, {}},
                 {"align_sevenscenes_time", summarise(scenes->ms).mean, {}}};
  for (const char* other : {"tum_fr1_xyz", "icl_of_kt3"}) {
    const auto run = follow(other, tsdf, options);
    if (!run) continue;  // not there: the row does not need it
    if (auto its_errors = errors_of(*run, other_cm)) result.details[other] = std::move(*its_errors);
  }
  for (const WorldKind world : {WorldKind::kRoom, WorldKind::kHouse}) {
    const auto run = follow(world, tsdf, options);
    if (!run) return forward_error(run);
    auto its_errors = errors_of(*run, other_cm);
    if (!its_errors) return forward_error(its_errors);
    result.details[fmt::format("simulated_{}", kWorldKindNames[static_cast<std::size_t>(world)])] =
        std::move(*its_errors);
  }
  return result;
}

}  // namespace hm::bench
