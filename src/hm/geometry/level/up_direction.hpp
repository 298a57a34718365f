#pragma once
#include <optional>
#include <string>
#include <string_view>

#include "hm/geometry/se3.hpp"

namespace hm {

/// Evidence for the direction "up" of a frame.
enum class UpSource {
  kUnknown,
  kFrame,             ///< the frame is defined by it: simulated, or said by the caller
  kFloorAndWalls,     ///< level and vertical surfaces of the scene
  kGravity,           ///< an accelerometer along the path
  kGravityAndLevels,  ///< the same, refined by level and vertical surfaces close to it
};

/// Up in a frame. Where it is unknown, `up` is a guess that only pictures may use.
struct UpDirection {
  Vec3 up = Vec3::UnitZ();  ///< unit
  UpSource source = UpSource::kUnknown;
  double sigma_rad = 0;  ///< standard deviation of its tilt; 0 where the frame is defined by it

  [[nodiscard]] bool known() const { return source != UpSource::kUnknown; }
};

/// z, by the definition of a frame.
inline UpDirection z_is_up() { return {Vec3::UnitZ(), UpSource::kFrame, 0}; }

/// "floor and walls", "gravity", ...; empty for kUnknown and kFrame.
std::string_view to_string(UpSource source);
/// "z", "-y", "0.0120 -0.9981 0.0604": the axis of the frame, or the direction with four decimals.
std::string axis_text(const Vec3& up);
/// axis_text and the source: "z", "-y (from floor and walls)", "unknown".
std::string to_string(const UpDirection& up);
/// Parses the text of to_string(), which holds no deviation; nothing for other text.
std::optional<UpDirection> parse_up(std::string_view text);

/// The frame's own axis if `up` is within this of one: a frame that is level but for what cannot be told from
/// measurements was most likely made level.
inline constexpr double kAxisTolerance_rad = 0.5 * 0.017453292519943295;
Vec3 snapped_to_axis(const Vec3& up);

/// The smallest rotation that turns `up` to z; about x where up is -z. Exact for the axes of the frame.
Mat3 rotation_to_z_up(const Vec3& up);

/// Orientation of a camera (x right, y down, z forward) at the origin of a level frame (z up) in which it
/// looks along x as seen from above. `up_camera`: unit, in the camera's frame. A camera that looks straight
/// up or down has its image's upper or lower edge towards x.
SE3 level_pose(const Vec3& up_camera);

}  // namespace hm
