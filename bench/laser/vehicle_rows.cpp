// Rows about the vehicle: height over steps, and velocity with a late laser.
#include <algorithm>

#include "hm/core/statistics.hpp"
#include "hm/estimation/testing/laser_flight.hpp"
#include "hm/laser/testing/floor_flight.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

/// The worst of several flights.
HeightScore worse(const HeightScore& a, const HeightScore& b) {
  return {.rmse_m = std::max(a.rmse_m, b.rmse_m),
          .max_error_m = std::max(a.max_error_m, b.max_error_m),
          .end_error_m = std::max(a.end_error_m, b.end_error_m),
          .worst_floor_m = std::max(a.worst_floor_m, b.worst_floor_m),
          .false_floors = a.false_floors + b.false_floors,
          .events = a.events + b.events,
          .answers = a.answers + b.answers};
}

}  // namespace

Result<BenchResult> bench_height(const BenchOptions&) {
  constexpr int kFlights = 10;
  HeightScore ours, published, flat, flat_published, ours_with_imu;
  for (std::uint64_t seed = 1; seed <= kFlights; ++seed) {
    FloorFlightParams flight;
    flight.seed = seed;
    flight.boxes = FloorFlight::steps_from_10_to_80_cm();
    flight.duration_s = 100;  // ten times over all boxes at 1 m/s
    ours = worse(ours, score_height(flight, {}));
    ours_with_imu = worse(ours_with_imu, score_height(flight, {}, true));
    published = worse(published, score_histogram_height(flight));
    if (seed > 2) continue;
    flight.boxes.clear();
    flight.duration_s = 600;
    flat = worse(flat, score_height(flight, {}));
    flat_published = worse(flat_published, score_histogram_height(flight));
  }
  BenchResult result;
  result.rows = {{"height", ours.rmse_m * 1e3, published.rmse_m * 1e3},
                 {"height_floors", ours.worst_floor_m * 1e3, published.worst_floor_m * 1e3},
                 {"height_false_steps", static_cast<double>(flat.events + ours.false_floors),
                  static_cast<double>(flat_published.events + published.false_floors)},
                 {"height_return", ours.end_error_m * 1e3, published.end_error_m * 1e3}};
  result.details = JsonValue::object({{"flights", kFlights},
                                      {"largest_error_mm", ours.max_error_m * 1e3},
                                      {"flat_rmse_mm", flat.rmse_m * 1e3},
                                      {"with_imu_rmse_mm", ours_with_imu.rmse_m * 1e3},
                                      {"with_imu_floors_mm", ours_with_imu.worst_floor_m * 1e3}});
  return result;
}

Result<BenchResult> bench_late_laser(const BenchOptions&) {
  double with = 0, without = 0, thesis = 0, punctual = 0;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    LaserFlightParams flight_params;
    flight_params.seed = seed;
    const LaserFlight late(flight_params);
    flight_params.laser_delay_s = 0;
    const LaserFlight in_time(flight_params);
    StateEstimatorParams params;
    with = std::max(with, velocity_rmse_m_s(late, params));
    punctual = std::max(punctual, velocity_rmse_m_s(in_time, params));
    params.fusion.delay_compensation = false;
    without = std::max(without, velocity_rmse_m_s(late, params));
    params.mode = FusionMode::kThesis;
    params.thesis = DecoupledKalmanParams::city_flyer();
    thesis = std::max(thesis, velocity_rmse_m_s(late, params));
  }
  BenchResult result;
  result.rows = {{"late_laser", with, without}};
  result.details =
      JsonValue::object({{"published_filters_m_s", thesis}, {"laser_without_delay_m_s", punctual}});
  return result;
}

}  // namespace hm::bench
