#pragma once
#include <optional>

#include "hm/core/param_doc.hpp"
#include "hm/core/time.hpp"

namespace hm {

struct TouchdownParams {
  float touchdown_climb_m_s = 0.1F;
  float touchdown_thrust_ratio = 0.6F;
  float touchdown_after_s = 0.35F;
  float touchdown_clearance_m = 0.15F;
  float touchdown_carried_m_s2 = 1.5F;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"touchdown_climb_m_s", {0.01, 1}, "a landing vehicle that sinks faster is not on the ground"},
      self.touchdown_climb_m_s);
    v(ParamDoc{"touchdown_thrust_ratio",
               {0.05, 1},
               "thrust below this share of hover thrust: the ground carries"},
      self.touchdown_thrust_ratio);
    v(ParamDoc{"touchdown_after_s", {0, 5}, "duration of these conditions after which the ground is reached"},
      self.touchdown_after_s);
    v(ParamDoc{"touchdown_clearance_m", {0.01, 2}, "a larger known distance to the ground rules it out"},
      self.touchdown_clearance_m);
    v(
        ParamDoc{
            "touchdown_carried_m_s2",
            {0.2, 9},
            "specific force beyond that of the rotors: the ground carries, whatever the speed seems to be"},
        self.touchdown_carried_m_s2);
  }
};

/// What tells a vehicle on the ground from one in the air.
struct GroundSigns {
  float wanted_climb_m_s = 0;  ///< set-point
  float climb_m_s = 0;         ///< estimate
  float thrust_per_hover = 1;
  float carried_m_s2 = 0;            ///< specific force that the rotors' thrust does not explain, upwards
  std::optional<float> clearance_m;  ///< feet above the ground, where a sensor measures it
};

/// Finds the touch-down: the set-point sinks, the vehicle does not, its thrust stays far below that of
/// hovering, and the ground is near if its distance is known; all for touchdown_after_s (PX4: 350 ms).
/// Where the climb rate has drifted without a height, the accelerometer finds it: something else than the
/// rotors carries a good part of the weight. It needs thrust below hovering, as a descent that does not
/// descend comes to. A sensor may see the floor beside what the feet stand on (a table): without a near
/// ground a vehicle that stands is found after kUnseen.
class TouchdownDetector {
 public:
  static constexpr Duration kUnseen{2'000'000'000};

  explicit TouchdownDetector(const TouchdownParams& params = {});
  void reset() { since_.reset(); }
  /// Adds a step; returns whether the vehicle is on the ground. Signs that are no numbers are no touch-down.
  bool step(Time now, const GroundSigns& signs);

 private:
  TouchdownParams params_;
  Duration after_;
  std::optional<Time> since_;
};

}  // namespace hm
