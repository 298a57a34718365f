#include "hm/slam/laser/search/correlative_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
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

/// Beams from one place to the points; behind them and between them nothing is observed.
ObservedArea seen_by_beams(const Vec2& from_m, const std::vector<Vec2>& points) {
  std::vector<SeenBeam> beams;
  for (const Vec2& point : points) beams.push_back({from_m, point});
  return ObservedArea(beams);
}

TEST(CorrelativeMap, SquaresThatCountAsSeenAreSeen) {
  Rng rng(7);
  const auto points = random_points(150, 2, rng);
  const CorrelativeMap map(points, kMap, seen_by_beams({0.3, -0.2}, points));
  ASSERT_NE(map.seen(), nullptr);
  int seen = 0, missed = 0;
  for (int i = 0; i < 2000; ++i) {
    const int level = static_cast<int>(rng.below(5));
    const int x = static_cast<int>(rng.below(140)) - 20, y = static_cast<int>(rng.below(140)) - 20;
    bool all = true;
    for (int dy = 0; dy < 1 << level; ++dy)
      for (int dx = 0; dx < 1 << level; ++dx)
        for (const double part : {0.01, 0.99})
          all &= map.seen()->contains(map.low_m() + 0.05 * (Vec2(x + dx, y + dy) + Vec2(part, part)));
    EXPECT_TRUE(all || !map.all_seen(level, x, y)) << level << " " << x << " " << y;
    seen += map.all_seen(level, x, y);
    missed += all && !map.all_seen(level, x, y);
  }
  EXPECT_GT(seen, 300);
  EXPECT_LT(missed, seen);  // at the border only
  EXPECT_FALSE(CorrelativeMap(points, kMap).all_seen(0, 40, 40));
}

