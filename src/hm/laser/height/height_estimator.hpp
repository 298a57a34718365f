#pragma once
#include <optional>
#include <vector>

#include "hm/laser/height/floor_filter.hpp"
#include "hm/laser/height/height_modes.hpp"
#include "hm/laser/height/height_params.hpp"
#include "hm/laser/height/mirror_distances.hpp"

namespace hm {

enum class HeightStatus {
  kOk,
  kTooFewReadings,  ///< fewer returns than needed for one surface
  kSpreadTooWide,   ///< readings, but no surface in them
  kTilted,          ///< the vehicle is tilted too far for its mirrors
  kTimeBackwards,   ///< not later than the previous scan; ignored
  kInvalidInput,    ///< attitude, acceleration or a distance is not a number; ignored
};

enum class FloorEvent { kNone, kStepUp, kStepDown };

/// Height after one scan. Unless the status is kOk, height and climb are predictions (kTimeBackwards and
/// kInvalidInput: those of the previous scan).
///
/// For a ceiling the vertical axis is inverted: height is the distance of the base below the reference
/// ceiling, a level is the distance of a surface below it, and the climb rate is positive downwards.
struct HeightEstimate {
  Time stamp;
  HeightStatus status = HeightStatus::kTooFewReadings;
  double height_m = 0;  ///< base above the reference floor
  double height_std_m = 0;
  double climb_m_s = 0, climb_std_m_s = 0;
  double clearance_m = 0;    ///< base above the surface with most beams now; 0 without a result
  double spread_m = 0;       ///< standard deviation of the readings of that surface
  int readings = 0;          ///< of that surface
  double floor_level_m = 0;  ///< of the floor below the vehicle, above the reference
  int floor_id = 0;          ///< id of that floor
  FloorEvent event = FloorEvent::kNone;
  double step_m = 0;  ///< with an event: new level minus old level
};

/// Robust height from mirrored beams (dissertation 2.2.3), tracking altitude and floor level together.
///
/// For each scan: finds the surfaces in the readings (height_modes.hpp); predicts the height with the climb
/// rate; corrects height and floor with every surface that fits a known floor, within the noise of the
/// prediction or `min_step_m`; adds a floor for a surface that fits none, at a level as uncertain as the
/// height at that time (floor_filter.hpp), and confirms it after `confirm_sightings` observations. Hence the
/// motion between scans does not leak into the floor level, and a floor is recognised when flown over again.
///
/// Steps below `min_step_m` are taken as climb, and so are ramps where no IMU measures the vertical
/// acceleration: with one, a surface that rises by 0.3 m/s and more without it becomes a row of
/// floors. Not thread safe; update() allocates only the readings of the scan.
class HeightEstimator {
 public:
  explicit HeightEstimator(const HeightParams& params = {}, SurfaceSide side = SurfaceSide::kFloor);

  /// Processes the vertical distances of one scan (mirror_distances(), range_distance()). `acceleration_m_s2`
  /// is the mean upward acceleration since the previous scan (without gravity), if an IMU measured it.
  HeightEstimate update(const MirrorDistances& scan, const std::optional<double>& acceleration_m_s2 = {});

  /// Confirmed floors, sorted by level.
  [[nodiscard]] std::vector<FloorLevel> profile() const;
  [[nodiscard]] const HeightEstimate& last() const { return last_; }
  [[nodiscard]] SurfaceSide side() const { return side_; }

 private:
  struct Sighting {
    int floor_id = -1, readings = 0;
  };
  using Sightings = std::array<Sighting, HeightModes::kMax>;
  HeightEstimate finish(HeightStatus status, const HeightModes& modes);
  [[nodiscard]] double variance_m2(const HeightMode& mode) const;
  [[nodiscard]] double variance_m2(const HeightMode& mode, const FloorLevel& floor) const;
  [[nodiscard]] int best_floor(const HeightMode& mode, const Sightings& taken) const;
  Sightings associate(Time time, const HeightModes& modes);
  void forget_unconfirmed();
  void follow_floor(const Sightings& seen, HeightEstimate& estimate);

  HeightParams params_;
  SurfaceSide side_;
  FloorFilter filter_;
  HeightEstimate last_;
  bool any_scan_ = false;
  double explained_ratio_ = 1;  // of the readings of the newest scan
  int current_id_ = 0;
  std::vector<double> sorted_m_;  // kept between scans for its memory
};

}  // namespace hm
