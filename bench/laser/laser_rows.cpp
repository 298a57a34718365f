// Rows about scan matching: time per match, the dissertation's ablation, and standing still.
#include <algorithm>
#include <cmath>
#include <limits>

#include "dense/scene_frames.hpp"
#include "hm/core/statistics.hpp"
#include "hm/core/stopwatch.hpp"
#include "hm/io/laser/laser_recording.hpp"
#include "hm/laser/odometry/scan_odometry.hpp"
#include "hm/laser/odometry/scan_projection.hpp"
#include "hm/laser/testing/planar_world.hpp"
#include "measurement.hpp"

namespace hm::bench {
namespace {

using laser_testing::kOfficeLoop_m;
using laser_testing::office_loop;
using laser_testing::PlanarWorld;
using laser_testing::TestLaser;

constexpr std::size_t kScans = 1200;  // 30 s at 40 Hz
constexpr std::uint64_t kSeeds = 4;
constexpr double kLost_m = 0.5;

struct Flight {
  std::vector<SE2> truth;  // T_world_base
  std::vector<PlanarScan> scans;
};

/// 30 s of a 1081-beam laser in the office: around the loop of 41.7 m, or standing still.
Flight fly(bool moving, double sigma_m, std::uint64_t seed) {
  const PlanarWorld world = laser_testing::office_world();
  const TestLaser laser{.range_sigma_m = sigma_m};
  Rng rng(seed);
  Flight flight;
  for (std::size_t i = 0; i < kScans; ++i) {
    const double distance_m = kOfficeLoop_m * static_cast<double>(i) / static_cast<double>(kScans);
    flight.truth.push_back(moving ? office_loop(distance_m) : SE2(1.5, 1.5, 0.3));
    flight.scans.push_back(planar_scan_of_world(world, flight.truth.back(), laser, rng));
    flight.scans.back().stamp = Time::from_seconds(static_cast<double>(i) / 40);
  }
  return flight;
}

struct Score {
  double squared_m2 = 0, end_squared_m2 = 0, iterations = 0, runs = 0;
  int failures = 0;

