#include "hm/flight/command_gate.hpp"

#include <cmath>

#include "hm/estimation/filter_math.hpp"

namespace hm {
namespace {
/// Larger direct roll and pitch commands are refused: 29 degrees.
constexpr float kMostDirectTilt_rad = 0.5F;
/// Longer position steps are refused: a longer way is a goal, which the fence and the path know.
constexpr float kMostStep_m = 1.0F;

/// Commands from so much later than now are refused: more than the clocks of pilots differ once they are
/// synchronised.
constexpr float kCommandLead_s = 0.05F;

}  // namespace

Refusal CommandGate::admit(const FlightCommand& command, Time now) {
  if (command.kind == CommandKind::kEStop) return Refusal::kNone;
  const Refusal refusal = judge(command, now);
  if (refusal != Refusal::kNone) return count(refusal);
  note(command);
  pilot_ = command.kind == CommandKind::kRelease ? std::uint8_t{0} : command.pilot;
  return Refusal::kNone;
}

Refusal CommandGate::count(Refusal reason) {
  ++refused_[static_cast<std::size_t>(reason)];
  return reason;
}

Refusal CommandGate::judge(const FlightCommand& command, Time now) const {
  if (command.pilot == 0) return Refusal::kNoPilot;
  const Refusal stamp = judge_stamp(command, now);
  if (stamp != Refusal::kNone) return stamp;
  const bool other = pilot_ != 0 && pilot_ != command.pilot;
  if (other && command.kind != CommandKind::kTakeOver) return Refusal::kOtherPilot;
  return judge_values(command);
}

Refusal CommandGate::judge_stamp(const FlightCommand& command, Time now) const {
  if (command.stamp - now > duration_of(kCommandLead_s)) return Refusal::kFutureStamp;
  if (now - command.stamp > duration_of(params_.command_age_s)) return Refusal::kStaleStamp;
  for (const PilotStamp& entry : stamps_)
    if (entry.pilot == command.pilot && command.stamp <= entry.stamp) return Refusal::kBackwardStamp;
  return Refusal::kNone;
}

Refusal CommandGate::judge_values(const FlightCommand& command) const {
  const auto length = [](const Vec3f& v) { return norm_f(v); };
  const bool finite = is_finite_f(command.position_m) && is_finite_f(command.velocity_m_s) &&
                      is_finite_f(command.acceleration_m_s2) && std::isfinite(command.yaw_rad) &&
                      std::isfinite(command.roll_rad) && std::isfinite(command.pitch_rad) &&
                      std::isfinite(command.yaw_rate_rad_s) && std::isfinite(command.thrust_ratio);
  if (!finite) return Refusal::kNotANumber;
  bool in_range = true;
  switch (command.kind) {
    case CommandKind::kVelocity:
      in_range = length(command.velocity_m_s) <= params_.speed_m_s &&
                 std::abs(command.yaw_rad) <= params_.yaw_rate_rad_s;
      break;
    case CommandKind::kPositionStep:
      in_range = length(command.position_m) <= kMostStep_m;
      break;
    case CommandKind::kPath:
      in_range = length(command.velocity_m_s) <= params_.speed_m_s;
      break;
    case CommandKind::kDirect:
      in_range = std::abs(command.roll_rad) <= kMostDirectTilt_rad &&
                 std::abs(command.pitch_rad) <= kMostDirectTilt_rad &&
                 std::abs(command.yaw_rate_rad_s) <= params_.yaw_rate_rad_s && command.thrust_ratio >= 0 &&
                 command.thrust_ratio <= 1;
      break;
    default:
      break;
  }
  return in_range ? Refusal::kNone : Refusal::kOutOfRange;
}

void CommandGate::note(const FlightCommand& command) {
  PilotStamp* place = &stamps_[0];
  for (PilotStamp& entry : stamps_) {
    if (entry.pilot == command.pilot) {
      entry.stamp = command.stamp;
      return;
    }
    if (entry.stamp < place->stamp) place = &entry;
  }
  *place = {command.pilot, command.stamp};
}

std::optional<Time> CommandGate::last_heard() const {
  for (const PilotStamp& entry : stamps_)
    if (pilot_ != 0 && entry.pilot == pilot_) return entry.stamp;
  return {};
}

}  // namespace hm
