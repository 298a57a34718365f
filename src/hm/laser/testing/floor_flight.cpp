#include "hm/laser/testing/floor_flight.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "hm/geometry/se2.hpp"
#include "hm/laser/height/histogram_height.hpp"

namespace hm {
namespace {

constexpr double kScanRate_hz = 40, kPi = std::numbers::pi;
constexpr int kSpotRays = 7;

/// The virtual laser of the dissertation's vehicle, and its first 20 beams.
LaserRig::Mirror city_flyer_mirror() {
  const SE3 T_base_laser(Mat3::Identity(), Vec3(0, 0, 0.12));
  const SE3 T_laser_virtual(rotation_from_roll_pitch_yaw({kPi / 2, -kPi / 4, -kPi / 4}),
                            Vec3(-0.0474, -0.0474, 0.0670));
  return {{0, 20}, T_base_laser * T_laser_virtual};
}

}  // namespace

FloorFlight::FloorFlight(const FloorFlightParams& params)
    : params_(params), mirror_(city_flyer_mirror()), rng_(params.seed) {
  for (double& phase : phases_) phase = rng_.uniform(0, 2 * kPi);
}

std::vector<FloorBox> FloorFlight::steps_from_10_to_80_cm() {
  return {{1.0, 1.8, 0.10}, {2.4, 3.2, 0.20}, {3.8, 4.6, 0.40},
          {4.6, 5.4, 0.55}, {6.0, 6.8, 0.80}, {7.4, 8.6, 0.30}};
}

std::size_t FloorFlight::frame_count() const {
  return static_cast<std::size_t>(params_.duration_s * kScanRate_hz);
}

double FloorFlight::height_m(double time_s) const {
  return params_.altitude_m + params_.bob_m * (0.7 * std::sin(1.3 * time_s + phases_[0]) +
                                               0.3 * std::sin(3.1 * time_s + phases_[1]));
}

SE3 FloorFlight::T_world_base(double time_s) const {
  const double along = std::fmod(params_.speed_m_s * time_s, 2 * params_.length_m);
  const double x = along < params_.length_m ? along : 2 * params_.length_m - along;
  const Vec3 angles(params_.tilt_rad * std::sin(2.1 * time_s + phases_[2]),
                    params_.tilt_rad * std::sin(1.7 * time_s + phases_[3]), 0.2 * std::sin(0.3 * time_s));
  return {rotation_from_roll_pitch_yaw(angles), Vec3(x, 0, height_m(time_s))};
}

/// Along a ray that goes down: the floor z = 0, or the first box (a slab in x, below its top).
double FloorFlight::distance_to_surface_m(const Vec3& origin, const Vec3& direction) const {
  double nearest = -origin.z() / direction.z();
  for (const FloorBox& box : params_.boxes) {
    double enter = (box.top_m - origin.z()) / direction.z(), leave = std::numeric_limits<double>::infinity();
    if (std::abs(direction.x()) > 1e-12) {
      const double a = (box.begin_m - origin.x()) / direction.x(),
                   b = (box.end_m - origin.x()) / direction.x();
      enter = std::max(enter, std::min(a, b));
      leave = std::max(a, b);
    } else if (origin.x() < box.begin_m || origin.x() > box.end_m) {
      continue;
    }
    if (enter < leave && enter > 0) nearest = std::min(nearest, enter);
  }
  return nearest;
}

double FloorFlight::range_m(const SE3& T_world_virtual, double angle_rad) {
  const Vec3 direction = T_world_virtual.rotation() * Vec3(std::cos(angle_rad), std::sin(angle_rad), 0);
  if (rng_.uniform() < params_.outlier_ratio)
    return rng_.uniform(0.2, 1.0) * distance_to_surface_m(T_world_virtual.translation(), direction);
  double sum = 0;
  for (int ray = 0; ray < kSpotRays; ++ray) {
    const double offset_rad = params_.spot_rad * (ray / (kSpotRays - 1.0) - 0.5);
    const Vec3 within_spot = (direction + Vec3(offset_rad, 0, 0)).normalized();
    sum += distance_to_surface_m(T_world_virtual.translation(), within_spot);
  }
  return sum / kSpotRays + rng_.normal(0, params_.reading_std_m);
}

FloorFlight::Frame FloorFlight::next() {
  const double start_s = static_cast<double>(next_++) / kScanRate_hz;
  Frame frame;
  LaserScan& scan = frame.scan;
  scan.stamp = Time::from_seconds(start_s);
  scan.angle_min_rad = -0.75 * kPi;
  scan.angle_increment_rad = kPi / 720;
  scan.time_increment_s = 0.025 / 1440;
  scan.range_min_m = 0.1;
  scan.range_max_m = 30;
  for (std::size_t beam = 0; beam < mirror_.beams.end; ++beam) {
    const SE3 T_world_virtual = T_world_base(scan.stamp_of(beam).seconds()) * mirror_.T_base_virtual_laser;
    scan.ranges_m.push_back(static_cast<float>(range_m(T_world_virtual, scan.angle_rad(beam))));
  }
  frame.attitude.begin = scan.stamp;
  frame.attitude.end = scan.stamp + Duration::from_seconds(0.025);
  frame.attitude.R_world_base_begin = T_world_base(start_s).quaternion();
  frame.attitude.R_world_base_end = T_world_base(start_s + 0.025).quaternion();
  const double middle_s = scan.stamp_of(10).seconds();
  const Vec3 base = T_world_base(middle_s).translation();
  frame.height_m = base.z();
  frame.acceleration_m_s2 = -params_.bob_m * (0.7 * 1.3 * 1.3 * std::sin(1.3 * middle_s + phases_[0]) +
                                              0.3 * 3.1 * 3.1 * std::sin(3.1 * middle_s + phases_[1]));
  frame.floor_level_m = base.z() - distance_to_surface_m(base, -Vec3::UnitZ());
  return frame;
}

namespace {

double distance_to_nearest(const std::vector<double>& levels, double level) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const double other : levels) nearest = std::min(nearest, std::abs(other - level));
  return nearest;
}

