#pragma once
#include "hm/io/rgbd/recording.hpp"
#include "hm/odometry/interface/odometry_params.hpp"

namespace hm {

/// Whether the images are a Kinect's or an Xtion's, whose colour cameras have a rolling shutter: 7-Scenes,
/// and recordings with the intrinsics of a camera of the TUM RGB-D benchmark.
[[nodiscard]] bool is_from_kinect(const RecordingInfo& info);

/// Parameters with a Kinect's times of the colour image's rows, unless the parameters give some.
[[nodiscard]] OdometryParams with_kinect_prior(OdometryParams params);

}  // namespace hm
