#include "rgbd/peer_opencv.hpp"

#include <limits>
#include <opencv2/imgproc.hpp>
#include <opencv2/rgbd/depth.hpp>

namespace hm::bench {
namespace {

cv::Mat gray_of(const RgbdFrame& frame) {
  const cv::Mat color(frame.color.height(), frame.color.width(), CV_8UC3,
                      const_cast<Rgb8*>(frame.color.data()));
  cv::Mat gray;
  cv::cvtColor(color, gray, cv::COLOR_RGB2GRAY);
  return gray;
}

/// Metres, NaN where there is no reading.
cv::Mat depth_of(const RgbdFrame& frame) {
  cv::Mat depth(frame.depth.height(), frame.depth.width(), CV_32FC1);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      depth.at<float>(y, x) = frame.depth.units(x, y) == 0 ? std::numeric_limits<float>::quiet_NaN()
                                                           : static_cast<float>(frame.depth.depth_m(x, y));
    }
  }
  return depth;
}

cv::Ptr<cv::rgbd::Odometry> make(OpencvMethod method, const PinholeCamera& camera) {
  const cv::Mat matrix =
      (cv::Mat_<float>(3, 3) << static_cast<float>(camera.fx), 0.F, static_cast<float>(camera.cx), 0.F,
       static_cast<float>(camera.fy), static_cast<float>(camera.cy), 0.F, 0.F, 1.F);
  if (method == OpencvMethod::kRgbd) return cv::rgbd::RgbdOdometry::create(matrix);
  return cv::rgbd::RgbdICPOdometry::create(matrix);
}

SE3 to_motion(const cv::Mat& matrix) {
  Mat3 rotation;
  Vec3 translation;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) rotation(row, column) = matrix.at<double>(row, column);
    translation(row) = matrix.at<double>(row, 3);
  }
  return {Eigen::Quaterniond(rotation), translation};
}

}  // namespace

struct OpencvOdometry::Impl {
  cv::Ptr<cv::rgbd::Odometry> odometry;
  cv::Ptr<cv::rgbd::OdometryFrame> last;
  SE3 T_odom_camera;
  int failures = 0;
};

OpencvOdometry::OpencvOdometry(OpencvMethod method, const PinholeCamera& camera)
    : impl_(std::make_unique<Impl>()) {
  cv::setNumThreads(1);
  impl_->odometry = make(method, camera);
}

OpencvOdometry::~OpencvOdometry() = default;

SE3 OpencvOdometry::track(const RgbdFrame& frame) {
  cv::Ptr<cv::rgbd::OdometryFrame> current = cv::rgbd::OdometryFrame::create(gray_of(frame), depth_of(frame));
  if (impl_->last) {
    // From the source's coordinates to the destination's; the frames keep what is computed of them.
    cv::Mat T_last_current;
    if (impl_->odometry->compute(current, impl_->last, T_last_current)) {
      impl_->T_odom_camera = impl_->T_odom_camera * to_motion(T_last_current);
    } else {
      ++impl_->failures;
    }
  }
  impl_->last = current;
  return impl_->T_odom_camera;
}

int OpencvOdometry::failures() const { return impl_->failures; }

}  // namespace hm::bench
