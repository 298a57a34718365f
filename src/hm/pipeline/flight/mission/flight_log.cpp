#include "hm/pipeline/flight/mission/flight_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "hm/flight/flight_text.hpp"
#include "hm/geometry/se2.hpp"

namespace hm {
namespace {

constexpr std::size_t kSamplePeriod = 20;   ///< steps
constexpr std::size_t kSettleSteps = 3000;  ///< of a wait, before it counts as hovering
constexpr std::size_t kMostEvents = 2000;   ///< of a flight that goes wrong again and again
constexpr double kFar_m = std::numeric_limits<double>::infinity();

double yaw_of(const Mat3& rotation) { return std::atan2(rotation(1, 0), rotation(0, 0)); }

std::string_view name_of(FaultKind kind) { return kFaultNames[static_cast<std::size_t>(kind)]; }

std::string outcome_text(const OrderRecord& record) {
  std::string text = fmt::format("'{}' {}", record.order.text, to_string(record.outcome));
  return record.reason.empty() ? text : text + ": " + record.reason;
}

}  // namespace

FlightMotion true_motion(const FlightMoment& moment) {
  const Mat3 R_odom_world = moment.T_odom_base.rotation() * moment.truth.T_world_base.rotation().transpose();
  return {moment.T_odom_base.translation(), R_odom_world * moment.truth.velocity_world_m_s,
          yaw_of(moment.T_odom_base.rotation())};
}

FlightMotion estimated_motion(const FlightMoment& moment) {
  const BasicVehicleState<float> estimate = estimate_in_map(moment);
  FlightMotion motion{estimate.position_m.cast<double>(), estimate.velocity_m_s.cast<double>(),
                      static_cast<double>(estimate.roll_pitch_yaw_rad.z())};
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  if (!moment.estimate.planar_ready) {
    motion.position_m.head<2>().fill(kUnknown);
    motion.velocity_m_s.head<2>().fill(kUnknown);
    motion.yaw_rad = kUnknown;
  }
  if (!moment.estimate.height_ready) motion.position_m.z() = motion.velocity_m_s.z() = kUnknown;
  return motion;
}

PilotView pilot_view(const FlightMoment& moment, std::uint8_t identity) {
  PilotView view;
  view.now = moment.stamp;
  view.state = moment.autopilot.state;
  view.phase = moment.autopilot.phase;
  if (moment.autopilot.safety.action != SafetyAction::kNone) view.reason = moment.autopilot.safety.reason;
  const BasicVehicleState<float> estimate = estimate_in_map(moment);
  view.T_map_odom = moment.T_map_odom;
  view.position_m = estimate.position_m;
  view.velocity_m_s = estimate.velocity_m_s;
  view.yaw_rad = estimate.roll_pitch_yaw_rad.z();
  if (moment.answer && moment.answer->command.pilot == identity) {
    view.answered = moment.answer->command.kind;
    view.refusal = moment.answer->refusal;
  }
  return view;
}

void FlightLog::add(const FlightRun& run, const ScriptPilot& pilot) {
  const FlightMoment& moment = run.moment();
  now_s_ = run.elapsed().seconds();
  const bool room = events_.size() < kMostEvents;
  if (room) note_faults();
  note_state(moment);
  note_fail_safes(moment);
  note_collisions(run);
  note_texts(run.core());
  note_orders(pilot);
  follow_goal(moment);
  measure(moment, pilot);
  ++steps_;
}

/// Logs the texts of another autopilot, as why it does not arm.
void FlightLog::note_texts(const FlightCore& core) {
  for (const CoreText& said : core.texts().subspan(texts_))
    if (events_.size() < kMostEvents) note(now_s_, "autopilot: " + said.text);
  texts_ = core.texts().size();
}

void FlightLog::note_state(const FlightMoment& moment) {
  const AutopilotOutputs& out = moment.autopilot;
  const bool room = events_.size() < kMostEvents;
  if (out.state != state_ && room) note(now_s_, std::string(text_of(out.state)));
  if (out.phase != phase_ && out.phase != FlightPhase::kGround && room)
    note(now_s_, fmt::format("phase: {}", text_of(out.phase)));
  state_ = out.state;
  phase_ = out.phase;
  if (moment.answer && moment.answer->refusal != Refusal::kNone) {
    ++refusals_;
    if (room) note(now_s_, fmt::format("command refused: {}", text_of(moment.answer->refusal)));
  }
}

void FlightLog::note_fail_safes(const FlightMoment& moment) {
  const SafetyVerdict& verdict = moment.autopilot.safety;
  if (verdict.active == active_) return;
  for (std::size_t i = 0; i < kFailSafeCount; ++i) {
    const auto which = static_cast<FailSafe>(i);
    const bool was = (active_ >> i & 1U) != 0, is = verdict.has(which);
    if (was == is) continue;
    if (is && fail_safes_.size() < kMostEvents) {
      fail_safes_.push_back({which, action_of(which), now_s_, {}});
      const std::optional<float>& turned_rad = moment.autopilot.tilt_mismatch_rad;
      if (which == FailSafe::kTiltMismatch && turned_rad)
        fail_safes_.back().angle_rad = static_cast<double>(*turned_rad);
      note(now_s_, "fail-safe: " + fail_safe_text(which, moment.autopilot));
    }
    const auto open = std::find_if(fail_safes_.rbegin(), fail_safes_.rend(), [&](const auto& episode) {
      return episode.which == which && !episode.end_s;
    });
    if (!is && open != fail_safes_.rend()) open->end_s = now_s_;
  }
  active_ = verdict.active;
}

void FlightLog::note_faults() {
  fault_active_.resize(faults_.all().size(), false);
  for (std::size_t i = 0; i < fault_active_.size(); ++i) {
    const ScriptedFault& fault = faults_.all()[i];
    const bool active = now_s_ >= fault.at.seconds() && now_s_ < (fault.at + fault.duration).seconds();
    if (active != fault_active_[i])
      note(now_s_, fmt::format("fault {} {}", name_of(fault.kind), active ? "begins" : "ends"));
    fault_active_[i] = active;
  }
}

void FlightLog::note_collisions(const FlightRun& run) {
  for (; collisions_ < run.collisions().size(); ++collisions_) {
    const VehicleCollision& hit = run.collisions()[collisions_];
    if (collisions_ < kMostEvents)
      note(now_s_,
           fmt::format("collision at {:.2f} m/s, ({:.2f}, {:.2f}, {:.2f}) in the world", hit.speed_m_s,
                       hit.position_world.x(), hit.position_world.y(), hit.position_world.z()));
  }
}

void FlightLog::note_orders(const ScriptPilot& pilot) {
  const auto records = pilot.records();
  for (; orders_begun_ < records.size() && records[orders_begun_].outcome != OrderOutcome::kWaiting;
       ++orders_begun_) {
    const OrderRecord& record = records[orders_begun_];
    if (record.order.kind != FlightOrder::Kind::kGoTo || record.outcome == OrderOutcome::kSkipped) continue;
    way_points_.push_back({orders_begun_, record.order.position_m, false, kFar_m, now_s_, {}});
  }
  for (; orders_ended_ < orders_begun_ && records[orders_ended_].outcome != OrderOutcome::kRunning;
       ++orders_ended_) {
    const OrderRecord& record = records[orders_ended_];
    note(now_s_, outcome_text(record));
    const auto leg = std::ranges::find(way_points_, orders_ended_, &WayPointRecord::order);
    if (leg == way_points_.end()) continue;
    leg->reached = record.outcome == OrderOutcome::kDone;
    leg->end_s = now_s_;
  }
}

/// The goal of the position mode follows from the commands that the core accepts.
void FlightLog::follow_goal(const FlightMoment& moment) {
  if (phase_ != FlightPhase::kPosition && phase_ != FlightPhase::kTakeOff) {
    goal_m_.reset();
    goal_yaw_rad_.reset();
  }
  if (!moment.answer || moment.answer->refusal != Refusal::kNone) return;
  const FlightCommand& command = moment.answer->command;
  if (command.kind == CommandKind::kGoTo) {
    goal_m_ = command.position_m.cast<double>();
    goal_m_->head<2>() = moment.T_map_odom * Vec2(goal_m_->head<2>());
    goal_yaw_rad_ = wrap_angle(static_cast<double>(command.yaw_rad) + moment.T_map_odom.angle());
  }
  if (command.kind == CommandKind::kTakeOff) {
    const FlightMotion estimate = estimated_motion(moment);
    const auto asked_m = static_cast<double>(command.position_m.z());
    goal_m_ = estimate.position_m + Vec3(0, 0, asked_m > 0 ? asked_m : takeoff_height_m_);
    goal_yaw_rad_ = estimate.yaw_rad;
  }
}

void FlightLog::measure(const FlightMoment& moment, const ScriptPilot& pilot) {
  const FlightMotion truth = true_motion(moment);
  const double tilt_rad = std::acos(std::clamp(moment.T_odom_base.rotation()(2, 2), -1.0, 1.0));
  if (in_air(state_)) {
    ++air_steps_;
    max_speed_m_s_ = std::max(max_speed_m_s_, truth.velocity_m_s.norm());
    max_tilt_rad_ = std::max(max_tilt_rad_, tilt_rad);
  }
  if (!way_points_.empty() && !way_points_.back().end_s) {
    WayPointRecord& way_point = way_points_.back();
    way_point.nearest_m = std::min(way_point.nearest_m, (truth.position_m - way_point.goal_m).norm());
  }
  const OrderRecord* order = pilot.current();
  measure_hover(truth.position_m, order && order->order.kind == FlightOrder::Kind::kWait);
  if (steps_ % kSamplePeriod != 0) return;
  const FlightMotion estimate = estimated_motion(moment);
  if (in_air(state_)) {
    const double error_m = (truth.position_m - estimate.position_m).norm();
    if (std::isfinite(error_m)) estimate_error_m_.add(error_m);
    if (last_m_) path_m_ += (truth.position_m - *last_m_).norm();
  }
  last_m_ = truth.position_m;
  samples_.push_back({now_s_, truth, estimate, goal_m_, goal_yaw_rad_, tilt_rad, moment.battery_ratio});
}

void FlightLog::measure_hover(const Vec3& true_m, bool waits) {
  if (!waits || !goal_m_ || phase_ != FlightPhase::kPosition) {
    wait_steps_ = 0;
    return;
  }
  if (++wait_steps_ <= kSettleSteps) return;
  const Vec3 off = true_m - *goal_m_;
  hover_xy_m_ = std::max(hover_xy_m_, off.head<2>().norm());
  hover_z_m_ = std::max(hover_z_m_, std::abs(off.z()));
  hover_squares_m2_ += off.squaredNorm();
  ++hover_steps_;
}

std::optional<HoverError> FlightLog::hover() const {
  if (hover_steps_ == 0) return {};
  const auto steps = static_cast<double>(hover_steps_);
  return HoverError{hover_xy_m_, hover_z_m_, std::sqrt(hover_squares_m2_ / steps), steps * 1e-3};
}

}  // namespace hm
