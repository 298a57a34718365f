#pragma once
#include <string>
#include <vector>

#include "hm/geometry/camera.hpp"
#include "hm/sensors/rgbd_frame.hpp"

namespace hm {

/// Two frames of a recording that see much the same from different places. Both have poses.
struct FramePair {
  RgbdFrame from;
  RgbdFrame to;
};

/// One way to read a recording, where its files leave it open.
struct ReadingHypothesis {
  bool poses_inverted = false;  ///< the given poses are T_camera_world
  bool fy_flipped = false;
  bool real_part_first = false;  ///< quaternions are qw qx qy qz, and were read as qx qy qz qw
  bool poses_ignored = false;    ///< as if the camera had not moved: what a reading must beat
  double depth_factor = 1.0;

  [[nodiscard]] int changes() const {
    return poses_inverted + fy_flipped + real_part_first + (depth_factor != 1.0);
  }
};
std::string to_string(const ReadingHypothesis& hypothesis);

/// Agreement of depth and poses over one pair, or a summary of many.
struct Agreement {
  double median_m = 0;  ///< median |z predicted - z measured|, in the hypothesis' own metres
  double relative = 1;  ///< median of |z predicted - z measured| / z measured; 1 when nothing overlaps
  /// Median over tiles of 80 x 80 pixels of |mean of (z predicted - z measured) / z measured|: what is left
  /// of the difference when the noise of single pixels is averaged out. 1 when nothing overlaps.
  double systematic = 1;
  /// Turn about an axis in the image plane that these means show, as far as surfaces face the camera.
  double tilt_rad = 0;
  double overlap_ratio = 0;  ///< share of the points moved that met a valid depth
  /// Share of the points that the other view saw through: they stand clearly in front of what it measured.
  /// Of those only that it could have seen (points behind are hidden). 0 when nothing overlaps.
  double contradicted_ratio = 0;
};

/// Moves every sixth pixel of one depth image into the other frame by the poses, and compares. Both frames
/// have poses; `camera` has no distortion.
Agreement compare(const RgbdFrame& from, const RgbdFrame& to, const PinholeCamera& camera,
                  const ReadingHypothesis& hypothesis);

/// Compares many pairs, each as compare(); median_of() gives the medians over them.
std::vector<Agreement> compare_all(const std::vector<FramePair>& pairs, const PinholeCamera& camera,
                                   const ReadingHypothesis& hypothesis);
Agreement median_of(const std::vector<Agreement>& agreements);

/// Everything worth a try: as given, poses ignored, then one change, then two (quaternions in the other order
/// only alone). Depth scales are round
/// multiples of that given (in units per metre), and the usual ones: 1000 and 5000.
std::vector<ReadingHypothesis> reading_hypotheses(double units_per_m);

}  // namespace hm
