#pragma once
#include <array>
#include <string_view>

#include "hm/core/params.hpp"
#include "hm/odometry/feature/feature_params.hpp"
#include "hm/odometry/interface/published_params.hpp"
#include "hm/odometry/interface/tracker_params.hpp"

namespace hm {

/// How poses are found: the default tracker, or the dissertation's pipeline as it was published with ICP
/// alone, with RANSAC predicting it, or RANSAC from frame to frame without a model (dissertation 3.2,
/// Fig. 3.9).
enum class OdometryMethod { kTracker, kPublishedIcp, kPublishedRansacIcp, kFrameToFrame };
inline constexpr std::array<std::string_view, 4> kOdometryMethodNames{
    "tracker", "published_icp", "published_ransac_icp", "frame_to_frame"};

/// What the tracker takes from an inertial device that was carried along: the gyroscope predicts rotations,
/// gravity holds roll and pitch.
enum class ImuUse { kOff, kGyroscope, kGravity, kBoth };
inline constexpr std::array<std::string_view, 4> kImuUseNames{"off", "gyroscope", "gravity", "both"};

/// `visit` gives the section `odometry`; the members that are parameter structs have their own sections.
struct OdometryParams {
  OdometryMethod method = OdometryMethod::kTracker;
  ImuUse use_imu = ImuUse::kOff;  ///< it was not seen to pay (docs/odometry_pipeline.md)
  double gravity_sigma_rad = 0.02;
  double max_depth_m = 5.5;
  double max_depth_sigma_m = 0.05;
  FeatureParams features;     ///< of every method but the published ones, section `odometry_features`
  PublishedParams published;  ///< section `odometry_published`
  TrackerParams tracker;      ///< section `odometry_tracker`

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& v) {
    v(ParamDoc{"method", {}, "how poses are found", ParamLevel::kBasic}, self.method, kOdometryMethodNames);
    v(ParamDoc{"use_imu",
               {},
               "what the tracker takes from an inertial device, where there is one",
               ParamLevel::kBasic},
      self.use_imu, kImuUseNames);
    v(ParamDoc{"gravity_sigma_rad", {1e-4, 1}, "deviation of roll and pitch by gravity, of one frame"},
      self.gravity_sigma_rad);
    v(ParamDoc{"max_depth_m", {0.1, 100}, "readings beyond are not used for features", ParamLevel::kBasic},
      self.max_depth_m);
    v(ParamDoc{"max_depth_sigma_m", {1e-4, 10}, "features whose depth is less certain are used without it"},
      self.max_depth_sigma_m);
  }
};

}  // namespace hm
