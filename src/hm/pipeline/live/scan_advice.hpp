#pragma once
#include <optional>
#include <string>
#include <vector>

#include "hm/geometry/trajectory.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

enum class AdviceLevel { kOk, kWarning, kBad };

/// A sentence for the person who scans: what is wrong now, with the number that shows it.
struct ScanAdvice {
  AdviceLevel level = AdviceLevel::kOk;
  std::string text;    ///< "too fast"
  std::string number;  ///< "74 deg/s; keep below 60"
};

/// View of a depth camera at a moment, by a sample of its pixels.
struct FrameLook {
  double depth_share = 0;                 ///< of pixels with a reading
  std::optional<double> median_depth_m;   ///< of those
  std::optional<double> mean_brightness;  ///< 0 to 255; nothing without a colour image
};
FrameLook look_at(const DepthImage& depth, const Image<Rgb8>& color);

/// Input of the advice.
struct ScanMoment {
  Time stamp;
  std::optional<SE3> T_map_camera;
  std::string trouble;  ///< why there is no pose
  bool has_frame = true;
  std::optional<FrameLook> look;  ///< of the last picture that was looked at
};

/// Advises a person who carries the camera about faults: lost, too fast, too near, dark, no depth. Not thread
/// safe.
class ScanAdviser {
 public:
  /// Frames in order of time; the worst sentence first, none when all is well.
  std::vector<ScanAdvice> advise(const ScanMoment& moment);

 private:
  void judge_motion(const ScanMoment& moment, std::vector<ScanAdvice>& all);

  std::optional<StampedPose> last_;
  double speed_m_s_ = 0, turn_rad_s_ = 0;  ///< smoothed
};

}  // namespace hm
