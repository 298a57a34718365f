#include "hm/pipeline/laser/laser_mapper.hpp"

#include <algorithm>
#include <deque>
#include <utility>

#include "hm/pipeline/common/parameters.hpp"
#include "hm/pipeline/laser/laser_params.hpp"
#include "hm/pipeline/laser/laser_pipeline.hpp"

namespace hm {
namespace {

/// A scan that is in the map, for the map of the corrected poses.
struct InsertedScan {
  LaserScan scan;
  std::size_t laser = 0;
  Time stamp;
  SE3 T_odom_base;
  std::vector<SweepKnot> sweep;
};

LaserPose pose_of(const LaserStep& step) {
  LaserPose pose{step.stamp, step.laser, step.reason, step.T_odom_base, {}, {}, step.velocity_base};
  if (step.T_odom_base) pose.T_map_base = step.map_frame.T_map_odom.to_se3() * *step.T_odom_base;
  if (step.height && step.height->status == HeightStatus::kOk) pose.height_m = step.height->height_m;
  return pose;
}

}  // namespace

struct LaserMapper::Impl {
  Impl(const LaserParameters& all, const LaserPlatform& platform, const OccupancyGrid2D* saved_map)
      : parameters(all),
        rigs(platform.rigs),
        pipeline(all, platform, saved_map, LoopThread::kOwn),
        keeps_scans(pipeline.map_frame().source() != MapFrameSource::kOdometry) {}

  LaserParameters parameters;
  std::vector<LaserRig> rigs;
  LaserPipeline pipeline;
  bool keeps_scans;                            ///< `map` may become another frame than `odom`
  std::vector<std::deque<LaserScan>> waiting;  ///< of each laser, until their steps come
  std::vector<InsertedScan> mapped;
  Trajectory T_odom_base;
  std::vector<LaserPose> poses;

  void collect();
  void keep(LaserStep& step);
};

LaserMapper::LaserMapper(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
LaserMapper::~LaserMapper() = default;
LaserMapper::LaserMapper(LaserMapper&&) noexcept = default;
LaserMapper& LaserMapper::operator=(LaserMapper&&) noexcept = default;

Result<LaserMapper> LaserMapper::create(LaserPlatform platform, const std::vector<std::string>& settings,
                                        const OccupancyGrid2D* saved_map) {
  if (platform.rigs.empty()) return fail(ErrorCode::kUsage, "platform", "it has no laser");
  LaserRunParameters parameters;
  if (const auto set = apply_settings(list_laser(parameters), settings); !set) return forward_error(set);
  if (const auto checked = check_parameters(parameters); !checked) return forward_error(checked);
  auto impl = std::make_unique<Impl>(parameters.laser, platform, saved_map);
  impl->waiting.resize(platform.rigs.size());
  return LaserMapper(std::move(impl));
}

/// Takes the scan of a step from those that wait, and keeps it if the step brought it into the map.
void LaserMapper::Impl::keep(LaserStep& step) {
  std::deque<LaserScan>& scans = waiting[step.laser];
  while (!scans.empty() && scans.front().stamp != step.scan_stamp) scans.pop_front();
  if (scans.empty()) return;
  if (step.T_odom_base && !step.sweep.empty())
    mapped.push_back(
        {std::move(scans.front()), step.laser, step.stamp, *step.T_odom_base, std::move(step.sweep)});
  scans.pop_front();
}

void LaserMapper::Impl::collect() {
  for (LaserStep& step : pipeline.take_steps()) {
    poses.push_back(pose_of(step));
    if (step.T_odom_base && (T_odom_base.empty() || step.stamp > T_odom_base.back().stamp))
      T_odom_base.push_back({step.stamp, *step.T_odom_base});
    if (keeps_scans) keep(step);
  }
}

void LaserMapper::add_imu(const ImuSample& sample) {
  impl_->pipeline.add_imu(sample);
  impl_->collect();
}

void LaserMapper::add_odometry(const StampedPose& T_odom_base) {
  impl_->pipeline.add_odometry(T_odom_base);
  impl_->collect();
}

void LaserMapper::add_range(const RangeReading& reading) { impl_->pipeline.add_range(reading); }

void LaserMapper::add_scan(LaserScan scan, std::size_t laser) {
  if (impl_->keeps_scans && impl_->pipeline.uses(laser)) impl_->waiting[laser].push_back(scan);
  impl_->pipeline.add_scan(std::move(scan), laser);
  impl_->collect();
}

void LaserMapper::finish() {
  impl_->pipeline.finish();
  impl_->collect();
}

std::vector<LaserPose> LaserMapper::take_poses() { return std::exchange(impl_->poses, {}); }

Trajectory LaserMapper::trajectory() const {
  return impl_->pipeline.map_frame().corrected(impl_->T_odom_base);
}

bool LaserMapper::corrects() const { return impl_->pipeline.map_frame().corrects(); }
const MultiVolumeGrid& LaserMapper::map() const { return impl_->pipeline.map(); }

MultiVolumeGrid LaserMapper::corrected_map() const {
  if (!impl_->keeps_scans) return MultiVolumeGrid::parse(map().serialise()).value();
  MultiVolumeGrid grid(impl_->parameters.mvog);
  SweepPoints points(impl_->parameters.run.clear_without_return_m);
  for (const InsertedScan& scan : impl_->mapped) {
    const SE2 T_map_odom =
        impl_->pipeline.map_frame().T_map_odom_at(scan.stamp, SE2::from_se3(scan.T_odom_base));
    points.compute_again(scan.scan, impl_->rigs[scan.laser], scan.sweep, T_map_odom.to_se3());
    grid.insert(points.beam_scan());
  }
  return grid;
}

}  // namespace hm
