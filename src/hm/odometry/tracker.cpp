#include "hm/odometry/tracker.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "hm/core/stopwatch.hpp"
#include "hm/odometry/coarse_alignment.hpp"
#include "hm/odometry/feature_detection.hpp"
#include "hm/odometry/local_map.hpp"
#include "hm/odometry/surface_alignment.hpp"
#include "hm/odometry/tracker_matching.hpp"
#include "hm/odometry/window_adjustment.hpp"

namespace hm {
namespace {

constexpr int kPyramidLevels = 5;
constexpr std::size_t kCoarsePixels = 2000;
constexpr double kAnchorSigma_px = 0.15;
constexpr double kFreeDistance_px = 14;

double env(const char* name, double value) {
  const char* text = std::getenv(name);
  return text ? std::atof(text) : value;
}

class Tracker final : public VisualOdometry {
 public:
  Tracker(const OdometryParams& params, const PinholeCamera& camera, const SE3& T_odom_first_camera)
      : params_(params),
        camera_(camera),
        detector_(FeatureParams{}, camera, {params.max_depth_m, params.max_depth_sigma_m}),
        map_(static_cast<std::size_t>(params.tracker.max_model_points),
             static_cast<std::size_t>(params.tracker.max_keyframes)),
        T_odom_last_(T_odom_first_camera) {
    matching_.limit = static_cast<std::size_t>(params.tracker.target_landmarks);
    matching_.max_depth_m = params.max_depth_m;
    matching_.max_depth_sigma_m = params.max_depth_sigma_m;
  }

  TrackedFrame track(const RgbdFrame& frame, const MotionHint& hint) override {
    const Stopwatch total;
    TrackedFrame out;
    out.submap = submap_;
    last_stamp_ = frame.stamp;
    TrackerFrame view = make_view(frame, out);
    if (map_.empty()) {
      start(view, out);
    } else {
      follow(view, hint, out);
    }
    if (out.T_odom_camera) coarse_ = CoarseReference(view.pyramid, view.grid, camera_, kCoarsePixels);
    out.numbers.model_points = map_.landmark_count();
    out.numbers.total_ms = total.milliseconds();
    return out;
  }

  [[nodiscard]] std::size_t memory_bytes() const override { return map_.memory_bytes(); }

 private:
  TrackerFrame make_view(const RgbdFrame& frame, TrackedFrame& out) {
    const Stopwatch watch;
    TrackerFrame view;
    view.frame = &frame;
    view.pyramid = ImagePyramid(to_gray(frame.color), kPyramidLevels);
    view.grid = make_depth_grid(frame.depth, camera_, noise_, params_.max_depth_m);
    out.numbers.sharpness = sharpness(view.pyramid.level(0));
    out.numbers.depth_coverage_ratio = depth_coverage(frame.depth);
    out.numbers.features_ms = watch.milliseconds();
    return view;
  }

  void start(TrackerFrame& view, TrackedFrame& out) {
    insert_keyframe(view, {}, T_odom_last_, Mat6::Zero(), out);
    out.status = TrackingStatus::kStarted;
    out.T_odom_camera = T_odom_last_;
  }

  void follow(TrackerFrame& view, const MotionHint& hint, TrackedFrame& out) {
    Stopwatch watch;
    const SE3 T_pred = predict(view, hint);
    out.numbers.prediction_ms = watch.milliseconds();
    watch.restart();
    std::vector<std::size_t> looked_for;
    auto matches = match_landmarks(map_, view, T_pred, camera_, matching_, looked_for);
    Mat6 information;
    const SE3 T = refine(view, matches, T_pred, information);
    int inliers = 0;
    for (const LandmarkMatch& match : matches) inliers += match.inlier ? 1 : 0;
    out.numbers.features = static_cast<int>(looked_for.size());
    out.numbers.matches = static_cast<int>(matches.size());
    out.numbers.inliers = inliers;
    out.numbers.registration_ms = watch.milliseconds();
    watch.restart();
    if (inliers < params_.tracker.min_inliers) {
      out.status = TrackingStatus::kLost;
      out.reason = fmt::format("{} inliers", inliers);
      return;
    }
    for (const std::size_t landmark : looked_for) map_.landmark(landmark).looked_for += 1;
    for (const LandmarkMatch& match : matches) map_.landmark(match.landmark).found += match.inlier ? 1 : 0;
    velocity_ = (T_odom_last_.inverse() * T).log();
    T_odom_last_ = T;
    ++since_keyframe_;
    if (keyframe_due(view, T, inliers)) {
      insert_keyframe(view, matches, T, Mat6::Zero(), out);
      WindowAdjustmentParams window;
      window.keyframes = static_cast<std::size_t>(params_.tracker.window_keyframes);
      static const int iterations = static_cast<int>(env("BA_IT", 4));
      window.iterations = iterations;
      adjust_window(map_, camera_, window);
      map_.forget_unproven();
      T_odom_last_ = map_.keyframes().back().T_odom_camera;
    }
    out.numbers.model_ms = watch.milliseconds();
    out.status = TrackingStatus::kTracked;
    out.T_odom_camera = T_odom_last_;
  }

