#include "hm/odometry/tracker/tracker_frame.hpp"

#include "hm/odometry/feature/feature_detection.hpp"

namespace hm {

TrackerFrame make_tracker_frame(const RgbdFrame& frame, const PinholeCamera& camera, const DepthNoise& noise,
                                double max_depth_m) {
  constexpr int kPyramidLevels = 5;
  TrackerFrame view;
  view.frame = &frame;
  if (!frame.color.empty()) view.pyramid = ImagePyramid(to_gray(frame.color), kPyramidLevels);
  view.grid = make_depth_grid(frame.depth, camera, noise, max_depth_m);
  return view;
}

}  // namespace hm
