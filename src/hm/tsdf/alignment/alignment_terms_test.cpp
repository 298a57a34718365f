#include "hm/tsdf/alignment/alignment_terms.hpp"

#include <gtest/gtest.h>

#include "hm/tsdf/alignment/alignment_pairs.hpp"
#include "hm/tsdf/alignment/alignment_search.hpp"
#include "hm/tsdf/alignment/alignment_step.hpp"
#include "hm/tsdf/testing/integration_bench.hpp"

namespace hm {
namespace {

/// Map of a random scene, and the readings of one view of it.
struct Terms {
  explicit Terms(std::uint64_t seed) : bench(TsdfParams{}) {
    Rng rng(seed);
    const AnalyticScene scene = random_scene(rng);
    T_world_camera = random_pose(rng);
    bench.add(scene, T_world_camera);
    AlignmentSampler({}, bench.params, {}, kCamera)
        .choose(scene.render(kCamera, T_world_camera).depth, points);
    centre.p_world = T_world_camera * Vec3(0.1, 0.2, 2.0);
    for (std::size_t i = 0; i < points.size(); ++i)
      points.inverse_width[i] = 1.0f / (2.5f * std::sqrt(points.variance_m2[i] + 1e-5f));
  }
  [[nodiscard]] AlignmentView view(const SE3& pose) const {
    return {pose, centre.p_world, bench.grid, bench.params.distance_limit_m()};
  }
  IntegrationBench bench;
  SE3 T_world_camera;
  AlignmentPoints points;
  TurningCentre centre;
};

/// The same sums by definition, reading by reading in double precision.
AlignmentTerms plain_terms(const Terms& t, const SE3& pose, std::size_t count) {
  AlignmentTerms terms;
  const double limit_m = 0.75 * t.bench.params.distance_limit_m();
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 p = pose * Vec3(t.points.x_m[i], t.points.y_m[i], t.points.z_m[i]);
    const auto sample = t.bench.grid.sample(p);
    const double share = static_cast<double>(t.points.share[i]);
    terms.cost += share;
    if (!sample || std::abs(sample->distance_m) >= limit_m || sample->gradient.norm() <= 0.3 ||
        sample->gradient.dot(p - pose.translation()) >= 0)
      continue;
    terms.on_map += 1;
    const Vec3 normal = sample->gradient.normalized();
    const double distance = sample->distance_m / sample->gradient.norm();
    const double width = 1.0 / static_cast<double>(t.points.inverse_width[i]),
                 rest = 1 - std::pow(distance / width, 2);
    if (rest <= 0) continue;
    const double weight = share * rest * rest / (width * width);
    Vec6 jacobian;
    jacobian << normal, (p - t.centre.p_world).cross(normal);
    terms.H += weight * jacobian * jacobian.transpose();
    terms.b += weight * distance * jacobian;
    terms.weight += weight;
    terms.cost -= share * rest * rest * rest;
    terms.agreeing += 1;
    terms.square_m2 += distance * distance;
  }
  return terms;
}

TEST(AlignmentTerms, AgreeWithAPlainLoop) {
  std::size_t compared = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    Terms t(seed);
    VoxelLookup lookup(t.bench.grid);
    Rng rng(seed);
    for (int i = 0; i < 4; ++i) {  // reuses the corners cached for the previous pose
      Vec6 xi;
      for (double& value : xi) value = rng.normal(0, 0.004);
      const SE3 pose = t.centre.moved(t.T_world_camera, xi);
      const std::size_t count = t.points.round_end[static_cast<std::size_t>(i % 2)];
      const AlignmentTerms fast = sum_alignment_terms(t.view(pose), count, lookup, t.points);
      const AlignmentTerms plain = plain_terms(t, pose, count);
      // A few readings are on the other side of a limit in single precision.
      EXPECT_NEAR(fast.on_map, plain.on_map, 3 + 1e-3 * plain.on_map);
      EXPECT_NEAR(fast.agreeing, plain.agreeing, 3 + 1e-3 * plain.agreeing);
      EXPECT_NEAR(fast.cost, plain.cost, 3 + 1e-3 * plain.cost);
      EXPECT_LT((fast.H - plain.H).norm(), 3e-3 * plain.H.norm() + 1e-9);
      EXPECT_LT((fast.b - plain.b).norm(), 3e-3 * plain.weight * 0.02 + 1e-9);
      EXPECT_NEAR(fast.weight, plain.weight, 3e-3 * plain.weight + 1e-9);
      compared += static_cast<std::size_t>(plain.agreeing);
    }
  }
  EXPECT_GT(compared, 20000u);
}

/// Map of a wall seen obliquely, and the readings selected from a depth image of it: a very smooth distance
/// field.
struct ObliqueWall {
  IntegrationBench bench{{}};
  AlignmentPoints points;
  TurningCentre centre{Vec3(2, 0, 0), 1};
  ObliqueWall() {
    const AnalyticScene scene{{{Vec3(-1, 0.2, 0.1).normalized(), -2.0}}, {}};
    const SE3 pose = looking_along_x(Vec3::Zero());
    for (int i = 0; i < 3; ++i) bench.add(scene, pose);
    AlignmentSampler({}, bench.params, {}, kCamera).choose(scene.render(kCamera, pose).depth, points);
  }
};

