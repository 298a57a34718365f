#pragma once
#include <string>
#include <string_view>

#include "hm/pipeline/flight/flight_run.hpp"

namespace hm::test {

/// The house of seed 1, once for all tests.
inline const FlightSite& house_site() {
  static const FlightSite site(WorldKind::kHouse, 1);
  return site;
}

/// A flight that starts in the largest room, where a blind descent has a metre to each side.
inline FlightRunParams in_the_room() {
  FlightRunParams params;
  params.run.start_x_m = 4;
  params.run.start_y_m = 3;
  return params;
}

/// A flight in the house that a script flies: engages, takes off, and sends signs of life of pilot 1.
class ScriptedFlight {
 public:
  static constexpr Duration kLifePeriod{200'000'000};

  explicit ScriptedFlight(const FlightRunParams& params = {}, std::string_view faults = {},
                          FlightObserver* observer = nullptr)
      : run(house_site(), params, FaultSchedule::parse(faults, "faults").value(), observer) {}

  /// One step; the sign of life takes the place of a missing command.
  void step(std::optional<FlightCommand> command = std::nullopt) {
    if (!command && sends_life && run.now() - last_command_ >= kLifePeriod) command.emplace();
    if (command) {
      command->stamp = run.now();
      command->pilot = 1;
      last_command_ = run.now();
    }
    const FlightMoment& m = run.step(command);
    if (m.answer && m.answer->command.kind != CommandKind::kSignOfLife) last_refusal = m.answer->refusal;
    if (watched) watched(m);
  }
  void send(CommandKind kind) {
    FlightCommand command;
    command.kind = kind;
    step(command);
  }
  void go_to(double x_m, double y_m, double z_m, double yaw_rad = 0) {
    FlightCommand command;
    command.kind = CommandKind::kGoTo;
    command.position_m = Eigen::Vector3d(x_m, y_m, z_m).cast<float>();
    command.yaw_rad = static_cast<float>(yaw_rad);
    step(command);
  }
  void run_s(double seconds) {
    const Time end = run.now() + Duration::from_seconds(seconds);
    while (run.now() < end) step();
  }
  /// Steps until the condition holds; seconds that took, -1 if it never did within `most_s`.
  template <class Condition>
  double seconds_until(Condition condition, double most_s) {
    const Time begin = run.now();
    while ((run.now() - begin).seconds() <= most_s) {
      if (condition(run.moment())) return (run.now() - begin).seconds();
      step();
    }
    return -1;
  }
  /// Engages and takes off; true when it flies in position mode at its height.
  bool take_off(double settle_s = 2) {
    run_s(1);
    send(CommandKind::kToggleEngage);
    if (seconds_until([](const auto& m) { return m.autopilot.state == AutopilotState::kIdle; }, 2) < 0)
      return false;
    send(CommandKind::kTakeOff);
    const bool flies =
        seconds_until([](const auto& m) { return m.autopilot.phase == FlightPhase::kPosition; }, 8) > 0;
    run_s(settle_s);
    return flies;
  }
  [[nodiscard]] const FlightMoment& now() const { return run.moment(); }
  [[nodiscard]] Vec3 position() const { return run.moment().T_odom_base.translation(); }

  FlightRun run;
  bool sends_life = true;
  Refusal last_refusal = Refusal::kNone;
  std::function<void(const FlightMoment&)> watched;

 private:
  Time last_command_{};
};

}  // namespace hm::test
