#include "hm/odometry/tracker/tracker.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "hm/core/stopwatch.hpp"
#include "hm/geometry/state_bytes.hpp"
#include "hm/odometry/geometry_tracking/geometry_tracker.hpp"
#include "hm/odometry/interface/frame_check.hpp"
#include "hm/odometry/registration/relocalisation.hpp"
#include "hm/odometry/tracker/color_time_estimator.hpp"
#include "hm/odometry/tracker/frame_clock.hpp"
#include "hm/odometry/tracker/motion_filter.hpp"
#include "hm/odometry/tracker/tracker_attempt.hpp"
#include "hm/odometry/tracker/tracker_inertia.hpp"
#include "hm/odometry/tracker/tracker_keyframes.hpp"
#include "hm/odometry/tracker/tracker_prediction.hpp"
#include "hm/odometry/tracker/window_adjustment.hpp"

namespace hm {
namespace {

constexpr int kMinStartFeatures = 30;
constexpr int kUnknownFrames = 5;          // with features but no known landmark: the model has none here
constexpr double kLongGap_s = 0.1;         // without a pose: the camera may have rotated far
constexpr double kShortGap_s = 0.25;       // the last picture still shows part of this one
constexpr double kMaxBridgeSigma_m = 0.3;  // of a pose without images; beyond it the frame is lost

class Tracker final : public VisualOdometry {
 public:
  Tracker(const OdometryParams& params, const PinholeCamera& camera, const SE3& T_odom_first_camera)
      : params_(params),
        camera_(camera),
        attempts_(params),
        detector_(params.features, camera, {params.max_depth_m, params.max_depth_sigma_m}),
        map_(static_cast<std::size_t>(params.tracker.max_model_points),
             static_cast<std::size_t>(params.tracker.max_keyframes)),
        filter_(params.features.depth_noise),
        geometry_(params.features.depth_noise),
        inertia_(params.gravity_sigma_rad),
        color_times_({params.tracker.readout_s, params.tracker.color_delay_s},
                     params.tracker.estimate_row_times),
        T_odom_start_(T_odom_first_camera) {}

  TrackedFrame track(const RgbdFrame& frame, const MotionHint& hint, const OnPose& on_pose) override {
    const Stopwatch total;
    TrackedFrame out;
    on_pose_ = on_pose;
    inertia_.begin_frame(hint);
    out.reason = reason_to_skip(frame, camera_, last_stamp_, ColorNeed::kIfPresent);
    if (out.reason.empty()) {
      last_stamp_ = frame.stamp;
      clock_.add(frame.stamp);
      TrackerFrame view = make_view(frame, out);
      if (map_.empty() && !geometry_.is_active())
        begin_submap(view, features_of(view), out);
      else
        follow(view, hint, out);
      if (out.T_odom_camera) {
        lost_.found();
        posed_stamp_ = frame.stamp;
        posed_frame_ = frame.index;
        reference_ = make_prediction_reference(view, camera_);
      }
    } else {
      out.status = TrackingStatus::kSkipped;
    }
    inertia_.end_frame(frame.stamp, hint, out.status, T_odom_last_);
    out.numbers.inertial = inertia_.use();
    tell_pose_once(out);
    if (out.T_odom_camera) move_to_odom(out);
    out.submap = submap_;
    out.numbers.readout_s = color_times_.in_use().readout_s;
    out.numbers.color_delay_s = color_times_.in_use().delay_s;
    out.numbers.model_points = map_.landmark_count();
    out.numbers.total_ms = total.milliseconds();
    return out;
  }

  [[nodiscard]] std::size_t memory_bytes() const override {
    return sizeof(*this) + map_.memory_bytes() + reference_.memory_bytes() + filter_.memory_bytes() +
           geometry_.memory_bytes() + inertia_.memory_bytes();
  }

  bool save(StateWriter& state) const override {
    const_cast<Tracker*>(this)->visit_state(state);  // a writer changes nothing
    return true;
  }