std::vector<double> true_levels(const FloorFlightParams& flight) {
  std::vector<double> levels{0};
  for (const FloorBox& box : flight.boxes) levels.push_back(box.top_m);
  return levels;
}

struct ErrorSum {
  double squares = 0;
  void add(HeightScore& score, double error_m) {
    squares += error_m * error_m;
    ++score.answers;
    score.max_error_m = std::max(score.max_error_m, std::abs(error_m));
    score.end_error_m = std::abs(error_m);
    score.rmse_m = std::sqrt(squares / score.answers);
  }
};

}  // namespace

HeightScore score_height(const FloorFlightParams& params, const HeightParams& height_params,
                         bool with_acceleration) {
  FloorFlight flight(params);
  HeightEstimator estimator(height_params);
  HeightScore score;
  ErrorSum sum;
  for (std::size_t i = 0; i < flight.frame_count(); ++i) {
    const auto frame = flight.next();
    const auto scan = mirror_distances(frame.scan, flight.mirror(), frame.attitude, SurfaceSide::kFloor);
    const auto height =
        estimator.update(scan, with_acceleration ? std::optional(frame.acceleration_m_s2) : std::nullopt);
    // Every scan counts: without an answer, the prediction is judged.
    if (!estimator.profile().empty()) sum.add(score, height.height_m - frame.height_m);
    score.events += height.event != FloorEvent::kNone;
  }
  std::vector<double> found;
  for (const FloorLevel& floor : estimator.profile()) found.push_back(floor.level_m);
  for (const double level : true_levels(params))
    score.worst_floor_m = std::max(score.worst_floor_m, distance_to_nearest(found, level));
  for (const double level : found)
    score.false_floors += distance_to_nearest(true_levels(params), level) > 0.02;
  return score;
}

HeightScore score_histogram_height(const FloorFlightParams& params) {
  FloorFlight flight(params);
  HistogramHeight estimator;
  HeightScore score;
  ErrorSum sum;
  double floor_m = 0;
  std::vector<double> found{0};
  for (std::size_t i = 0; i < flight.frame_count(); ++i) {
    const auto frame = flight.next();
    const auto scan = mirror_distances(frame.scan, flight.mirror(), frame.attitude, SurfaceSide::kFloor);
    const auto height = estimator.update(scan.stamp, scan.distances_m);
    if (!height) continue;
    sum.add(score, height->height_m - frame.height_m);
    if (height->floor_level_m == floor_m) continue;
    floor_m = height->floor_level_m;
    ++score.events;
    found.push_back(floor_m);
    score.false_floors += distance_to_nearest(true_levels(params), floor_m) > 0.02;
  }
  for (const double level : true_levels(params))
    score.worst_floor_m = std::max(score.worst_floor_m, distance_to_nearest(found, level));
  return score;
}

}  // namespace hm
