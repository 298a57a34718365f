#pragma once
#include "hm/core/time.hpp"
#include "hm/odometry/feature.hpp"

namespace hm {

/// A frame that later ones refer to: for relocalisation, place recognition, bundle adjustment and maps
/// (dissertation 3.3). Pictures are not kept: `frame_index` finds them in the recording.
struct Keyframe {
  std::size_t frame_index = 0;
  Time stamp;
  int submap = 0;  ///< a new one begins where tracking was lost and found no place again
  SE3 T_odom_camera;
  FeatureSet features;  ///< all of the frame, with descriptors; those without depth too
};

}  // namespace hm