  Result<void> restore(StateReader& state, const OdometryHistory& history) override {
    visit_state(state);
    state.require(submap_ >= 0 &&
                  map_.keyframes().size() <= static_cast<std::size_t>(params_.tracker.max_keyframes));
    state.require(!last_stamp_ || posed_stamp_ <= *last_stamp_);
    if (!state.ok()) return fail(ErrorCode::kCorrupted, "state of odometry", "is damaged");
    if (map_.empty() && !geometry_.is_active()) return {};
    if (const auto restored = restore_geometry(history); !restored) return restored;
    if (const auto restored = map_.restore([&](MapKeyframe& keyframe, bool with_surface) {
          return complete_keyframe(keyframe, with_surface, history, camera_, noise(), params_.max_depth_m);
        });
        !restored)
      return restored;
    const auto frame = read_again(posed_frame_, camera_, history);
    if (!frame) return forward_error(frame);
    const TrackerFrame view = make_view(*frame);
    reference_ = make_prediction_reference(view, camera_);
    if (params_.tracker.motion_filter) filter_.restore(view.grid);
    return {};
  }

 private:
  template <class Archive>
  void visit_state(Archive& archive) {
    archive(T_odom_start_, T_odom_last_, covariance_last_, velocity_, last_stamp_, clock_, posed_stamp_,
            posed_frame_, lost_, submap_, best_inliers_, keyframe_depth_m_, inertia_, filter_, color_times_,
            timed_, map_, geometry_, unknown_frames_);
  }

  Result<void> restore_geometry(const OdometryHistory& history) {
    return geometry_.restore([&](std::size_t index) -> Result<DepthGrid> {
      const auto frame = read_again(index, camera_, history);
      if (!frame) return forward_error(frame);
      return make_depth_grid(frame->depth, camera_, noise(), params_.max_depth_m);
    });
  }

  void tell_pose_once(const TrackedFrame& out) {
    if (!out.T_odom_camera) return;
    if (const OnPose on_pose = std::exchange(on_pose_, {})) on_pose(T_odom_start_ * *out.T_odom_camera);
  }

  /// Transforms a result to odom from the model's frame, the first camera's: results do not depend on odom.
  void move_to_odom(TrackedFrame& out) const {
    out.T_odom_camera = T_odom_start_ * *out.T_odom_camera;
    out.covariance = covariance_by_adjoint(out.covariance, T_odom_start_);
  }

  [[nodiscard]] TrackerFrame make_view(const RgbdFrame& frame) const {
    return make_tracker_frame(frame, camera_, noise(), params_.max_depth_m);
  }

  TrackerFrame make_view(const RgbdFrame& frame, TrackedFrame& out) const {
    const Stopwatch watch;
    TrackerFrame view = make_view(frame);
    if (has_color(view)) out.numbers.sharpness = sharpness(view.pyramid.level(0));
    out.numbers.depth_coverage_ratio = depth_coverage(frame.depth);
    out.numbers.features_ms = watch.milliseconds();
    return view;
  }

  /// Starts the model with this frame, if it has enough features; otherwise it is lost.
  void begin_submap(const TrackerFrame& view, FeatureSet features, TrackedFrame& out) {
    out.numbers.features = static_cast<int>(features.size());
    out.numbers.features_with_depth = count_with_depth(features);
    if (out.numbers.features_with_depth < kMinStartFeatures) {
      out.reason = too_few_features(out.numbers, kMinStartFeatures);
      return begin_by_depth(view, out);
    }
    map_.clear();
    geometry_.end();
    velocity_.reset();
    add_keyframe({&view, std::move(features), {}, T_odom_last_, covariance_last_, Mat6::Zero(), submap_},
                 out);
    filter_.restart(view.grid, T_odom_last_);
    timed_ = TimedFrame{0, T_odom_last_, {}, true, {}};  // to be retimed
    out.status = TrackingStatus::kStarted;
    out.T_odom_camera = T_odom_last_;
    out.covariance = covariance_last_;
  }

