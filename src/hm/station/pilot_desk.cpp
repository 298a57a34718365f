#include "hm/station/pilot_desk.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "hm/io/bytes/json.hpp"

namespace hm {
namespace {

constexpr std::array kKinds{"toggle_engage", "take_off", "land",     "hold",  "e_stop",
                            "reset",         "return",   "velocity", "go_to", "preview"};
constexpr double kMaxExpiry_ms = 1000;
constexpr std::size_t kMaxUnanswered = 1000;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
// Numbers that JavaScript holds exactly.
constexpr std::int64_t kMaxSequence = std::int64_t{1} << 53;

double milliseconds(Duration from, Duration to) { return static_cast<double>(to.ns - from.ns) * 1e-6; }

std::optional<std::int64_t> sequence_of(const JsonValue& message) {
  const auto* sequence = message.find_as<std::int64_t>("sequence");
  if (!sequence || *sequence < 0 || *sequence > kMaxSequence) return std::nullopt;
  return *sequence;
}

/// Vector and yaw of the kinds that have them. False if they are missing or not finite.
bool read_target(const JsonValue& message, PilotOrder& order) {
  const bool velocity = order.kind == "velocity";
  if (!velocity && order.kind != "go_to" && order.kind != "preview") return true;
  const JsonValue::Array& list = message.list_at(velocity ? "velocity_m_s" : "position_m");
  if (list.size() != 3) return false;
  for (std::size_t i = 0; i < 3; ++i) order.vector[i] = list[i].number_or(kNaN);
  order.yaw = message.number_at(velocity ? "yaw_rad_s" : "yaw_rad", kNaN);
  return std::isfinite(order.yaw) &&
         std::all_of(order.vector.begin(), order.vector.end(), [](double x) { return std::isfinite(x); });
}

}  // namespace

void PilotDesk::say(Pilot& pilot, const JsonValue& message) {
  pilot.waiting.push_back(to_json_text(message, JsonStyle::kCompact));
}

void PilotDesk::say_answer(Pilot& pilot, std::int64_t sequence, bool accepted, const std::string& reason) {
  say(pilot, JsonValue::object(
                 {{"type", "answer"}, {"sequence", sequence}, {"accepted", accepted}, {"reason", reason}}));
}

void PilotDesk::tell_lease(PilotId id, Pilot& pilot) const {
  const char* holder = !holder_ ? "none" : *holder_ == id ? "you" : "other";
  say(pilot, JsonValue::object({{"type", "lease"}, {"holder", holder}}));
}

void PilotDesk::hold(const std::string& reason) {
  steering_ = Steering::kNone;
  handler_.hold(reason);
}

PilotId PilotDesk::open(Duration now) {
  const PilotId id = next_pilot_++;
  Pilot& pilot = pilots_[id];
  pilot.proven_at = now;
  pilot.ping_at = now;
  pilot.ping_due = true;
  tell_lease(id, pilot);
  return id;
}

void PilotDesk::close(PilotId pilot) {
  pilots_.erase(pilot);
  if (holder_ != pilot) return;
  if (steering_ != Steering::kNone) hold("the pilot's connection ended");
  set_holder(std::nullopt);
}

void PilotDesk::set_holder(std::optional<PilotId> holder) {
  if (holder_ == holder) return;
  holder_ = holder;
  for (auto& [id, pilot] : pilots_) tell_lease(id, pilot);
}

void PilotDesk::take_lease(PilotId pilot, bool force) {
  if (holder_ == pilot || (holder_ && !force)) return tell_lease(pilot, pilots_.at(pilot));
  if (steering_ != Steering::kNone) hold("another pilot took over");
  set_holder(pilot);
}

std::optional<std::string> PilotDesk::receive(PilotId id, std::string_view text, Duration now) {
  const auto message = parse_json(text, "message");
  if (!message) return "no JSON: " + message.error().message;
  const auto* type = message->find_as<std::string>("type");
  if (!type) return "a message needs a type";
  if (*type == "command") return command(id, *message, now);
  if (*type == "pong") return pong(pilots_.at(id), *message, now);
  if (*type == "take") {
    const bool* force = message->find_as<bool>("force");
    take_lease(id, force && *force);
    return std::nullopt;
  }
  if (*type == "release") {
    if (holder_ != id) return std::nullopt;
    if (steering_ != Steering::kNone) hold("the pilot let go");
    set_holder(std::nullopt);
    return std::nullopt;
  }
  return "type '" + type->substr(0, 40) + "' is not known";
}

std::optional<std::string> PilotDesk::pong(Pilot& pilot, const JsonValue& message, Duration now) {
  const auto sequence = sequence_of(message);
  if (!sequence || *sequence > pilot.last_ping) return "pong to a ping that was not sent";
  while (!pilot.pings.empty() && pilot.pings.front().first <= *sequence) {
    const auto [answered, sent_at] = pilot.pings.front();
    pilot.pings.pop_front();
    if (answered != *sequence) continue;
    pilot.proven_at = sent_at;
    pilot.round_trip = Duration{now.ns - sent_at.ns};
  }
  return std::nullopt;
}

std::optional<std::string> PilotDesk::command(PilotId id, const JsonValue& message, Duration now) {
  Command given;
  const auto sequence = sequence_of(message);
  const auto* kind = message.find_as<std::string>("kind");
  if (!sequence || !kind) return "a command needs a sequence and a kind";
  given.sequence = *sequence;
  given.order.kind = *kind;
  given.age_ms = message.number_at("age_ms", kNaN);
  given.expires_ms = message.number_at("expires_ms", kNaN);
  Pilot& pilot = pilots_.at(id);
  Refusal refusal;
  if (std::find(kKinds.begin(), kKinds.end(), *kind) == kKinds.end())
    refusal = "kind '" + kind->substr(0, 40) + "' is not known";
  else if (!read_target(message, given.order))
    refusal = *kind + " needs three numbers and a yaw";
  else
    refusal = refuse(id, pilot, given, now);
  pilot.last_sequence = std::max(pilot.last_sequence.value_or(0), *sequence);
  if (refusal) {
    ++refused_;
    say_answer(pilot, *sequence, false, *refusal);
  } else {
    fly(id, std::move(given), now);
  }
  return std::nullopt;
}

PilotDesk::Refusal PilotDesk::refuse(PilotId id, const Pilot& pilot, const Command& command,
                                     Duration now) const {
  if (command.order.kind == "e_stop") return std::nullopt;  // from anyone, at any time
  if (pilot.last_sequence && command.sequence <= *pilot.last_sequence)
    return fmt::format("sequence {} is not above {}", command.sequence, *pilot.last_sequence);
  if (holder_ != id) return holder_ ? "another pilot has the lease" : "take the lease first";
  if (!(command.age_ms >= 0) || !(command.expires_ms > 0)) return "age_ms and expires_ms are needed";
  const double most = command.order.kind == "velocity" ? milliseconds({}, kDeadMan) : kMaxExpiry_ms;
  const double under_way_ms = milliseconds(pilot.proven_at, now);
  const double limit_ms = std::min(command.expires_ms, most);
  if (command.age_ms + under_way_ms < limit_ms) return std::nullopt;
  return fmt::format("too old: the input is {:.0f} ms old, up to {:.0f} ms on the way, allowed are {:.0f} ms",
                     command.age_ms, under_way_ms, limit_ms);
}

void PilotDesk::fly(PilotId id, Command command, Duration now) {
  PilotOrder& order = command.order;
  order.sequence = ++orders_;
  unanswered_[orders_] = {id, command.sequence};
  if (unanswered_.size() > kMaxUnanswered) unanswered_.erase(unanswered_.begin());
  if (order.kind == "velocity") {
    const Duration input_at{now.ns - static_cast<std::int64_t>(command.age_ms * 1e6)};
    input_at_ = steering_ == Steering::kVelocity ? std::max(input_at_, input_at) : input_at;
    steering_ = Steering::kVelocity;
  } else if (order.kind == "go_to") {
    steering_ = Steering::kGoTo;
  } else if (order.kind != "preview") {
    steering_ = Steering::kNone;
  }
  handler_.take(order);
}

void PilotDesk::tick(Duration now) {
  if (steering_ == Steering::kVelocity && now.ns - input_at_.ns >= kDeadMan.ns)
    hold("no input of the pilot for 0.3 s");
  for (auto& [id, pilot] : pilots_) {
    if (pilot.ping_due || now.ns - pilot.ping_at.ns < kPingPeriod.ns) continue;
    pilot.ping_due = true;
  }
}

void PilotDesk::answer(std::uint64_t sequence, bool accepted, const std::string& reason) {
  const auto found = unanswered_.find(sequence);
  if (found == unanswered_.end()) return;
  const auto [id, own_sequence] = found->second;
  if (!accepted) ++refused_;
  unanswered_.erase(found);
  const auto pilot = pilots_.find(id);
  if (pilot != pilots_.end()) say_answer(pilot->second, own_sequence, accepted, reason);
}

std::optional<std::string> PilotDesk::next(PilotId id, Duration now) {
  Pilot& pilot = pilots_.at(id);
  // A ping counts from when it leaves, thus it never waits.
  if (pilot.ping_due) {
    pilot.ping_due = false;
    pilot.ping_at = now;
    pilot.pings.emplace_back(++pilot.last_ping, now);
    auto ping = JsonValue::object({{"type", "ping"}, {"sequence", pilot.last_ping}});
    if (pilot.round_trip) ping["round_trip_ms"] = static_cast<double>(pilot.round_trip->ns) * 1e-6;
    return to_json_text(ping, JsonStyle::kCompact);
  }
  if (pilot.waiting.empty()) return std::nullopt;
  std::string text = std::move(pilot.waiting.front());
  pilot.waiting.pop_front();
  return text;
}

std::optional<std::string> PilotDesk::reason_to_end(PilotId id, Duration now) const {
  const Pilot& pilot = pilots_.at(id);
  if (pilot.waiting.size() > kMaxWaiting) return "messages are not read";
  if (!pilot.pings.empty() && now.ns - pilot.pings.front().second.ns > kGone.ns)
    return "no answer to pings for 3 s";
  return std::nullopt;
}

}  // namespace hm
