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

/// Simulated depth and colour camera with errors, for calibration with boards (dissertation 3.1).
struct CalibrationRig {
  PinholeCamera color_camera, depth_camera;  ///< with lens distortion
  SE3 T_color_depth;
  DepthNoise noise;           ///< axial
  double warp_at_4m_m = 0.1;  ///< largest bias at 4 m
  /// If set, a device of depth_sensor.hpp, whose bias is then used, as in its simulated recordings.
  std::optional<SensorModel> device;
  double min_depth_m = 0.4, max_depth_m = 6;
  double depth_unit_m = 1e-3;
  double dropout_ratio = 0.02;  ///< share of missing readings
  double gray_sigma = 2;        ///< image noise, grey levels
};

/// Asus Xtion Pro with published calibration: both cameras and their extrinsics; axial noise 0.001425 z^2
/// (dissertation 3.1.3).
CalibrationRig xtion_rig();

/// Device whose colour camera is its depth camera, with the bias and noise of its simulated recordings.
CalibrationRig device_rig(SensorPreset preset);

/// Depth bias (measured minus true, metres) at a raw pixel and a true depth: smooth over the image, growing
/// with depth, at most warp_at_4m_m at 4 m; or the device's bias.
double simulated_warp_m(const CalibrationRig& rig, const Vec2& pixel, double depth_m);

/// Planar picture in space, e.g. a board: x right, y down from its top left corner, z = 0.
struct FlatPicture {
  const Image<std::uint8_t>& gray;
  double pixel_m = 0.001;
  [[nodiscard]] double width_m() const { return gray.width() * pixel_m; }
  [[nodiscard]] double height_m() const { return gray.height() * pixel_m; }
};

/// Renders planar pictures through a camera with lens distortion.
class FlatRenderer {
 public:
  explicit FlatRenderer(const PinholeCamera& camera);
  [[nodiscard]] const PinholeCamera& camera() const { return camera_; }
  /// Renders the camera's image with 4 x 4 rays per pixel, a patternless background and noise.
  [[nodiscard]] Image<Rgb8> render(const FlatPicture& picture, const SE3& T_camera_picture, double gray_sigma,
                                   Rng& rng) const;
  /// True depth of each pixel on the picture; 0 elsewhere.
  [[nodiscard]] Image<float> depth_m(const FlatPicture& picture, const SE3& T_camera_picture) const;

 private:
  struct PixelBox;
  [[nodiscard]] PixelBox box_of(const FlatPicture& picture, const SE3& T_camera_picture) const;
  PinholeCamera camera_;
  std::vector<Eigen::Vector2f> rays_;  ///< x / z and y / z at pixel corners, (width + 1) x (height + 1)
};

/// Simulates a depth image of the rig's depth camera: bias, noise, missing readings, rounding.
DepthImage sense_flat(const CalibrationRig& rig, const Image<float>& true_depth_m, Rng& rng);

/// Position of a planar picture relative to a camera.
struct FlatView {
  Vec2 pixel = Vec2::Zero();  ///< projection of its centre
  double distance_m = 1;      ///< depth of its centre
  double tilt_rad = 0;        ///< from facing the camera
  double tilt_axis_rad = 0;   ///< in the picture's plane
  double roll_rad = 0;
};
SE3 place_picture(const PinholeCamera& camera, const FlatPicture& picture, const FlatView& view);

/// True when the whole picture is visible with a margin of `margin_px`.
bool sees_whole(const PinholeCamera& camera, const FlatPicture& picture, const SE3& T_camera_picture,
                double margin_px);

}  // namespace hm
