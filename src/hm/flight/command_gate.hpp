#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "hm/core/param_doc.hpp"
#include "hm/core/time.hpp"
#include "hm/flight/flight_command.hpp"

namespace hm {

struct CommandParams {
  float command_age_s = 0.5F;
  float speed_m_s = 1.5F;
  float yaw_rate_rad_s = 1.0F;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"command_age_s", {0.01, 10}, "older commands are refused"}, self.command_age_s);
    v(ParamDoc{"speed_m_s", {0.05, 20}, "faster velocity commands are refused"}, self.speed_m_s);
    v(ParamDoc{"yaw_rate_rad_s", {0.05, 6}, "faster turns are refused"}, self.yaw_rate_rad_s);
  }
};

/// Decides which commands count: finite, within limits, neither late nor repeated, and from the pilot who has
/// control. One pilot has it at a time: the first whose command arrives while nobody has, until kRelease or
/// another pilot's kTakeOver. An emergency stop counts from anybody, whatever its stamp. Every refusal is
/// counted.
class CommandGate {
 public:
  explicit CommandGate(const CommandParams& params = {}) : params_(params) {}
  /// Judges a command at `now`; kNone also notes the sign of life and who has control.
  Refusal admit(const FlightCommand& command, Time now);
  [[nodiscard]] std::uint8_t pilot() const { return pilot_; }  ///< 0: nobody
  /// Newest admitted command of the pilot in control; nothing without one.
  [[nodiscard]] std::optional<Time> last_heard() const;
  [[nodiscard]] std::uint32_t refused(Refusal reason) const {
    return refused_[static_cast<std::size_t>(reason)];
  }
  /// Counts a refusal that was decided elsewhere.
  Refusal count(Refusal reason);

 private:
  struct PilotStamp {
    std::uint8_t pilot = 0;
    Time stamp;
  };
  [[nodiscard]] Refusal judge(const FlightCommand& command, Time now) const;
  [[nodiscard]] Refusal judge_values(const FlightCommand& command) const;
  [[nodiscard]] Refusal judge_stamp(const FlightCommand& command, Time now) const;
  void note(const FlightCommand& command);

  CommandParams params_;
  std::uint8_t pilot_ = 0;
  std::array<PilotStamp, 8> stamps_{};  // newest of each pilot; the oldest entry gives way
  std::array<std::uint32_t, static_cast<std::size_t>(kRefusalCount)> refused_{};
};

}  // namespace hm