  void follow(TrackerFrame& view, const MotionHint& hint, TrackedFrame& out) {
    Stopwatch watch;
    const bool by_images = has_color(view) && !geometry_.is_active() && !map_.empty();
    const auto inertial = by_images ? inertia_.predict(view) : std::nullopt;
    Attempt by_inertia;
    if (inertial && follow_inertia(view, *inertial, by_inertia, out)) return;
    const auto prior = std::exchange(view.prior, {});
    std::optional<GeometryAttempt> by_depth;
    if (geometry_.is_active() || !has_color(view)) by_depth = attempt_by_depth(view);
    const bool is_followed = by_depth && by_depth->refusal.empty();
    if (!has_color(view) || map_.empty()) return recover(view, "no landmarks", by_depth, out);
    const SE3 T_predicted = is_followed ? by_depth->T_odom_camera : predict(view);
    view.motion = row_motion(view);
    out.numbers.turn_given = inertia_.R_posed_current().has_value();
    out.numbers.gravity = inertia_.weigh(T_predicted, hint, view);
    out.numbers.prediction_ms = watch.milliseconds();
    watch.restart();
    Attempt attempt = attempt_pose(map_, view, T_predicted, camera_, attempts_);
    attempt_by_velocity(view, attempt);
    if (!attempt.refusal.empty()) attempt_by_surface(view, T_predicted, attempt);
    out.numbers.registration_ms = watch.milliseconds();
    note(attempt, out.numbers);
    if (inertial && (!attempt.refusal.empty() || inertia_.contradicts(*inertial, attempt.registration))) {
      view.prior = prior;
      if (bridge(view, *inertial, by_inertia, out)) return;
      view.prior.reset();
    }
    if (!attempt.refusal.empty()) return recover(view, attempt.refusal, by_depth, out);
    arrival_ = geometry_.arrival(by_depth, T_odom_last_ * motion_by_velocity(view));
    if (is_followed) {  // the drift of tracking by depth, now that landmarks are found again
      T_odom_last_ = attempt.registration.T_odom_camera * by_depth->T_odom_camera.inverse() * T_odom_last_;
      filter_.restart(reference_.grid, T_odom_last_);
    }
    const bool is_found_again = geometry_.is_active() && !is_followed;
    accept(view, attempt, is_found_again ? TrackingStatus::kRelocalised : TrackingStatus::kTracked, out);
  }

  /// Registers the frame near the readings' prediction; of few landmarks, six that agree with it are enough.
  bool follow_inertia(TrackerFrame& view, const InertialPrediction& prediction, Attempt& attempt,
                      TrackedFrame& out) {
    const Stopwatch watch;
    view.motion = row_motion(view);
    attempt = attempt_pose(map_, view, prediction.state.T_odom_camera, camera_, attempts_);
    out.numbers.registration_ms = watch.milliseconds();
    note(attempt, out.numbers);
    if (!is_enough_with_prior(attempt) || TrackerInertia::is_far(prediction, attempt.registration))
      return false;
    accept(view, attempt, TrackingStatus::kTracked, out);
    return true;
  }

  /// Pose by prediction and surfaces, where images show too little or contradict the prediction. False: it
  /// has become too uncertain.
  bool bridge(TrackerFrame& view, const InertialPrediction& prediction, Attempt& attempt, TrackedFrame& out) {
    Registration& found = attempt.registration;
    if (TrackerInertia::is_far(prediction, found)) found = registration_by_prior(*view.prior);
    attempt.matches.clear();
    attempt.looked_for.clear();
    found.inliers = 0;
    if (!(position_sigma_m(found) * std::sqrt(covariance_scale(found)) < kMaxBridgeSigma_m)) return false;
    accept(view, attempt, TrackingStatus::kBridged, out);
    if (out.new_keyframe) inertia_.begin_model(view, T_odom_last_, prediction);
    return true;
  }

  [[nodiscard]] double since_posed_s(const TrackerFrame& view) const {
    return clock_.interval_s(posed_stamp_, view.frame->stamp);
  }
  [[nodiscard]] SE3 motion_by_velocity(const TrackerFrame& view) const {
    return velocity_.motion(since_posed_s(view));
  }
  /// Motion of the frame's rows; unknown after a long gap.
  [[nodiscard]] RowMotionModel row_motion(const TrackerFrame& view) const {
    const double since_s = since_posed_s(view);
    return {camera_, color_times_.in_use(), T_odom_last_,
            since_s > kLongGap_s || geometry_.is_active() ? 0 : since_s, velocity_.twist_s()};
  }
  [[nodiscard]] SE3 predict(const TrackerFrame& view) const {
    MotionGuess guess{motion_by_velocity(view), inertia_.R_posed_current(), false};
    guess.may_have_turned_far = since_posed_s(view) > kLongGap_s;
    return T_odom_last_ * predict_motion(reference_, view, guess, noise());
  }

  /// Repeats the attempt from the last velocity where it was refused, or may have followed a person.
  void attempt_by_velocity(const TrackerFrame& view, Attempt& attempt) const {
    if (since_posed_s(view) > kLongGap_s || !velocity_.twist_s()) return;
    attempt_again(map_, view, T_odom_last_ * motion_by_velocity(view), camera_, attempts_, attempt);
  }

