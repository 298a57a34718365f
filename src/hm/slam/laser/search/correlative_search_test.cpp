#include "hm/slam/laser/search/correlative_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

constexpr CorrelativeMapParams kMap{0.05, 0.06, 6};

std::vector<Vec2> random_points(int count, double size_m, Rng& rng) {
  std::vector<Vec2> points;
  for (int i = 0; i < count; ++i)
    points.emplace_back(rng.uniform(-size_m, size_m), rng.uniform(-size_m, size_m));
  return points;
}

std::vector<Vec2> seen_from(const SE2& T_map_scan, const std::vector<Vec2>& points_map) {
  std::vector<Vec2> points;
  for (const Vec2& point : points_map) points.push_back(T_map_scan.inverse() * point);
  return points;
}

void expect_likelihoods(double half_width_m) {
  Rng rng(1);
  const auto points = random_points(60, 2, rng);
  CorrelativeMapParams params = kMap;
  params.half_width_m = half_width_m;
  const CorrelativeMap map(points, params);
  for (int i = 0; i < 3000; ++i) {
    const Eigen::Vector2i cell(static_cast<int>(rng.below(120)) - 10, static_cast<int>(rng.below(120)) - 10);
    const Vec2 centre = map.low_m() + 0.05 * (cell.cast<double>() + Vec2(0.5, 0.5));
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec2& point : points)
      nearest =
          std::min(nearest, ((centre - point).cwiseAbs().array() - half_width_m).max(0).matrix().norm());
    const double likelihood = 255 * std::exp(-0.5 * std::pow(nearest / 0.06, 2));
    EXPECT_NEAR(map.value(cell.x(), cell.y()), likelihood, 255 * 0.012 + 0.5);  // the kernel ends at 3 sigma
  }
}

TEST(CorrelativeMap, ValueIsTheLikelihoodOfTheNearestPoint) { expect_likelihoods(0); }

TEST(CorrelativeMap, PointsOfAWidthAreAllAsLikely) { expect_likelihoods(0.07); }

TEST(CorrelativeMap, PyramidIsTheMaximumOfItsSquares) {
  Rng rng(2);
  const CorrelativeMap map(random_points(30, 1, rng), kMap);
  for (int i = 0; i < 2000; ++i) {
    const int level = static_cast<int>(rng.below(6));
    const int x = static_cast<int>(rng.below(160)) - 80, y = static_cast<int>(rng.below(160)) - 80;
    int most = 0;
    for (int dy = 0; dy < 1 << level; ++dy)
      for (int dx = 0; dx < 1 << level; ++dx) most = std::max<int>(most, map.value(x + dx, y + dy));
    EXPECT_EQ(map.bound(level, x, y), most) << level << " " << x << " " << y;
  }
}