  SE3 predict(const TrackerFrame& view, const MotionHint& hint) const {
    const SE3 velocity = SE3::exp(velocity_);
    std::vector<SE3> guesses{velocity, SE3{}};
    if (hint.R_last_current) guesses.insert(guesses.begin(), SE3(*hint.R_last_current, velocity.translation()));
    const CoarseResult coarse = align_coarsely(coarse_, view.pyramid, guesses);
    return T_odom_last_ * coarse.T_ref_cur;
  }

  SE3 refine(const TrackerFrame& view, std::vector<LandmarkMatch>& matches, SE3 T, Mat6& information) const {
    std::vector<PointObservation> observations;
    for (const LandmarkMatch& match : matches) observations.push_back(match.observation);
    const MapKeyframe& reference = map_.keyframes().back();
    static const double surface_weight = env("SURF", params_.tracker.surface_weight_ratio);
    static const double px = env("PX", 0.3);
    for (auto& o : observations) o.pixel_covariance += Mat2::Identity() * px * px;
    SurfaceMatching surface;
    surface.noise = noise_;
    for (int iteration = 0; iteration < 10; ++iteration) {
      PoseEquations equations = point_equations(observations, T, camera_);
      if (surface_weight > 0) {
        surface.extra_gate_m = iteration < 2 ? 0.03 : 0.0;
        PoseEquations other = surface_equations(reference.surface, view.grid,
                                                reference.T_odom_camera.inverse() * T, surface);
        other.information *= surface_weight;
        other.gradient *= surface_weight;
        equations += other;
      }
      information = equations.information;
      Mat6 damped = information;
      damped.diagonal().array() += 1e-3;
      const Vec6 step = -damped.ldlt().solve(equations.gradient);
      if (!step.allFinite()) break;
      T = T * SE3::exp(step);
      if (step.head<3>().norm() < 2e-5 && step.tail<3>().norm() < 2e-5) break;
    }
    for (std::size_t i = 0; i < matches.size(); ++i) {
      const auto residual = point_residual(observations[i], T, camera_);
      matches[i].inlier = residual && residual->squared_mahalanobis < kOutlierSquaredMahalanobis;
      matches[i].observation.pixel_covariance = observations[i].pixel_covariance;
    }
    return T;
  }

  bool keyframe_due(const TrackerFrame&, const SE3& T, int inliers) const {
    const MapKeyframe& last = map_.keyframes().back();
    const SE3 motion = last.T_odom_camera.inverse() * T;
    if (inliers < params_.tracker.keyframe_inlier_ratio * static_cast<double>(last.sightings.size())) return true;
    if (motion.angle() > params_.tracker.keyframe_angle_rad) return true;
    return motion.translation().norm() > params_.tracker.keyframe_distance_ratio * keyframe_depth_m_;
  }

  void insert_keyframe(TrackerFrame& view, const std::vector<LandmarkMatch>& matches, const SE3& T,
                       const Mat6& covariance, TrackedFrame& out) {
    auto record = std::make_shared<Keyframe>();
    record->frame_index = view.frame->index;
    record->stamp = view.frame->stamp;
    record->submap = submap_;
    record->T_odom_camera = T;
    record->features = detector_.detect(view.pyramid.level(0), view.frame->depth);
    MapKeyframe keyframe;
    keyframe.T_odom_camera = T;
    keyframe.covariance = covariance;
    keyframe.surface = make_surface_grid(view.grid, noise_);
    for (const LandmarkMatch& match : matches) {
      if (!match.inlier) continue;
      const PointObservation& o = match.observation;
      keyframe.sightings.push_back({match.landmark, o.pixel, o.pixel_covariance, o.depth_m, o.depth_variance_m2});
    }
    if (!map_.empty()) add_factor(keyframe, view.grid);
    keyframe.record = record;
    keyframe.pyramid = view.pyramid;
    std::vector<std::pair<std::size_t, const Feature*>> fresh;
    const std::vector<const Feature*> chosen = choose_new(record->features, keyframe.sightings);
    std::vector<double> depths;
    for (const Feature& feature : record->features)
      if (feature.has_depth) depths.push_back(feature.p_camera.z());
    if (!depths.empty()) {
      std::nth_element(depths.begin(), depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2), depths.end());
      keyframe_depth_m_ = depths[depths.size() / 2];
    }
    MapKeyframe& added = map_.add_keyframe(std::move(keyframe));
    for (const Feature* feature : chosen) add_landmark(added, *feature);
    since_keyframe_ = 0;
    out.new_keyframe = record;
    out.numbers.features_with_depth = static_cast<int>(depths.size());
  }

