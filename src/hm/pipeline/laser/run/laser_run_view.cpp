#include "hm/pipeline/laser/run/laser_run_view.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "hm/pipeline/common/mvog_file.hpp"

namespace hm {
namespace {

/// Metres or radians by which loops move `map` before the path is shown again.
constexpr double kShownCorrection = 0.01;

LiveVehicle vehicle_of(const LaserStep& step) {
  LiveVehicle vehicle;
  vehicle.stamp = step.stamp;
  vehicle.T_map_base = step.map_frame.T_map_odom.to_se3() * *step.T_odom_base;
  if (step.planar_covariance)
    vehicle.sigma_m = std::sqrt(step.planar_covariance->topLeftCorner<2, 2>().trace());
  vehicle.velocity_m_s = {step.velocity_base.x(), step.velocity_base.y(), 0};
  if (step.height) {
    vehicle.height_m = step.height->height_m;
    vehicle.floor_m = step.height->floor_level_m;
  }
  return vehicle;
}

}  // namespace

void show_scan(LiveView& view, const LaserScan& scan, const SE3& T_map_laser) {
  std::vector<Eigen::Vector3f> points;
  for (std::size_t beam = 0; beam < scan.size(); ++beam) {
    if (!scan.is_return(beam)) continue;
    const double angle = scan.angle_rad(beam);
    const Vec3 p_laser = static_cast<double>(scan.ranges_m[beam]) * Vec3(std::cos(angle), std::sin(angle), 0);
    points.emplace_back((T_map_laser * p_laser).cast<float>());
  }
  view.on_scan(LiveScan::kLaser, scan.stamp, points);
}

void show_grid(LiveView& view, const MultiVolumeGrid& map, const SE2& T_map_grid,
               const LaserRunParams& params, bool is_planar) {
  constexpr double kAllHeights_m = 1e6;
  if (is_planar)
    view.on_grid(map, T_map_grid, -kAllHeights_m, kAllHeights_m);
  else
    view.on_grid(map, T_map_grid, params.slice_bottom_m, params.slice_top_m);
}

const LaserScan* LaserRunView::scan_of(const LaserStep& step) const {
  const auto& scans = recording_.lasers[step.laser].scans;
  const auto found = std::lower_bound(scans.begin(), scans.end(), step.scan_stamp,
                                      [](const LaserScan& scan, Time stamp) { return scan.stamp < stamp; });
  return found != scans.end() && found->stamp == step.scan_stamp ? &*found : nullptr;
}

void LaserRunView::show_path(const Trajectory& T_map_base) {
  std::vector<Vec3> points;
  for (const StampedPose& pose : T_map_base) points.push_back(pose.T_world_base.translation());
  view_.on_path(LivePath::kTrajectory, points);
}

void LaserRunView::show(const LaserStep& step, const LaserPipeline& pipeline, const Trajectory& T_odom_base) {
  const SE2& T_map_odom = step.map_frame.T_map_odom;
  ++scans_;
  if (!step.T_odom_base) ++scans_without_pose_;
  if (step.odometry.new_keyframe) ++keyframes_;
  if (step.T_odom_base) {
    const LiveVehicle vehicle = vehicle_of(step);
    view_.on_vehicle(vehicle);
    if (const LaserScan* scan = scan_of(step))
      show_scan(view_, *scan, vehicle.T_map_base * recording_.lasers[step.laser].T_base_laser);
  } else {
    view_.on_event(LogLevel::kWarning, "a scan has no pose: " + step.reason);
  }
  show_grid(view_, pipeline.map(), T_map_odom, params_, !pipeline.measures_height());
  if (pipeline.map_frame().is_settled() &&
      (T_map_odom_.inverse() * T_map_odom).log().norm() > kShownCorrection) {
    T_map_odom_ = T_map_odom;
    show_path(pipeline.map_frame().corrected(T_odom_base));
  }
  LiveNumbers numbers{"laser", scans_, scans_total_, {}, {}, {}};
  numbers.stages_ms = {{"project", step.project_ms},
                       {"match", step.match_ms},
                       {"loops", step.map_frame.ms},
                       {"insert", step.insert_ms}};
  numbers.counts = {
      {"scans", scans_}, {"scans without a pose", scans_without_pose_}, {"keyframes", keyframes_}};
  numbers.memory = {{"map", pipeline.map().bytes()}};
  view_.on_numbers(numbers);
}

void LaserRunView::show_end(const MultiVolumeGrid& map, const LaserSummary& summary) {
  show_path(summary.trajectory);
  show_grid(view_, map, {}, params_, is_planar(map));
  view_.on_end(summary.verdict);
}

}  // namespace hm
