#pragma once
#include "hm/control/axis_mode.hpp"
#include "hm/control/jerk_limited_axis.hpp"
#include "hm/core/param_doc.hpp"
#include "hm/geometry/float/float_math.hpp"

namespace hm {

struct ShaperParams {
  float speed_m_s = 1.5F;
  float climb_m_s = 1.0F, sink_m_s = 0.7F;
  float acceleration_m_s2 = 2.5F;
  float jerk_m_s3 = 8;
  float yaw_rate_rad_s = 1;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"speed_m_s", {0.05, 20}, "maximum horizontal speed", ParamLevel::kBasic}, self.speed_m_s);
    v(ParamDoc{"climb_m_s", {0.05, 10}, "maximum speed upwards"}, self.climb_m_s);
    v(ParamDoc{"sink_m_s", {0.05, 10}, "maximum speed downwards"}, self.sink_m_s);
    v(ParamDoc{"acceleration_m_s2", {0.1, 9}, "maximum acceleration of set-points"}, self.acceleration_m_s2);
    v(ParamDoc{"jerk_m_s3", {0.5, 200}, "maximum change of that acceleration in a second"}, self.jerk_m_s3);
    v(ParamDoc{"yaw_rate_rad_s", {0.05, 6}, "maximum yaw rate"}, self.yaw_rate_rad_s);
  }
};

/// Modes of the groups of axes of the default cascade. Horizontal: x and y of the odom frame; kDirect means
/// roll and pitch.
struct FlightModes {
  AxisMode horizontal = AxisMode::kDisabled, vertical = AxisMode::kDisabled, heading = AxisMode::kDisabled;
  friend bool operator==(const FlightModes&, const FlightModes&) = default;
};

/// Where to go, in the odom frame: position and yaw count in kPosition, velocity and yaw rate in kVelocity.
struct MotionGoal {
  Vec3f position_m = Vec3f::Zero(), velocity_m_s = Vec3f::Zero();
  float yaw_rad = 0, yaw_rate_rad_s = 0;
};

/// A moment of a motion, in the odom frame.
struct MotionReference {
  Vec3f position_m = Vec3f::Zero(), velocity_m_s = Vec3f::Zero(), acceleration_m_s2 = Vec3f::Zero();
  float yaw_rad = 0, yaw_rate_rad_s = 0;
};

/// Turns goals, which may jump at any time, into a motion within limits of speed, acceleration and jerk that
/// can always stop. Horizontally it goes straight from where it would come to rest to the goal; while it
/// turns towards a new goal the acceleration along and across may add up to 1.41 times the limit. Yaw takes
/// the shorter way round.
class SetpointShaper {
 public:
  SetpointShaper(const ShaperParams& params, float step_s) : params_(params), step_s_(step_s) {}

  /// Starts from a state. Accelerations beyond the limit are reduced to it.
  void start_from(const MotionReference& state);
  void start_horizontal_from(const Vec3f& position_m, const Vec3f& velocity_m_s,
                             const Vec3f& acceleration_m_s2);
  void start_vertical_from(float position_m, float velocity_m_s, float acceleration_m_s2);
  void start_heading_from(float yaw_rad, float yaw_rate_rad_s);
  /// One step. In kVelocity (kDirect, kDisabled) the reference's position is the measured one.
  const MotionReference& step(const FlightModes& modes, const MotionGoal& goal, const Vec3f& measured_m,
                              float measured_yaw_rad);
  /// Smaller limits than the parameters from the next step on, for as long as they are set; larger ones do
  /// not count. Speed horizontal, up and down.
  void limit_speed(float speed_m_s, float climb_m_s, float sink_m_s);
  [[nodiscard]] const MotionReference& reference() const { return reference_; }
  /// Where the reference would come to rest if it braked now.
  [[nodiscard]] Vec3f stopping_point() const;

 private:
  void step_horizontal(AxisMode mode, const MotionGoal& goal, const Vec3f& measured_m);
  void step_vertical(AxisMode mode, const MotionGoal& goal, float measured_m);
  void step_heading(AxisMode mode, const MotionGoal& goal, float measured_rad);
  void follow_horizontal_goal(const Vec3f& goal_m, const AxisLimits& limits);
  void align_to(float x, float y);
  [[nodiscard]] AxisLimits horizontal_limits() const;
  [[nodiscard]] AxisLimits vertical_limits() const;
  [[nodiscard]] AxisLimits heading_limits() const;
  [[nodiscard]] float world_x(float along, float across) const { return cos_ * along - sin_ * across; }
  [[nodiscard]] float world_y(float along, float across) const { return sin_ * along + cos_ * across; }

  ShaperParams params_;
  float step_s_;
  float max_speed_m_s_ = 1e3F, max_climb_m_s_ = 1e3F, max_sink_m_s_ = 1e3F;
  MotionReference reference_;
  Vec3f goal_m_ = Vec3f::Zero();  // to which the distances to go lead
  float goal_yaw_rad_ = 0;
  JerkLimitedAxis along_, across_, vertical_, heading_;
  float cos_ = 1, sin_ = 0;  // direction of the axis `along`
};

}  // namespace hm
