#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "hm/core/params.hpp"
#include "hm/flight/fail_safes.hpp"
#include "hm/flight/flight_command.hpp"
#include "hm/geometry/se2.hpp"
#include "hm/pipeline/flight/flight_script.hpp"

namespace hm {

struct PilotParams {
  double arrival_m = 0.1;
  double leg_speed_m_s = 0.25;
  /// A vehicle that cannot take off for so long ends the script.
  double ready_s = 15;
  /// Beyond the time that a leg or a climb takes at `leg_speed_m_s`.
  static constexpr double kSpare_s = 10;
  /// Time for stopping the motors, or coming to rest.
  static constexpr double kSettle_s = 10;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"arrival_m", {0.02, 5}, "distance at which a way point is reached", ParamLevel::kBasic},
      self.arrival_m);
    v(ParamDoc{"leg_speed_m_s", {0.01, 5}, "a way point that takes longer than at this speed is missed"},
      self.leg_speed_m_s);
  }
};

/// View of the vehicle that a pilot has.
struct PilotView {
  Time now;  ///< on the vehicle's clock
  AutopilotState state = AutopilotState::kOff;
  FlightPhase phase = FlightPhase::kGround;
  std::optional<FailSafe> reason;    ///< of the fail-safe that acts
  Vec3f position_m = Vec3f::Zero();  ///< estimate, in `map`
  Vec3f velocity_m_s = Vec3f::Zero();
  float yaw_rad = 0;
  std::optional<CommandKind> answered;  ///< this pilot's command that reached the vehicle since the last step
  Refusal refusal = Refusal::kNone;     ///< valid with `answered`
  SE2 T_map_odom = {};                  ///< a goal given in `map` moves for the vehicle with it
};

enum class OrderOutcome { kWaiting, kRunning, kDone, kMissed, kSkipped };
[[nodiscard]] std::string_view to_string(OrderOutcome outcome);

/// Outcome of an order.
struct OrderRecord {
  FlightOrder order;
  OrderOutcome outcome = OrderOutcome::kWaiting;
  Time begin, end;          ///< valid where it was begun, ended
  double distance_m = 0;    ///< kGoTo, kStep: from the goal at the end, by the estimate
  std::string reason = {};  ///< kMissed, kSkipped
};

/// Flies orders, one after the other: takes control, engages, takes off, repeats velocity commands and signs
/// of life, waits until a place is reached by the estimate, and gives up after a time-out. A way point is
/// passed where the next order is one too; otherwise the vehicle comes to rest there. At the end it lands, if
/// it flies, stops the motors and releases control.
///
/// What fails (a time-out, a refusal, a fail-safe that lands) is missed with the reason, and the next order
/// follows; after an error of the autopilot, or where it cannot take off, all others are skipped. When
/// another pilot takes control, all orders are skipped too; it takes control back for an order that comes
/// after that. Knows what the vehicle sends, nothing of a simulation. Deterministic.
class ScriptPilot {
 public:
  /// Its identity among pilots, unless another one is given.
  static constexpr std::uint8_t kPilot = 1;
  explicit ScriptPilot(const PilotParams& params = {}, std::uint8_t identity = kPilot);

  void add(const FlightOrder& order);
  /// Skips what runs and what waits, and carries this out at once.
  void interrupt(const FlightOrder& order);
  /// No more orders will come; what was added is carried out.
  void close() { closed_ = true; }
  /// Ends the flight: skips what runs and what waits, and lands. No orders are accepted afterwards.
  void land_now(const std::string& reason);

  /// The command to send now, if any. Called each millisecond.
  std::optional<FlightCommand> step(const PilotView& view);
  /// No order is left, the motors stand (or an error is latched), control is released.
  [[nodiscard]] bool is_over() const { return released_; }
  [[nodiscard]] std::span<const OrderRecord> records() const { return records_; }
  /// The order that is carried out, null: none.
  [[nodiscard]] const OrderRecord* current() const;

 private:
  std::optional<FlightCommand> fly(const PilotView& view);
  std::optional<FlightCommand> carry_out(const PilotView& view);
  std::optional<FlightCommand> take_off(const PilotView& view);
  std::optional<FlightCommand> go_to(const PilotView& view);
  std::optional<FlightCommand> go_step(const PilotView& view);
  std::optional<FlightCommand> fly_velocity(const PilotView& view);
  std::optional<FlightCommand> hold(const PilotView& view);
  std::optional<FlightCommand> return_home(const PilotView& view);
  std::optional<FlightCommand> land(const PilotView& view);
  std::optional<FlightCommand> end_flight(const PilotView& view);

  void note_answer(const PilotView& view);
  void begin(const PilotView& view);
  void finish(const PilotView& view, OrderOutcome outcome, std::string reason = {});
  void miss(const PilotView& view, std::string reason) {
    finish(view, OrderOutcome::kMissed, std::move(reason));
  }
  void skip_rest(const std::string& reason, Time now);
  [[nodiscard]] bool is_there(const PilotView& view) const;
  /// Whether a place that the vehicle flies to cannot be reached any more; the order is missed then.
  bool gives_up(const PilotView& view);
  [[nodiscard]] FlightCommand command_of(CommandKind kind) const;
  /// The command, unless the same kind was sent less than `period_s` ago.
  std::optional<FlightCommand> again(const FlightCommand& command, const PilotView& view, double period_s);
  [[nodiscard]] double running_s(const PilotView& view) const {
    return (view.now - record().begin).seconds();
  }
  [[nodiscard]] OrderRecord& record() { return records_[next_]; }
  [[nodiscard]] const OrderRecord& record() const { return records_[next_]; }

  PilotParams params_;
  std::uint8_t identity_;
  std::vector<OrderRecord> records_;
  std::size_t next_ = 0;  // record that runs or waits
  bool closed_ = false, in_control_ = false, released_ = false, ends_ = false;
  bool has_yielded_ = false;                // to another pilot
  std::optional<std::string> stop_reason_;  // of land_now(), until the next step

  // Of the order that runs.
  std::optional<CommandKind> sent_;
  Time sent_at_;
  std::optional<Time>
      since_;              // kVelocity, kStep: when the vehicle was in that mode; kReturn: when it last flew
  bool accepted_ = false;  // kGoTo, kStep: the vehicle has this goal
  SE2 T_map_odom_sent_;    // kGoTo: when the goal was sent
  Vec3 goal_m_ = Vec3::Zero();  // kGoTo, kStep: in `map`
  Refusal refusal_ = Refusal::kNone;
  float goal_yaw_rad_ = 0;
  double time_limit_s_ = 0;

  std::optional<Time> last_stamp_;  // of the newest command
};

}  // namespace hm