TEST(CorrelativeMap, NothingAndBrokenPoints) {
  const CorrelativeMap none(std::vector<Vec2>{}, kMap);
  EXPECT_TRUE(none.empty());
  EXPECT_EQ(none.bound(5, 0, 0), 0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<Vec2> points = {{0, 0}, {nan, 1}, {1e9, 0}};
  const CorrelativeMap map(points, kMap);
  EXPECT_LT(map.bytes(), 100'000U);
  EXPECT_EQ(search_correlative(none, points, {}).status, CorrelativeStatus::kNothing);
  EXPECT_EQ(search_correlative(map, {}, {}).status, CorrelativeStatus::kNothing);
  EXPECT_EQ(search_correlative(map, points, {SE2(nan, 0, 0), 1, 1, 1}).status, CorrelativeStatus::kNothing);
}

/// Best sum over every cell and angle of the window, by exhaustive search.
double brute_force(const CorrelativeMap& map, const std::vector<Vec2>& points, const SearchWindow& window,
                   const CorrelativeSearchParams& params) {
  const double step_rad = params.angle_step_rad;
  double best = 0;
  const auto steps = [](double half, double step) { return static_cast<int>(std::ceil(half / step - 1e-9)); };
  const int angles = steps(window.half_angle_rad, step_rad), columns = steps(window.half_x_m, 0.05),
            rows = steps(window.half_y_m, 0.05);
  for (int a = -angles; a <= angles; ++a) {
    const SE2 T(window.centre.translation(), window.centre.angle() + a * step_rad);
    for (int y = -rows; y <= rows; ++y)
      for (int x = -columns; x <= columns; ++x) {
        double sum = 0;
        for (const Vec2& point : points) {
          const Eigen::Vector2i cell = map.cell_of(T * point);
          sum += map.value(cell.x() + x, cell.y() + y);
        }
        const double turn = a * step_rad, shift_m2 = 0.05 * 0.05 * (x * x + y * y);
        const double loss =
            params.shift_penalty_per_m2 * shift_m2 + params.turn_penalty_per_rad2 * turn * turn;
        best = std::max(best, sum / (255.0 * static_cast<double>(points.size())) - loss);
      }
  }
  return best;
}

TEST(CorrelativeSearch, FindsWhatBruteForceFinds) {
  Rng rng(3);
  for (int trial = 0; trial < 12; ++trial) {
    const auto world = random_points(25, 3, rng);
    const CorrelativeMap map(world, kMap);
    const SE2 truth(rng.uniform(-0.4, 0.4), rng.uniform(-0.4, 0.4), rng.uniform(-0.3, 0.3));
    auto scan = seen_from(truth, world);
    for (Vec2& point : scan) point += Vec2(rng.normal(0, 0.05), rng.normal(0, 0.05));
    CorrelativeSearchParams params;
    params.min_score = 0.05;
    params.angle_step_rad = 0.03;
    const SearchWindow window{SE2(0.1, -0.05, 0.02), 0.6, 0.5, 0.4};
    const CorrelativeMatch match = search_correlative(map, scan, window, params);
    ASSERT_NE(match.status, CorrelativeStatus::kNothing);
    EXPECT_NEAR(match.score, brute_force(map, scan, window, params), 1e-9);
    params.shift_penalty_per_m2 = rng.uniform(0, 2);
    params.turn_penalty_per_rad2 = rng.uniform(0, 3);
    // Penalties are rounded down by at most the value of one cell for one point.
    EXPECT_NEAR(search_correlative(map, scan, window, params).score, brute_force(map, scan, window, params),
                1 / (255.0 * static_cast<double>(scan.size())) + 1e-9);
  }
}

TEST(CorrelativeSearch, ExactScanIsFoundBelowACell) {
  Rng rng(4);
  for (int trial = 0; trial < 10; ++trial) {
    const auto world = random_points(150, 5, rng);
    const SE2 truth(rng.uniform(-2, 2), rng.uniform(-2, 2), rng.uniform(-0.8, 0.8));
    const CorrelativeMatch match =
        search_correlative(CorrelativeMap(world, kMap), seen_from(truth, world), {SE2(), 2.5, 2.5, 1.0});
    ASSERT_EQ(match.status, CorrelativeStatus::kFound);
    const SE2 error = truth.inverse() * match.T_map_scan;
    EXPECT_LT(error.translation().norm(), 0.02);
    EXPECT_LT(std::abs(error.angle()), 0.005);
  }
}

/// The same shape twice, 1.5 m apart: ambiguous, unless the window contains only one of them.
TEST(CorrelativeSearch, TwoEqualPlacesAreAmbiguous) {
  Rng rng(5);
  const auto shape = random_points(60, 0.6, rng);
  std::vector<Vec2> world = shape;
  for (const Vec2& point : shape) world.push_back(point + Vec2(1.5, 0));
  const CorrelativeMap map(world, kMap);
  const CorrelativeMatch wide = search_correlative(map, shape, {SE2(0.2, 0, 0), 1.6, 0.5, 0.1});
  EXPECT_EQ(wide.status, CorrelativeStatus::kAmbiguous);
  EXPECT_GT(wide.other_score, 0.92 * wide.score);
  const CorrelativeMatch narrow = search_correlative(map, shape, {SE2(0.2, 0, 0), 0.6, 0.5, 0.1});
  EXPECT_EQ(narrow.status, CorrelativeStatus::kFound);
  EXPECT_LT(narrow.T_map_scan.translation().norm(), 0.02);
}

/// Two walls of a corridor: another place along them is none with a free axis, the corridor beside it is.
TEST(CorrelativeSearch, AlongAFreeAxisPosesAreNoAlternatives) {
  std::vector<Vec2> corridor, scan;
  for (double x = -10; x <= 10; x += 0.04)
    for (const double y : {-1.0, 1.2}) {
      corridor.emplace_back(x, y);
      if (std::abs(x) < 4) scan.emplace_back(x, y);
    }
  const SearchWindow window{SE2(0.1, 0.05, 0), 1, 1, 0.1};
  CorrelativeSearchParams params;
  params.other_window_ratio = 4;
  EXPECT_EQ(search_correlative({corridor, kMap}, scan, window, params).status, CorrelativeStatus::kAmbiguous);
  params.free_axis = Vec2(1, 0);
  const CorrelativeMatch match = search_correlative({corridor, kMap}, scan, window, params);
  EXPECT_EQ(match.status, CorrelativeStatus::kFound);
  EXPECT_LT(std::abs(match.T_map_scan.y()), 0.02);
  params.free_axis = Vec2(0, 1);
  EXPECT_EQ(search_correlative({corridor, kMap}, scan, window, params).status, CorrelativeStatus::kAmbiguous);
  std::vector<Vec2> two = corridor;
  for (const Vec2& point : corridor) two.push_back(point + Vec2(0, 3.5));
  params.free_axis = Vec2(1, 0);
  EXPECT_EQ(search_correlative({two, kMap}, scan, window, params).status, CorrelativeStatus::kAmbiguous);
}

TEST(CorrelativeSearch, BoundedAndDeterministic) {
  Rng rng(6);
  const auto world = random_points(100, 5, rng), other = random_points(100, 5, rng);
  const CorrelativeMap map(world, kMap);
  CorrelativeSearchParams params;
  params.max_evaluations = 500;
  const CorrelativeMatch bounded = search_correlative(map, other, {SE2(), 3, 3, 3}, params);
  EXPECT_EQ(bounded.status, CorrelativeStatus::kLimitReached);
  EXPECT_LE(bounded.evaluations, 502U);
  const SearchWindow window{SE2(0.1, 0, 0), 1, 1, 0.5};
  const auto scan = seen_from(SE2(0.3, -0.2, 0.2), world);
  const CorrelativeMatch a = search_correlative(map, scan, window), b = search_correlative(map, scan, window);
  EXPECT_EQ(a.T_map_scan.vector(), b.T_map_scan.vector());
  EXPECT_EQ(a.evaluations, b.evaluations);
}

}  // namespace
}  // namespace hm