  [[nodiscard]] double rmse_m() const { return std::sqrt(squared_m2 / runs); }
  [[nodiscard]] double end_m() const { return std::sqrt(end_squared_m2 / runs); }
  [[nodiscard]] JsonValue json() const {
    return JsonValue::object({{"rmse_mm", rmse_m() * 1e3},
                              {"end_mm", end_m() * 1e3},
                              {"iterations", iterations / runs},
                              {"failures", failures}});
  }
};

/// Adds one run of the odometry. A scan without a match counts with the last pose.
void add_run(const Flight& flight, const ScanOdometryParams& params, Score& score) {
  ScanOdometry odometry(params);
  odometry.start(flight.truth[0]);
  SE2 last = flight.truth[0];
  double squared = 0, iterations = 0, error = 0;
  for (std::size_t i = 0; i < flight.scans.size(); ++i) {
    const OdometryStep step = odometry.process(flight.scans[i]);
    if (step.T_odom_base) last = *step.T_odom_base;
    score.failures += !step.T_odom_base;
    iterations += step.match.iterations;
    error = (last.translation() - flight.truth[i].translation()).norm();
    squared += error * error;
  }
  score.squared_m2 += squared / static_cast<double>(flight.scans.size());
  score.end_squared_m2 += error * error;
  score.iterations += iterations / static_cast<double>(flight.scans.size());
  score.runs += 1;
}

ScanOdometryParams published(bool keyframes, bool velocity, double distance_m, double angle_rad) {
  ScanOdometryParams params = ScanOdometryParams::dissertation();
  params.use_keyframes = keyframes;
  params.use_velocity = velocity;
  params.keyframe_distance_m = distance_m;
  params.keyframe_angle_rad = angle_rad;
  return params;
}

struct Times {
  std::vector<double> ms;  ///< fastest round of every scan but the first
  int failures = 0;
};

/// Every scan counts with its fastest round.
Times time_scans(const std::vector<PlanarScan>& scans, const ScanOdometryParams& params, int rounds) {
  Times times;
  std::vector<double> fastest(scans.size(), std::numeric_limits<double>::max());
  for (int round = 0; round < rounds; ++round) {
    ScanOdometry odometry(params);
    for (std::size_t i = 0; i < scans.size(); ++i) {
      const Stopwatch watch;
      const OdometryStep step = odometry.process(scans[i]);
      fastest[i] = std::min(fastest[i], watch.milliseconds());
      if (round == 0) times.failures += !step.T_odom_base;
    }
  }
  times.ms.assign(fastest.begin() + 1, fastest.end());
  return times;
}

JsonValue json_of(const Times& times) {
  return JsonValue::object({{"median_ms", quantile(times.ms, 0.5)},
                            {"p99_ms", quantile(times.ms, 0.99)},
                            {"slowest_ms", quantile(times.ms, 1)},
                            {"failures", times.failures}});
}

}  // namespace

Result<BenchResult> bench_plicp_1081(const BenchOptions& options) {
  const Flight flight = fly(true, 0.01, 1);
  const Times ours = time_scans(flight.scans, {}, options.rounds);
  const Times plain = time_scans(flight.scans, ScanOdometryParams::dissertation(), options.rounds);
  ScanOdometryParams without;
  without.matcher.compute_covariance = false;
  const Times no_covariance = time_scans(flight.scans, without, options.rounds);
  const double median = quantile(ours.ms, 0.5);
  BenchResult result;
  result.rows = {{"plicp_1081", median, quantile(plain.ms, 0.5)},
                 {"plicp_1081_p99", quantile(ours.ms, 0.99) / median, {}},
                 {"plicp_covariance", 100 * (median / quantile(no_covariance.ms, 0.5) - 1), {}}};
  result.details = JsonValue::object({{"ours", json_of(ours)}, {"published", json_of(plain)}});
  return result;
}

Result<BenchResult> bench_plicp_bag(const BenchOptions& options) {
  const auto recording = open_laser_recording(data_folder() / "bags" / "scan_tools_laser_demo.bag");
  if (!recording) return forward_error(recording);
  ScanProjector projector({});
  std::vector<PlanarScan> scans;
  for (const LaserScan& scan : recording->lasers.at(0).scans) scans.push_back(projector.project(scan).scan);
  const Times ours = time_scans(scans, {}, options.rounds);
  const Times plain = time_scans(scans, ScanOdometryParams::dissertation(), options.rounds);
  const double median = quantile(ours.ms, 0.5);
  BenchResult result;
  result.rows = {
      {"plicp_bag", median, quantile(plain.ms, 0.5)},
      {"plicp_bag_p99", quantile(ours.ms, 0.99) / median, {}},
      {"plicp_bag_failures", static_cast<double>(ours.failures), static_cast<double>(plain.failures)}};
  result.details =
      JsonValue::object({{"ours", json_of(ours)}, {"published", json_of(plain)}, {"scans", scans.size()}});
  return result;
}

/// The five rows of the ablation on the published matcher, with its best keyframes of 0.5 m and 30 degrees
/// besides, and what the library does by default.
Result<BenchResult> bench_plicp_ablation(const BenchOptions&) {
  const std::pair<const char*, ScanOdometryParams> configurations[] = {
      {"frame_to_frame_zero_velocity", published(false, false, 0, 0)},
      {"frame_to_frame_velocity", published(false, true, 0, 0)},
      {"keyframes_zero_velocity", published(true, false, 0.1, 0.175)},
      {"keyframes_0_1_velocity", published(true, true, 0.1, 0.175)},
      {"keyframes_0_2_velocity", published(true, true, 0.2, 0.349)},
      {"keyframes_0_5_velocity", published(true, true, 0.5, 0.524)},
      {"default", {}}};
  std::vector<Score> scores(std::size(configurations));
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Flight flight = fly(true, 0.03, seed);
    for (std::size_t k = 0; k < scores.size(); ++k) add_run(flight, configurations[k].second, scores[k]);
  }
  const auto rmse_m = [&](std::size_t k) { return scores[k].rmse_m(); };
  // Lost without both; each extension helps; both together are best, and we are better still.
  const bool claims[] = {rmse_m(0) > kLost_m, rmse_m(1) < rmse_m(0), rmse_m(3) < rmse_m(2),
                         rmse_m(3) < rmse_m(1), rmse_m(6) < rmse_m(5)};
  BenchResult result;
  result.rows = {{"plicp_ablation", rmse_m(6) * 1e3, rmse_m(5) * 1e3},
                 {"plicp_ablation_end", scores[6].end_m() * 1e3, scores[5].end_m() * 1e3},
                 {"plicp_ablation_order",
                  static_cast<double>(std::count(std::begin(claims), std::end(claims), false)),
                  {}}};
  for (std::size_t k = 0; k < scores.size(); ++k) result.details[configurations[k].first] = scores[k].json();
  return result;
}

Result<BenchResult> bench_plicp_still(const BenchOptions&) {
  Score ours, plain;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Flight flight = fly(false, 0.03, seed);
    add_run(flight, {}, ours);
    add_run(flight, ScanOdometryParams::dissertation(), plain);
  }
  BenchResult result;
  result.rows = {{"plicp_still", ours.rmse_m() * 1e3, plain.rmse_m() * 1e3}};
  result.details = JsonValue::object({{"ours", ours.json()}, {"published", plain.json()}});
  return result;
}

}  // namespace hm::bench
