#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>

#include "hm/core/time.hpp"
#include "hm/laser/height/height_params.hpp"

namespace hm {

/// A horizontal surface that the vehicle has flown over.
struct FloorLevel {
  int id = 0;          ///< 0 is the reference, the floor under the first reading
  double level_m = 0;  ///< above the reference
  double std_m = 0;
  int sightings = 0;     ///< scans that saw it
  int unseen_scans = 0;  ///< since then
  bool confirmed = false;
  Time first_seen, last_seen;
};

/// Height, climb rate and all floor levels as one Gaussian: the Kalman filter whose state is
/// [height, climb, level 1, level 2 ...]. As every level keeps its correlation with the height, seeing a
/// known floor again takes away the error that was gained since, and the reference floor anchors everything.
/// Fixed capacity, no heap.
class FloorFilter {
 public:
  static constexpr int kMaxFloors = 32;

  explicit FloorFilter(const HeightParams& params) : params_(params) {}

  /// Starts over the reference floor: height = distance. `variance_m2` is that of the distance.
  void start(Time time, double distance_m, double variance_m2);
  [[nodiscard]] bool started() const { return floors_ > 0; }

  /// To the next scan: the climb rate goes on, changed by `acceleration_m_s2` (upwards, known) and by white
  /// noise.
  void predict(double dt_s, double acceleration_m_s2);

  /// How well a distance fits a floor.
  struct Innovation {
    double residual_m = 0;   ///< measured minus predicted distance
    double variance_m2 = 0;  ///< of it
  };
  [[nodiscard]] Innovation innovation(int floor, double distance_m, double variance_m2) const;
  /// A scan saw `floor` at this distance.
  void correct(int floor, Time time, double distance_m, double variance_m2);
  /// A surface not seen before, at this distance; its index. When there is no room, the floor seen least
  /// (never the reference, never `keep`) makes place.
  int add(Time time, double distance_m, double variance_m2, int keep);
  void remove(int floor);

  [[nodiscard]] double height_m() const { return mean_(0); }
  [[nodiscard]] double climb_m_s() const { return mean_(1); }
  [[nodiscard]] double height_std_m() const;
  [[nodiscard]] double climb_std_m_s() const;
  [[nodiscard]] int floors() const { return floors_; }
  [[nodiscard]] FloorLevel floor(int index) const;
  /// The floor with this id, if it is still known.
  [[nodiscard]] std::optional<int> index_of(int id) const;

 private:
  static constexpr int kMaxStates = kMaxFloors + 1;  // the reference is not a state
  using Mean = Eigen::Matrix<double, kMaxStates, 1>;
  using Covariance = Eigen::Matrix<double, kMaxStates, kMaxStates>;
  [[nodiscard]] int states() const { return floors_ + 1; }

  HeightParams params_;
  Mean mean_ = Mean::Zero();
  Covariance covariance_ = Covariance::Zero();
  std::array<FloorLevel, kMaxFloors> records_{};  // level and std are in mean_ and covariance_
  int floors_ = 0, next_id_ = 0;
};

}  // namespace hm
