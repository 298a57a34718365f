#include "hm/odometry/tracker/tracker_matching.hpp"

#include <Eigen/Dense>
#include <cmath>

#include "hm/odometry/feature/depth_uncertainty.hpp"

namespace hm {
namespace {

void read_depth(const DepthImage& depth, const MatchingParams& params, PointObservation& observation) {
  const int x = static_cast<int>(std::lround(observation.pixel.x()));
  const int y = static_cast<int>(std::lround(observation.pixel.y()));
  const auto reading = mixture_depth(depth, x, y, params.noise);
  if (!reading || reading->mean_m > params.max_depth_m) return;
  if (reading->variance_m2 > params.max_depth_sigma_m * params.max_depth_sigma_m) return;
  observation.depth_m = reading->mean_m;
  observation.depth_variance_m2 = reading->variance_m2;
}

}  // namespace

std::vector<LandmarkMatch> match_landmarks(const LocalMap& map, const TrackerFrame& frame,
                                           const SE3& T_odom_camera, const PinholeCamera& camera,
                                           const MatchingParams& params,
                                           std::vector<std::size_t>& looked_for) {
  std::vector<LandmarkMatch> matches;
  const Mat3 R_camera_odom = T_odom_camera.rotation().transpose();
  for (const Candidate& candidate : map.candidates(T_odom_camera, camera, params.limit)) {
    const MapLandmark& landmark = map.landmark(candidate.landmark);
    const MapKeyframe* anchor = map.find(landmark.anchor);
    const SE3 T_ref_cur = anchor->T_odom_camera.inverse() * T_odom_camera;
    const auto warp = plane_warp(camera, T_ref_cur, candidate.p_camera, R_camera_odom * landmark.normal_odom);
    if (!warp) continue;
    looked_for.push_back(candidate.landmark);
    const auto match = align_patch({&anchor->pyramid, landmark.anchor_pixel, *warp}, frame.pyramid,
                                   candidate.pixel, params.search);
    if (!match) continue;
    LandmarkMatch found{candidate.landmark, {}, false};
    found.observation.p_odom = landmark.p_odom;
    found.observation.covariance = landmark.covariance;
    found.observation.pixel = match->pixel;
    found.observation.pixel_covariance =
        match->information.inverse() + Mat2::Identity() * params.pixel_sigma_px * params.pixel_sigma_px;
    read_depth(frame.frame->depth, params, found.observation);
    matches.push_back(found);
  }
  return matches;
}

int count_with_depth(const std::vector<LandmarkMatch>& matches) {
  int count = 0;
  for (const LandmarkMatch& match : matches) count += match.observation.depth_m > 0 ? 1 : 0;
  return count;
}

}  // namespace hm
