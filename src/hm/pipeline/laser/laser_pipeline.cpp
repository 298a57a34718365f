#include "hm/pipeline/laser/laser_pipeline.hpp"

#include <algorithm>
#include <cmath>
#include <deque>

#include "hm/core/check.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/geometry/planar_covariance.hpp"
#include "hm/laser/height/height_hypotheses.hpp"
#include "hm/pipeline/laser/laser_motion.hpp"
#include "hm/slam/laser/motion/free_direction_search.hpp"
#include "hm/slam/laser/motion/motion_search.hpp"

namespace hm {
namespace {

constexpr int kScansForVelocity = 4;
constexpr double kSlowScan_s = 0.2;
/// Headings that are searched: any after a long gap, else about what wheels predict or what a vehicle may
/// turn.
constexpr double kAnyHeading_rad = 4, kWheelTurn_rad = 0.6, kTurnRate_rad_s = 1, kLeastTurn_rad = 0.3;

/// Without a reading for so long, the height is a prediction.
constexpr double kRangeAge_s = 0.5;

/// Parameters for the readings of a range sensor, one at a time, or for mirrors.
HeightParams floor_params(const HeightParams& given, const LaserRig& rig) {
  return rig.down || !rig.T_base_range ? given : given.for_range_sensor();
}

/// Time at which the last beam of a scan was measured.
Time end_of(const LaserScan& scan) { return scan.stamp_of(scan.size()); }

/// The matcher's covariance in the axes of `odom`.
Mat3 in_odom(const OdometryStep& step) {
  const SE2 T_odom_keyframe = *step.T_odom_base * step.T_keyframe_base->inverse();
  return turned_covariance(T_odom_keyframe.rotation(), step.match.covariance);
}

/// Heading of a scan that was matched for certain.
std::optional<double> heading_of(const OdometryStep& step) {
  const bool is_sure = step.status == OdometryStatus::kTracking && step.confirmed;
  return is_sure ? std::optional(step.T_odom_base->angle()) : std::nullopt;
}

bool decide_matching(const LaserParameters& params, const LaserPlatform& platform) {
  if (params.run.poses != LaserPoseSource::kAuto) return params.run.poses == LaserPoseSource::kScans;
  return scans_horizontally(platform.rigs.front()) || !platform.has_odometry;
}

LaserMapFrame map_frame_of(const LaserParameters& params, bool matches_scans, const OccupancyGrid2D* saved,
                           LoopThread loops) {
  const LaserMapFrameParams frame{params.loops, params.localiser, params.run.kSeekInterval_s};
  if (!matches_scans) return {};
  if (saved) return LaserMapFrame::from_saved_map(*saved, frame);
  return params.run.close_loops ? LaserMapFrame::from_loops(frame, loops) : LaserMapFrame();
}

}  // namespace

std::string_view to_string(LaserScanStatus status) {
  switch (status) {
    case LaserScanStatus::kPosed:
      return "posed";
    case LaserScanStatus::kNotProjected:
      return "not projected";
    case LaserScanStatus::kNotMatched:
      return "not matched";
    case LaserScanStatus::kNoOdometry:
      return "no odometry";
    case LaserScanStatus::kTimeBackwards:
      return "time backwards";
    case LaserScanStatus::kNoHeight:
      return "no height";
  }
  return "unknown";
}

bool scans_horizontally(const LaserRig& rig) {
  return std::abs(rig.T_base_laser.rotation()(2, 2)) >= std::cos(LaserPipeline::kMaxHorizontalTilt_rad);
}

/// The stages of a LaserPipeline and what they remember.
struct LaserPipeline::State {
  State(const LaserParameters& parameters, LaserPlatform of_vehicle, const OccupancyGrid2D* saved_map,
        LoopThread loops);
  void process_waiting(bool all);
  void process(const LaserScan& scan, LaserStep& step);
  void process_matched(const LaserScan& scan, LaserStep& step);
  void process_with_odometry(const LaserScan& scan, LaserStep& step);
  void note_visit(const LaserScan& scan, const LaserStep& step);
  void estimate_height(const LaserScan& scan, LaserStep& step);
  void process_ranges(Time until);
  [[nodiscard]] HeightEstimate height_of_ranges(Time stamp) const;
  [[nodiscard]] bool uses_range() const { return matches_scans && !rig().down && rig().T_base_range; }
  [[nodiscard]] bool measures_height() const { return rig().down || uses_range(); }
  ProjectedScan project(const LaserScan& scan, LaserStep& step);
  [[nodiscard]] MotionPrediction prediction_for(Time stamp);
  bool match(const PlanarScan& scan, LaserStep& step);
  void fuse(LaserStep& step);
  [[nodiscard]] MatchedSweep sweep_of(const LaserStep& step) const;
  void insert(const LaserScan& scan, LaserStep& step, const SweepPose& T_odom_base);
  [[nodiscard]] bool is_ready(const LaserScan& scan) const;
  [[nodiscard]] const LaserRig& rig() const { return platform.rigs.front(); }

