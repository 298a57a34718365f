#pragma once
#include <optional>

#include "hm/core/time.hpp"

namespace hm {

/// Measurements that distinguish a vehicle on the ground from one in the air.
struct GroundSigns {
  float wanted_climb_m_s = 0;  ///< set-point
  float climb_m_s = 0;         ///< estimate
  float thrust_per_hover = 1;
  float carried_m_s2 = 0;            ///< specific force that the rotors' thrust does not explain, upwards
  std::optional<float> clearance_m;  ///< feet above the ground, where a sensor measures it
};

/// Finds the touch-down: the set-point sinks, the vehicle does not, its thrust stays far below that of
/// hovering or its feet are seen down, and the ground is near if its distance is known; all for 350 ms (as in
/// PX4).
/// Where the climb rate has drifted without a height, the accelerometer finds it: something else than the
/// rotors carries a good part of the weight. It needs thrust below hovering, as a descent that does not
/// descend comes to. A sensor may see the floor beside what the feet stand on (a table): without a near
/// ground a vehicle that stands is found after kUnseen.
class TouchdownDetector {
 public:
  static constexpr Duration kUnseen{2'000'000'000};

  void reset() { since_.reset(); }
  /// Adds a step; returns whether the vehicle is on the ground. Signs that are no numbers are no touch-down.
  bool step(Time now, const GroundSigns& signs);

 private:
  std::optional<Time> since_;
};

}  // namespace hm
