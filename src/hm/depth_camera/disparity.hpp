#pragma once
#include <cstdint>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Depth of a structured-light camera's raw disparity d: z = 1 / (offset_per_m + slope_per_m d). The defaults
/// are those of the first Kinect as OpenKinect publishes them ("Imaging Information"); devices differ from
/// them by some percent, `fit_disparity_camera()` finds those of one.
struct DisparityModel {
  double offset_per_m = 3.3309495161, slope_per_m = -0.0030711016;

  /// Metres; 0 where the disparity is of no depth in front of the camera.
  [[nodiscard]] double depth_m(double disparity) const;
  /// The disparity at a depth > 0.
  [[nodiscard]] double disparity(double depth_m) const { return (1 / depth_m - offset_per_m) / slope_per_m; }
};

/// An error unless both numbers are finite and of different signs, as they must be where depth grows with
/// disparity.
Result<void> check_disparity(const DisparityModel& model);

/// Turns pictures of raw 11-bit disparity into depth; const members may be used from any thread.
class DisparityTable {
 public:
  static constexpr std::uint16_t kNone =
      2047;  ///< the device's mark of no reading; 0 and above: none as well

  DisparityTable(const DisparityModel& model, double unit_m);
  /// In place: disparity becomes depth in units of `unit_m`, rounded; 0 without a reading or beyond 65535.
  void apply(Image<std::uint16_t>& raw) const;

 private:
  std::vector<std::uint16_t> units_;  ///< of each disparity
};

}  // namespace hm