  /// Repeats the attempt from the motion of the depth surfaces, if it was refused: the prediction was wrong.
  void attempt_by_surface(const TrackerFrame& view, const SE3& T_predicted, Attempt& attempt) const {
    const std::vector<SE3> guesses{motion_by_velocity(view), T_odom_last_.inverse() * T_predicted};
    const auto motions = motions_by_surface(reference_, view, guesses, noise());
    if (auto next = attempt_by_motions(map_, view, T_odom_last_, motions, camera_, attempts_))
      attempt = std::move(*next);
  }

  void accept(const TrackerFrame& view, Attempt& attempt, TrackingStatus status, TrackedFrame& out) {
    const Stopwatch watch;
    const SE3 T = renormalised(attempt.registration.T_odom_camera);
    inertia_.accept(view, attempt.registration, status, T_odom_last_ * motion_by_velocity(view));
    const Vec6 twist_s = mean_twist_s(T_odom_last_, T, since_posed_s(view));
    geometry_.end();
    unknown_frames_ = 0;
    const bool at_known_velocity = status == TrackingStatus::kTracked && view.motion.since_last_s > 0;
    if (at_known_velocity && timed_) settle_times(*timed_, twist_s, since_posed_s(view));
    timed_.reset();
    if (at_known_velocity)
      timed_ = TimedFrame{map_.keyframes().back().identity, T, twist_s, false, attempt.matches};
    if (status != TrackingStatus::kRelocalised && !lost_.lost())
      velocity_.update(T_odom_last_.inverse() * T, since_posed_s(view));
    else
      velocity_.reset();
    for (const std::size_t index : attempt.looked_for) map_.landmark(index).looked_for += 1;
    for (const LandmarkMatch& match : attempt.matches)
      map_.landmark(match.landmark).found += match.inlier ? 1 : 0;
    T_odom_last_ = T;
    covariance_last_ = covariance_of(map_, attempt);
    out.T_camera_depth = view.motion.steady_depth_motion(T);
    out.T_odom_camera = publish(view, T, out.T_camera_depth, status);
    tell_pose_once(out);
    out.covariance = covariance_last_;
    if (params_.tracker.motion_filter) out.covariance += filter_.covariance_in_odom();
    best_inliers_ = std::max(best_inliers_, attempt.registration.inliers);
    const bool due =
        arrival_ || keyframe_due(params_.tracker, map_.keyframes().back().T_odom_camera.inverse() * T,
                                 attempt.registration.inliers, best_inliers_, keyframe_depth_m_);
    FeatureSet features = due ? detect_features(view, T) : FeatureSet{};
    if (due && (status != TrackingStatus::kBridged || count_with_depth(features) >= kMinStartFeatures)) {
      const auto turn = inertia_.turn(map_.keyframes().back().record->stamp, view.frame->stamp);
      add_keyframe({&view, std::move(features), std::move(attempt.matches), T, covariance_last_,
                    covariance_in_camera(attempt.registration), submap_, std::nullopt, turn},
                   out);
      map_.forget_unproven();
      if (timed_) timed_->is_keyframe = true;
      T_odom_last_ = map_.keyframes().back().T_odom_camera;
      inertia_.model_moved(T_odom_last_ * T.inverse());
      filter_.model_moved(T_odom_last_ * view.motion.steady_depth_motion(T));
    } else {
      fuse_depths(map_, attempt.matches, T, camera_, noise());
    }
    out.status = status;
    out.numbers.model_ms = watch.milliseconds();
  }

  SE3 publish(const TrackerFrame& view, const SE3& T, const SE3& T_camera_depth, TrackingStatus status) {
    if (!params_.tracker.motion_filter) return T;
    const SE3 T_odom_depth = T * T_camera_depth;
    if (status == TrackingStatus::kTracked)
      return filter_.update(view.grid, T_odom_depth) * T_camera_depth.inverse();
    filter_.restart(view.grid, T_odom_depth);
    return T;
  }

  /// Uses the last frame with the mean of the velocities before and after it, now that both are known.
  void settle_times(const TimedFrame& frame, const Vec6& twist_after_s, double interval_s) {
    const InstantMotion motion = frame.motion(twist_after_s, interval_s);
    if (const MapKeyframe* reference = map_.find(frame.reference))
      color_times_.add(*reference, frame, reference_.grid, motion, camera_, noise());
    if (frame.is_keyframe) retime_keyframe(map_, motion, color_times_.in_use(), camera_);
  }