/// d cost / d xi = 6 b: the cost is Tukey's, its derivative by numeric differences.
TEST(AlignmentTerms, TheGradientIsTheDerivativeOfTheCost) {
  ObliqueWall wall;
  auto& [bench, points, centre] = wall;
  for (std::size_t i = 0; i < points.size(); ++i) points.inverse_width[i] = 1.0f / 0.05f;
  VoxelLookup lookup(bench.grid);
  const auto terms_at = [&](const Vec6& xi) {
    const SE3 pose = centre.moved(looking_along_x(Vec3(0.008, 0, 0)), xi);
    return sum_alignment_terms({pose, centre.p_world, bench.grid, bench.params.distance_limit_m()},
                               points.round_end.back(), lookup, points);
  };
  const AlignmentTerms here = terms_at(Vec6::Zero());
  for (Eigen::Index i = 0; i < 6; ++i) {
    Vec6 step = Vec6::Zero();
    step[i] = 1e-3;
    const double numeric = (terms_at(step).cost - terms_at(-step).cost) / 2e-3;
    EXPECT_NEAR(6 * here.b[i], numeric, 0.02 * 6 * here.b.norm()) << i;
  }
}

/// d cost / d xi = 2 b / width^2: the cost is Geman and McClure's, the surface is found along each ray.
TEST(SearchTerms, TheGradientIsTheDerivativeOfTheCost) {
  ObliqueWall wall;
  auto& [bench, points, centre] = wall;
  const SurfaceSearch search{0.3, 0.5 * bench.params.distance_limit_m(), 0.1, points.round_end.back(), 1};
  VoxelLookup lookup(bench.grid);
  const auto terms_at = [&](const Vec6& xi) {
    const SE3 pose = centre.moved(looking_along_x(Vec3(0.06, 0, 0)), xi);
    return sum_search_terms(search, points, {pose, centre.p_world}, lookup);
  };
  const AlignmentTerms here = terms_at(Vec6::Zero());
  EXPECT_GT(here.agreeing, 100);
  const Vec6 analytic = 2 / (search.width_m * search.width_m) * here.b;
  for (Eigen::Index i = 0; i < 6; ++i) {
    const Vec6 step = 1e-3 * Vec6::Unit(i);
    EXPECT_NEAR(analytic[i], (terms_at(step).cost - terms_at(-step).cost) / 2e-3, 0.02 * analytic.norm())
        << i;
  }
}

TEST(AlignmentTerms, PairsOfNeighboursDoNotTakeNoiseForGeometry) {
  // One wall in a noisy map: three directions are unobservable.
  IntegrationBench bench({});
  Rng rng(3);
  const SE3 pose = looking_along_x(Vec3::Zero());
  for (int i = 0; i < 4; ++i) {
    RgbdFrame frame = kWall.render(kCamera, pose);
    for (std::uint16_t& units : frame.depth.units.pixels())
      units = static_cast<std::uint16_t>(units + std::lround(rng.normal(0, 100)));
    bench.integrator.integrate(bench.grid, frame);
  }
  AlignmentPoints points;
  AlignmentSampler({}, bench.params, {}, kCamera).choose(kWall.render(kCamera, pose).depth, points);
  for (std::size_t i = 0; i < points.size(); ++i) points.inverse_width[i] = 1.0f / 0.03f;
  const TurningCentre centre{Vec3(2, 0, 0), 1};
  const AlignmentView view(pose, centre.p_world, bench.grid, bench.params.distance_limit_m());
  VoxelLookup lookup(bench.grid);
  const AlignmentTerms terms = sum_alignment_terms(view, points.round_end.front(), lookup, points);
  const PairTerms pairs = sum_pair_terms(view, points.round_end.front(), points);
  const Observability alone = observability(terms.H, terms.weight, 1, 0.01);
  const Observability together = observability(pairs.H, pairs.weight, 1, 0.01);
  EXPECT_GT(alone.share[0], 0.01);  // the noise of normals
  EXPECT_EQ(together.unobservable, 3);
  EXPECT_LT(together.share.head<3>().cwiseAbs().maxCoeff(), 0.2 * alone.share[0]);
}

TEST(TurningCentre, BetweenUndoesMoved) {
  Rng rng(2);
  for (int i = 0; i < 50; ++i) {
    const TurningCentre centre{Vec3(rng.normal(), rng.normal(), rng.normal()), 1};
    const SE3 pose = random_pose(rng);
    Vec6 xi;
    for (double& value : xi) value = rng.normal(0, 0.3);
    EXPECT_LT((centre.between(pose, centre.moved(pose, xi)) - xi).norm(), 1e-9);
    // to_origin() is the derivative of the perturbation about the origin.
    const Vec6 small = 1e-6 * xi;
    const Vec6 at_origin = (centre.moved(pose, small) * pose.inverse()).log();
    EXPECT_LT((at_origin - centre.to_origin() * small).norm(), 1e-10);
  }
}

}  // namespace
}  // namespace hm
