#pragma once
#include <cstdint>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Depth of a structured-light camera's raw disparity d: z = 1 / (offset_per_m + slope_per_m d). The defaults
/// are OpenKinect's for the first Kinect ("Imaging Information"); devices differ by a few percent,
/// `fit_disparity_camera()` fits those of one.
struct DisparityModel {
  double offset_per_m = 3.3309495161, slope_per_m = -0.0030711016;

  /// Depth in metres; 0 where the disparity corresponds to no depth in front of the camera.
  [[nodiscard]] double depth_m(double disparity) const;
  /// Disparity at a depth > 0 in metres.
  [[nodiscard]] double disparity(double depth_m) const { return (1 / depth_m - offset_per_m) / slope_per_m; }
};

/// Checks a model; error unless both numbers are finite and of opposite sign, so that depth grows with
/// disparity.
Result<void> check_disparity(const DisparityModel& model);

/// Converts images of raw 11-bit disparity to depth by table lookup. Const members are thread-safe.
class DisparityTable {
 public:
  static constexpr std::uint16_t kNone =
      2047;  ///< the device's marker of no reading, as are 0 and larger values

  DisparityTable(const DisparityModel& model, double unit_m);
  /// Converts disparity in place to depth in units of `unit_m`, rounded; 0 without a reading or beyond 65535.
  void apply(Image<std::uint16_t>& raw) const;

 private:
  std::vector<std::uint16_t> units_;  ///< of each disparity
};

}  // namespace hm
