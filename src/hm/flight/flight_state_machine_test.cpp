#include "hm/flight/flight_state_machine.hpp"

#include <gtest/gtest.h>

#include <array>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "hm/flight/flight_text.hpp"

namespace hm {
namespace {

using State = AutopilotState;
using Action = FlightAction;
using Phase = FlightPhase;

/// A machine and its clock.
struct Flight {
  FlightStateMachine machine;
  Time now{1'000'000'000};
  bool motors = false;

  void run_ms(int count) {
    for (int i = 0; i < count; ++i) {
      now = now + Duration{1'000'000};
      machine.step(now, motors);
    }
  }
  Refusal act(Action action, bool rc = true) { return machine.act(action, {rc, Refusal::kNone}); }
};

/// Where the test starts: each state with its phases.
enum class Start {
  kOff,
  kEngaging,
  kDisengaging,
  kIdle,
  kTakeOff,
  kPosition,
  kDescend,
  kForced,
  kTouchDown,
  kError
};
constexpr std::array<Start, 10> kStarts{
    Start::kOff,      Start::kEngaging, Start::kDisengaging, Start::kIdle,      Start::kTakeOff,
    Start::kPosition, Start::kDescend,  Start::kForced,      Start::kTouchDown, Start::kError};

/// Brings a machine there on the published way, with the motors observed as asked; false if that cannot be.
bool bring_to(Start start, bool motors, Flight& flight) {
  flight.run_ms(1);
  if (start == Start::kError) {
    flight.motors = motors;
    flight.run_ms(20);
    flight.act(Action::kEStop);
    flight.run_ms(10);
    return true;
  }
  if (start == Start::kOff) return !motors;
  flight.act(Action::kToggleEngage);
  if (start == Start::kEngaging) return !motors;
  flight.motors = true;
  flight.run_ms(10);
  if (start == Start::kDisengaging) flight.act(Action::kToggleEngage);
  if (start == Start::kIdle || start == Start::kDisengaging) return motors;
  flight.act(Action::kTakeOff);
  if (start == Start::kTakeOff) return motors;
  flight.machine.took_off();
  if (start == Start::kPosition) return motors;
  if (start == Start::kForced)
    flight.machine.force_landing();
  else
    flight.act(Action::kLand);
  if (start == Start::kTouchDown) flight.machine.touched_down();
  return motors;
}

struct Outcome {
  State state;
  Phase phase;
  Refusal refusal;
};

/// The table, written down apart from the implementation. Rows as kStarts, columns as the actions' codes 0
/// to 6. What is not reached without RC is the same with kRcDisabled, but for the emergency stop.
std::vector<std::vector<Outcome>> table(bool motors) {
  const Outcome error{State::kError, Phase::kGround, Refusal::kNone};
  const auto stays = [](State state, Phase phase, Refusal refusal) { return Outcome{state, phase, refusal}; };
  const auto row = [&](State s, Phase p, Outcome toggle, Outcome take_off, Outcome land) {
    const Outcome nothing = stays(s, p, Refusal::kNotSupported);
    return std::vector<Outcome>{
        error, nothing, nothing, toggle, take_off, land, stays(s, p, Refusal::kNoError)};
  };
  const auto ground = Phase::kGround;
  const auto in_transition = [&](State s) {
    return row(s, ground, stays(s, ground, Refusal::kInTransition), stays(s, ground, Refusal::kInTransition),
               stays(s, ground, Refusal::kNotFlying));
  };
  const auto flying = [&](Phase p) {
    return row(State::kFlying, p, stays(State::kFlying, p, Refusal::kAlreadyFlying),
               stays(State::kFlying, p, Refusal::kAlreadyFlying),
               {State::kLanding, Phase::kDescend, Refusal::kNone});
  };
  const auto landing = [&](Phase p) {
    return row(State::kLanding, p, stays(State::kLanding, p, Refusal::kAlreadyFlying),
               stays(State::kLanding, p, Refusal::kAlreadyFlying), stays(State::kLanding, p, Refusal::kNone));
  };
  std::vector<Outcome> latched(7, {State::kError, ground, Refusal::kErrorLatched});
  latched[0].refusal = Refusal::kNone;
  latched[6] = motors ? Outcome{State::kError, ground, Refusal::kMotorsOn}
                      : Outcome{State::kOff, ground, Refusal::kNone};
  return {
      row(State::kOff, ground, {State::kEngaging, ground, Refusal::kNone},
          stays(State::kOff, ground, Refusal::kMotorsOff), stays(State::kOff, ground, Refusal::kNotFlying)),
      in_transition(State::kEngaging),
      in_transition(State::kDisengaging),
      row(State::kIdle, ground, {State::kDisengaging, ground, Refusal::kNone},
          {State::kFlying, Phase::kTakeOff, Refusal::kNone},
          stays(State::kIdle, ground, Refusal::kNotFlying)),
      flying(Phase::kTakeOff),
      flying(Phase::kPosition),
      landing(Phase::kDescend),
      landing(Phase::kDescend),
      landing(Phase::kTouchDown),
      latched};
}

TEST(FlightStateMachine, EveryStateAndActionHasItsOutcome) {
  int checked = 0;
  for (const bool motors : {false, true}) {
    const auto expected = table(motors);
    for (std::size_t start = 0; start < kStarts.size(); ++start) {
      for (int code = 0; code <= 6; ++code) {
        for (const bool rc : {false, true}) {
          Flight flight;
          if (!bring_to(kStarts[start], motors, flight)) continue;
          const State state = flight.machine.state();
          const Phase phase = flight.machine.phase();
          const auto action = static_cast<Action>(code);
          const Refusal refusal = flight.act(action, rc);
          Outcome outcome = expected[start][static_cast<std::size_t>(code)];
          if (!rc && action != Action::kEStop) outcome = {state, phase, Refusal::kRcDisabled};
          EXPECT_EQ(flight.machine.state(), outcome.state) << start << " action " << code << " rc " << rc;
          EXPECT_EQ(flight.machine.phase(), outcome.phase) << start << " action " << code << " rc " << rc;
          EXPECT_EQ(refusal, outcome.refusal) << start << " action " << code << " rc " << rc;
          ++checked;
        }
      }
    }
  }
  EXPECT_EQ(checked, 11 * 7 * 2);  // each start with the motors as they are there, the error with both
}

TEST(FlightStateMachine, EveryStateAndChangeOfTheMotorsHasItsOutcome) {
  const std::array<State, 10> after_off{State::kOff, State::kOff, State::kOff, State::kOff, State::kOff,
                                        State::kOff, State::kOff, State::kOff, State::kOff, State::kError};
  for (std::size_t i = 0; i < kStarts.size(); ++i) {
    Flight flight;
    if (!bring_to(kStarts[i], true, flight)) continue;
    flight.motors = false;
    flight.run_ms(10);
    EXPECT_EQ(flight.machine.state(), after_off[i]) << i;
    EXPECT_EQ(flight.machine.motor_demand(), MotorDemand::kOff);
  }
  for (const auto& [start, state] :
       {std::pair{Start::kOff, State::kIdle}, std::pair{Start::kEngaging, State::kIdle},
        std::pair{Start::kError, State::kError}}) {  // the firmware left its error here
    Flight flight;
    ASSERT_TRUE(bring_to(start, false, flight));
    flight.motors = true;
    flight.run_ms(10);
    EXPECT_EQ(flight.machine.state(), state);
  }
}

/// A start of the tests of events: one of kStarts, or a phase of pilots in flight.
struct EventStart {
  Start start;
  std::optional<Phase> phase;
};

std::vector<EventStart> event_starts() {
  std::vector<EventStart> all;
  for (const Start start : kStarts) all.push_back({start, {}});
  for (const Phase phase :
       {Phase::kVelocity, Phase::kDirect, Phase::kPath, Phase::kHold, Phase::kDeadReckoning, Phase::kReturn})
    all.push_back({Start::kPosition, phase});
  return all;
}

struct Event {
  const char* name;
  void (*happens)(Flight&);
  /// Where it leads from a state and phase; nothing: it changes neither.
  std::optional<std::pair<State, Phase>> (*leads_to)(Start, State, Phase);
};

const Event kEvents[] = {
    {"landing is forced", [](Flight& f) { f.machine.force_landing(); },
     [](Start, State s, Phase) -> std::optional<std::pair<State, Phase>> {
       if (s == State::kFlying) return std::pair(State::kLanding, Phase::kDescend);
       return {};
     }},
    {"its cause is gone", [](Flight& f) { f.machine.recover_to_hold(); },
     [](Start start, State s, Phase) -> std::optional<std::pair<State, Phase>> {
       if (s == State::kFlying || start == Start::kForced) return std::pair(State::kFlying, Phase::kHold);
       return {};
     }},
    {"motors are cut", [](Flight& f) { f.machine.fail(); },
     [](Start, State, Phase) -> std::optional<std::pair<State, Phase>> {
       return std::pair(State::kError, Phase::kGround);
     }},
    {"ground is touched", [](Flight& f) { f.machine.touched_down(); },
     [](Start, State, Phase p) -> std::optional<std::pair<State, Phase>> {
       if (p == Phase::kDescend) return std::pair(State::kLanding, Phase::kTouchDown);
       return {};
     }},
    {"height is reached", [](Flight& f) { f.machine.took_off(); },
     [](Start, State, Phase p) -> std::optional<std::pair<State, Phase>> {
       if (p == Phase::kTakeOff) return std::pair(State::kFlying, Phase::kPosition);
       return {};
     }},
    {"two seconds pass", [](Flight& f) { f.run_ms(2100); },
     [](Start, State s, Phase p) -> std::optional<std::pair<State, Phase>> {
       if (s == State::kEngaging || s == State::kDisengaging) return std::pair(State::kError, Phase::kGround);
       if (p == Phase::kTouchDown) return std::pair(State::kIdle, Phase::kGround);
       return {};
     }},
};

TEST(FlightStateMachine, EveryStateAndEventHasItsOutcome) {
  int checked = 0;
  for (const Event& event : kEvents)
    for (const EventStart& from : event_starts()) {
      Flight flight;
      if (!bring_to(from.start, true, flight)) bring_to(from.start, false, flight = Flight());
      if (from.phase) {
        ASSERT_EQ(flight.machine.enter_phase(*from.phase), Refusal::kNone);
      }
      const State state = flight.machine.state();
      const Phase phase = flight.machine.phase();
      const auto expected = event.leads_to(from.start, state, phase).value_or(std::pair(state, phase));
      event.happens(flight);
      EXPECT_EQ(flight.machine.state(), expected.first) << event.name << " from " << text_of(state);
      EXPECT_EQ(flight.machine.phase(), expected.second) << event.name << " from phase " << text_of(phase);
      ++checked;
    }
  EXPECT_EQ(checked, 6 * 16);
}

TEST(FlightStateMachine, TimedTransitionsEndToTheMillisecond) {
  for (const bool engaging : {true, false}) {
    Flight flight;
    ASSERT_TRUE(bring_to(engaging ? Start::kEngaging : Start::kDisengaging, !engaging, flight));
    flight.run_ms(1999);
    EXPECT_EQ(flight.machine.state(), engaging ? State::kEngaging : State::kDisengaging);
    flight.run_ms(1);
    EXPECT_EQ(flight.machine.state(), State::kError);
    EXPECT_EQ(flight.machine.motor_demand(), MotorDemand::kOff);
  }
  Flight landing;
  ASSERT_TRUE(bring_to(Start::kTouchDown, true, landing));
  landing.run_ms(250);
  EXPECT_NEAR(landing.machine.thrust_share(), 0.5F, 1e-3F);
  landing.run_ms(250);
  EXPECT_EQ(landing.machine.thrust_share(), 0.0F);
  EXPECT_EQ(landing.machine.motor_demand(), MotorDemand::kIdle);
  landing.run_ms(299);
  EXPECT_EQ(landing.machine.state(), State::kLanding);
  landing.run_ms(1);
  EXPECT_EQ(landing.machine.state(), State::kIdle);
}

TEST(FlightStateMachine, MotorsAreBelievedAfterTheDebounce) {
  Flight flight;
  ASSERT_TRUE(bring_to(Start::kEngaging, false, flight));
  for (int i = 0; i < 50; ++i) {  // a contact that chatters
    flight.motors = i % 4 != 0;
    flight.run_ms(1);
  }
  EXPECT_EQ(flight.machine.state(), State::kEngaging);
  flight.motors = true;
  flight.run_ms(6);
  EXPECT_EQ(flight.machine.state(), State::kIdle);
}

TEST(FlightStateMachine, PhasesChangeOnlyInFlight) {
  for (const Start start : kStarts) {
    for (int code = 0; code <= static_cast<int>(Phase::kTouchDown); ++code) {
      const auto wanted = static_cast<Phase>(code);
      Flight flight;
      bring_to(start, true, flight);
      const State state = flight.machine.state();
      const Phase before = flight.machine.phase();
      const Refusal refusal = flight.machine.enter_phase(wanted);
      const bool pilots = wanted >= Phase::kPosition && wanted <= Phase::kReturn;
      Refusal expected = Refusal::kNotFlying;
      if (in_air(state) && wanted == before)
        expected = Refusal::kNone;
      else if (start == Start::kTouchDown)
        expected = Refusal::kTouchedDown;
      else if (start == Start::kForced)
        expected = Refusal::kLandingForced;
      else if (start == Start::kDescend)
        expected = wanted == Phase::kHold ? Refusal::kNone : Refusal::kWrongMode;
      else if (state == State::kFlying)
        expected = pilots ? Refusal::kNone : Refusal::kWrongMode;
      EXPECT_EQ(refusal, expected) << static_cast<int>(start) << " phase " << code;
      EXPECT_EQ(flight.machine.phase(), expected == Refusal::kNone ? wanted : before);
    }
  }
}

TEST(FlightStateMachine, TakeOffIsRefusedForTheReasonGiven) {
  for (const Refusal reason : {Refusal::kNotReady, Refusal::kBatteryLow}) {
    Flight flight;
    ASSERT_TRUE(bring_to(Start::kIdle, true, flight));
    EXPECT_EQ(flight.machine.act(Action::kTakeOff, {true, reason}), reason);
    EXPECT_EQ(flight.machine.state(), State::kIdle);
  }
}

TEST(FlightStateMachine, AForcedLandingEndsInHoldOnlyWhileItDescends) {
  Flight flight;
  bring_to(Start::kForced, true, flight);
  flight.machine.recover_to_hold();
  EXPECT_EQ(flight.machine.phase(), Phase::kHold);
  flight.machine.force_landing();
  flight.machine.touched_down();
  EXPECT_TRUE(flight.machine.landing_forced());
  flight.machine.recover_to_hold();
  EXPECT_EQ(flight.machine.phase(), Phase::kTouchDown);
}

TEST(FlightText, EveryNumberHasItsOwnWords) {
  std::set<std::string> refusals, reasons;
  for (int i = 0; i < kRefusalCount; ++i) refusals.emplace(text_of(static_cast<Refusal>(i)));
  for (std::size_t i = 0; i < kFailSafeCount; ++i) reasons.emplace(text_of(static_cast<FailSafe>(i)));
  EXPECT_EQ(refusals.size(), static_cast<std::size_t>(kRefusalCount));
  EXPECT_EQ(reasons.size(), kFailSafeCount);
  EXPECT_EQ(refusals.count("unknown") + reasons.count("unknown"), 0u);
  EXPECT_EQ(text_of(State::kError), "error");
  EXPECT_EQ(text_of(Phase::kDeadReckoning), "dead reckoning");
}

}  // namespace
}  // namespace hm
