#include "hm/pipeline/laser/laser_pipeline.hpp"

#include <cmath>

#include "hm/core/check.hpp"
#include "hm/pipeline/laser/laser_pipeline_state.hpp"

namespace hm {

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

LaserPipeline::LaserPipeline(const LaserParameters& params, LaserPlatform platform,
                             const OccupancyGrid2D* saved_map) {
  HM_CHECK(!platform.rigs.empty(), "a platform without a laser");
  state_ = std::make_unique<State>(params, std::move(platform), saved_map);
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

void LaserPipeline::add_scan(LaserScan scan, std::size_t laser) {
  HM_CHECK(laser < state_->platform.rigs.size(), "laser {} of {}", laser, state_->platform.rigs.size());
  if (!uses(laser)) return;
  const Time end = end_of(scan);
  if (!state_->newest_input || end > *state_->newest_input) state_->newest_input = end;
  state_->waiting.push_back({std::move(scan), laser});
  state_->process_waiting(false);
}

void LaserPipeline::finish() {
  state_->process_waiting(true);
  state_->map_frame.finish();
}
std::vector<LaserStep> LaserPipeline::take_steps() { return std::exchange(state_->steps, {}); }
bool LaserPipeline::matches_scans() const { return state_->matches_scans; }
bool LaserPipeline::uses(std::size_t laser) const { return !state_->matches_scans || laser == 0; }
const MultiVolumeGrid& LaserPipeline::map() const { return state_->grid; }
const LaserMapFrame& LaserPipeline::map_frame() const { return state_->map_frame; }
std::vector<FloorLevel> LaserPipeline::floors() const {
  return state_->rig().down ? state_->floor.profile() : std::vector<FloorLevel>{};
}

}  // namespace hm