  /// Detects features and places them at the time of the middle row.
  FeatureSet detect_features(const TrackerFrame& view, const SE3& T_odom_camera) {
    return at_middle_row(detector_.detect(view.pyramid.level(0), view.frame->depth), view, T_odom_camera,
                         camera_, params_, keyframe_depth_m_);
  }

  void add_keyframe(KeyframeParts parts, TrackedFrame& out) {
    if (const auto depth_m = median_depth_m(parts.features)) keyframe_depth_m_ = *depth_m;
    const auto record =
        insert_keyframe(map_, std::move(parts), camera_, attempts_.registration, attempts_.matching.limit);
    adjust_window(map_, camera_, {static_cast<std::size_t>(params_.tracker.kWindowKeyframes)});
    record->T_odom_camera = T_odom_start_ * map_.keyframes().back().T_odom_camera;
    if (const auto arrival = std::exchange(arrival_, {}))
      record->end_of_drift = end_of_drift(map_, *arrival, T_odom_start_);
    out.new_keyframe = record;
    best_inliers_ = 0;
  }

  [[nodiscard]] FeatureSet features_of(const TrackerFrame& view) {
    return has_color(view) ? detector_.detect(view.pyramid.level(0), view.frame->depth) : FeatureSet{};
  }
  [[nodiscard]] GeometryFrame geometry_frame(const TrackerFrame& view) const {
    return {&view.grid, view.frame->index, since_posed_s(view), inertia_.R_posed_current(),
            color_times_.in_use().delay_s};
  }
  [[nodiscard]] GeometryAttempt attempt_by_depth(const TrackerFrame& view) const {
    return geometry_.attempt({T_odom_last_, velocity_.twist_s(), covariance_last_}, geometry_frame(view),
                             surface_references(map_));
  }

  /// Starts with the depth image alone, when colour shows nothing and there is no model to find again.
  void begin_by_depth(const TrackerFrame& view, TrackedFrame& out) {
    if (!map_.empty() || !GeometryTracker::is_usable(view.grid)) return;
    velocity_.reset();
    geometry_.begin({T_odom_last_, {}, covariance_last_}, geometry_frame(view));
    filter_.restart(view.grid, T_odom_last_);
    finish_by_depth(TrackingStatus::kStarted, out);
    out.new_keyframe =
        make_depth_keyframe({&view, {}, {}, T_odom_start_ * T_odom_last_, {}, Mat6::Zero(), submap_});
  }

  /// Takes the pose from the depth image. The model gets landmarks where the last few frames' are unknown.
  void accept_by_depth(const TrackerFrame& view, const GeometryAttempt& attempt, FeatureSet features,
                       TrackedFrame& out) {
    geometry_.accept(attempt, geometry_frame(view));
    velocity_.update(T_odom_last_.inverse() * attempt.T_odom_camera, since_posed_s(view));
    T_odom_last_ = renormalised(attempt.T_odom_camera);
    covariance_last_ = attempt.covariance;
    out.T_camera_depth = attempt.T_camera_depth;
    filter_.restart(view.grid, T_odom_last_ * out.T_camera_depth);
    finish_by_depth(TrackingStatus::kTracked, out);
    out.numbers.by_depth_sigma_m = attempt.sigma_m();
    unknown_frames_ = count_with_depth(features) < kMinStartFeatures ? 0 : unknown_frames_ + 1;
    if (unknown_frames_ > 0 && (map_.empty() || unknown_frames_ >= kUnknownFrames)) {
      add_keyframe({&view,
                    std::move(features),
                    {},
                    T_odom_last_,
                    covariance_last_,
                    attempt.motion_covariance,
                    submap_,
                    attempt.covariance_since_model},
                   out);
      T_odom_last_ = map_.keyframes().back().T_odom_camera;
      geometry_.end();
      unknown_frames_ = 0;
    } else if (attempt.keyframe_due) {
      out.new_keyframe = make_depth_keyframe(
          {&view, {}, {}, T_odom_start_ * T_odom_last_, {}, attempt.motion_covariance, submap_});
    }
  }

  /// Whether a picture in which nothing known is found shows the same place as the last, as in a turn's blur.
  [[nodiscard]] bool is_same_place(const TrackerFrame& view, const GeometryAttempt& attempt) const {
    const auto same = shows_the_same(reference_, view, T_odom_last_.inverse() * attempt.T_odom_camera);
    const bool is_sure = attempt.is_sure() && GeometryTracker::is_usable(view.grid);
    return geometry_.is_active() ? same.value_or(true) : is_sure && same.value_or(false);
  }

