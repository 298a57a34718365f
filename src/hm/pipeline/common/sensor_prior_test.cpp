#include "hm/pipeline/common/sensor_prior.hpp"

#include <gtest/gtest.h>

namespace hm {
namespace {

RecordingInfo recording_of(RecordingKind kind, double fx, double fy) {
  RecordingInfo info;
  info.kind = kind;
  info.camera.fx = fx;
  info.camera.fy = fy;
  return info;
}

TEST(SensorPrior, AKinectIsKnownByLayoutOrIntrinsics) {
  EXPECT_TRUE(is_from_kinect(recording_of(RecordingKind::kSevenScenes, 585, 585)));
  EXPECT_TRUE(is_from_kinect(recording_of(RecordingKind::kTumRgbd, 517.3, 516.5)));
  EXPECT_TRUE(is_from_kinect(recording_of(RecordingKind::kTumRgbd, 535.4, 539.2)));
  EXPECT_FALSE(is_from_kinect(recording_of(RecordingKind::kTumRgbd, 517.3, 539.2)));
  EXPECT_FALSE(is_from_kinect(recording_of(RecordingKind::kTumRgbd, 481.2, -480)));
}

TEST(SensorPrior, TimesThatAreGivenStay) {
  const RowTimesPrior prior = kinect_row_times();
  EXPECT_GT(prior.readout_s, 0);
  EXPECT_EQ(with_kinect_prior({}).tracker.readout_s, prior.readout_s);
  EXPECT_EQ(with_kinect_prior({}).tracker.color_delay_s, prior.color_delay_s);
  OdometryParams given;
  given.tracker.readout_s = 0.03;
  EXPECT_EQ(with_kinect_prior(given).tracker.readout_s, 0.03);
  EXPECT_EQ(with_kinect_prior(given).tracker.color_delay_s, 0);
  OdometryParams fixed;
  fixed.tracker.estimate_row_times = false;
  EXPECT_EQ(with_kinect_prior(fixed).tracker.readout_s, 0);
}

}  // namespace
}  // namespace hm