TEST(CorrelativeMap, FourSquaresAtOnceAreTheirBounds) {
  Rng rng(8);
  const CorrelativeMap map(random_points(30, 1, rng), kMap);
  for (int i = 0; i < 2000; ++i) {
    const int level = static_cast<int>(rng.below(6)), side = 1 << level;
    const int x = static_cast<int>(rng.below(160)) - 80, y = static_cast<int>(rng.below(160)) - 80;
    std::array<std::uint32_t, 4> sums{1, 2, 3, 4};
    map.add_bounds(level, x, y, sums);
    EXPECT_EQ(sums[0], 1U + map.bound(level, x, y));
    EXPECT_EQ(sums[1], 2U + map.bound(level, x + side, y));
    EXPECT_EQ(sums[2], 3U + map.bound(level, x, y + side));
    EXPECT_EQ(sums[3], 4U + map.bound(level, x + side, y + side));
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

/// Every pose of a window, by exhaustive search.
template <class Function>
void for_each_pose(const CorrelativeMap& map, const SearchWindow& window, double step_rad,
                   const Function& function) {
  const auto steps = [](double half, double step) { return static_cast<int>(std::ceil(half / step - 1e-9)); };
  const double cell_m = map.resolution_m();
  const int angles = steps(window.half_angle_rad, step_rad), columns = steps(window.half_x_m, cell_m),
            rows = steps(window.half_y_m, cell_m);
  for (int a = -angles; a <= angles; ++a)
    for (int y = -rows; y <= rows; ++y)
      for (int x = -columns; x <= columns; ++x)
        function(SE2(window.centre.x() + cell_m * x, window.centre.y() + cell_m * y,
                     window.centre.angle() + step_rad * a));
}

double sum_at(const CorrelativeMap& map, const std::vector<Vec2>& points, const SE2& T) {
  double sum = 0;
  for (const Vec2& point : points) {
    const Eigen::Vector2i cell = map.cell_of(T * point);
    sum += map.value(cell.x(), cell.y());
  }
  return sum / 255.0;
}

struct BestPose {
  double score = 0;
  SE2 T;
};

/// Best score over every cell and angle of the window.
BestPose brute_force(const CorrelativeMap& map, const std::vector<Vec2>& points, const SearchWindow& window,
                     const CorrelativeSearchParams& params) {
  BestPose best;
  for_each_pose(map, window, params.angle_step_rad, [&](const SE2& T) {
    const double turn = T.angle() - window.centre.angle();
    const double shift_m2 = (T.translation() - window.centre.translation()).squaredNorm();
    const double loss = params.shift_penalty_per_m2 * shift_m2 + params.turn_penalty_per_rad2 * turn * turn;
    const double score = sum_at(map, points, T) / static_cast<double>(points.size()) - loss;
    if (score > best.score) best = {score, T};
  });
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
    EXPECT_NEAR(match.score, brute_force(map, scan, window, params).score, 1e-9);
    params.shift_penalty_per_m2 = rng.uniform(0, 2);
    params.turn_penalty_per_rad2 = rng.uniform(0, 3);
    // Penalties are rounded down by at most the value of one cell for one point.
    EXPECT_NEAR(search_correlative(map, scan, window, params).score,
                brute_force(map, scan, window, params).score,
                1 / (255.0 * static_cast<double>(scan.size())) + 1e-9);
  }
}

/// Whether some pose of a window elsewhere than `best` scores enough inside the observed area, by exhaustive
/// search.
bool has_alternative(const CorrelativeMap& map, const std::vector<Vec2>& points, const SearchWindow& window,
                     const SE2& best, const CorrelativeSearchParams& params) {
  const auto seen_score = [&](const SE2& T) {
    const auto inside = static_cast<double>(
        std::ranges::count_if(points, [&](const Vec2& p) { return map.seen()->contains(T * p); }));
    return inside < params.min_overlap_ratio * static_cast<double>(points.size())
               ? 0
               : sum_at(map, points, T) / inside;
  };
  const double least = params.ambiguity_ratio * seen_score(best);
  bool found = false;
  for_each_pose(map, window, params.angle_step_rad, [&](const SE2& T) {
    const bool same_place = (T.translation() - best.translation()).norm() < params.other_place_m &&
                            std::abs(T.angle() - best.angle()) <= params.other_angle_rad;
    found |= !same_place && seen_score(T) >= least;
  });
  return found;
}

/// Places that are like the first one to different degrees, of which the beams show different parts.
TEST(CorrelativeSearch, FindsAnAlternativeWhereBruteForceDoes) {
  Rng rng(9);
  int alternatives = 0;
  constexpr int kTrials = 16;
  for (int trial = 0; trial < kTrials; ++trial) {
    const auto shape = random_points(24, 0.8, rng);
    std::vector<Vec2> world = shape;
    const SE2 beside(0.9, 0.3, 0.5);
    for (const Vec2& point : shape)
      if (rng.uniform(0, 1) > 0.02 * trial) world.push_back(beside * point);
    std::vector<Vec2> shown = world;
    shown.resize(world.size() - rng.below(20));
    const CorrelativeMap map(world, kMap, seen_by_beams({0.4, 0.1}, shown));
    CorrelativeSearchParams params;
    params.angle_step_rad = 0.05;
    params.other_window_ratio = 3;
    const SearchWindow window{SE2(0, 0, 0), 0.4, 0.2, 0.2}, wide{SE2(0, 0, 0), 1.2, 0.6, 0.5};
    const CorrelativeMatch match = search_correlative(map, shape, window, params);
    ASSERT_NEAR(match.score, 1, 0.15);  // where the shape is, to a cell
    const SE2 best = brute_force(map, shape, window, params).T;
    const bool expected = has_alternative(map, shape, wide, best, params);
    EXPECT_EQ(match.status == CorrelativeStatus::kAmbiguous, expected) << trial;
    alternatives += expected;
  }
  EXPECT_GT(alternatives, 2);
  EXPECT_LT(alternatives, kTrials - 2);
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

/// The same shape twice, a turn of 0.4 rad about a point 5 m away apart, as the niches of a round corridor:
/// it is outside of the window by its turn as by its place.
TEST(CorrelativeSearch, EqualPlacesAroundACurveAreAmbiguous) {
  Rng rng(10);
  const auto shape = random_points(60, 0.6, rng);
  const Vec2 centre(0, -5);
  std::vector<Vec2> world = shape;
  for (const Vec2& point : shape) world.push_back(SE2(0, 0, 0.4) * Vec2(point - centre) + centre);
  const CorrelativeMap map(world, kMap);
  const SearchWindow window{SE2(), 1, 0.5, 0.2};
  CorrelativeSearchParams params;
  EXPECT_EQ(search_correlative(map, shape, window, params).status, CorrelativeStatus::kFound);
  params.other_window_ratio = 3;
  EXPECT_EQ(search_correlative(map, shape, window, params).status, CorrelativeStatus::kAmbiguous);
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
