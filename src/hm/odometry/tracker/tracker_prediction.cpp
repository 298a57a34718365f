#include "hm/odometry/tracker/tracker_prediction.hpp"

#include <algorithm>
#include <cmath>

#include "hm/core/check.hpp"

namespace hm {
namespace {

constexpr std::size_t kCoarsePixels = 2000;
constexpr double kSurfaceElements = 1200;         // at most, of those compared
constexpr double kClearlyBetterBySurface = 0.85;  // intensity difference relative to the photometric result
constexpr double kMaxExtrapolation_s = 0.5;
// Correlation. Blurred pictures of one place have 0.85 and more (fr1/rpy, simulated house); of unlike views
// of a recording, at most four pairs in a thousand have more.
constexpr double kSamePicture = 0.6;

int surface_stride(const DepthGrid& grid) {
  const double cells = static_cast<double>(grid.depth_m.size());
  return std::max(1, static_cast<int>(std::ceil(std::sqrt(cells / kSurfaceElements))));
}

}  // namespace

SE3 renormalised(const SE3& pose) {
  constexpr double kMostOff = 1e-10;
  const Mat3& R = pose.rotation();
  if ((R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff() <= kMostOff) return pose;
  return {pose.quaternion(), pose.translation()};
}

void ConstantVelocity::update(const SE3& T_last_current, double duration_s) {
  HM_CHECK(duration_s > 0, "{} s", duration_s);
  twist_ = T_last_current.log() / duration_s;
}

SE3 ConstantVelocity::motion(double duration_s) const {
  return SE3::exp(twist_ * std::min(duration_s, kMaxExtrapolation_s));
}

PredictionReference make_prediction_reference(const TrackerFrame& frame, const PinholeCamera& camera) {
  if (frame.pyramid.levels() == 0) return {{}, frame.grid};
  return {PhotometricReference(frame.pyramid, frame.grid, camera, kCoarsePixels), frame.grid};
}

std::vector<SurfaceMotion> motions_by_surface(const PredictionReference& reference, const TrackerFrame& frame,
                                              const std::vector<SE3>& guesses_T_ref_cur,
                                              const DepthNoise& noise) {
  const std::vector<SurfaceElement> surface =
      sample_surface(reference.grid, noise, surface_stride(reference.grid));
  std::vector<SurfaceMotion> motions;
  for (const SE3& guess : guesses_T_ref_cur)
    if (const auto motion = follow_surface(surface, frame.grid, guess, noise)) motions.push_back(*motion);
  return motions;
}

std::optional<bool> shows_the_same(const PredictionReference& reference, const TrackerFrame& frame,
                                   const SE3& T_ref_cur) {
  const auto correlation = picture_correlation(reference.picture, frame.pyramid, T_ref_cur);
  return correlation ? std::optional(*correlation > kSamePicture) : std::nullopt;
}

SE3 predict_motion(const PredictionReference& reference, const TrackerFrame& frame, const MotionGuess& guess,
                   const DepthNoise& noise) {
  std::vector<SE3> guesses{guess.by_velocity, SE3{}};
  if (guess.R_ref_cur)
    guesses.insert(guesses.begin(), SE3(*guess.R_ref_cur, guess.by_velocity.translation()));
  const PhotometricResult coarse = align_photometrically(reference.picture, frame.pyramid, guesses);
  if (!guess.may_have_turned_far) return coarse.T_ref_cur;
  const PhotometricResult turned = search_turns(reference.picture, frame.pyramid, coarse, {guesses.front()});
  std::vector<SE3> motions;
  for (const SurfaceMotion& motion : motions_by_surface(reference, frame, guesses, noise))
    motions.push_back(motion.T_ref_cur);
  if (motions.empty()) return turned.T_ref_cur;
  const PhotometricResult by_surface = align_photometrically(reference.picture, frame.pyramid, motions);
  return by_surface.residual < kClearlyBetterBySurface * turned.residual ? by_surface.T_ref_cur
                                                                         : turned.T_ref_cur;
}

}  // namespace hm
