#pragma once
#include <cstddef>
#include <vector>

#include "hm/pipeline/flight/flight_run.hpp"

namespace hm {

/// How the poses that reach the core are changed.
enum class Poses {
  kGood,
  kShifted,  ///< by 0.4 m
  kTurned,   ///< by 90 degrees about the place where this begins
};
/// Behaviour of the pilot from the moment of the provocation on.
enum class ProvokingBehaviour {
  kHovers,
  kStopsVelocity,  ///< velocity commands for a second, then none
  kStopsDirect,    ///< the same with attitude commands
  kFallsSilent,
  kFliesAway,  ///< to a goal a metre from home
  kForwardByVelocity,
  kForwardByAttitude,
  kEStops,
};
/// How the flight must end.
enum class ProvokedEnd {
  kHolds,
  kLands,
  kFalls,  ///< lands, without the lift for a soft touch
  kCuts,
};
/// Whether it must end without a collision.
constexpr bool stays_whole(ProvokedEnd end) {
  return end == ProvokedEnd::kHolds || end == ProvokedEnd::kLands;
}

/// A way to bring fail-safes about in closed loop, seven seconds after the start, in the largest room of the
/// house.
struct Provocation {
  const char* name;
  const char* faults = "";  ///< lines of a script
  ProvokingBehaviour pilot = ProvokingBehaviour::kHovers;
  ProvokedEnd end = ProvokedEnd::kLands;
  std::vector<FailSafe> judged;  ///< that must act, the one that decides the end last
  void (*change)(FlightRunParams&) = nullptr;
  Poses poses = Poses::kGood;
  bool first_decides = false;  ///< the first of those judged ends the flight; the others need not act
};

/// Provocations of all fail-safes of the table (docs/flight.md).
std::vector<Provocation> fail_safe_provocations();

struct ProvocationOutcome {
  /// Time between the action of each fail-safe judged and the moment at which the table requires it, in steps
  /// of 1 ms; infinite if it did not act, though it had to, or the other way round.
  std::vector<double> off_steps;
  std::size_t collisions = 0;
  bool ended_well = false;
};

/// Flies with a seed. When each fail-safe must act is computed from what the core was given and what it
/// estimates, apart from the code that decides it. `house`: WorldKind::kHouse.
ProvocationOutcome provoke(const FlightSite& house, const Provocation& provocation, int seed);

}  // namespace hm
