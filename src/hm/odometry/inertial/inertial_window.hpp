#pragma once
#include <deque>
#include <optional>
#include <span>
#include <vector>

#include "hm/odometry/inertial/inertial_factors.hpp"

namespace hm {

using Vec18 = Eigen::Matrix<double, 18, 1>;
using Mat18 = Eigen::Matrix<double, 18, 18>;

/// Pose of a frame as the images show it: for T = T_odom_camera exp(d), with d = [translation; rotation],
/// the cost is d^T information d / 2 + gradient^T d.
struct VisualPose {
  SE3 T_odom_camera;
  Mat6 information = Mat6::Zero();
  Vec6 gradient = Vec6::Zero();

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(T_odom_camera, information, gradient);
  }
};

/// State of a coming frame by the readings alone, with the covariance of [state; common].
struct InertialPrediction {
  Time stamp;
  InertialState state;
  Mat18 covariance = Mat18::Zero();

  /// Covariance of the pose, for T exp([translation; rotation]).
  [[nodiscard]] Mat6 pose_covariance() const;
};

/// Rotation between two times by the gyroscope, R_begin_end exp(.) with this covariance.
struct GyroTurn {
  Mat3 R_begin_end = Mat3::Identity();
  Mat3 covariance = Mat3::Identity();
};

/// Motion of the newest frames, biases, gravity and the delay of the readings' stamps, by least squares from
/// preintegrated readings (inertial_residual) and visual poses. Frames that leave the window are
/// marginalised into a prior, in which biases and gravity walk. Yaw and position follow the visual poses:
/// readings do not show them.
class InertialWindow {
 public:
  /// Adds readings of the camera's frame; those not later than the last one are skipped.
  void feed(std::span<const ImuSample> readings);
  /// Adds a frame with a visual pose and solves. Begins anew, with what is known of biases and gravity, when
  /// the readings since the last frame have a gap.
  void add(Time stamp, const VisualPose& pose);
  /// Predicts a frame after the last one; empty before there are two frames, and with a gap in the readings.
  [[nodiscard]] std::optional<InertialPrediction> predict(Time stamp) const;
  /// Rotation between two times, if the readings of both are still there (for two seconds).
  [[nodiscard]] std::optional<GyroTurn> turn(Time begin, Time end) const;
  /// Continues from a pose whose relation to the earlier visual poses is not known: with the predicted
  /// velocity, or (null) with an unknown one.
  void continue_from(Time stamp, const VisualPose& pose, const InertialPrediction* prediction);
  /// Forgets everything but the readings.
  void forget();
  /// The frame of the visual poses has moved: T <- T_new_old T.
  void move(const SE3& T_new_old);

  [[nodiscard]] const InertialCommon& common() const { return common_; }
  [[nodiscard]] std::size_t frame_count() const { return frames_.size(); }
  /// Covariance of the newest frame's state and of what all share.
  [[nodiscard]] const Mat18& covariance() const { return covariance_; }
  [[nodiscard]] std::size_t memory_bytes() const;

  template <class Archive>
  void visit_state(Archive& archive) {
    archive(readings_, frames_, common_, knows_gravity_, prior_, covariance_);
  }

 private:
  struct Frame {
    Time stamp;
    InertialState state;
    VisualPose pose;

    template <class Archive>
    void visit_state(Archive& archive) {
      archive(stamp, state, pose);
    }
  };
  /// Cost of the first frame and the common parameters: d^T information d / 2 + gradient^T d.
  struct Prior {
    InertialState state;
    InertialCommon common;
    Mat18 information = Mat18::Zero();
    Vec18 gradient = Vec18::Zero();

    template <class Archive>
    void visit_state(Archive& archive) {
      archive(state, common, information, gradient);
    }
  };
  struct Equations;

  [[nodiscard]] std::optional<Preintegration> between(const Frame& first, Time end) const;
  [[nodiscard]] Equations linearise(std::size_t frames) const;
  void find_gravity(const Frame& first, const Preintegration& readings);
  void solve();
  void marginalise_first();
  void drop_old_readings();
  [[nodiscard]] Mat9 known_common_information() const;

  std::vector<ImuSample> readings_;
  std::deque<Frame> frames_;
  InertialCommon common_;
  bool knows_gravity_ = false;
  Prior prior_;
  Mat18 covariance_ = Mat18::Zero();
};

}  // namespace hm
