#pragma once
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "hm/odometry/feature/image_pyramid.hpp"
#include "hm/odometry/feature/keyframe.hpp"
#include "hm/odometry/registration/patch_alignment.hpp"
#include "hm/odometry/registration/surface_grid.hpp"

namespace hm {

/// A landmark seen in a keyframe.
struct Sighting {
  std::size_t landmark = 0;
  Vec2 pixel = Vec2::Zero();
  Mat2 pixel_covariance = Mat2::Identity();
  double depth_m = 0;  ///< 0: none
  double depth_variance_m2 = 0;
};

/// A point of the persistent model, with the keyframe in which it looks as it is looked for.
struct MapLandmark {
  std::uint64_t identity = 0;  ///< counts up from 1, given by the map
  Vec3 p_odom = Vec3::Zero();
  Mat3 covariance = Mat3::Zero();  ///< m^2, odom
  Vec3 normal_odom = Vec3::Zero();
  std::size_t anchor = 0;  ///< identity of the keyframe
  Vec2 anchor_pixel = Vec2::Zero();
  int looked_for = 0, found = 0;
  int sightings = 0;
  bool alive = false;
};

/// How a keyframe's surface constrains another's pose: the cost, as a quadratic function of the motion
/// delta in T_ref_key = linearised_at exp(delta), is delta^T information delta / 2 + gradient^T delta.
struct SurfaceFactor {
  std::size_t reference = 0;  ///< identity of the keyframe whose surface it is
  SE3 linearised_at;
  Mat6 information = Mat6::Zero();
  Vec6 gradient = Vec6::Zero();
};

struct MapKeyframe {
  std::size_t identity = 0;  ///< counts up
  SE3 T_odom_camera;
  Mat6 covariance = Mat6::Zero();  ///< left perturbation in odom, as in TrackedFrame
  ImagePyramid pyramid;
  SurfaceGrid surface;  ///< emptied when the keyframe leaves the recent ones
  std::vector<Sighting> sightings;
  std::vector<SurfaceFactor> factors;
  std::shared_ptr<const Keyframe> record;
};

/// A landmark that may be visible, and where.
struct Candidate {
  std::size_t landmark = 0;
  Vec2 pixel = Vec2::Zero();
  Vec3 p_camera = Vec3::Zero();
};

/// The persistent model: landmarks and the keyframes that saw them, both bounded in number.
class LocalMap {
 public:
  LocalMap(std::size_t max_landmarks, std::size_t max_keyframes);

  [[nodiscard]] bool empty() const { return keyframes_.empty(); }
  [[nodiscard]] std::size_t landmark_count() const { return alive_; }
  [[nodiscard]] std::size_t memory_bytes() const;

  MapLandmark& landmark(std::size_t index) { return landmarks_[index]; }
  [[nodiscard]] const MapLandmark& landmark(std::size_t index) const { return landmarks_[index]; }
  std::deque<MapKeyframe>& keyframes() { return keyframes_; }
  [[nodiscard]] const std::deque<MapKeyframe>& keyframes() const { return keyframes_; }
  /// The keyframe with an identity; null when it was forgotten.
  [[nodiscard]] const MapKeyframe* find(std::size_t identity) const;
  MapKeyframe* find(std::size_t identity);

  /// The landmarks that a camera may see: in the picture, from a side and a distance like those from which
  /// they were seen first; at most `limit`, spread over the picture, best proven first.
  [[nodiscard]] std::vector<Candidate> candidates(const SE3& T_odom_camera, const PinholeCamera& camera,
                                                  std::size_t limit) const;

  /// Takes over a keyframe (its identity is given here) and counts its sightings. Forgets the oldest one
  /// first when there are too many.
  MapKeyframe& add_keyframe(MapKeyframe keyframe);
  /// A new landmark; nothing when the model is full (the oldest are forgotten with their keyframes).
  std::optional<std::size_t> add_landmark(const MapLandmark& landmark);
  /// Forgets landmarks that are looked for and not found, or that one keyframe alone ever saw.
  void forget_unproven();
  void clear();

 private:
  void forget_oldest_keyframe();
  void forget_landmark(std::size_t index);
  void drop_dead_sightings();
  bool reanchor(std::size_t index);

  std::size_t max_landmarks_, max_keyframes_;
  std::size_t next_identity_ = 1;
  std::uint64_t next_landmark_ = 1;
  std::size_t alive_ = 0;
  std::vector<MapLandmark> landmarks_;
  std::vector<std::size_t> free_;
  std::deque<MapKeyframe> keyframes_;
};

}  // namespace hm
