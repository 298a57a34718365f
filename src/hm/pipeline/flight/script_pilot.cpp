#include "hm/pipeline/flight/script_pilot.hpp"

#include <fmt/format.h>

#include <cmath>

#include "hm/flight/flight_text.hpp"
#include "hm/geometry/float/float_math.hpp"
#include "hm/pipeline/flight/flight_messages.hpp"

namespace hm {
namespace {
/// A slower vehicle has come to rest: it would stop within 5 mm.
constexpr double kArrivalSpeed_m_s = 0.15;
/// Error of the heading at which a way point is reached: 6 degrees.
constexpr double kArrivalYaw_rad = 0.1;

using Kind = FlightOrder::Kind;

constexpr double kRepeat_s = 0.2;      ///< of commands that were not carried out yet
constexpr double kToggleRepeat_s = 1;  ///< of those that a second one would undo
constexpr double kVelocityPeriod_s = 0.05;
constexpr double kSignOfLife_s = 0.5;

/// Why an order that needs a flying vehicle cannot go on.
std::string not_flying(const PilotView& view) {
  const std::string state(text_of(view.state));
  return view.reason ? fmt::format("the vehicle is {}: {}", state, text_of(*view.reason))
                     : fmt::format("the vehicle is {}", state);
}

/// Where a step from here leads to, in `map`.
Vec3 end_of_step(const FlightOrder& order, const PilotView& view) {
  const Eigen::AngleAxisd turn(static_cast<double>(view.yaw_rad), Vec3::UnitZ());
  return view.position_m.cast<double>() + turn * order.position_m;
}

bool is_hopeless(Refusal refusal) {
  return refusal == Refusal::kOutOfRange || refusal == Refusal::kNotANumber;
}

}  // namespace

std::string_view to_string(OrderOutcome outcome) {
  switch (outcome) {
    case OrderOutcome::kWaiting:
      return "waiting";
    case OrderOutcome::kRunning:
      return "running";
    case OrderOutcome::kDone:
      return "done";
    case OrderOutcome::kMissed:
      return "missed";
    case OrderOutcome::kSkipped:
      return "skipped";
  }
  return "unknown";
}

ScriptPilot::ScriptPilot(const PilotParams& params, std::uint8_t identity)
    : params_(params), identity_(identity) {}

void ScriptPilot::add(const FlightOrder& order) {
  if (closed_) return;
  records_.push_back({order, OrderOutcome::kWaiting, {}, {}, 0, {}});
  has_yielded_ = false;
}

void ScriptPilot::interrupt(const FlightOrder& order) {
  if (closed_) return;
  skip_rest("interrupted", last_stamp_.value_or(Time{}));
  add(order);
}

void ScriptPilot::land_now(const std::string& reason) {
  closed_ = true;
  stop_reason_ = reason;
  has_yielded_ = false;
}

const OrderRecord* ScriptPilot::current() const {
  const bool runs = next_ < records_.size() && record().outcome == OrderOutcome::kRunning;
  return runs ? &record() : nullptr;
}

FlightCommand ScriptPilot::command_of(CommandKind kind) const {
  FlightCommand command;
  command.kind = kind;
  return command;
}

std::optional<FlightCommand> ScriptPilot::step(const PilotView& view) {
  if (released_ || (last_stamp_ && view.now <= *last_stamp_)) return {};
  note_answer(view);
  if (stop_reason_ && !ends_) skip_rest(*stop_reason_, view.now);
  stop_reason_.reset();
  if (has_yielded_) {
    skip_rest("another pilot has taken control", view.now);
    const bool rests = view.state == AutopilotState::kOff || view.state == AutopilotState::kError;
    released_ = closed_ && rests;
    return {};
  }
  if (!in_control_ && !closed_ && next_ == records_.size()) return {};  // nothing to do
  std::optional<FlightCommand> command;
  if (in_control_) {
    command = fly(view);
  } else {
    command = command_of(CommandKind::kTakeOver);
    in_control_ = true;
  }
  const bool silent = last_stamp_ && (view.now - *last_stamp_).seconds() >= kSignOfLife_s;
  if (!command && silent) command = command_of(CommandKind::kSignOfLife);
  if (!command) return {};
  command->stamp = view.now;
  command->pilot = identity_;
  last_stamp_ = view.now;
  return command;
}

void ScriptPilot::note_answer(const PilotView& view) {
  if (!view.answered) return;
  if (view.refusal == Refusal::kOtherPilot) {
    in_control_ = false;
    has_yielded_ = true;
  }
  if (*view.answered != sent_) return;  // of an order before
  if (view.refusal != Refusal::kNone) refusal_ = view.refusal;
  const bool place = *view.answered == CommandKind::kGoTo || *view.answered == CommandKind::kPositionStep;
  if (place) accepted_ = view.refusal == Refusal::kNone;
}

std::optional<FlightCommand> ScriptPilot::fly(const PilotView& view) {
  if (next_ < records_.size() && view.state == AutopilotState::kError && record().order.kind != Kind::kEStop)
    skip_rest("an error is latched", view.now);
  if (next_ == records_.size()) return closed_ ? end_flight(view) : std::nullopt;
  if (record().outcome == OrderOutcome::kWaiting) begin(view);
  return carry_out(view);
}

std::optional<FlightCommand> ScriptPilot::carry_out(const PilotView& view) {
  switch (record().order.kind) {
    case Kind::kTakeOff:
      return take_off(view);
    case Kind::kGoTo:
      return go_to(view);
    case Kind::kStep:
      return go_step(view);
    case Kind::kVelocity:
      return fly_velocity(view);
    case Kind::kWait:
      if (running_s(view) >= record().order.duration.seconds()) finish(view, OrderOutcome::kDone);
      return {};
    case Kind::kHold:
      return hold(view);
    case Kind::kReturn:
      return return_home(view);
    case Kind::kLand:
      return land(view);
    case Kind::kEStop:
      break;
  }
  if (view.state == AutopilotState::kError) {
    finish(view, OrderOutcome::kDone);
    return {};
  }
  return again(command_of(CommandKind::kEStop), view, kRepeat_s);
}

void ScriptPilot::begin(const PilotView& view) {
  OrderRecord& now = record();
  now.outcome = OrderOutcome::kRunning;
  now.begin = view.now;
  sent_.reset();
  since_.reset();
  accepted_ = false;
  refusal_ = Refusal::kNone;
  const auto turn_rad = static_cast<float>(now.order.yaw_rad.value_or(0));
  goal_yaw_rad_ = view.yaw_rad;
  double leg_m = now.order.height_m;
  if (now.order.kind == Kind::kGoTo) {
    goal_m_ = now.order.position_m;
    leg_m = (goal_m_ - view.position_m.cast<double>()).norm();
    if (now.order.yaw_rad) goal_yaw_rad_ = wrap_angle_f(turn_rad);
  } else if (now.order.kind == Kind::kStep) {
    goal_m_ = end_of_step(now.order, view);
    leg_m = now.order.position_m.norm();
    goal_yaw_rad_ = wrap_angle_f(view.yaw_rad + turn_rad);
  }
  time_limit_s_ = leg_m / params_.leg_speed_m_s + PilotParams::kSpare_s;
}

void ScriptPilot::finish(const PilotView& view, OrderOutcome outcome, std::string reason) {
  OrderRecord& now = record();
  now.outcome = outcome;
  now.end = view.now;
  now.reason = std::move(reason);
  if (now.order.kind == Kind::kGoTo || now.order.kind == Kind::kStep)
    now.distance_m = (goal_m_ - view.position_m.cast<double>()).norm();
  ++next_;
}

void ScriptPilot::skip_rest(const std::string& reason, Time now) {
  for (; next_ < records_.size(); ++next_) {
    OrderRecord& skipped = record();
    if (skipped.outcome == OrderOutcome::kWaiting) skipped.begin = now;
    skipped.outcome = OrderOutcome::kSkipped;
    skipped.end = now;
    skipped.reason = reason;
  }
}

std::optional<FlightCommand> ScriptPilot::again(const FlightCommand& command, const PilotView& view,
                                                double period_s) {
  if (sent_ == command.kind && (view.now - sent_at_).seconds() < period_s) return {};
  sent_ = command.kind;
  sent_at_ = view.now;
  return command;
}

std::optional<FlightCommand> ScriptPilot::take_off(const PilotView& view) {
  const bool climbs = view.phase == FlightPhase::kTakeOff;
  if (view.state == AutopilotState::kFlying && !climbs) {
    const bool took_off = sent_ == CommandKind::kTakeOff;
    finish(view, took_off ? OrderOutcome::kDone : OrderOutcome::kMissed, took_off ? "" : "it flies already");
    return {};
  }
  if (view.state == AutopilotState::kLanding) {
    miss(view, not_flying(view));
    return {};
  }
  if (running_s(view) > (climbs ? time_limit_s_ + params_.ready_s : params_.ready_s)) {
    const std::string reason = climbs ? "not at the height after its time"
                                      : fmt::format("no take-off in {:g} s{}{}", params_.ready_s,
                                                    refusal_ == Refusal::kNone ? "" : ": ",
                                                    refusal_ == Refusal::kNone ? "" : text_of(refusal_));
    miss(view, reason);
    if (!climbs) skip_rest("the vehicle did not take off", view.now);
    return {};
  }
  if (view.state == AutopilotState::kOff)
    return again(command_of(CommandKind::kToggleEngage), view, kToggleRepeat_s);
  if (view.state != AutopilotState::kIdle) return {};
  FlightCommand command = command_of(CommandKind::kTakeOff);
  command.position_m.z() = static_cast<float>(record().order.height_m);
  return again(command, view, kRepeat_s);
}

bool ScriptPilot::is_there(const PilotView& view) const {
  const double distance_m = (goal_m_ - view.position_m.cast<double>()).norm();
  if (distance_m > params_.arrival_m) return false;
  const bool passes = record().order.kind == Kind::kGoTo && next_ + 1 < records_.size() &&
                      records_[next_ + 1].order.kind == Kind::kGoTo;
  if (passes) return true;
  const float turn = wrap_angle_f(view.yaw_rad - goal_yaw_rad_);
  return view.velocity_m_s.norm() <= kArrivalSpeed_m_s && std::abs(turn) <= kArrivalYaw_rad;
}

bool ScriptPilot::gives_up(const PilotView& view) {
  if (view.state != AutopilotState::kFlying)
    miss(view, not_flying(view));
  else if (is_hopeless(refusal_))
    miss(view, std::string(text_of(refusal_)));
  else if (running_s(view) > time_limit_s_)
    miss(view, fmt::format("not there after {:.0f} s", running_s(view)));
  else
    return false;
  return true;
}

std::optional<FlightCommand> ScriptPilot::go_to(const PilotView& view) {
  if (gives_up(view)) return {};
  const bool in_position = view.phase == FlightPhase::kPosition;
  const bool moved = is_goal_moved(record().order.position_m.head<2>(), T_map_odom_sent_, view.T_map_odom);
  if (accepted_ && in_position && !moved) {
    if (is_there(view)) finish(view, OrderOutcome::kDone);
    return {};
  }
  if (in_position || view.phase == FlightPhase::kHold) {
    accepted_ = false;
    T_map_odom_sent_ = view.T_map_odom;
    FlightCommand command = command_of(CommandKind::kGoTo);
    command.position_m = record().order.position_m.cast<float>();
    command.yaw_rad = goal_yaw_rad_;
    return again(command, view, kRepeat_s);
  }
  const bool by_pilot = view.phase == FlightPhase::kVelocity || view.phase == FlightPhase::kDirect ||
                        view.phase == FlightPhase::kPath;
  return by_pilot ? again(command_of(CommandKind::kHold), view, kRepeat_s) : std::nullopt;
}

/// First into position mode, in which the goal is where the vehicle is; then the step, which is not repeated
/// before its answer is overdue: two would be added.
std::optional<FlightCommand> ScriptPilot::go_step(const PilotView& view) {
  if (gives_up(view)) return {};
  const FlightOrder& order = record().order;
  if (accepted_) {
    if (is_there(view)) finish(view, OrderOutcome::kDone);
    return {};
  }
  const bool mode_answered = view.answered == CommandKind::kMode && view.refusal == Refusal::kNone;
  if (!since_ && mode_answered && sent_ == CommandKind::kMode) {
    since_ = view.now;
    goal_m_ = end_of_step(order, view);
  }
  if (!since_) {
    FlightCommand command = command_of(CommandKind::kMode);
    command.mode = FlightPhase::kPosition;
    return again(command, view, kRepeat_s);
  }
  FlightCommand command = command_of(CommandKind::kPositionStep);
  command.position_m = order.position_m.cast<float>();
  command.yaw_rad = static_cast<float>(order.yaw_rad.value_or(0));
  return again(command, view, kToggleRepeat_s);
}

std::optional<FlightCommand> ScriptPilot::fly_velocity(const PilotView& view) {
  const double duration_s = record().order.duration.seconds();
  if (view.state != AutopilotState::kFlying) {
    miss(view, not_flying(view));
    return {};
  }
  if (is_hopeless(refusal_)) {
    miss(view, std::string(text_of(refusal_)));
    return command_of(CommandKind::kHold);
  }
  if (!since_ && running_s(view) > PilotParams::kSpare_s) {
    miss(view, "velocities are not accepted");
    return {};
  }
  if (since_ && (view.now - *since_).seconds() >= duration_s) {
    finish(view, OrderOutcome::kDone);
    return command_of(CommandKind::kHold);
  }
  if (view.phase != FlightPhase::kVelocity) {
    FlightCommand command = command_of(CommandKind::kMode);
    command.mode = FlightPhase::kVelocity;
    return again(command, view, kRepeat_s);
  }
  if (!since_) since_ = view.now;
  FlightCommand command = command_of(CommandKind::kVelocity);
  command.velocity_m_s = record().order.velocity_m_s.cast<float>();
  command.yaw_rad = static_cast<float>(record().order.yaw_rate_rad_s);
  return again(command, view, kVelocityPeriod_s);
}

std::optional<FlightCommand> ScriptPilot::hold(const PilotView& view) {
  if (!in_air(view.state)) {
    miss(view, not_flying(view));
    return {};
  }
  const bool holds = view.phase == FlightPhase::kHold;
  if (holds && view.velocity_m_s.norm() <= kArrivalSpeed_m_s) {
    finish(view, OrderOutcome::kDone);
    return {};
  }
  if (running_s(view) > PilotParams::kSettle_s) {
    miss(view, fmt::format("not at rest after {:g} s", PilotParams::kSettle_s));
    return {};
  }
  return holds ? std::nullopt : again(command_of(CommandKind::kHold), view, kRepeat_s);
}

/// The autopilot lands by itself where it took off.
std::optional<FlightCommand> ScriptPilot::return_home(const PilotView& view) {
  constexpr double kLongestReturn_s = 600;
  if (view.state != AutopilotState::kFlying) return land(view);
  since_ = view.now;
  if (running_s(view) > kLongestReturn_s) {
    miss(view, fmt::format("not back after {:g} s", kLongestReturn_s));
    return {};
  }
  if (view.phase == FlightPhase::kReturn) return {};
  FlightCommand command = command_of(CommandKind::kMode);
  command.mode = FlightPhase::kReturn;
  return again(command, view, kRepeat_s);
}

std::optional<FlightCommand> ScriptPilot::land(const PilotView& view) {
  constexpr double kLongestLanding_s = 120;
  if (view.state == AutopilotState::kOff) {
    finish(view, OrderOutcome::kDone);
    return {};
  }
  if ((view.now - since_.value_or(record().begin)).seconds() > kLongestLanding_s) {
    miss(view, fmt::format("not on the ground after {:g} s", kLongestLanding_s));
    return {};
  }
  if (view.state == AutopilotState::kFlying) return again(command_of(CommandKind::kLand), view, kRepeat_s);
  if (view.state == AutopilotState::kIdle)
    return again(command_of(CommandKind::kToggleEngage), view, kToggleRepeat_s);
  return {};
}

/// Lands once, if that is still to be done, and then gives control up.
std::optional<FlightCommand> ScriptPilot::end_flight(const PilotView& view) {
  const bool rests = view.state == AutopilotState::kOff || view.state == AutopilotState::kError;
  if (!rests && !ends_) {
    ends_ = true;
    FlightOrder order;
    order.kind = Kind::kLand;
    order.text = "land";
    records_.push_back({order, OrderOutcome::kWaiting, {}, {}, 0, {}});
    return fly(view);
  }
  released_ = true;
  return command_of(CommandKind::kRelease);
}

}  // namespace hm
