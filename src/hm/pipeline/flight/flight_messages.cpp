#include "hm/pipeline/flight/flight_messages.hpp"

#include <fmt/format.h>

#include "hm/core/angle.hpp"
#include "hm/flight/flight_text.hpp"

namespace hm {
namespace {

constexpr std::size_t kFrame = 8, kStamp = 8, kNumber = 4;

struct UpLength {
  std::size_t operator()(std::monostate) const { return 1; }
  std::size_t operator()(const PoseMessage& m) const {
    return kStamp + (m.pose.covariance ? 9 : 3) * kNumber;
  }
  std::size_t operator()(const HeightMessage&) const { return kStamp + 3 * kNumber; }
  std::size_t operator()(const ObstacleMessage& m) const { return kStamp + m.free.units.size(); }
  std::size_t operator()(const FlightCommand&) const { return kStamp + 4 + 14 * kNumber; }
  std::size_t operator()(const TimeQuestion&) const { return kStamp; }
};

struct DownLength {
  std::size_t operator()(const ImuSample& sample) const {
    return kStamp + (sample.R_world_imu ? 10 : 6) * kNumber;  // the orientation as a quaternion
  }
  std::size_t operator()(const StateMessage&) const { return kStamp + 6 * kNumber; }
  std::size_t operator()(const TimeAnswer&) const { return 2 * kStamp; }
};

}  // namespace

bool is_goal_moved(const Vec2& goal_map_m, const SE2& T_map_odom_then, const SE2& T_map_odom_now) {
  constexpr double kLeast_m = 2e-3;
  return (T_map_odom_then.inverse() * goal_map_m - T_map_odom_now.inverse() * goal_map_m).norm() > kLeast_m;
}

std::size_t bytes_on_wire(const UpMessage& message) { return kFrame + std::visit(UpLength{}, message); }
std::size_t bytes_on_wire(const DownMessage& message) { return kFrame + std::visit(DownLength{}, message); }

std::string fail_safe_text(FailSafe which, const AutopilotOutputs& outputs) {
  std::string text(text_of(which));
  if (which == FailSafe::kTiltMismatch && outputs.tilt_mismatch_rad)
    text += fmt::format(" by {:.0f} degrees",
                        static_cast<double>(*outputs.tilt_mismatch_rad) * kDegreesPerRadian);
  return text;
}

}  // namespace hm