  struct Waiting {
    LaserScan scan;
    std::size_t laser;
  };
  LaserParameters params;
  LaserPlatform platform;
  bool matches_scans, uses_imu, uses_odometry;
  LaserMotion motion;
  ScanProjector projector;
  ScanOdometry odometry;
  MotionSearch search;
  FreeDirectionSearch along;  ///< of corridors
  std::optional<Time> last_match;
  int scans_without_velocity = 0;  // so many more
  LaserMapFrame map_frame;
  ScanVisits visits;
  HeightHypotheses floor, ceiling;
  MultiVolumeGrid grid;
  SweepPoints points;
  std::vector<std::optional<Time>> last_stamps;  // of each laser
  std::optional<Time> newest_input;
  std::deque<Waiting> waiting;
  std::deque<RangeReading> waiting_ranges;
  std::optional<HeightEstimate> last_range;  // with a height
  RangeCounts range_counts;
  std::vector<LaserStep> steps;
};

LaserPipeline::State::State(const LaserParameters& parameters, LaserPlatform of_vehicle,
                            const OccupancyGrid2D* saved_map, LoopThread loops)
    : params(parameters),
      platform(std::move(of_vehicle)),
      matches_scans(decide_matching(params, platform)),
      uses_imu(matches_scans && platform.has_imu && params.run.use_imu),
      uses_odometry(platform.has_odometry && (!matches_scans || params.run.use_odometry)),
      motion(params.state, rig().T_base_imu, Duration::from_seconds(params.run.kMaxOdometryGap_s)),
      projector(rig(), params.projection),
      odometry(params.matcher),
      search(params.motion_search, params.matcher.matcher),
      map_frame(map_frame_of(params, matches_scans, saved_map, loops)),
      floor(floor_params(params.height, rig()), SurfaceSide::kFloor),
      ceiling(params.height, SurfaceSide::kCeiling),
      grid(params.mvog),
      points(params.run.clear_without_return_m),
      last_stamps(platform.rigs.size()) {}

bool LaserPipeline::State::is_ready(const LaserScan& scan) const {
  const Time end = end_of(scan);
  if ((!uses_imu || motion.imu_reaches(end)) && (!uses_odometry || motion.odometry_reaches(end))) return true;
  return newest_input && (*newest_input - end).seconds() >= params.run.max_wait_s;
}

void LaserPipeline::State::process_waiting(bool all) {
  while (!waiting.empty() && (all || is_ready(waiting.front().scan))) {
    const Waiting next = std::move(waiting.front());
    waiting.pop_front();
    LaserStep step;
    step.laser = next.laser;
    step.stamp = step.scan_stamp = next.scan.stamp;
    const Stopwatch watch;
    process(next.scan, step);
    step.total_ms = watch.milliseconds();
    steps.push_back(std::move(step));
  }
}

void LaserPipeline::State::process(const LaserScan& scan, LaserStep& step) {
  auto& last = last_stamps[step.laser];
  if (last && scan.stamp <= *last) {
    step.status = LaserScanStatus::kTimeBackwards;
    step.reason = "not later than the scan before";
    return;
  }
  last = scan.stamp;
  if (matches_scans)
    process_matched(scan, step);
  else
    process_with_odometry(scan, step);
}

/// A scan whose pose is the recording's odometry, for the comparison of visits.
void LaserPipeline::State::note_visit(const LaserScan& scan, const LaserStep& step) {
  if (step.laser != 0 || !scans_horizontally(rig())) return;
  const ProjectedScan projected = projector.project(scan, {});
  if (projected.status == ProjectionStatus::kOk)
    visits.add(projected.scan, SE2::from_se3(*step.T_odom_base), step.T_odom_base->translation().z());
}

void LaserPipeline::State::process_with_odometry(const LaserScan& scan, LaserStep& step) {
  step.stamp = scan.stamp_of(scan.size() / 2);
  step.T_odom_base = motion.odometry_at(step.stamp);
  step.status = LaserScanStatus::kPosed;
  if (step.T_odom_base) insert(scan, step, [this](Time time) { return motion.odometry_at(time); });
  if (step.T_odom_base && step.status == LaserScanStatus::kPosed) return note_visit(scan, step);
  step.T_odom_base.reset();
  step.status = LaserScanStatus::kNoOdometry;
  step.reason = "the odometry does not reach its time";
}

void LaserPipeline::State::process_matched(const LaserScan& scan, LaserStep& step) {
  estimate_height(scan, step);
  const ProjectedScan projected = project(scan, step);
  if (projected.status != ProjectionStatus::kOk) {
    step.status = LaserScanStatus::kNotProjected;
    step.reason = std::string(to_string(projected.status));
    return;
  }
  step.stamp = projected.scan.stamp;
  if (!match(projected.scan, step)) return;
  if (measures_height() && floor.profile().empty() &&
      (!step.height || step.height->status != HeightStatus::kOk)) {
    step.status = LaserScanStatus::kNoHeight;
    step.reason = "the height is not known yet";
    return;
  }
  const MatchedSweep sweep = sweep_of(step);
  step.T_odom_base = sweep.at(step.stamp);
  step.status = LaserScanStatus::kPosed;
  fuse(step);
  insert(scan, step, [&sweep](Time time) { return sweep.at(time); });
}

void LaserPipeline::State::estimate_height(const LaserScan& scan, LaserStep& step) {
  if (uses_range()) {
    process_ranges(end_of(scan));
    step.height = height_of_ranges(scan.stamp_of(scan.size() / 2));
  }
  if (!rig().down && !rig().up) return;
  const SweepAttitude attitude = motion.sweep_attitude(scan.stamp, end_of(scan));
  const auto update = [&](HeightHypotheses& surface, const LaserRig::Mirror& mirror) {
    const MirrorDistances distances = mirror_distances(scan, mirror, attitude, surface.side());
    return surface.update(distances, motion.upward_acceleration(surface.last().stamp, distances.stamp));
  };
  if (rig().down) step.height = update(floor, *rig().down);
  if (rig().up) update(ceiling, *rig().up);
}

/// Measures the height with the readings until then; level where no IMU reaches.
void LaserPipeline::State::process_ranges(Time until) {
  for (; !waiting_ranges.empty() && waiting_ranges.front().stamp <= until; waiting_ranges.pop_front()) {
    const RangeReading& reading = waiting_ranges.front();
    const auto attitude = motion.attitude() ? motion.attitude()->at(reading.stamp) : std::nullopt;
    const auto estimate =
        floor.update(range_distance(reading, *rig().T_base_range, attitude.value_or(Mat3::Identity())),
                     motion.upward_acceleration(floor.last().stamp, reading.stamp));
    ++range_counts.processed;
    if (estimate.status != HeightStatus::kOk) continue;
    ++range_counts.used;
    last_range = estimate;
    if (motion.any_imu())
      motion.estimator().add_height({estimate.stamp, estimate.height_m, estimate.height_std_m});
  }
}

/// The height at a moment, from that of the last reading and the climb rate.
HeightEstimate LaserPipeline::State::height_of_ranges(Time stamp) const {
  HeightEstimate height = last_range.value_or(HeightEstimate{});
  const double age_s = (stamp - height.stamp).seconds();
  height.stamp = stamp;
  if (!last_range) return height;
  const double climb_m = height.climb_m_s * std::clamp(age_s, -kRangeAge_s, kRangeAge_s);
  height.height_m += climb_m;
  height.clearance_m += climb_m;
  if (age_s > kRangeAge_s) height.status = HeightStatus::kTooFewReadings;
  return height;
}

ProjectedScan LaserPipeline::State::project(const LaserScan& scan, LaserStep& step) {
  const Stopwatch watch;
  SweepMotion sweep;
  sweep.attitude = motion.attitude();
  // Velocities of scan matching are those before this scan: too small where a vehicle begins to turn.
  const auto by_odometry = uses_odometry ? motion.odometry_velocity(scan.stamp, end_of(scan)) : std::nullopt;
  sweep.velocity_ortho = by_odometry.value_or(odometry.velocity_base());
  if (step.height && step.height->status == HeightStatus::kOk)
    sweep.height_above_floor_m = step.height->clearance_m;
  if (rig().up && ceiling.last().status == HeightStatus::kOk)
    sweep.clearance_below_ceiling_m = ceiling.last().clearance_m;
  auto projected = projector.project(scan, sweep);
  step.project_ms = watch.milliseconds();
  return projected;
}

MotionPrediction LaserPipeline::State::prediction_for(Time stamp) {
  MotionPrediction prediction = motion.since_last(stamp);
  if (!params.run.search_motion) return prediction;
  const double elapsed_s = last_match ? (stamp - *last_match).seconds() : 0;
  const bool long_gap = elapsed_s > params.run.search_gap_s && !prediction.T_last_now;
  const double half_angle_rad = long_gap                ? kAnyHeading_rad
                                : prediction.T_last_now ? kWheelTurn_rad
                                                        : kTurnRate_rad_s * elapsed_s + kLeastTurn_rad;
  prediction.find = [this, elapsed_s, half_angle_rad](
                        const PlanarScan& scan, const PredictedPose& predicted) -> std::optional<FoundPose> {
    const auto found =
        search.find(scan, {predicted.T_odom_base, half_angle_rad, elapsed_s, predicted.covariance});
    if (!found) return std::nullopt;
    return FoundPose{found->T_odom_base, found->covariance, found->sure};
  };
  // The yaw of an IMU leaves little to confirm, and a tilted scan shows floor and ceiling, which agree with
  // nothing.
  if (!uses_imu) {
    prediction.confirms = [this](const PlanarScan& scan, const SE2& T_odom_base) {
      return search.agrees(scan, T_odom_base);
    };
    prediction.find_along = [this](const PlanarScan& scan, const SE2& T_odom_base, const Vec2& direction_odom,
                                   double predicted_sigma_m) {
      return along.find(scan, T_odom_base, direction_odom, predicted_sigma_m);
    };
  }
  // A vehicle may do anything between scans that far apart. Where it may have moved on by more than the
  // matcher corrects, a velocity must first be learned.
  if (long_gap || !last_match) scans_without_velocity = kScansForVelocity;
  const bool slow = scans_without_velocity > 0 && elapsed_s > kSlowScan_s && !prediction.T_last_now;
  if (scans_without_velocity > 0) --scans_without_velocity;
  prediction.find_first = long_gap || slow;
  return prediction;
}

bool LaserPipeline::State::match(const PlanarScan& scan, LaserStep& step) {
  const MotionPrediction prediction = prediction_for(scan.stamp);
  const Stopwatch watch;
  step.odometry = odometry.process(scan, prediction);
  if (step.odometry.T_odom_base) {
    last_match = scan.stamp;
    if (params.run.search_motion) {
      // Odometry took the place of a match: by its error, the scans before lie elsewhere. Good matches of the
      // next scans with this one would not agree with them.
      if (!step.odometry.confirmed && step.odometry.status == OdometryStatus::kFound) {
        search.clear();
        along.clear();
      }
      search.add(scan, *step.odometry.T_odom_base);
      if (!uses_imu) along.add(scan, *step.odometry.T_odom_base);
    }
  }
  step.match_ms = watch.milliseconds();
  step.matched_scan = true;
  step.velocity_base = odometry.velocity_base();
  const OdometryStatus status = step.odometry.status;
  if (status != OdometryStatus::kTimeBackwards && status != OdometryStatus::kTooFewPoints)
    motion.remember(scan.stamp, heading_of(step.odometry));
  const double height_m = step.height ? step.height->height_m : 0;
  step.map_frame = map_frame.process(scan, step.odometry, height_m);
  if (step.odometry.T_odom_base) visits.add(scan, *step.odometry.T_odom_base, height_m);
  if (step.odometry.T_keyframe_base && step.odometry.match.ok() && params.matcher.matcher.compute_covariance)
    step.planar_covariance = in_odom(step.odometry);
  if (step.odometry.T_odom_base) return true;
  step.status = status == OdometryStatus::kTimeBackwards ? LaserScanStatus::kTimeBackwards
                                                         : LaserScanStatus::kNotMatched;
  step.reason = std::string(status == OdometryStatus::kMatchFailed ? to_string(step.odometry.match.status)
                                                                   : to_string(status));
  return false;
}

MatchedSweep LaserPipeline::State::sweep_of(const LaserStep& step) const {
  const SE2& planar = *step.odometry.T_odom_base;
  const Vec2 v_odom = planar.rotation() * step.velocity_base.head<2>();
  MatchedSweep sweep;
  sweep.stamp = step.stamp;
  sweep.yaw_rad = planar.angle();
  sweep.yaw_rate_rad_s = step.velocity_base.z();
  sweep.p_odom = Vec3(planar.x(), planar.y(), step.height ? step.height->height_m : 0);
  sweep.v_odom_m_s = Vec3(v_odom.x(), v_odom.y(), step.height ? step.height->climb_m_s : 0);
  sweep.attitude = motion.attitude();
  if (sweep.attitude)
    if (const auto R_world_base = sweep.attitude->at(step.stamp))
      sweep.attitude_yaw_rad = roll_pitch_yaw(*R_world_base).z();
  return sweep;
}

void LaserPipeline::State::fuse(LaserStep& step) {
  if (!motion.any_imu()) return;
  motion.estimator().add_pose({step.stamp, *step.odometry.T_odom_base, step.planar_covariance});
  // Readings of a range sensor have been given to it one by one.
  if (!uses_range() && step.height && step.height->status == HeightStatus::kOk)
    motion.estimator().add_height({step.height->stamp, step.height->height_m, step.height->height_std_m});
  step.state = motion.estimator().state();
}

void LaserPipeline::State::insert(const LaserScan& scan, LaserStep& step, const SweepPose& T_odom_base) {
  const Stopwatch watch;
  if (points.compute(scan, platform.rigs[step.laser], T_odom_base)) {
    step.beams = grid.insert(points.beam_scan());
    if (map_frame.source() != MapFrameSource::kOdometry) step.sweep = points.knots();
  } else {
    step.status = LaserScanStatus::kNotProjected;
    step.reason = "no pose for all of its beams";
  }
  step.insert_ms = watch.milliseconds();
}

LaserPipeline::LaserPipeline(const LaserParameters& params, LaserPlatform platform,
                             const OccupancyGrid2D* saved_map, LoopThread loops) {
  HM_CHECK(!platform.rigs.empty(), "a platform without a laser");
  state_ = std::make_unique<State>(params, std::move(platform), saved_map, loops);
}

LaserPipeline::~LaserPipeline() = default;

void LaserPipeline::add_imu(const ImuSample& sample) {
  if (!state_->uses_imu) return;
  state_->motion.add_imu(sample);
  if (!state_->newest_input || sample.stamp > *state_->newest_input) state_->newest_input = sample.stamp;
  state_->process_waiting(false);
}

void LaserPipeline::add_odometry(const StampedPose& T_odom_base) {
  if (!state_->uses_odometry) return;
  state_->motion.add_odometry(T_odom_base);
  if (!state_->newest_input || T_odom_base.stamp > *state_->newest_input)
    state_->newest_input = T_odom_base.stamp;
  state_->process_waiting(false);
}

void LaserPipeline::add_range(const RangeReading& reading) {
  if (state_->uses_range()) state_->waiting_ranges.push_back(reading);
}

void LaserPipeline::add_scan(LaserScan scan, std::size_t laser) {
  HM_CHECK(laser < state_->platform.rigs.size(), "laser {} of {}", laser, state_->platform.rigs.size());
  if (!uses(laser)) return;
  const Time end = end_of(scan);
  if (!state_->newest_input || end > *state_->newest_input) state_->newest_input = end;
  state_->waiting.push_back({std::move(scan), laser});
  state_->process_waiting(false);
}

void LaserPipeline::finish(const RunContext& run) {
  state_->process_waiting(true);
  state_->map_frame.finish(run);
}
std::vector<LaserStep> LaserPipeline::take_steps() { return std::exchange(state_->steps, {}); }
bool LaserPipeline::matches_scans() const { return state_->matches_scans; }
bool LaserPipeline::uses(std::size_t laser) const { return !state_->matches_scans || laser == 0; }
bool LaserPipeline::uses_range() const { return state_->uses_range(); }
bool LaserPipeline::measures_height() const { return state_->measures_height(); }
const RangeCounts& LaserPipeline::range_counts() const { return state_->range_counts; }
const MultiVolumeGrid& LaserPipeline::map() const { return state_->grid; }
Duration LaserPipeline::odometry_delay() const { return state_->motion.odometry_delay(); }
const LaserMapFrame& LaserPipeline::map_frame() const { return state_->map_frame; }
const ScanVisits& LaserPipeline::visits() const { return state_->visits; }
std::vector<FloorLevel> LaserPipeline::floors() const {
  return state_->measures_height() ? state_->floor.profile() : std::vector<FloorLevel>{};
}

}  // namespace hm
