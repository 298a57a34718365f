#pragma once
#include <deque>

#include "hm/odometry/inertial/inertial_window.hpp"
#include "hm/odometry/interface/visual_odometry.hpp"

namespace hm {

/// Predictions of the poses by inertial readings, once these have proved right: for two seconds the window
/// only watches. Readings with wrong axes, stamps or scale never get further, and a run with them is that
/// without.
class InertialTracking {
 public:
  /// Adds the readings until a frame (they may reach further); before it is tracked.
  void feed(std::span<const ImuSample> readings);
  /// Prediction of the frame; empty while the readings are not trusted.
  [[nodiscard]] std::optional<InertialPrediction> predict(Time stamp) const;
  /// Rotation between two frames by the gyroscope; empty while the readings are not trusted.
  [[nodiscard]] std::optional<GyroTurn> turn(Time begin, Time end) const;
  /// A frame has a pose. `vision`: what the images alone say of it; `T_by_velocity`: where constant velocity
  /// would have it.
  void add(Time stamp, const VisualPose& vision, const SE3& T_by_velocity);
  /// First frame of a trajectory: nothing is known.
  void begin(Time stamp, const VisualPose& vision);
  /// A frame's pose does not continue the path: (null) relocalised; or the model begins anew at the
  /// prediction.
  void continue_from(Time stamp, const VisualPose& vision, const InertialPrediction* prediction);
  /// The model has moved: T <- T_new_old T.
  void move(const SE3& T_new_old) { window_.move(T_new_old); }

  [[nodiscard]] InertialUse use() const { return use_; }
  [[nodiscard]] const InertialWindow& window() const { return window_; }
  [[nodiscard]] std::size_t memory_bytes() const;

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(window_, comparisons_);
    archive.choice(use_, 5);
  }

 private:
  /// Prediction against the pose by the images.
  struct Comparison {
    Time stamp;
    double squared_mahalanobis = 0;
    double error_m = 0, by_velocity_m = 0;  ///< rotations count 1 m a radian

    template <class Archive>
    void visit_state(Archive& archive) {
      archive(stamp, squared_mahalanobis, error_m, by_velocity_m);
    }
  };
  void compare(const InertialPrediction& prediction, const VisualPose& vision, const SE3& T_by_velocity);
  [[nodiscard]] InertialUse judged() const;

  InertialWindow window_;
  std::deque<Comparison> comparisons_;
  InertialUse use_ = InertialUse::kNone;
};

}  // namespace hm
