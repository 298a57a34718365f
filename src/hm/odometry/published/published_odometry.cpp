#include "hm/odometry/published/published_odometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>

#include "hm/core/check.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/odometry/feature/feature_detection.hpp"
#include "hm/odometry/feature/keyframe.hpp"
#include "hm/odometry/interface/frame_check.hpp"
#include "hm/odometry/published/frame_to_frame.hpp"
#include "hm/odometry/published/model_registration.hpp"
#include "hm/odometry/registration/pose_equations.hpp"
#include "hm/odometry/registration/relocalisation.hpp"

namespace hm {

namespace {

/// Estimated pose, or the reason why there is none.
struct Answer {
  bool found = false;
  std::string reason;
  SE3 T_odom_camera;
  Mat6 covariance = Mat6::Zero();
};

/// Removes the components of a motion, in odom, that the constraint excludes.
SE3 constrained(const SE3& motion, MotionConstraint constraint) {
  if (constraint == MotionConstraint::kNone) return motion;
  const double yaw = std::atan2(motion.rotation()(1, 0), motion.rotation()(0, 0));
  Vec3 translation = motion.translation();
  if (constraint == MotionConstraint::kRollPitchHeight) translation.z() = 0;
  return {so3_exp(Vec3(0, 0, yaw)), translation};
}

std::vector<UncertainPoint> points_of(const FeatureSet& features) {
  std::vector<UncertainPoint> points;
  for (const Feature& f : features) {
    if (f.has_depth) points.push_back({f.p_camera, f.covariance});
  }
  return points;
}

std::vector<UncertainPoint> transformed(std::vector<UncertainPoint> points, const SE3& T) {
  for (UncertainPoint& point : points) {
    point.mean = T * point.mean;
    point.covariance = T.rotation() * point.covariance * T.rotation().transpose();
  }
  return points;
}

class PublishedOdometry final : public VisualOdometry {
 public:
  PublishedOdometry(const OdometryParams& params, const PinholeCamera& camera, const SE3& T_odom_first_camera)
      : method_(params.method),
        params_(params.published),
        camera_(camera),
        detector_(params.published.features, camera, {params.max_depth_m, params.max_depth_sigma_m}),
        model_(params.published.model),
        T_odom_camera_(T_odom_first_camera) {
    HM_CHECK(method_ != OdometryMethod::kTracker, "the tracker is not one of the published methods");
  }

  TrackedFrame track(const RgbdFrame& frame, const MotionHint& hint, const OnPose& on_pose) override;

  [[nodiscard]] std::size_t memory_bytes() const override {
    std::size_t features = last_features_.capacity();
    for (const Place& place : places_) features += place.keyframe->features.capacity();
    return model_.memory_bytes() + features * sizeof(Feature) + places_.size() * sizeof(Place);
  }

 private:
  FeatureSet detect(const RgbdFrame& frame, TrackingNumbers& numbers);
  void start(const RgbdFrame& frame, FeatureSet features, TrackedFrame& result);
  Answer register_frame(const FeatureSet& features, TrackingNumbers& numbers);
  Answer register_to_points(const FeatureSet& features, const SE3& prediction, TrackingNumbers& numbers);
  void accept(const RgbdFrame& frame, const Answer& answer, FeatureSet features, TrackedFrame& result);
  std::optional<Answer> relocalise(const FeatureSet& features, TrackingNumbers& numbers);
  void lose(const RgbdFrame& frame, FeatureSet features, const std::string& reason, TrackedFrame& result);
  void take_in(const FeatureSet& features, TrackingNumbers& numbers);
  void make_keyframe(const RgbdFrame& frame, TrackedFrame& result);

  [[nodiscard]] bool has_model() const { return method_ != OdometryMethod::kFrameToFrame; }
  [[nodiscard]] bool has_ransac() const { return method_ != OdometryMethod::kPublishedIcp; }
  [[nodiscard]] int needed_features() const {
    return has_model() ? params_.icp.kMinPairs : params_.ransac.min_inliers;
  }

  OdometryMethod method_;
  PublishedParams params_;
  PinholeCamera camera_;
  FeatureDetector detector_;
  PointModel model_;

