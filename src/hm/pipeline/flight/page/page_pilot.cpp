#include "hm/pipeline/flight/page/page_pilot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "hm/flight/flight_text.hpp"

namespace hm {
namespace {

constexpr Duration kPageLifePeriod{500'000'000};
/// An answer that has not come by then was lost with its link.
constexpr Duration kAnswerTimeout{1'000'000'000};
constexpr std::size_t kMostOrders = 64;

struct SimpleOrder {
  std::string_view kind;
  CommandKind command;
};
constexpr std::array kSimpleOrders{
    SimpleOrder{"toggle_engage", CommandKind::kToggleEngage}, SimpleOrder{"land", CommandKind::kLand},
    SimpleOrder{"hold", CommandKind::kHold}, SimpleOrder{"e_stop", CommandKind::kEStop},
    SimpleOrder{"reset", CommandKind::kReset}};

Vec3 vector_of(const PilotOrder& order) { return {order.vector[0], order.vector[1], order.vector[2]}; }

}  // namespace

void PagePilot::take(const PilotOrder& order) {
  const std::lock_guard lock(mutex_);
  // A velocity replaces one that waits.
  if (order.kind == "velocity" && !orders_.empty() && orders_.back().kind == "velocity") orders_.pop_back();
  if (order.kind == "e_stop") orders_.clear();
  if (orders_.size() < kMostOrders) orders_.push_back(order);
}

void PagePilot::hold(const std::string& reason) {
  const std::lock_guard lock(mutex_);
  std::erase_if(orders_, [](const PilotOrder& order) { return order.kind == "velocity"; });
  hold_reason_ = reason;
}

PagePilot::Waiting& PagePilot::add(CommandKind kind, std::optional<std::uint64_t> sequence) {
  waiting_.push_back({{}, sequence});
  waiting_.back().command.kind = kind;
  return waiting_.back();
}

void PagePilot::fly_velocity(const PilotOrder& order, const FlightMoment& moment) {
  std::erase_if(waiting_, [](const Waiting& w) { return w.command.kind == CommandKind::kVelocity; });
  if (moment.autopilot.phase != FlightPhase::kVelocity) {
    const bool asked = std::any_of(waiting_.begin(), waiting_.end(),
                                   [](const Waiting& w) { return w.command.kind == CommandKind::kMode; });
    if (!asked) add(CommandKind::kMode, order.sequence).command.mode = FlightPhase::kVelocity;
    return;
  }
  FlightCommand& command = add(CommandKind::kVelocity, order.sequence).command;
  command.velocity_m_s = vector_of(order).cast<float>();
  command.yaw_rad = static_cast<float>(order.yaw);
}

/// `order.vector` is in `map`, as the goals of every pilot; the map of the laser is in `odom`.
void PagePilot::go_to(const PilotOrder& order, bool flies, const FlightMoment& moment,
                      const MultiVolumeGrid& map) {
  const SE3 T_map_odom = moment.T_map_odom.to_se3();
  const Vec3 from_odom_m = moment.estimate.position_m.cast<double>();
  const StraightWay way = straight_way(map, from_odom_m, T_map_odom.inverse() * vector_of(order));
  if (view_) {
    std::vector<Vec3> shown;
    for (const Vec3& point : way.points_m) shown.push_back(T_map_odom * point);
    view_->on_plan(way.refusal.empty() ? LivePlan::kValid : LivePlan::kRefused, shown, way.refusal);
  }
  if (!way.refusal.empty() || !flies) return answer_(order.sequence, way.refusal.empty(), way.refusal);
  FlightCommand& command = add(CommandKind::kGoTo, order.sequence).command;
  command.position_m = vector_of(order).cast<float>();
  command.yaw_rad = static_cast<float>(order.yaw);
}

void PagePilot::end() {
  waiting_.clear();
  if (in_control_) add(CommandKind::kRelease);
  ended_ = true;
}

void PagePilot::obey(const PilotOrder& order, const FlightMoment& moment, const MultiVolumeGrid& map) {
  if (ended_ && order.kind != "e_stop") return answer_(order.sequence, false, "the flight ends");
  if (!in_control_ && order.kind != "e_stop" && order.kind != "preview") add(CommandKind::kTakeOver);
  const auto simple = std::find_if(kSimpleOrders.begin(), kSimpleOrders.end(),
                                   [&](const SimpleOrder& known) { return known.kind == order.kind; });
  if (simple != kSimpleOrders.end()) {
    if (simple->command == CommandKind::kEStop) waiting_.clear();
    add(simple->command, order.sequence);
  } else if (order.kind == "take_off") {
    add(CommandKind::kTakeOff, order.sequence).command.position_m.z() =
        static_cast<float>(std::max(0.0, order.vector[2]));
  } else if (order.kind == "return") {
    add(CommandKind::kMode, order.sequence).command.mode = FlightPhase::kReturn;
  } else if (order.kind == "velocity") {
    fly_velocity(order, moment);
  } else if (order.kind == "go_to" || order.kind == "preview") {
    go_to(order, order.kind == "go_to", moment, map);
  } else {
    answer_(order.sequence, false, "there is no command " + order.kind);
  }
}

/// Answers come in the order of the commands, one at a time.
void PagePilot::note_answer(const FlightMoment& moment) {
  if (!sent_) return;
  if (!moment.answer || moment.answer->command.pilot != kPilot) {
    if (moment.stamp - *sent_at_ < kAnswerTimeout) return;
    if (sent_->sequence) answer_(*sent_->sequence, false, "the vehicle does not answer");
    sent_.reset();
    return;
  }
  const auto& [command, refusal] = *moment.answer;
  in_control_ = refusal != Refusal::kOtherPilot && command.kind != CommandKind::kRelease;
  if (sent_->sequence)
    answer_(*sent_->sequence, refusal == Refusal::kNone,
            refusal == Refusal::kNone ? std::string() : std::string(text_of(refusal)));
  sent_.reset();
}

std::optional<FlightCommand> PagePilot::step(const FlightMoment& moment, const MultiVolumeGrid& map,
                                             bool may_send) {
  note_answer(moment);
  std::deque<PilotOrder> orders;
  std::optional<std::string> hold_reason;
  {
    const std::lock_guard lock(mutex_);
    orders.swap(orders_);
    hold_reason.swap(hold_reason_);
  }
  for (const PilotOrder& order : orders) obey(order, moment, map);
  if (hold_reason && !ended_ && moment.autopilot.state == AutopilotState::kFlying && in_control_) {
    std::erase_if(waiting_, [](const Waiting& w) { return w.command.kind == CommandKind::kVelocity; });
    add(CommandKind::kHold);
    if (view_) view_->on_event(LogLevel::kWarning, "the vehicle holds: " + *hold_reason);
  }
  if (waiting_.empty() && in_control_ && is_due(life_at_, kPageLifePeriod, moment.stamp))
    add(CommandKind::kSignOfLife);
  const bool is_urgent = !waiting_.empty() && waiting_.front().command.kind == CommandKind::kEStop;
  if (!may_send || waiting_.empty() || (sent_ && !is_urgent) || moment.stamp <= last_stamp_)
    return std::nullopt;
  sent_ = waiting_.front();
  waiting_.pop_front();
  sent_at_ = last_stamp_ = moment.stamp;
  FlightCommand command = sent_->command;
  command.stamp = moment.stamp;
  command.pilot = kPilot;
  return command;
}

}  // namespace hm
