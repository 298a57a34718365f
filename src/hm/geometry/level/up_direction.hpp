#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "hm/geometry/se3.hpp"

namespace hm {

/// Evidence for the direction "up" of a frame.
enum class UpSource {
  kUnknown,
  kFrame,             ///< by definition of the frame: simulated, or set by the caller
  kFloorAndWalls,     ///< horizontal and vertical surfaces of the scene
  kGravity,           ///< an accelerometer along the path
  kGravityAndLevels,  ///< the same, refined by horizontal and vertical surfaces
};

/// Up direction in a frame. If unknown, `up` is a guess to be used for display only.
struct UpDirection {
  Vec3 up = Vec3::UnitZ();  ///< unit
  UpSource source = UpSource::kUnknown;
  double sigma_rad = 0;  ///< standard deviation of its tilt; 0 if the frame is defined by it

  [[nodiscard]] bool known() const { return source != UpSource::kUnknown; }
};

/// Up is z by definition of the frame.
inline UpDirection z_is_up() { return {Vec3::UnitZ(), UpSource::kFrame, 0}; }

/// "floor and walls", "gravity", ...; empty for kUnknown and kFrame.
std::string_view to_string(UpSource source);
/// Text of a direction, with four decimals unless it is an axis: "z", "-y", "0.0120 -0.9981 0.0604".
std::string axis_text(const Vec3& up);
/// axis_text and the source: "z", "-y (from floor and walls)", "unknown".
std::string to_string(const UpDirection& up);
/// Parses the text of to_string(), which has no standard deviation; nothing for other text.
std::optional<UpDirection> parse_up(std::string_view text);

/// Maximum angle at which `up` is replaced by the nearest axis of the frame: a frame that is level within the
/// accuracy of measurement was most likely levelled on purpose.
inline constexpr double kAxisTolerance_rad = 0.5 * 0.017453292519943295;
Vec3 snapped_to_axis(const Vec3& up);

/// Smallest rotation from `up` to z; about x if up is -z. Exact for the axes of the frame.
Mat3 rotation_to_z_up(const Vec3& up);

/// Orientation of a camera (x right, y down, z forward) at the origin of a level frame (z up) with its
/// horizontal viewing direction along x. `up_camera`: unit, camera frame. For a camera that looks straight up
/// or down, the upper or lower edge of its image is towards x.
SE3 level_pose(const Vec3& up_camera);

}  // namespace hm
