#pragma once
#include "hm/core/param_doc.hpp"

namespace hm {

/// Limits and time-outs of the fail-safes; each is a row of the table in docs/flight.md.
struct FailSafeParams {
  float pose_stale_s = 0.2F;
  float pose_lost_s = 1.0F;
  float pose_lost_std_m = 0.5F;
  float height_stale_s = 0.5F;
  float pose_refused_s = 0.5F;
  float velocity_stale_s = 0.3F;
  float direct_stale_s = 0.1F;
  float pilot_lost_s = 2.0F;
  float pilot_gone_s = 10.0F;
  float computer_silent_s = 1.0F;
  float battery_after_s = 1.0F;
  float battery_empty_ratio = 0.1F;
  float fence_return_m = 0.2F;
  float fence_land_m = 1.0F;
  float obstacle_margin_m = 0.4F;
  float no_lift_s = 1.0F;
  float no_lift_sink_m_s = 0.3F;
  float imu_gap_s = 0.02F;
  float imu_lost_s = 0.1F;
  float overturned_rad = 1.047F;
  float overturned_s = 0.1F;
  float uncontrolled_rad = 0.524F;
  float uncontrolled_s = 0.4F;
  float tilt_mismatch_rad = 0.785F;
  float tilt_mismatch_s = 3.0F;
  float tilt_doubt_s = 0.15F;
  float pose_jump_m = 0.2F;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    visit_estimate(self, v);
    visit_commands(self, v);
    visit_vehicle(self, v);
  }

 private:
  template <class Self, class Visitor>
  static void visit_estimate(Self& self, Visitor& v) {
    v(ParamDoc{"pose_stale_s", {0.02, 10}, "without a pose for so long: dead reckoning"}, self.pose_stale_s);
    v(ParamDoc{"pose_lost_s", {0.05, 60}, "without a pose for so long: level descent"}, self.pose_lost_s);
    v(ParamDoc{"pose_lost_std_m", {0.05, 10}, "level descent when the position is less certain"},
      self.pose_lost_std_m);
    v(ParamDoc{"height_stale_s", {0.05, 10}, "without a height for so long: sinks slowly"},
      self.height_stale_s);
    v(ParamDoc{"pose_refused_s", {0.05, 10}, "all poses refused by the gate for so long: dead reckoning"},
      self.pose_refused_s);
    v(
        ParamDoc{
            "tilt_mismatch_rad", {0.1, 3}, "tilt and acceleration that differ more do not belong together"},
        self.tilt_mismatch_rad);
    v(ParamDoc{"tilt_mismatch_s", {0.1, 60}, "such a difference for so long: the sensor is turned, land"},
      self.tilt_mismatch_s);
    v(ParamDoc{"tilt_doubt_s", {0.02, 60}, "such a difference for so long: poses are turned back by it"},
      self.tilt_doubt_s);
    v(ParamDoc{"pose_jump_m", {0.02, 100}, "poses that jump further are refused"}, self.pose_jump_m);
  }
  template <class Self, class Visitor>
  static void visit_commands(Self& self, Visitor& v) {
    v(ParamDoc{"velocity_stale_s", {0.05, 10}, "a velocity set-point is valid for so long: hold"},
      self.velocity_stale_s);
    v(ParamDoc{"direct_stale_s", {0.01, 10}, "a direct set-point is valid for so long: hold"},
      self.direct_stale_s);
    v(ParamDoc{"pilot_lost_s", {0.1, 600}, "no sign of the pilot for so long: hold"}, self.pilot_lost_s);
    v(ParamDoc{"pilot_gone_s", {0.1, 3600}, "no sign of the pilot for so long: return"}, self.pilot_gone_s);
    v(
        ParamDoc{
            "computer_silent_s", {0.05, 60}, "no sign of the on-board computer for so long: level descent"},
        self.computer_silent_s);
  }
  template <class Self, class Visitor>
  static void visit_vehicle(Self& self, Visitor& v) {
    v(ParamDoc{"battery_after_s", {0, 60}, "duration of a low charge before it counts"},
      self.battery_after_s);
    v(ParamDoc{"battery_empty_ratio", {0, 0.9}, "remaining charge at which the vehicle lands"},
      self.battery_empty_ratio);
    v(ParamDoc{"fence_return_m", {0, 100}, "so far outside of the fence: return"}, self.fence_return_m);
    v(ParamDoc{"fence_land_m", {0, 100}, "so far outside of the fence: land"}, self.fence_land_m);
    v(ParamDoc{"obstacle_margin_m", {0, 10}, "distance from obstacles at which the vehicle comes to rest"},
      self.obstacle_margin_m);
    v(ParamDoc{"no_lift_s", {0.05, 60}, "full thrust and sinking for so long: land"}, self.no_lift_s);
    v(ParamDoc{"no_lift_sink_m_s", {0, 10}, "least sinking speed of that"}, self.no_lift_sink_m_s);
    v(ParamDoc{"imu_gap_s", {0.002, 1}, "without the IMU for so long: motor commands stand"}, self.imu_gap_s);
    v(ParamDoc{"imu_lost_s", {0.005, 5}, "without the IMU for so long: motors off"}, self.imu_lost_s);
    v(ParamDoc{"overturned_rad", {0.2, 3.1}, "larger tilt is a crash"}, self.overturned_rad);
    v(ParamDoc{"overturned_s", {0, 5}, "such a tilt for so long: motors off"}, self.overturned_s);
    v(ParamDoc{"uncontrolled_rad", {0.1, 3.1}, "a tilt that differs more from its command is not controlled"},
      self.uncontrolled_rad);
    v(ParamDoc{"uncontrolled_s", {0.05, 5}, "such a difference for so long: motors off"},
      self.uncontrolled_s);
  }
};

}  // namespace hm