  void finish_by_depth(TrackingStatus status, TrackedFrame& out) {
    timed_.reset();
    out.status = status;
    out.reason.clear();
    out.numbers.by_depth = true;
    out.T_odom_camera = T_odom_last_;
    out.covariance = covariance_last_;
  }

  /// Relocalises among the keyframes, or follows the depth image; after some time starts a new submap.
  void recover(const TrackerFrame& view, const std::string& refusal, std::optional<GeometryAttempt>& by_depth,
               TrackedFrame& out) {
    FeatureSet features = features_of(view);
    int matches = 0;
    if (const auto found = search_keyframes(features, view.frame->stamp, matches)) {
      Attempt attempt = attempt_pose(map_, view, found->T_odom_camera, camera_, attempts_.widened());
      if (attempt.refusal.empty()) {
        note(attempt, out.numbers);
        arrival_ = geometry_.arrival(by_depth, T_odom_last_ * motion_by_velocity(view));
        return accept(view, attempt, TrackingStatus::kRelocalised, out);
      }
    }
    const bool is_blank = count_with_depth(features) < kMinStartFeatures;
    if (!by_depth && (is_blank || since_posed_s(view) < kShortGap_s)) by_depth = attempt_by_depth(view);
    if (by_depth && by_depth->refusal.empty() && (is_blank || is_same_place(view, *by_depth)))
      return accept_by_depth(view, *by_depth, std::move(features), out);
    if (!geometry_.is_active()) geometry_.end();  // nothing is kept of a refused pose
    lost_.count(view.frame->stamp);
    velocity_.reset();
    out.status = TrackingStatus::kLost;
    out.reason = why_lost(refusal, features.size(), matches, out.numbers, by_depth ? by_depth->refusal : "");
    if (lost_.frames() < params_.tracker.submap_after_frames &&
        lost_.duration_s() < params_.tracker.kSubmapAfter_s)
      return;
    const std::string reason = std::exchange(out.reason, {});
    submap_ += 1;
    begin_submap(view, std::move(features), out);
    if (!out.T_odom_camera) submap_ -= 1, out.reason = reason + "; " + out.reason;
  }

  std::optional<Relocalisation> search_keyframes(const FeatureSet& features, Time stamp, int& matches) {
    std::vector<KnownPlace> places = known_places(map_);
    if (geometry_.is_active()) sort_by_view(places, T_odom_last_);
    return find_again(places, features, lost_.next_search(stamp, posed_stamp_, attempts_.min_inliers),
                      matches);
  }

  [[nodiscard]] const DepthNoise& noise() const { return params_.features.depth_noise; }

  OdometryParams params_;
  PinholeCamera camera_;
  AttemptParams attempts_;
  FeatureDetector detector_;
  LocalMap map_;
  PredictionReference reference_;  ///< the last frame with a pose
  MotionFilter filter_;
  GeometryTracker geometry_;
  TrackerInertia inertia_;
  ColorTimeEstimator color_times_;
  SE3 T_odom_start_;  ///< transforms output poses; those below are in the first camera's frame
  SE3 T_odom_last_;   ///< pose in the model
  Mat6 covariance_last_ = Mat6::Zero();
  ConstantVelocity velocity_;
  std::optional<Time> last_stamp_;
  FrameClock clock_;
  Time posed_stamp_;
  std::size_t posed_frame_ = 0;          ///< index of the frame that `reference_` shows
  std::optional<TimedFrame> timed_;      ///< the last frame with a pose
  std::optional<DepthArrival> arrival_;  ///< in this frame, at the end of a stretch by depth
  LostState lost_;
  OnPose on_pose_;  ///< of the frame that is tracked; empty: it was told
  int submap_ = 0;
  int unknown_frames_ = 0;  ///< in a row, tracked by depth although their colour has features
  int best_inliers_ = 0;    ///< since the last keyframe
  double keyframe_depth_m_ = 2;
};

}  // namespace

std::unique_ptr<VisualOdometry> make_tracker(const OdometryParams& params, const PinholeCamera& camera,
                                             const SE3& T_odom_first_camera) {
  HM_CHECK(camera.distortion.is_zero(), "the camera has lens distortion");
  return std::make_unique<Tracker>(params, camera, T_odom_first_camera);
}

}  // namespace hm
