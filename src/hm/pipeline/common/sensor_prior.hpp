#pragma once
#include "hm/io/rgbd/recording.hpp"
#include "hm/odometry/interface/odometry_params.hpp"

namespace hm {

/// Whether the images are a Kinect's or an Xtion's, whose colour cameras have a rolling shutter: 7-Scenes,
/// and recordings with the intrinsics of a camera of the TUM RGB-D benchmark.
[[nodiscard]] bool is_from_kinect(const RecordingInfo& info);

/// Times of the rows of a Kinect's colour images, as the tracker assumes them before it has estimated them.
struct RowTimesPrior {
  double readout_s = 0;      ///< from the first row to the last
  double color_delay_s = 0;  ///< from the depth image to the middle row of the colour image
};
[[nodiscard]] RowTimesPrior kinect_row_times();

/// Parameters with a Kinect's times of the colour image's rows, unless the parameters give some.
[[nodiscard]] OdometryParams with_kinect_prior(OdometryParams params);

}  // namespace hm
