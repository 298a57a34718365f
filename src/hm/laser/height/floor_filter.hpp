#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>

#include "hm/core/time.hpp"
#include "hm/laser/height/height_params.hpp"

namespace hm {

/// Horizontal surface below the vehicle's path (a floor level).
struct FloorLevel {
  int id = 0;          ///< 0: the reference, i.e. the floor at the first reading
  double level_m = 0;  ///< above the reference
  double std_m = 0;
  int sightings = 0;     ///< number of scans that observed it
  int unseen_scans = 0;  ///< scans since the last observation
  bool confirmed = false;
  Time first_seen, last_seen;
};

/// Kalman filter of height, climb rate, bias of the measured acceleration and all floor levels: state
/// [height, climb, bias, level 1, level 2 ...], metres, m/s, m/s^2. Since every level stays correlated with
/// the height, observing a known floor again removes the drift accumulated since, and the reference floor
/// anchors the estimate. Fixed capacity, no heap allocation.
class FloorFilter {
 public:
  static constexpr int kMaxFloors = 32;

  explicit FloorFilter(const HeightParams& params) : params_(params) {}

  /// Initialises above the reference floor: height = distance, with variance `variance_m2`.
  void start(Time time, double distance_m, double variance_m2);
  [[nodiscard]] bool started() const { return floors_ > 0; }

  /// Predicts the next scan: the climb rate changes by the mean upward acceleration that an IMU measured,
  /// without its bias, and little noise; or by the noise of HeightParams::acceleration_density_m_s2_sqrt_hz.
  void predict(double dt_s, const std::optional<double>& acceleration_m_s2);

  /// Whether the last prediction had an acceleration.
  [[nodiscard]] bool climb_is_measured() const { return climb_is_measured_; }

  /// Innovation of a distance measurement to a floor.
  struct Innovation {
    double residual_m = 0;   ///< measured minus predicted distance
    double variance_m2 = 0;  ///< of the residual
  };
  [[nodiscard]] Innovation innovation(int floor, double distance_m, double variance_m2) const;
  /// Corrects with a measured distance to `floor`; where the climb is measured, a deviation counts for no
  /// more than kMostDeviationsRatio: a ramp deviates with every scan, noise does not.
  void correct(int floor, Time time, double distance_m, double variance_m2);
  /// Adds a new floor at this distance and returns its index. At capacity it replaces the floor with the
  /// fewest observations (never the reference or `keep`).
  int add(Time time, double distance_m, double variance_m2, int keep);
  void remove(int floor);

  [[nodiscard]] double height_m() const { return mean_(0); }
  [[nodiscard]] double climb_m_s() const { return mean_(1); }
  [[nodiscard]] double height_std_m() const;
  [[nodiscard]] double climb_std_m_s() const;
  [[nodiscard]] int floors() const { return floors_; }
  [[nodiscard]] FloorLevel floor(int index) const;
  /// Index of the floor with this id, if it still exists.
  [[nodiscard]] std::optional<int> index_of(int id) const;

 private:
  static constexpr int kMaxStates = kMaxFloors + 2;  // the reference is not a state
  using Mean = Eigen::Matrix<double, kMaxStates, 1>;
  using Covariance = Eigen::Matrix<double, kMaxStates, kMaxStates>;
  [[nodiscard]] int states() const { return floors_ + 2; }
  [[nodiscard]] static int state_of(int floor) { return floor + 2; }

  HeightParams params_;
  Mean mean_ = Mean::Zero();
  Covariance covariance_ = Covariance::Zero();
  std::array<FloorLevel, kMaxFloors> records_{};  // level and std are in mean_ and covariance_
  int floors_ = 0, next_id_ = 0;
  bool climb_is_measured_ = false;
};

}  // namespace hm
