#pragma once
#include <array>
#include <string_view>

#include "hm/core/params.hpp"
#include "hm/odometry/feature/feature_params.hpp"
#include "hm/odometry/interface/published_params.hpp"
#include "hm/odometry/interface/tracker_params.hpp"

namespace hm {

/// Odometry method: the default tracker, or the dissertation's pipeline as published, with ICP only, ICP
/// initialised by RANSAC, or frame-to-frame RANSAC without a model (dissertation 3.2, Fig. 3.9).
enum class OdometryMethod { kTracker, kPublishedIcp, kPublishedRansacIcp, kFrameToFrame };
inline constexpr std::array<std::string_view, 4> kOdometryMethodNames{
    "tracker", "published_icp", "published_ransac_icp", "frame_to_frame"};

/// IMU data used by the tracker: the gyroscope predicts rotations, gravity constrains roll and pitch, or both
/// independently; `inertial`: preintegrated readings predict poses (of an accelerometer alone: gravity);
/// `auto`: the same if there are a gyroscope and an accelerometer, otherwise off.
enum class ImuUse { kOff, kGyroscope, kGravity, kBoth, kInertial, kAuto };
inline constexpr std::array<std::string_view, 6> kImuUseNames{"off",  "gyroscope", "gravity",
                                                              "both", "inertial",  "auto"};

/// Parameters of the section `odometry`; members that are parameter structs have their own sections.
struct OdometryParams {
  OdometryMethod method = OdometryMethod::kTracker;
  ImuUse use_imu = ImuUse::kAuto;
  double gravity_sigma_rad = 0.02;
  double max_depth_m = 5.5;
  double max_depth_sigma_m = 0.05;
  FeatureParams features;     ///< for all but the published methods; section `odometry_features`
  PublishedParams published;  ///< section `odometry_published`
  TrackerParams tracker;      ///< section `odometry_tracker`

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"method",
               {},
               "odometry method: the default tracker, or the pipeline as published",
               ParamLevel::kBasic},
      self.method, kOdometryMethodNames);
    v(ParamDoc{"use_imu", {}, "IMU data used by the tracker, if available", ParamLevel::kBasic}, self.use_imu,
      kImuUseNames);
    v(ParamDoc{"gravity_sigma_rad", {1e-4, 1}, "standard deviation of roll and pitch from gravity per frame"},
      self.gravity_sigma_rad);
    v(
        ParamDoc{
            "max_depth_m", {0.1, 100}, "readings beyond this are not used for features", ParamLevel::kBasic},
        self.max_depth_m);
    v(ParamDoc{"max_depth_sigma_m",
               {1e-4, 10},
               "features with a larger depth standard deviation are used without depth"},
      self.max_depth_sigma_m);
  }
};

}  // namespace hm