  bool started_ = false;
  int submap_ = 0;
  LostState lost_;
  std::optional<Time> last_stamp_, posed_stamp_;
  SE3 T_odom_camera_;  ///< of the last tracked frame
  Mat6 covariance_ = Mat6::Zero();
  FeatureSet last_features_;  ///< of that frame
  /// A keyframe of this submap, with the covariance of its pose.
  struct Place {
    std::shared_ptr<const Keyframe> keyframe;
    Mat6 covariance = Mat6::Zero();
  };
  std::deque<Place> places_;  ///< newest last
};

FeatureSet PublishedOdometry::detect(const RgbdFrame& frame, TrackingNumbers& numbers) {
  const Stopwatch stopwatch;
  const Image<std::uint8_t> gray = to_gray(frame.color);
  numbers.sharpness = sharpness(gray);
  numbers.depth_coverage_ratio = depth_coverage(frame.depth);
  FeatureSet features = detector_.detect(gray, frame.depth);
  numbers.features = static_cast<int>(features.size());
  for (const Feature& f : features) numbers.features_with_depth += f.has_depth ? 1 : 0;
  numbers.features_ms = stopwatch.milliseconds();
  return features;
}

TrackedFrame PublishedOdometry::track(const RgbdFrame& frame, const MotionHint& /*hint*/,
                                      const OnPose& on_pose) {
  const Stopwatch stopwatch;
  TrackedFrame result;
  result.submap = submap_;
  result.numbers.model_points = model_.points().size();
  result.reason = reason_to_skip(frame, camera_, last_stamp_);
  if (!result.reason.empty()) {
    result.status = TrackingStatus::kSkipped;
    return result;
  }
  last_stamp_ = frame.stamp;
  FeatureSet features = detect(frame, result.numbers);
  if (!started_) {
    start(frame, std::move(features), result);
  } else if (const Answer answer = register_frame(features, result.numbers); answer.found) {
    result.status = TrackingStatus::kTracked;
    accept(frame, answer, std::move(features), result);
  } else if (const auto again = relocalise(features, result.numbers)) {
    result.status = TrackingStatus::kRelocalised;
    accept(frame, *again, std::move(features), result);
  } else {
    lose(frame, std::move(features), answer.reason, result);
  }
  if (result.T_odom_camera) {
    posed_stamp_ = frame.stamp;
    lost_.found();
    if (on_pose) on_pose(*result.T_odom_camera);
  }
  result.submap = submap_;
  result.numbers.model_points = model_.points().size();
  result.numbers.total_ms = stopwatch.milliseconds();
  return result;
}

void PublishedOdometry::start(const RgbdFrame& frame, FeatureSet features, TrackedFrame& result) {
  if (result.numbers.features_with_depth < needed_features()) {
    result.reason = fmt::format(
        "{} features with depth, {} needed to begin; sharpness {:.0f}, depth at {:.0f} % "
        "of the pixels",
        result.numbers.features_with_depth, needed_features(), result.numbers.sharpness,
        100 * result.numbers.depth_coverage_ratio);
    return;
  }
  started_ = true;
  result.reason.clear();
  covariance_.setZero();
  last_features_ = std::move(features);
  take_in(last_features_, result.numbers);
  result.status = TrackingStatus::kStarted;
  result.T_odom_camera = T_odom_camera_;
  make_keyframe(frame, result);
}

/// Predicts and registers the pose of a frame (dissertation 3.2, Fig. 3.9).
Answer PublishedOdometry::register_frame(const FeatureSet& features, TrackingNumbers& numbers) {
  const Stopwatch stopwatch;
  FrameMotion predicted;
  if (has_ransac()) {
    Rng rng(static_cast<std::uint64_t>(params_.kSeed), static_cast<std::uint64_t>(last_stamp_->ns));
    predicted = match_frames(last_features_, features,
                             {{params_.kMaxMatchRatio, 256, false, true}, params_.ransac}, rng);
    numbers.prediction_ms = stopwatch.milliseconds();
  }
  // The motion is in the camera frame, so it is composed on the right of the last pose in the model.
  const SE3 prediction = predicted.motion.found ? T_odom_camera_ * predicted.motion.T_a_b : T_odom_camera_;
  if (has_model()) return register_to_points(features, prediction, numbers);
  numbers.matches = predicted.matches;
  numbers.inliers = static_cast<int>(predicted.motion.inliers.size());
  return {predicted.motion.found, predicted.motion.reason, prediction,
          covariance_ + covariance_by_adjoint(predicted.motion.covariance, T_odom_camera_)};
}

Answer PublishedOdometry::register_to_points(const FeatureSet& features, const SE3& prediction,
                                             TrackingNumbers& numbers) {
  const Stopwatch stopwatch;
  const std::vector<UncertainPoint> points = points_of(features);
  const ModelRegistration found = register_to_model(points, model_, prediction, params_.icp);
  numbers.matches = found.pairs;
  numbers.registration_ms = stopwatch.milliseconds();
  return {found.found, found.reason, found.T_odom_camera, found.covariance};
}

void PublishedOdometry::accept(const RgbdFrame& frame, const Answer& answer, FeatureSet features,
                               TrackedFrame& result) {
  const SE3 motion = answer.T_odom_camera * T_odom_camera_.inverse();
  T_odom_camera_ = constrained(motion, params_.constraint) * T_odom_camera_;
  // Renormalises, so that rounding errors do not accumulate.
  T_odom_camera_ = SE3(T_odom_camera_.quaternion(), T_odom_camera_.translation());
  covariance_ = answer.covariance;
  last_features_ = std::move(features);
  take_in(last_features_, result.numbers);
  result.T_odom_camera = T_odom_camera_;
  result.covariance = covariance_;
  const SE3 moved = places_.back().keyframe->T_odom_camera.inverse() * T_odom_camera_;
  if (moved.translation().norm() >= params_.kKeyframeDistance_m ||
      moved.angle() >= params_.kKeyframeAngle_rad) {
    make_keyframe(frame, result);
  }
}

/// Relocalises against a keyframe and, if there is a model, registers to the model from there.
std::optional<Answer> PublishedOdometry::relocalise(const FeatureSet& features, TrackingNumbers& numbers) {
  std::vector<KnownPlace> known;
  for (const Place& place : places_)
    known.push_back({&place.keyframe->features, place.keyframe->T_odom_camera, place.keyframe->frame_index});
  int matches = 0;
  const auto search = lost_.next_search(*last_stamp_, *posed_stamp_, params_.ransac.min_inliers);
  const auto found = find_again(known, features, search, matches);
  if (!found) return std::nullopt;
  if (has_model()) {
    Answer answer = register_to_points(features, found->T_odom_camera, numbers);
    return answer.found ? std::optional(std::move(answer)) : std::nullopt;
  }
  const auto place = std::find_if(places_.begin(), places_.end(),
                                  [&](const Place& p) { return p.keyframe->frame_index == found->keyframe; });
  numbers.matches = matches;
  numbers.inliers = found->inliers;
  return Answer{true, {}, found->T_odom_camera, place->covariance + found->covariance};
}

/// Handles a frame without a pose: the model is unchanged, unless relocalisation has failed long enough.
void PublishedOdometry::lose(const RgbdFrame& frame, FeatureSet features, const std::string& reason,
                             TrackedFrame& result) {
  result.status = TrackingStatus::kLost;
  const TrackingNumbers& numbers = result.numbers;
  result.reason = fmt::format(
      "{}; {} features, {} with depth, sharpness {:.0f}, depth at {:.0f} % of the pixels", reason,
      numbers.features, numbers.features_with_depth, numbers.sharpness, 100 * numbers.depth_coverage_ratio);
  lost_.count(frame.stamp);
  if (lost_.frames() <= params_.max_lost_frames || numbers.features_with_depth < needed_features()) return;
  ++submap_;
  model_.clear();
  places_.clear();
  start(frame, std::move(features), result);
}

void PublishedOdometry::take_in(const FeatureSet& features, TrackingNumbers& numbers) {
  if (!has_model()) return;
  const Stopwatch stopwatch;
  numbers.inliers = model_.update(transformed(points_of(features), T_odom_camera_)).updated;
  numbers.model_ms = stopwatch.milliseconds();
}

void PublishedOdometry::make_keyframe(const RgbdFrame& frame, TrackedFrame& result) {
  places_.push_back(
      {std::make_shared<const Keyframe>(
           Keyframe{frame.index, frame.stamp, submap_, T_odom_camera_, last_features_, Mat6::Zero(), {}}),
       covariance_});
  if (places_.size() > static_cast<std::size_t>(params_.kMaxKeyframes)) places_.pop_front();
  result.new_keyframe = places_.back().keyframe;
}

}  // namespace

std::unique_ptr<VisualOdometry> make_published_odometry(const OdometryParams& params,
                                                        const PinholeCamera& camera,
                                                        const SE3& T_odom_first_camera) {
  return std::make_unique<PublishedOdometry>(params, camera, T_odom_first_camera);
}

}  // namespace hm
