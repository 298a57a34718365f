#pragma once
#include <optional>
#include <span>
#include <vector>

#include "hm/core/time.hpp"
#include "hm/odometry/feature/feature.hpp"
#include "hm/odometry/registration/ransac.hpp"

namespace hm {

/// Keyframe as a candidate for relocalisation.
struct KnownPlace {
  const FeatureSet* features = nullptr;
  SE3 T_odom_camera;
  std::size_t identity = 0;
};

/// Result of relocalisation: the pose and the matched keyframe.
struct Relocalisation {
  SE3 T_odom_camera;
  std::size_t keyframe = 0;  ///< identity of the keyframe
  int inliers = 0;
  Mat6 covariance = Mat6::Zero();  ///< against the keyframe (left perturbation in odom)
};

/// Part of the known places to search: `first` is the first one, counted from the newest; at most `count` are
/// tried, so that a full search can be spread over several frames.
struct RelocalisationSearch {
  std::size_t first = 0, count = 4;
  int min_inliers = 15;
};

/// Matches a frame's features to those of known places (newest last) by descriptor, and estimates the pose
/// with RANSAC (Mahalanobis test). Nothing when no place fits; `best_matches` is then the largest number of
/// matches.
std::optional<Relocalisation> find_again(std::span<const KnownPlace> places, const FeatureSet& features,
                                         const RelocalisationSearch& search, int& best_matches);

/// Sorts places so that those that look most like a camera's view by their poses (position and direction)
/// come last, where a search begins.
void sort_by_view(std::vector<KnownPlace>& places, const SE3& T_odom_camera);

/// State while tracking is lost: duration, and progress of the search through the keyframes.
class LostState {
 public:
  [[nodiscard]] bool lost() const { return frames_ > 0; }
  [[nodiscard]] int frames() const { return frames_; }
  /// Time from the first frame without a pose to the last one.
  [[nodiscard]] double duration_s() const { return frames_ > 0 ? (last_ - since_).seconds() : 0; }
  /// Places to compare with this frame: four per 1/30 s, so that a full search takes the same time at any
  /// frame rate. `posed` is the stamp of the last frame with a pose.
  RelocalisationSearch next_search(Time stamp, Time posed, int min_inliers);
  void count(Time stamp);
  void found() { *this = {}; }
  template <class Archive>
  void visit_state(Archive& archive) {
    archive(frames_, searched_, since_, last_);
  }

 private:
  int frames_ = 0;
  std::size_t searched_ = 0;
  Time since_, last_;
};

}  // namespace hm
