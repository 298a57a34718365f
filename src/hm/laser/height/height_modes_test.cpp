#include "hm/laser/height/height_modes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "hm/core/rng.hpp"
#include "hm/geometry/se2.hpp"
#include "hm/laser/height/floor_filter.hpp"
#include "hm/laser/height/mirror_distances.hpp"

namespace hm {
namespace {

HeightModes modes_of(std::vector<double> distances, const HeightParams& params = {}) {
  return find_height_modes(distances, params);
}

std::vector<double> around(Rng& rng, double center, int count, double sigma = 0.01) {
  std::vector<double> values;
  for (int i = 0; i < count; ++i) values.push_back(center + rng.normal(0, sigma));
  return values;
}

std::vector<double> joined(std::vector<double> a, const std::vector<double>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(HeightModes, TwoFloorsAndWhatLiesBetweenThem) {
  Rng rng(1);
  for (int run = 0; run < 100; ++run) {
    auto readings = joined(around(rng, 1.5, 9), around(rng, 1.1, 7));
    for (int i = 1; i <= 4; ++i) readings.push_back(1.1 + 0.08 * i);  // mixed ones, spread evenly
    const auto found = modes_of(readings);
    ASSERT_EQ(found.size, 2);
    EXPECT_NEAR(found.modes[0].distance_m, 1.5, 0.015);
    EXPECT_NEAR(found.modes[1].distance_m, 1.1, 0.015);
    EXPECT_NEAR(found.explained_ratio, 0.8, 0.11);
  }
}

TEST(HeightModes, BinEdgesDoNotMatter) {
  Rng rng(2);
  for (int run = 0; run < 200; ++run) {
    const auto readings = joined(around(rng, 1.0, 14), around(rng, 1.3, 6));
    const auto reference = modes_of(readings);
    // A histogram of fixed bins would split the mode for some of these.
    for (const double shift : {0.003, 0.007, 0.0133, 0.019, 5.0}) {
      auto moved = readings;
      for (double& value : moved) value += shift;
      const auto found = modes_of(moved);
      ASSERT_EQ(found.size, reference.size);
      for (int i = 0; i < found.size; ++i) {
        const auto k = static_cast<std::size_t>(i);
        ASSERT_NEAR(found.modes[k].distance_m, reference.modes[k].distance_m + shift, 1e-6);
        ASSERT_EQ(found.modes[k].readings, reference.modes[k].readings);
      }
    }
  }
}

TEST(HeightModes, OrderOfTheReadingsDoesNotMatter) {
  Rng rng(3);
  auto readings = joined(around(rng, 1.0, 10), around(rng, 1.4, 10));
  const auto reference = modes_of(readings);
  for (int run = 0; run < 20; ++run) {
    for (std::size_t i = readings.size(); i > 1; --i)
      std::swap(readings[i - 1], readings[rng.below(static_cast<std::uint32_t>(i))]);
    const auto found = modes_of(readings);
    ASSERT_EQ(found.size, reference.size);
    ASSERT_EQ(found.modes[0].distance_m, reference.modes[0].distance_m);
  }
}

// With bins of 5 cm and a gate of 3 cm on the spread within a bin, the published gate could never fire.
TEST(HeightModes, TheSpreadGateFires) {
  std::vector<double> ramp;
  for (int i = 0; i < 40; ++i) ramp.push_back(1 + 0.005 * i);
  const auto found = modes_of(ramp);
  EXPECT_EQ(found.size, 0);
  EXPECT_GT(found.rejected, 0);
  EXPECT_LT(HeightParams{}.max_spread_m(), HeightParams{}.mode_half_width_m() / std::sqrt(3.0));
}

TEST(HeightModes, FewOrNoReadings) {
  EXPECT_EQ(modes_of({}).size, 0);
  EXPECT_EQ(modes_of({1, 1, 1, 1}).size, 0);
  EXPECT_EQ(modes_of({1, 1, 1, 1, 1}).size, 1);
  EXPECT_EQ(modes_of({1, 2, 3, 4, 5, 6, 7}).size, 0);
}

/// A mirror that looks straight down from the base; beams fan out in the xz plane.
LaserRig::Mirror straight_down(std::size_t beams) {
  Mat3 rotation;
  rotation << 0, 1, 0, 0, 0, -1, -1, 0, 0;  // virtual x down, y along base x
  return {{0, beams}, SE3(rotation, Vec3(0.1, 0, -0.05))};
}

LaserScan fan(std::size_t beams) {
  LaserScan scan;
  scan.stamp = Time::from_seconds(10);
  scan.angle_increment_rad = 0.01;
  scan.angle_min_rad = -0.01 * static_cast<double>(beams) / 2;
  scan.time_increment_s = 0.01;  // slow, so that the attitude changes a lot
  scan.range_min_m = 0.1;
  scan.range_max_m = 30;
  scan.ranges_m.assign(beams, LaserScan::kNoReturn);
  return scan;
}

TEST(MirrorDistances, APlaneBelowATurningVehicleIsFlat) {
  const std::size_t beams = 20;
  const auto mirror = straight_down(beams);
  LaserScan scan = fan(beams);
  SweepAttitude attitude;
  attitude.begin = scan.stamp;
  attitude.end = scan.stamp_of(beams);
  attitude.R_world_base_begin = rotation_from_roll_pitch_yaw({0.3, -0.2, 1});
  attitude.R_world_base_end = rotation_from_roll_pitch_yaw({-0.2, 0.3, 1.5});
  const double height_m = 1.7;
  for (std::size_t i = 0; i < beams; ++i) {
    const Mat3 rotation = attitude.at(scan.stamp_of(i)).toRotationMatrix();
    const Vec3 origin = rotation * mirror.T_base_virtual_laser.translation() + Vec3(0, 0, height_m);
    const Vec3 direction = rotation * (mirror.T_base_virtual_laser.rotation() *
                                       Vec3(std::cos(scan.angle_rad(i)), std::sin(scan.angle_rad(i)), 0));
    scan.ranges_m[i] = static_cast<float>(-origin.z() / direction.z());
  }
  const auto result = mirror_distances(scan, mirror, attitude, SurfaceSide::kFloor);
  ASSERT_EQ(result.distances_m.size(), beams);
  for (const double distance : result.distances_m) EXPECT_NEAR(distance, height_m, 1e-6);
  // One attitude for all beams would not do.
  const auto held = mirror_distances(
      scan, mirror, SweepAttitude::constant(attitude.at(scan.stamp).toRotationMatrix()), SurfaceSide::kFloor);
  const auto [low, high] = std::minmax_element(held.distances_m.begin(), held.distances_m.end());
  EXPECT_GT(*high - *low, 0.05);
  EXPECT_EQ(result.stamp, scan.stamp_of(beams / 2));
}

TEST(MirrorDistances, LeavesOutWhatIsNoReading) {
  LaserScan scan = fan(8);
  const float values[] = {1, LaserScan::kInvalid, LaserScan::kNoReturn, 0.05F, 31, -1, 1.2F, 1.1F};
  scan.ranges_m.assign(std::begin(values), std::end(values));
  const auto level = SweepAttitude::constant(Mat3::Identity());
  EXPECT_EQ(mirror_distances(scan, straight_down(8), level, SurfaceSide::kFloor).distances_m.size(), 3u);
  EXPECT_EQ(mirror_distances(scan, straight_down(8), level, SurfaceSide::kCeiling).distances_m.size(), 0u);
  auto beyond = straight_down(8);
  beyond.beams = {6, 500};  // more than the scan has
  EXPECT_EQ(mirror_distances(scan, beyond, level, SurfaceSide::kFloor).distances_m.size(), 2u);
  auto broken = level;
  broken.R_world_base_end.w() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(std::isnan(mirror_distances(scan, straight_down(8), broken, SurfaceSide::kFloor).tilt_rad));
}

/// The joint filter written down on dense matrices: [height, climb, bias, levels...].
struct DenseFloors {
  Eigen::VectorXd x;
  Eigen::MatrixXd p;
  bool measured = false;
  /// With an acceleration that is measured, or nothing.
  void predict(double dt, const HeightParams& params, const std::optional<double>& a) {
    const double density =
        std::pow(a ? params.kMeasuredDensity_m_s2_sqrt_hz : params.acceleration_density_m_s2_sqrt_hz, 2);
    Eigen::MatrixXd f = Eigen::MatrixXd::Identity(x.size(), x.size()),
                    q = Eigen::MatrixXd::Zero(x.size(), x.size());
    f(0, 1) = dt;
    q(0, 0) = density * dt * dt * dt / 3;
    q(0, 1) = q(1, 0) = density * dt * dt / 2;
    q(1, 1) = density * dt;
    q(2, 2) = std::pow(params.kBiasDensity_m_s2_sqrt_s, 2) * dt;
    measured = a.has_value();
    if (a) f(0, 2) = -0.5 * dt * dt, f(1, 2) = -dt;
    x = f * x;
    x(0) += 0.5 * dt * dt * a.value_or(0);
    x(1) += dt * a.value_or(0);
    p = f * p * f.transpose() + q;
  }
  void correct(int floor, double d, double r) {
    Eigen::RowVectorXd h = Eigen::RowVectorXd::Zero(x.size());
    h(0) = 1;
    if (floor > 0) h(floor + 2) = -1;
    const double residual = d - h * x;
    double s = h * p * h.transpose() + r;
    if (measured) s = std::max(s, residual * residual / std::pow(HeightParams::kMostDeviationsRatio, 2));
    const Eigen::VectorXd k = p * h.transpose() / s;
    x += k * (d - h * x);
    p -= k * s * k.transpose();
  }
  void add(double d, double r) {
    const Eigen::Index n = x.size();
    Eigen::MatrixXd grow = Eigen::MatrixXd::Zero(n + 1, n);
    grow.topRows(n).setIdentity();
    grow(n, 0) = 1;
    x = (grow * x).eval();
    x(n) -= d;
    p = (grow * p * grow.transpose()).eval();
    p(n, n) += r;
  }
  void remove(int floor) {
    const Eigen::Index n = x.size(), gone = floor + 2;
    Eigen::MatrixXd keep = Eigen::MatrixXd::Zero(n - 1, n);
    for (Eigen::Index i = 0, j = 0; j < n; ++j)
      if (j != gone) keep(i++, j) = 1;
    x = (keep * x).eval();
    p = (keep * p * keep.transpose()).eval();
  }
};

TEST(FloorFilter, IsTheTextbookFilterOfHeightAndFloors) {
  HeightParams params;
  FloorFilter filter(params);
  filter.start({}, 1.5, 1e-4);
  DenseFloors dense{Eigen::Vector3d(1.5, 0, 0),
                    Eigen::Vector3d(1e-4, 1, std::pow(params.kInitialBiasStd_m_s2, 2)).asDiagonal()};
  Rng rng(6);
  for (int i = 0; i < 3000; ++i) {
    const double dt = rng.uniform(0.01, 0.05);
    const auto a = rng.below(3) > 0 ? std::optional(rng.normal()) : std::nullopt;
    filter.predict(dt, a);
    dense.predict(dt, params, a);
    const auto choice = rng.below(20);
    const double r = rng.uniform(1e-6, 1e-4);
    if (choice == 0 && filter.floors() < 10) {
      const double d = rng.uniform(0.5, 2);
      filter.add({}, d, r, 0);
      dense.add(d, r);
    } else if (choice == 1 && filter.floors() > 4) {
      const int floor = 1 + static_cast<int>(rng.below(static_cast<std::uint32_t>(filter.floors() - 1)));
      filter.remove(floor);
      dense.remove(floor);
    } else {
      const int floor = static_cast<int>(rng.below(static_cast<std::uint32_t>(filter.floors())));
      const double d = dense.x(0) - (floor > 0 ? dense.x(floor + 2) : 0) + rng.normal(0, 0.01);
      filter.correct(floor, {}, d, r);
      dense.correct(floor, d, r);
    }
    ASSERT_NEAR(filter.height_m(), dense.x(0), 1e-8);
    ASSERT_NEAR(filter.climb_m_s(), dense.x(1), 1e-8);
    ASSERT_NEAR(filter.height_std_m(), std::sqrt(dense.p(0, 0)), 1e-8);
    ASSERT_EQ(filter.floors() + 2, dense.x.size());
    for (int k = 1; k < filter.floors(); ++k) {
      ASSERT_NEAR(filter.floor(k).level_m, dense.x(k + 2), 1e-8);
      ASSERT_NEAR(filter.floor(k).std_m, std::sqrt(dense.p(k + 2, k + 2)), 1e-8);
    }
  }
}

TEST(FloorFilter, AFullMemoryForgetsTheFloorSeenLeast) {
  FloorFilter filter{HeightParams{}};
  filter.start({}, 50, 1e-4);
  for (int i = 1; i < FloorFilter::kMaxFloors; ++i) {
    filter.add({}, 50 - i, 1e-4, 0);
    if (i != 7 && i != 3) filter.correct(i, {}, 50 - i, 1e-4);
  }
  const int added = filter.add({}, 10, 1e-4, 3);  // 3 is kept, though seen as rarely as 7
  EXPECT_EQ(filter.floors(), FloorFilter::kMaxFloors);
  EXPECT_EQ(added, FloorFilter::kMaxFloors - 1);
  EXPECT_TRUE(filter.index_of(0));
  EXPECT_TRUE(filter.index_of(3));
  EXPECT_FALSE(filter.index_of(7));
  EXPECT_NEAR(filter.floor(*filter.index_of(8)).level_m, 8, 0.01);
  EXPECT_NEAR(filter.floor(added).level_m, 40, 0.01);
}

}  // namespace
}  // namespace hm
