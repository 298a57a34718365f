#include "hm/pipeline/flight/page/flight_view.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "hm/flight/flight_text.hpp"
#include "hm/pipeline/flight/ground_station.hpp"
#include "hm/pipeline/flight/page/page_pilot.hpp"
#include "hm/pipeline/flight/script_pilot.hpp"
#include "hm/pipeline/laser/run/laser_run_view.hpp"

namespace hm {
namespace {

constexpr Duration kShownPeriod{20'000'000}, kNumbersPeriod{250'000'000};
/// To each side of the direction of flight, obstacles are shown that brake the vehicle.
constexpr double kBrakingSide_rad = 0.3;

/// 1 sigma of the estimated position; 0: unknown.
double sigma_of(const BasicVehicleState<float>& estimate) {
  const float variance = estimate.planar_covariance.trace() + estimate.height_variance;
  return variance > 0 ? std::sqrt(static_cast<double>(variance)) : 0;
}

/// Where the vehicle would touch something, about its direction of flight.
std::vector<Eigen::Vector3f> points_ahead(const FreeDistances& free, const BasicVehicleState<float>& state) {
  const auto yaw_rad = static_cast<double>(state.roll_pitch_yaw_rad.z());
  const double course_rad =
      std::atan2(static_cast<double>(state.velocity_m_s.y()), static_cast<double>(state.velocity_m_s.x()));
  constexpr double kSector_rad = 2 * std::numbers::pi / FreeDistances::kDirections;
  std::vector<Eigen::Vector3f> points;
  for (double side_rad = -kBrakingSide_rad; side_rad <= kBrakingSide_rad; side_rad += kSector_rad) {
    const double angle_rad = course_rad + side_rad;
    const auto free_m = free.towards(angle_rad - yaw_rad);
    if (!free_m) continue;
    const Vec3 way = *free_m * Vec3(std::cos(angle_rad), std::sin(angle_rad), 0);
    points.emplace_back(Eigen::Vector3f(state.position_m.x(), state.position_m.y(), state.position_m.z()) +
                        way.cast<float>());
  }
  return points;
}

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
  stages_ms_ = {{"project", step.project_ms},
                {"match", step.match_ms},
                {"loops", step.map_frame.ms},
                {"insert", step.insert_ms}};
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

void FlightView::on_obstacles(const Received<ObstacleMessage>& obstacles) {
  obstacles_ = obstacles.measured;
  next_.on_obstacles(obstacles);
}

LiveVehicle FlightView::vehicle(const FlightMoment& moment) const {
  const LinkState state = link_state(estimate_in_map(moment));
  LiveVehicle vehicle;
  vehicle.stamp = moment.stamp;
  vehicle.T_map_base = state.T_odom_base;
  vehicle.sigma_m = sigma_of(moment.estimate);
  // `odom` and `map` both begin at the start: what loops correct is the estimate.
  vehicle.true_position_m = moment.T_odom_base.translation();
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

/// From the moment when they brake the vehicle until it does something else than hold before them. That
/// moment may be a single step.
void FlightView::note_obstacles(const FlightMoment& moment) {
  const bool brakes = moment.autopilot.safety.has(FailSafe::kObstacleAhead);
  if (brakes && obstacles_) {
    view_->on_scan(LiveScan::kObstacles, moment.stamp,
                   points_ahead(obstacles_->free, estimate_in_map(moment)));
    obstacles_.reset();
    obstacles_shown_ = true;
  }
  if (brakes || !obstacles_shown_ || moment.autopilot.phase == FlightPhase::kHold) return;
  view_->on_scan(LiveScan::kObstacles, moment.stamp, {});
  obstacles_shown_ = false;
}

void FlightView::show_numbers(const FlightRun& run) {
  const Time now = run.now();
  const double since_s = numbers_at_ ? (now - *numbers_at_).seconds() : 0;
  if (!is_due(numbers_at_, kNumbersPeriod, now)) return;
  std::vector<StageCounts> counts = run.counts();
  std::vector<std::string> dropped;
  for (const StageCounts& stage : counts) dropped.push_back(stage.stage + " dropped");
  LiveNumbers numbers{"flying", static_cast<std::size_t>(run.elapsed().seconds()), 0, stages_ms_, {}, {}, {}};
  for (std::size_t i = 0; i < counts.size(); ++i) {
    numbers.counts.emplace_back(dropped[i], static_cast<double>(counts[i].dropped));
    if (since_s > 0 && i < counts_then_.size())
      numbers.rates_hz.emplace_back(counts[i].stage,
                                    static_cast<double>(counts[i].in - counts_then_[i].in) / since_s);
  }
  numbers.memory = {{"map", static_cast<double>(run.perception().map().bytes())}};
  view_->on_numbers(numbers);
  counts_then_ = std::move(counts);
}

void FlightView::show_way_points(std::span<const OrderRecord> orders) {
  if (!view_ || orders.size() == orders_shown_) return;
  orders_shown_ = orders.size();
  std::vector<Vec3> places;
  for (const OrderRecord& record : orders)
    if (record.order.kind == FlightOrder::Kind::kGoTo) places.push_back(record.order.position_m);
  view_->on_path(LivePath::kWayPoints, places);
}

void FlightView::step(const FlightRun& run) {
  const FlightMoment& moment = run.moment();
  note_pilot(moment);
  if (!view_) return;
  note_obstacles(moment);
  if (!is_due(shown_at_, kShownPeriod, moment.stamp)) return;
  if (!moment.estimate.planar_ready || !moment.estimate.height_ready) return;
  const LiveVehicle now = vehicle(moment);
  view_->on_vehicle(now);
  show_numbers(run);
  if (scan_) {
    show_scan(*view_, *scan_, now.T_map_base * run.rig().T_base_laser);
    scan_.reset();
    show_grid(*view_, run.perception().map(), moment.T_map_odom, params_, false);
  }
}

}  // namespace hm
