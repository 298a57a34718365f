#pragma once
#include "hm/control/cascade.hpp"
#include "hm/flight/flight_command.hpp"
#include "hm/flight/flown_path.hpp"

namespace hm {

struct GuidanceParams {
  float takeoff_height_m = 1.3F;
  float takeoff_climb_m_s = 0.5F;
  float descend_m_s = 0.4F;
  float arrival_m = 0.2F;
  float fence_radius_m = 50;
  float fence_height_m = 10;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"takeoff_height_m", {0.2, 100}, "height above the place of take-off", ParamLevel::kBasic},
      self.takeoff_height_m);
    v(ParamDoc{"takeoff_climb_m_s", {0.05, 5}, "maximum speed at take-off"}, self.takeoff_climb_m_s);
    v(ParamDoc{"descend_m_s", {0.05, 2}, "sinking speed of landings"}, self.descend_m_s);
    v(ParamDoc{"arrival_m", {0.02, 5}, "distance at which a way point counts as reached"}, self.arrival_m);
    v(ParamDoc{"fence_radius_m", {1, 1e5}, "radius of the fence about home", ParamLevel::kBasic},
      self.fence_radius_m);
    v(ParamDoc{"fence_height_m", {1, 1e4}, "height of the fence above home", ParamLevel::kBasic},
      self.fence_height_m);
  }
};

/// Inputs of the guidance besides the phase.
struct GuidanceSigns {
  bool pose_lost = false;                      ///< the position is not known
  bool height_lost = false;                    ///< the height is not known
  bool fence_ahead = false;                    ///< the vehicle would come to rest outside of the fence
  float speed_std_m_s = 0, climb_std_m_s = 0;  ///< standard deviations of the velocity, along an axis
  float hover_thrust_ratio = 0.485F;
  float thrust_share = 1;  ///< in kTouchDown
};

/// Turns phases and commands into what the cascade flies.
class Guidance {
 public:
  explicit Guidance(const GuidanceParams& params = {}) : params_(params) {}

  /// Take-off from here: home, the fence's centre, and the goal above. Height 0: the parameter's.
  void take_off(const ControlState& state, float yaw_rad, float height_m);
  /// A phase begins; `rest` is where the set-points would come to rest.
  void enter(FlightPhase phase, const ControlState& state, const MotionReference& reference,
             const Vec3f& rest);
  /// New goals. Outside of the fence: kOutOfRange, and nothing changes.
  Refusal go_to(const Vec3f& position_m, float yaw_rad);
  Refusal step_by(const Vec3f& step_level_m, float step_yaw_rad, float yaw_rad);
  void set_velocity(const FlightCommand& command) { set_point_ = command; }

  /// One step in the air.
  CascadeCommand step(FlightPhase phase, const ControlState& state, float yaw_rad,
                      const GuidanceSigns& signs);
  /// kTakeOff: the height is reached. kReturn: home is reached.
  [[nodiscard]] bool arrived() const { return arrived_; }
  /// Thrust at the moment of touch-down, which the ramp starts from.
  void note_thrust(float thrust_ratio) { touchdown_thrust_ = thrust_ratio; }

  /// How far a point lies outside of the fence; 0 inside.
  [[nodiscard]] float outside_m(const Vec3f& position_m) const;
  [[nodiscard]] float way_home_m(const Vec3f& position_m) const { return path_.length_m(position_m); }
  [[nodiscard]] const Vec3f& goal_m() const { return goal_m_; }
  /// Vertical speed that the last step asked for, for the touch-down detector.
  [[nodiscard]] float wanted_climb_m_s() const { return wanted_climb_m_s_; }

 private:
  void follow_goal(CascadeCommand& command) const;
  void fly_home(CascadeCommand& command, const ControlState& state);
  void fly_velocity(CascadeCommand& command, float yaw_rad, bool fence_ahead) const;
  void fly_path(CascadeCommand& command) const;
  void fly_directly(CascadeCommand& command) const;
  void descend(CascadeCommand& command, const ControlState& state, const GuidanceSigns& signs) const;
  void touch_down(CascadeCommand& command, const GuidanceSigns& signs) const;
  void descend_blindly(CascadeCommand& command, FlightPhase phase, const ControlState& state,
                       const GuidanceSigns& signs);
  void sink_slowly(CascadeCommand& command, const ControlState& state, const GuidanceSigns& signs);

  GuidanceParams params_;
  FlownPath path_;
  Vec3f home_m_ = Vec3f::Zero(), goal_m_ = Vec3f::Zero();
  float goal_yaw_rad_ = 0, touchdown_thrust_ = 0, wanted_climb_m_s_ = 0;
  FlightCommand set_point_;  // newest of kVelocity, kDirect, kPath
  bool arrived_ = false;
  float sink_left_m_ = 0,
        sink_share_ = 1;  // without a height: way to the ground, and what is left of the thrust
  FlightPhase phase_ = FlightPhase::kGround;  // entered last
};

}  // namespace hm
