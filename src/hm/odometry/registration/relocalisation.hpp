#pragma once
#include <optional>
#include <span>

#include "hm/core/time.hpp"
#include "hm/odometry/feature/feature.hpp"
#include "hm/odometry/registration/ransac.hpp"

namespace hm {

/// A keyframe where the camera may be again.
struct KnownPlace {
  const FeatureSet* features = nullptr;
  SE3 T_odom_camera;
  std::size_t identity = 0;
};

/// A pose found again, and against which keyframe.
struct Relocalisation {
  SE3 T_odom_camera;
  std::size_t keyframe = 0;  ///< identity
  int inliers = 0;
  Mat6 covariance = Mat6::Zero();  ///< against the keyframe (left perturbation in odom)
};

/// Compares a frame's features with those of known places (the newest last) by descriptor, and looks for the
/// motion that most pairs agree with (RANSAC, Mahalanobis test). `first` says with which place to begin,
/// counted from the newest; at most `count` are tried, so that a search through all of them can be spread
/// over frames. Nothing when none of them fits; `best_matches` is then the most pairs of a place.
struct RelocalisationSearch {
  std::size_t first = 0, count = 4;
  int min_inliers = 15;
};
std::optional<Relocalisation> find_again(std::span<const KnownPlace> places, const FeatureSet& features,
                                         const RelocalisationSearch& search, int& best_matches);

/// Being lost: since when, and how far the search through the keyframes has come.
class LostState {
 public:
  [[nodiscard]] bool lost() const { return frames_ > 0; }
  [[nodiscard]] int frames() const { return frames_; }
  /// From the first frame without a pose to the last one.
  [[nodiscard]] double duration_s() const { return frames_ > 0 ? (last_ - since_).seconds() : 0; }
  /// The places that this frame is to be compared with: four in every 1/30 s, so that all of them are come
  /// to in the same time at any rate. `posed` is the stamp of the last frame with a pose.
  RelocalisationSearch next_search(Time stamp, Time posed, int min_inliers);
  void count(Time stamp);
  void found() { *this = {}; }

 private:
  int frames_ = 0;
  std::size_t searched_ = 0;
  Time since_, last_;
};

}  // namespace hm
