#pragma once
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "hm/core/result.hpp"
#include "hm/odometry/feature/image_pyramid.hpp"
#include "hm/odometry/feature/keyframe.hpp"
#include "hm/odometry/registration/patch_alignment.hpp"
#include "hm/odometry/registration/surface_grid.hpp"
#include "hm/odometry/tracker/row_motion.hpp"

namespace hm {

/// Observation of a landmark in a keyframe.
struct Sighting {
  std::size_t landmark = 0;
  Vec2 pixel = Vec2::Zero();
  Mat2 pixel_covariance = Mat2::Identity();
  double depth_m = 0;  ///< 0: none
  double depth_variance_m2 = 0;
  Vec2 image_pixel = Vec2::Zero();  ///< in the colour image; `pixel` is at the time of its middle row

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(landmark, pixel, pixel_covariance, depth_m, depth_variance_m2, image_pixel);
  }
};

/// Point of the persistent model, with the keyframe that provides its patch (anchor).
struct MapLandmark {
  std::uint64_t identity = 0;  ///< assigned by the map, increasing from 1
  Vec3 p_odom = Vec3::Zero();
  Mat3 covariance = Mat3::Zero();  ///< m^2, odom
  Vec3 normal_odom = Vec3::Zero();
  std::size_t anchor = 0;            ///< identity of the keyframe
  Vec2 anchor_pixel = Vec2::Zero();  ///< in its colour image
  int looked_for = 0, found = 0;
  int sightings = 0;
  bool alive = false;

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(identity, p_odom, covariance, normal_odom, anchor, anchor_pixel, looked_for, found, sightings,
            alive);
  }
};

/// Constraint of a keyframe's pose by another keyframe's surface: for T_ref_key = linearised_at exp(delta)
/// the cost is delta^T information delta / 2 + gradient^T delta.
struct SurfaceFactor {
  std::size_t reference = 0;  ///< identity of the keyframe whose surface it is
  SE3 linearised_at;
  Mat6 information = Mat6::Zero();
  Vec6 gradient = Vec6::Zero();

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(reference, linearised_at, information, gradient);
  }
};

struct MapKeyframe {
  std::size_t identity = 0;  ///< increasing
  SE3 T_odom_camera;
  Mat6 covariance = Mat6::Zero();  ///< left perturbation in odom, as in TrackedFrame
  ImagePyramid pyramid;
  DepthGrid grid;
  SurfaceGrid surface;  ///< cleared when the keyframe is no longer recent
  std::vector<Sighting> sightings;
  std::vector<SurfaceFactor> factors;
  std::optional<InstantMotion> motion;  ///< of the camera, if known
  std::optional<SE3> T_camera_depth;    ///< pose at the time of the depth image, if not the same
  std::shared_ptr<const Keyframe> record;

  /// All but the images and the record, of which only the frame index is kept: LocalMap::restore() gives the
  /// rest.
  template <class Archive>
  void visit_state(Archive& archive) {
    std::size_t frame_index = record ? record->frame_index : 0;
    archive(identity, T_odom_camera, covariance, sightings, factors, motion, T_camera_depth, frame_index);
    if constexpr (Archive::kReads) {
      Keyframe named;
      named.frame_index = frame_index;
      record = std::make_shared<const Keyframe>(named);
    }
  }
};

/// Landmark that may be visible, and its predicted position.
struct Candidate {
  std::size_t landmark = 0;
  Vec2 pixel = Vec2::Zero();
  Vec3 p_camera = Vec3::Zero();
};

/// Persistent model of the tracker: landmarks and the keyframes that observed them, both bounded in number.
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
  /// Keyframe with this identity; null when it was removed.
  [[nodiscard]] const MapKeyframe* find(std::size_t identity) const;
  MapKeyframe* find(std::size_t identity);

  /// Landmarks that a camera may observe: inside the image, at a viewing angle and distance similar to the
  /// anchor's; at most `limit`, spread over the image, most reliable first.
  [[nodiscard]] std::vector<Candidate> candidates(const SE3& T_odom_camera, const PinholeCamera& camera,
                                                  std::size_t limit) const;

  /// Adds a keyframe (assigns its identity) and counts its sightings. Removes the oldest keyframe first at
  /// capacity.
  MapKeyframe& add_keyframe(MapKeyframe keyframe);
  /// Adds a landmark and returns its index; nothing when the model is full (landmarks are removed with their
  /// keyframes).
  std::optional<std::size_t> add_landmark(const MapLandmark& landmark);
  /// Removes landmarks that are repeatedly not found, or were observed in a single keyframe only.
  void forget_unproven();
  void clear();

  /// The fields of a saved model, without images.
  template <class Archive>
  void visit_state(Archive& archive) {
    archive(next_identity_, next_landmark_, alive_, landmarks_, free_, keyframes_);
  }
  /// Gives keyframes that were just read their image pyramids, surfaces and records. Errors: of
  /// `restore_keyframe`; kCorrupted where landmarks and keyframes do not belong together.
  Result<void> restore(const std::function<Result<void>(MapKeyframe&, bool with_surface)>& restore_keyframe);

 private:
  [[nodiscard]] bool is_sound() const;
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
