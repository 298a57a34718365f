#include "hm/pipeline/flight/page/flight_view.hpp"

#include <fmt/format.h>

#include "hm/flight/flight_text.hpp"
#include "hm/pipeline/flight/ground_station.hpp"
#include "hm/pipeline/flight/page/page_pilot.hpp"
#include "hm/pipeline/flight/script_pilot.hpp"
#include "hm/pipeline/laser/run/laser_run_view.hpp"

namespace hm {
namespace {

constexpr Duration kShownPeriod{20'000'000};

std::string name_of_pilot(std::uint8_t pilot) {
  switch (pilot) {
    case 0:
      return {};
    case ScriptPilot::kPilot:
      return "script";
    case GroundStation::kPilot:
      return "ground station";
    case PagePilot::kPilot:
      return "page";
    default:
      return fmt::format("pilot {}", pilot);
  }
}

}  // namespace

void FlightView::on_scan(const Received<LaserScan>& scan) {
  if (view_) {
    scan_ = scan.measured;
    scan_at_ = scan.at;
  }
  next_.on_scan(scan);
}

void FlightView::on_imu(const Received<ImuSample>& sample) {
  imu_at_ = sample.at;
  next_.on_imu(sample);
}

void FlightView::on_laser_step(const LaserStep& step) {
  if (step.height && step.height->status == HeightStatus::kOk) {
    height_m_ = step.height->height_m;
    floor_m_ = step.height->floor_level_m;
  }
  next_.on_laser_step(step);
}

void FlightView::on_pose(const Received<PoseMessage>& pose) {
  pose_at_ = pose.at;
  next_.on_pose(pose);
}

void FlightView::on_height(const Received<HeightMessage>& height) {
  height_at_ = height.at;
  next_.on_height(height);
}

LiveVehicle FlightView::vehicle(const FlightMoment& moment) const {
  const LinkState state = link_state(estimate_in_map(moment));
  LiveVehicle vehicle;
  vehicle.stamp = moment.stamp;
  vehicle.T_map_base = state.T_odom_base;
  vehicle.velocity_m_s = state.velocity_body;
  vehicle.height_m = height_m_;
  vehicle.floor_m = floor_m_;
  const AutopilotOutputs& out = moment.autopilot;
  vehicle.state = text_of(out.state);
  vehicle.phase = text_of(out.phase);
  vehicle.pilot = name_of_pilot(pilot_);
  vehicle.armed = out.state == AutopilotState::kIdle || in_air(out.state);
  vehicle.battery_ratio = moment.battery_ratio;
  if (out.safety.action != SafetyAction::kNone) vehicle.fail_safes = {fail_safe_text(out.safety.reason, out)};
  const auto age = [&](std::string_view name, const std::optional<Time>& at) {
    if (at) vehicle.links_s.emplace_back(name, (moment.stamp - *at).seconds());
  };
  age("laser", scan_at_);
  age("imu", imu_at_);
  age("pose", pose_at_);
  age("height", height_at_);
  return vehicle;
}

/// As the core's gate does: whoever's command counts has control, until it is given up.
void FlightView::note_pilot(const FlightMoment& moment) {
  if (!moment.answer || moment.answer->refusal != Refusal::kNone) return;
  const FlightCommand& command = moment.answer->command;
  if (command.kind == CommandKind::kEStop) return;
  pilot_ = command.kind == CommandKind::kRelease ? std::uint8_t{0} : command.pilot;
}

void FlightView::step(const FlightRun& run) {
  const FlightMoment& moment = run.moment();
  note_pilot(moment);
  if (!view_ || !is_due(shown_at_, kShownPeriod, moment.stamp)) return;
  if (!moment.estimate.planar_ready || !moment.estimate.height_ready) return;
  const LiveVehicle now = vehicle(moment);
  view_->on_vehicle(now);
  if (scan_) {
    show_scan(*view_, *scan_, now.T_map_base * run.rig().T_base_laser);
    scan_.reset();
    show_grid(*view_, run.perception().map(), moment.T_map_odom, params_, false);
  }
}

}  // namespace hm
