#pragma once
#include <optional>
#include <span>
#include <vector>

#include "hm/core/parallel.hpp"
#include "hm/core/rng.hpp"
#include "hm/geometry/camera.hpp"
#include "hm/geometry/image.hpp"
#include "hm/geometry/se3.hpp"
#include "hm/sensors/depth_noise.hpp"
#include "hm/sensors/rgbd_frame.hpp"
#include "hm/sim/sensor/depth_sensor.hpp"

namespace hm {

/// A depth camera with its colour camera, errors and all, that looks at boards (dissertation 3.1).
struct CalibrationRig {
  PinholeCamera color_camera, depth_camera;  ///< with lens distortion
  SE3 T_color_depth;
  DepthNoise noise;           ///< axial
  double warp_at_4m_m = 0.1;  ///< largest bias at 4 m
  /// A device of depth_sensor.hpp, whose bias is made then: that of the recordings it is simulated with.
  std::optional<SensorModel> device;
  double min_depth_m = 0.4, max_depth_m = 6;
  double depth_unit_m = 1e-3;
  double dropout_ratio = 0.02;  ///< readings that are missing
  double gray_sigma = 2;        ///< noise of pictures, grey levels
};

/// An Asus Xtion Pro as its owner's calibration was published: both cameras and the motion between them;
/// axial noise 0.001425 z^2 (dissertation 3.1.3).
CalibrationRig xtion_rig();

/// A device whose colour camera is its depth camera, with the bias and the noise that its recordings have.
CalibrationRig device_rig(SensorPreset preset);

/// What the depth camera reads too much at a (raw) pixel and a true depth: smooth over the image, growing
/// with depth, at most warp_at_4m_m at 4 m; or the device's bias.
double simulated_warp_m(const CalibrationRig& rig, const Vec2& pixel, double depth_m);

/// A flat picture in space: x right, y down from its top left corner, z = 0.
struct FlatPicture {
  const Image<std::uint8_t>& gray;
  double pixel_m = 0.001;
  [[nodiscard]] double width_m() const { return gray.width() * pixel_m; }
  [[nodiscard]] double height_m() const { return gray.height() * pixel_m; }
};

/// Renders flat pictures through one camera with lens distortion.
class FlatRenderer {
 public:
  explicit FlatRenderer(const PinholeCamera& camera);
  [[nodiscard]] const PinholeCamera& camera() const { return camera_; }
  /// What the camera sees, 4 x 4 rays a pixel, against a background that is no pattern; with noise.
  [[nodiscard]] Image<Rgb8> render(const FlatPicture& picture, const SE3& T_camera_picture, double gray_sigma,
                                   Rng& rng) const;
  /// True depth of each pixel that sees the picture; 0 elsewhere.
  [[nodiscard]] Image<float> depth_m(const FlatPicture& picture, const SE3& T_camera_picture) const;

 private:
  struct PixelBox;
  [[nodiscard]] PixelBox box_of(const FlatPicture& picture, const SE3& T_camera_picture) const;
  PinholeCamera camera_;
  std::vector<Eigen::Vector2f> rays_;  ///< x / z and y / z at pixel corners, (width + 1) x (height + 1)
};

/// A reading of a depth image as the rig's depth camera makes it: warp, noise, missing readings, rounding.
DepthImage sense_flat(const CalibrationRig& rig, const Image<float>& true_depth_m, Rng& rng);

/// Where a flat picture may be seen by a camera.
struct FlatView {
  Vec2 pixel = Vec2::Zero();  ///< that its middle is seen at
  double distance_m = 1;      ///< of its middle along z
  double tilt_rad = 0;        ///< from facing the camera
  double tilt_axis_rad = 0;   ///< in the picture's plane
  double roll_rad = 0;
};
SE3 place_picture(const PinholeCamera& camera, const FlatPicture& picture, const FlatView& view);

/// True when a camera sees the whole picture with `margin_px` to spare.
bool sees_whole(const PinholeCamera& camera, const FlatPicture& picture, const SE3& T_camera_picture,
                double margin_px);

}  // namespace hm
