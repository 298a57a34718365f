#include "hm/laser/height/height_estimator.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "hm/core/rng.hpp"
#include "hm/laser/height/histogram_height.hpp"
#include "hm/laser/testing/floor_flight.hpp"

namespace hm {
namespace {

/// 20 readings of surfaces, without noise, `seconds` after the start.
MirrorDistances readings(double seconds, std::vector<std::pair<double, int>> surfaces) {
  MirrorDistances scan;
  scan.stamp = Time::from_seconds(seconds);
  for (const auto& [distance, count] : surfaces)
    for (int i = 0; i < count; ++i) scan.distances_m.push_back(distance + 0.002 * (i % 3 - 1));
  return scan;
}

TEST(HeightEstimator, FollowsAClimbAndAStepUnderneath) {
  // Climbing with 0.4 m/s, a box of 0.3 m comes between 1 s and 2 s.
  HeightEstimator estimator;
  HistogramHeight histogram;
  int up = 0, down = 0;
  for (int i = 0; i < 160; ++i) {
    const double time = 0.025 * i, height = 1 + 0.4 * time, level = time >= 1 && time < 2 ? 0.3 : 0;
    const auto scan = readings(time, {{height - level, 20}});
    const auto estimate = estimator.update(scan);
    ASSERT_EQ(estimate.status, HeightStatus::kOk);
    histogram.update(scan.stamp, scan.distances_m);
    if (i > 20) {
      ASSERT_NEAR(estimate.height_m, height, 0.005) << time;
      ASSERT_NEAR(estimate.climb_m_s, 0.4, 0.1) << time;
    }
    up += estimate.event == FloorEvent::kStepUp;
    down += estimate.event == FloorEvent::kStepDown;
    if (estimate.event == FloorEvent::kStepUp) {
      EXPECT_NEAR(estimate.step_m, 0.3, 0.005);
    }
    if (time > 1.1 && time < 1.9) {
      ASSERT_NEAR(estimate.floor_level_m, 0.3, 0.005);
    }
    if (time > 2.1) {
      ASSERT_EQ(estimate.floor_level_m, 0);
    }
    ASSERT_NEAR(estimate.clearance_m, height - level, 0.002);
  }
  EXPECT_EQ(up, 1);
  EXPECT_EQ(down, 1);
  EXPECT_EQ(estimator.profile().size(), 2u);
}

// The published method attributes the motion between scans at every edge to the floor; with a climb always in
// the same direction, it drifts.
TEST(HeightEstimator, DoesNotDriftOverStepsWhereThePublishedMethodDoes) {
  HeightEstimator estimator;
  HistogramHeight histogram;
  double ours = 0, published = 0;
  for (int i = 0; i < 800; ++i) {
    const double time = 0.025 * i, height = 1 + 0.1 * time, level = i % 40 < 20 ? 0 : 0.4;
    const auto scan = readings(time, {{height - level, 20}});
    ours = estimator.update(scan).height_m - height;
    published =
        histogram.update(scan.stamp, scan.distances_m).value_or(HistogramHeight::Answer{}).height_m - height;
  }
  EXPECT_LT(std::abs(ours), 0.005);
  EXPECT_GT(std::abs(published), 0.05);  // 39 edges of 2.5 mm
}

TEST(HeightEstimator, WithBothFloorsInSightTheStepIsExactWhateverTheVehicleDoes) {
  HeightEstimator estimator;
  estimator.update(readings(0, {{1.5, 20}}));
  estimator.update(readings(0.025, {{1.5, 20}}));
  // A jolt of 2 cm in the scan that sees the edge: old and new floor are seen from the same place.
  for (int i = 2; i < 6; ++i) estimator.update(readings(0.025 * i, {{1.52, 12}, {1.32, 8}}));
  const auto profile = estimator.profile();
  ASSERT_EQ(profile.size(), 2u);
  EXPECT_NEAR(profile[1].level_m, 0.2, 0.004);
}

TEST(HeightEstimator, SmallStepsBelowThePublishedThresholdAreSeen) {
  for (const double step : {0.04, 0.06, 0.1, 0.14}) {
    HeightEstimator estimator;
    for (int i = 0; i < 100; ++i) estimator.update(readings(0.025 * i, {{1.5 - (i >= 50 ? step : 0), 20}}));
    EXPECT_NEAR(estimator.last().height_m, 1.5, 0.006) << step;
    EXPECT_NEAR(estimator.last().floor_level_m, step, 0.006) << step;
  }
}

TEST(HeightEstimator, AThingThatPassesQuicklyIsNoFloor) {
  HeightEstimator estimator;
  int events = 0;
  for (int i = 0; i < 200; ++i) {
    const bool cable = i % 50 >= 30 && i % 50 < 32;
    events += estimator.update(readings(0.025 * i, {{cable ? 0.9 : 1.5, 20}})).event != FloorEvent::kNone;
    ASSERT_NEAR(estimator.last().height_m, 1.5, 0.01);
  }
  EXPECT_EQ(events, 0);
  EXPECT_EQ(estimator.profile().size(), 1u);
}

TEST(HeightEstimator, SaysWhyThereIsNoAnswer) {
  HeightEstimator estimator;
  EXPECT_EQ(estimator.update(readings(0, {{1, 3}})).status, HeightStatus::kTooFewReadings);
  EXPECT_TRUE(estimator.profile().empty());
  EXPECT_EQ(estimator.update(readings(0.1, {{1, 20}})).status, HeightStatus::kOk);
  EXPECT_EQ(estimator.update(readings(0.2, {})).status, HeightStatus::kTooFewReadings);
  MirrorDistances smear = readings(0.3, {});
  for (int i = 0; i < 40; ++i) smear.distances_m.push_back(0.5 + 0.01 * i);
  EXPECT_EQ(estimator.update(smear).status, HeightStatus::kSpreadTooWide);
  MirrorDistances tilted = readings(0.4, {{1, 20}});
  tilted.tilt_rad = 0.7;
  EXPECT_EQ(estimator.update(tilted).status, HeightStatus::kTilted);
  EXPECT_NEAR(estimator.last().height_m, 1, 0.3);
  EXPECT_GT(estimator.last().height_std_m, 0.05);
  const auto before = estimator.last();
  EXPECT_EQ(estimator.update(readings(0.4, {{1, 20}})).status, HeightStatus::kTimeBackwards);
  EXPECT_EQ(estimator.update(readings(0.1, {{5, 20}})).status, HeightStatus::kTimeBackwards);
  tilted.stamp = Time::from_seconds(0.5);
  tilted.tilt_rad = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(estimator.update(tilted).status, HeightStatus::kInvalidInput);
  EXPECT_EQ(estimator.update(readings(0.5, {{std::numeric_limits<double>::infinity(), 20}})).status,
            HeightStatus::kInvalidInput);
  EXPECT_EQ(estimator.update(readings(0.5, {{1, 20}}), std::nan("")).status, HeightStatus::kInvalidInput);
  EXPECT_EQ(estimator.last().stamp, before.stamp);
  EXPECT_EQ(estimator.last().height_m, before.height_m);
  EXPECT_EQ(estimator.update(readings(0.5, {{1, 20}})).status, HeightStatus::kOk);
  EXPECT_NEAR(estimator.last().height_m, 1, 0.01);
  EXPECT_EQ(estimator.last().floor_id, 0);  // after the silence it is still the same floor
}

TEST(HeightEstimator, ACeilingIsAFloorTurnedOver) {
  HeightEstimator floor(HeightParams{}, SurfaceSide::kFloor), ceiling(HeightParams{}, SurfaceSide::kCeiling);
  for (int i = 0; i < 100; ++i) {
    const auto scan = readings(0.025 * i, {{1.5 + 0.01 * i - (i > 60 ? 0.5 : 0), 20}});
    const auto a = floor.update(scan, 0.1), b = ceiling.update(scan, -0.1);
    ASSERT_EQ(a.height_m, b.height_m);
    ASSERT_EQ(a.floor_level_m, b.floor_level_m);
  }
}

TEST(HeightEstimator, KnownAccelerationHelps) {
  // An acceleration of 40 m/s^2 for one scan looks like a step, unless it is measured by an IMU.
  for (const bool given : {false, true}) {
    HeightEstimator estimator;
    double height = 1.5, climb = 0;
    for (int i = 0; i < 80; ++i) {
      const double acceleration = i >= 40 && i < 44 ? 40 : 0;
      height += 0.025 * climb + 0.5 * 0.025 * 0.025 * acceleration;
      climb += 0.025 * acceleration;
      estimator.update(readings(0.025 * i, {{height, 20}}),
                       given ? std::optional(acceleration) : std::nullopt);
    }
    if (given) {
      EXPECT_NEAR(estimator.last().height_m, height, 0.01);
      EXPECT_EQ(estimator.profile().size(), 1u);
    } else {
      EXPECT_GT(std::abs(estimator.last().height_m - height), 0.05);
    }
  }
}

/// Hovers while the surface below rises for 1.2 s and ends in an edge, three times; an accelerometer with
/// noise and a bias. The error of the height at the end, and the largest.
std::pair<double, double> errors_over_ramps(double slope_m_s, std::uint64_t seed, bool with_imu) {
  constexpr double kHeight_m = 1.5, kBias_m_s2 = 0.15;
  HeightEstimator estimator;
  Rng rng(seed);
  double largest_m = 0, now_m = 0;
  for (int i = 0; i < 600; ++i) {
    const double time = 0.025 * i, on_ramp = std::fmod(time, 5) - 3;
    const double level = on_ramp > 0 && on_ramp < 1.2 ? slope_m_s * on_ramp : 0;
    const auto scan = readings(time, {{kHeight_m - level + rng.normal(0, 0.002), 20}});
    const double acceleration_m_s2 = kBias_m_s2 + rng.normal(0, 0.03);
    const auto estimate = estimator.update(scan, with_imu ? std::optional(acceleration_m_s2) : std::nullopt);
    now_m = std::abs(estimate.height_m - kHeight_m);
    largest_m = std::max(largest_m, now_m);
  }
  return {now_m, largest_m};
}

TEST(HeightEstimator, ARampIsNoClimbWhereAnImuTellsTheClimb) {
  for (const double slope_m_s : {0.2, 0.5, 1.2}) {
    for (std::uint64_t seed = 1; seed <= 20; ++seed) {
      const auto [end_m, largest_m] = errors_over_ramps(slope_m_s, seed, true);
      EXPECT_LT(end_m, 0.1) << slope_m_s << " m/s, seed " << seed;
      EXPECT_LT(largest_m, 0.12) << slope_m_s << " m/s, seed " << seed;
    }
    EXPECT_GT(errors_over_ramps(slope_m_s, 1, false).first, 3.3 * slope_m_s) << "without one it is";
  }
}

FloorFlightParams steps(std::uint64_t seed) {
  FloorFlightParams params;
  params.boxes = FloorFlight::steps_from_10_to_80_cm();
  params.seed = seed;
  params.duration_s = 100;  // ten times over the whole row of boxes
  return params;
}

TEST(HeightEstimator, KeepsItsBarsOverStepsWithMixedBeams) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    const auto score = score_height(steps(seed), {});
    EXPECT_LT(score.rmse_m, 0.010) << seed;
    EXPECT_LT(score.worst_floor_m, 0.020) << seed;
    EXPECT_LT(score.end_error_m, 0.020) << seed;
    EXPECT_EQ(score.false_floors, 0) << seed;
    EXPECT_EQ(score.events, 110) << seed;  // eleven changes of floor each way
    EXPECT_GT(score_histogram_height(steps(seed)).rmse_m, 5 * score.rmse_m) << seed;
  }
}

TEST(HeightEstimator, OutliersDoNotMatter) {
  auto flight = steps(4);
  flight.outlier_ratio = 0.2;
  flight.duration_s = 40;
  const auto score = score_height(flight, {});
  EXPECT_LT(score.rmse_m, 0.010);
  EXPECT_EQ(score.false_floors, 0);
}

TEST(HeightEstimator, TenMinutesOverAFlatFloorWithoutAStep) {
  FloorFlightParams flight;
  flight.duration_s = 600;
  flight.bob_m = 0.4;
  const auto score = score_height(flight, {});
  EXPECT_EQ(score.events, 0);
  EXPECT_EQ(score.false_floors, 0);
  EXPECT_LT(score.rmse_m, 0.004);
}

}  // namespace
}  // namespace hm