  void add_factor(MapKeyframe& keyframe, const DepthGrid& grid) const {
    const MapKeyframe& reference = map_.keyframes().back();
    SurfaceMatching surface;
    surface.noise = noise_;
    surface.extra_gate_m = 0;
    SurfaceFactor factor;
    factor.reference = reference.identity;
    factor.linearised_at = reference.T_odom_camera.inverse() * keyframe.T_odom_camera;
    const PoseEquations equations = surface_equations(reference.surface, grid, factor.linearised_at, surface);
    static const double w = env("SURFBA", params_.tracker.surface_weight_ratio);
    factor.information = equations.information * w;
    factor.gradient = equations.gradient * w;
    keyframe.factors.push_back(factor);
  }

  std::vector<const Feature*> choose_new(const FeatureSet& features, const std::vector<Sighting>& sightings) const {
    std::vector<Vec2> taken;
    for (const Sighting& sighting : sightings) taken.push_back(sighting.pixel);
    std::vector<const Feature*> chosen;
    const auto target = static_cast<std::size_t>(params_.tracker.target_landmarks);
    for (const Feature& feature : features) {
      if (!feature.has_depth) continue;
      if (taken.size() >= target) break;
      const bool free = std::none_of(taken.begin(), taken.end(), [&](const Vec2& pixel) {
        return (pixel - feature.pixel).squaredNorm() < kFreeDistance_px * kFreeDistance_px;
      });
      if (!free) continue;
      taken.push_back(feature.pixel);
      chosen.push_back(&feature);
    }
    return chosen;
  }

  void add_landmark(MapKeyframe& keyframe, const Feature& feature) {
    const Mat3& R = keyframe.T_odom_camera.rotation();
    Landmark landmark;
    landmark.p_odom = keyframe.T_odom_camera * feature.p_camera;
    const DepthGaussian depth{feature.p_camera.z(), feature.covariance(2, 2)};
    landmark.covariance =
        R * feature_covariance(camera_, feature.pixel, depth, kAnchorSigma_px) * R.transpose();
    const Vec2 cell = pixel_in_level(feature.pixel, 2);
    const int x = static_cast<int>(std::lround(cell.x())), y = static_cast<int>(std::lround(cell.y()));
    landmark.normal_odom = R * -feature.p_camera.normalized();
    if (keyframe.surface.elements.contains(x, y) && keyframe.surface.elements(x, y).sigma_m > 0)
      landmark.normal_odom = R * keyframe.surface.elements(x, y).normal.cast<double>();
    landmark.anchor = keyframe.identity;
    landmark.anchor_pixel = feature.pixel;
    landmark.sightings = 1;
    const auto index = map_.add_landmark(landmark);
    if (!index) return;
    keyframe.sightings.push_back({*index, feature.pixel,
                                  Mat2::Identity() * kAnchorSigma_px * kAnchorSigma_px, depth.mean_m,
                                  depth.variance_m2});
  }

  OdometryParams params_;
  PinholeCamera camera_;
  DepthNoise noise_;
  MatchingParams matching_;
  FeatureDetector detector_;
  LocalMap map_;
  CoarseReference coarse_;
  SE3 T_odom_last_;
  Vec6 velocity_ = Vec6::Zero();
  Time last_stamp_;
  int submap_ = 0;
  int since_keyframe_ = 0;
  double keyframe_depth_m_ = 2;
};

}  // namespace

std::unique_ptr<VisualOdometry> make_tracker(const OdometryParams& params, const PinholeCamera& camera,
                                             const SE3& T_odom_first_camera) {
  HM_CHECK(camera.distortion.is_zero(), "the camera has lens distortion");
  return std::make_unique<Tracker>(params, camera, T_odom_first_camera);
}

}  // namespace hm
