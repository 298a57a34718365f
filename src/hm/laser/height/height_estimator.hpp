#pragma once
#include <vector>

#include "hm/laser/height/floor_filter.hpp"
#include "hm/laser/height/height_modes.hpp"
#include "hm/laser/height/height_params.hpp"
#include "hm/laser/height/mirror_distances.hpp"

namespace hm {

enum class HeightStatus {
  kOk,
  kTooFewReadings,  ///< not even one surface's worth of beams came back
  kSpreadTooWide,   ///< there were readings, but no surface in them
  kTilted,          ///< the vehicle leans too far for its mirrors
  kTimeBackwards,   ///< not later than the scan before; ignored
  kInvalidInput,    ///< attitude, acceleration or a distance is not a number; ignored
};

enum class FloorEvent { kNone, kStepUp, kStepDown };

/// Height after one scan. Unless the status is kOk, height and climb are predictions (kTimeBackwards and
/// kInvalidInput: those of the scan before).
///
/// For a ceiling everything is turned over: height is how far the base is below the reference ceiling, a
/// level how far a surface hangs below it, and climbing is sinking.
struct HeightEstimate {
  Time stamp;
  HeightStatus status = HeightStatus::kTooFewReadings;
  double height_m = 0;  ///< base over the reference floor
  double height_std_m = 0;
  double climb_m_s = 0, climb_std_m_s = 0;
  double clearance_m = 0;    ///< base over the surface that most beams see now; 0 without an answer
  double spread_m = 0;       ///< standard deviation of the readings of that surface
  int readings = 0;          ///< of that surface
  double floor_level_m = 0;  ///< of the floor that the vehicle is over, above the reference
  int floor_id = 0;          ///< which floor that is
  FloorEvent event = FloorEvent::kNone;
  double step_m = 0;  ///< with an event: new level minus old level
};

/// Robust height from mirrored beams (dissertation 2.2.3), tracking altitude and floor level together.
///
/// Per scan: the surfaces that the readings agree on (height_modes.hpp); the height predicted with its climb
/// rate; every surface that fits a known floor, within the noise of the prediction or `min_step_m`, corrects
/// height and floor; a surface that fits none is a new floor, whose level is known as well as the height is
/// at that moment (floor_filter.hpp), and which counts once it was seen `confirm_sightings` times. So the
/// motion of a frame does not leak into the floor, and a floor flown over again is recognised.
///
/// A step below `min_step_m` is taken as climb; so is a ramp. Not thread safe; an update allocates nothing
/// but the readings of the scan.
class HeightEstimator {
 public:
  explicit HeightEstimator(const HeightParams& params = {}, SurfaceSide side = SurfaceSide::kFloor);

  /// One scan through the mirror. `acceleration_m_s2` is the mean upward acceleration since the scan before
  /// (without gravity) where an IMU knows it, else 0.
  HeightEstimate update(const LaserScan& scan, const LaserRig::Mirror& mirror, const SweepAttitude& attitude,
                        double acceleration_m_s2 = 0);
  /// One scan that is given as vertical distances already; `acceleration_m_s2` as above.
  HeightEstimate update(const MirrorDistances& scan, double acceleration_m_s2 = 0);

  /// The floors found so far (confirmed), in the order of their levels.
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
