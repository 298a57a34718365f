#include "hm/odometry/tracker/tracker_matching.hpp"

#include <Eigen/Dense>
#include <cmath>

#include "hm/odometry/feature/depth_uncertainty.hpp"

namespace hm {
namespace {

void read_depth(const DepthImage& depth, const RowMotion& rows, double expected_m,
                const MatchingParams& params, PointObservation& observation) {
  const Vec2 pixel = rows.in_depth_image(observation.pixel, expected_m);
  const int x = static_cast<int>(std::lround(pixel.x()));
  const int y = static_cast<int>(std::lround(pixel.y()));
  const auto reading = mixture_depth(depth, x, y, params.noise);
  if (!reading || reading->mean_m > params.max_depth_m) return;
  if (reading->variance_m2 > params.max_depth_sigma_m * params.max_depth_sigma_m) return;
  observation.depth_m = rows.depth_at_middle_row(pixel, reading->mean_m);
  observation.depth_variance_m2 = reading->variance_m2;
}

}  // namespace

std::vector<LandmarkMatch> match_landmarks(const LocalMap& map, const TrackerFrame& frame,
                                           const SE3& T_odom_camera, const PinholeCamera& camera,
                                           const MatchingParams& params,
                                           std::vector<std::size_t>& looked_for) {
  std::vector<LandmarkMatch> matches;
  const RowMotion rows = frame.motion.rows_at(T_odom_camera);
  const double turn_sigma_rad_s = frame.motion.turn_sigma_rad_s(T_odom_camera);
  const Mat3 R_camera_odom = T_odom_camera.rotation().transpose();
  for (const Candidate& candidate : map.candidates(T_odom_camera, camera, params.limit)) {
    const MapLandmark& landmark = map.landmark(candidate.landmark);
    const MapKeyframe* anchor = map.find(landmark.anchor);
    const SE3 T_ref_cur = anchor->T_odom_camera.inverse() * T_odom_camera;
    const auto warp = plane_warp(camera, T_ref_cur, candidate.p_camera, R_camera_odom * landmark.normal_odom);
    if (!warp) continue;
    looked_for.push_back(candidate.landmark);
    const auto match = align_patch({&anchor->pyramid, landmark.anchor_pixel, *warp}, frame.pyramid,
                                   rows.in_image(candidate.pixel, candidate.p_camera.z()), params.search);
    if (!match) continue;
    LandmarkMatch found{candidate.landmark, {}, false, match->pixel};
    found.observation.p_odom = landmark.p_odom;
    found.observation.covariance = landmark.covariance;
    found.observation.pixel = rows.at_middle_row(match->pixel, candidate.p_camera.z());
    found.observation.pixel_covariance =
        match->information.inverse() + Mat2::Identity() * params.pixel_sigma_px * params.pixel_sigma_px;
    if (!rows.is_zero()) {
      const double by_turn_px = camera.fx * turn_sigma_rad_s * rows.time_s(match->pixel.y());
      found.observation.pixel_covariance += Mat2::Identity() * by_turn_px * by_turn_px;
    }
    read_depth(frame.frame->depth, rows, candidate.p_camera.z(), params, found.observation);
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
