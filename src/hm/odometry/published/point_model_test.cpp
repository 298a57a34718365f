#include "hm/odometry/published/point_model.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "hm/odometry/published/model_registration.hpp"
#include "hm/odometry/testing/point_scenes.hpp"

namespace hm {
namespace {

UncertainPoint round_point(const Vec3& mean, double sigma_m) {
  return {mean, sigma_m * sigma_m * Mat3::Identity()};
}

TEST(PointIndex, AgreesWithASlowSearch) {
  Rng rng(1);
  for (const int count : {0, 1, 7, 9, 100, 1500}) {
    std::vector<Vec3> points;
    for (int i = 0; i < count; ++i) {
      // coarse positions: many are equal, many distances are equal
      points.emplace_back(0.1 * rng.below(12), 0.1 * rng.below(12), 0.1 * rng.below(3));
    }
    const PointIndex index(points);
    EXPECT_EQ(index.size(), points.size());
    std::vector<PointIndex::Neighbour> found;
    for (int trial = 0; trial < 100; ++trial) {
      const Vec3 query(rng.uniform(-0.2, 1.4), 0.1 * rng.below(12), rng.uniform(-0.2, 0.5));
      std::vector<PointIndex::Neighbour> all;
      for (int i = 0; i < count; ++i) {
        all.push_back({i, (points[static_cast<std::size_t>(i)] - query).squaredNorm()});
      }
      std::sort(all.begin(), all.end());
      index.nearest(query, 5, found);
      ASSERT_EQ(found.size(), std::min<std::size_t>(5, all.size()));
      for (std::size_t i = 0; i < found.size(); ++i) ASSERT_EQ(found[i].index, all[i].index);
      const double reach = rng.uniform(0.01, 0.3);
      const bool expected = !all.empty() && all[0].squared_distance_m2 < reach * reach;
      ASSERT_EQ(index.nearest(query, reach).index, expected ? all[0].index : -1);
    }
  }
  EXPECT_EQ(PointIndex().nearest(Vec3::Zero(), 1).index, -1);
}

TEST(Fuse, IsTheProductOfTwoGaussians) {
  Rng rng(2);
  for (int trial = 0; trial < 50; ++trial) {
    const Vec3 p = point_in_view(rng);
    const UncertainPoint prior{p, kinect_covariance(p)};
    const UncertainPoint seen{p + Vec3(0.01, -0.02, 0.01), kinect_covariance(point_in_view(rng))};
    const UncertainPoint fused = fuse(prior, seen, 0);
    const Mat3 information = prior.covariance.inverse() + seen.covariance.inverse();
    const Vec3 mean = information.inverse() *
                      (prior.covariance.inverse() * prior.mean + seen.covariance.inverse() * seen.mean);
    EXPECT_LT((fused.mean - mean).norm(), 1e-10);
    EXPECT_LT((fused.covariance - information.inverse()).norm(), 1e-12);
    EXPECT_EQ(fused.covariance, Mat3(fused.covariance.transpose()));
  }
}

TEST(Fuse, CertaintyStopsAtTheFloor) {
  UncertainPoint point = round_point(Vec3(0, 0, 2), 0.01);
  for (int i = 0; i < 10000; ++i) point = fuse(point, {point.mean, kinect_covariance(point.mean)}, 0.002);
  const Vec3 values = Eigen::SelfAdjointEigenSolver<Mat3>(point.covariance).eigenvalues();
  EXPECT_NEAR(std::sqrt(values.minCoeff()), 0.002, 1e-5);
  EXPECT_LT(std::sqrt(values.maxCoeff()), 0.0021);
}

TEST(PointModel, PointsSeenAgainAreFusedOthersInserted) {
  PointModel model({});
  EXPECT_EQ(
      model.update(std::vector{round_point(Vec3(0, 0, 1), 0.01), round_point(Vec3(1, 0, 1), 0.01)}).inserted,
      2);
  const auto update =
      model.update(std::vector{round_point(Vec3(0.02, 0, 1), 0.01), round_point(Vec3(0, 1, 1), 0.01)});
  EXPECT_EQ(update.updated, 1);
  EXPECT_EQ(update.inserted, 1);
  ASSERT_EQ(model.points().size(), 3U);
  EXPECT_NEAR(model.points()[0].mean.x(), 0.01, 1e-12);
  EXPECT_NEAR(model.points()[0].covariance(0, 0), 0.5e-4, 1e-12);
}

TEST(PointModel, AssociatesByMahalanobisNotByEuclideanDistance) {
  PointModel model({});
  UncertainPoint wide = round_point(Vec3(0.2, 0, 2), 0.001);
  wide.covariance(0, 0) = 0.04;
  model.update(std::vector{round_point(Vec3(-0.1, 0, 2), 0.005), wide});
  const auto update = model.update(std::vector{round_point(Vec3(0, 0, 2), 0.005)});  // nearer to the first
  EXPECT_EQ(update.updated, 1);
  EXPECT_EQ(model.points()[0].mean, Vec3(-0.1, 0, 2));
  EXPECT_LT(model.points()[1].mean.x(), 0.01);
}

TEST(PointModel, APointIsUpdatedOnceAFrame) {
  PointModel model({});
  model.update(std::vector{round_point(Vec3(0, 0, 1), 0.01)});
  const auto update = model.update(std::vector(5, round_point(Vec3(0.01, 0, 1), 0.01)));
  EXPECT_EQ(update.updated, 1);
  EXPECT_EQ(update.ignored, 4);
  EXPECT_NEAR(model.points()[0].covariance(0, 0), 0.5e-4, 1e-12);
}

TEST(PointModel, OldestPointsMakeRoom) {
  PointModelParams params;
  params.max_model_points = 10;
  PointModel model(params);
  std::size_t memory = 0;
  for (int i = 0; i < 1000; ++i) {
    model.update(std::vector{round_point(Vec3(i, 0, 1), 0.01)});
    if (i == 20) memory = model.memory_bytes();
  }
  ASSERT_EQ(model.points().size(), 10U);
  EXPECT_EQ(model.memory_bytes(), memory);
  for (const UncertainPoint& point : model.points()) EXPECT_GE(point.mean.x(), 990);
  EXPECT_EQ(model.nearest(Vec3(989, 0, 1), 0.5).index, -1);
  EXPECT_GE(model.nearest(Vec3(990, 0, 1), 0.5).index, 0);
}

TEST(PointModel, WhatAFrameInsertsDoesNotHideWhatItUpdates) {
  PointModelParams params;
  params.max_model_points = 2;
  PointModel model(params);
  model.update(std::vector{round_point(Vec3(0, 0, 1), 0.01), round_point(Vec3(5, 0, 1), 0.01)});
  // The new point takes slot 0, which the second point of this frame is fused with first.
  const auto update =
      model.update(std::vector{round_point(Vec3(9, 0, 1), 0.01), round_point(Vec3(0.01, 0, 1), 0.01)});
  EXPECT_EQ(update.updated, 1);
  EXPECT_EQ(update.inserted, 1);
  EXPECT_EQ(model.points()[0].mean, Vec3(9, 0, 1));
  EXPECT_EQ(model.points()[1].mean, Vec3(5, 0, 1));
}

std::vector<UncertainPoint> cloud(int count, Rng& rng) {
  std::vector<UncertainPoint> points;
  for (int i = 0; i < count; ++i) {
    const Vec3 p = point_in_view(rng);
    points.push_back({p, kinect_covariance(p)});
  }
  return points;
}

TEST(ModelRegistration, FindsAKnownMotion) {
  Rng rng(5);
  const std::vector<UncertainPoint> points = cloud(300, rng);
  PointModel model({});
  model.update(points);
  for (int trial = 0; trial < 20; ++trial) {
    const SE3 truth = random_motion(rng, 0.02, 0.01);
    std::vector<UncertainPoint> seen = points;
    for (UncertainPoint& point : seen) point.mean = truth.inverse() * point.mean;
    const ModelRegistration found = register_to_model(seen, model, {}, {});
    ASSERT_TRUE(found.found) << found.reason;
    EXPECT_LT((found.T_odom_camera.inverse() * truth).log().norm(), 2e-3);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat6>(found.covariance).eigenvalues().minCoeff(), 0);
  }
}

TEST(ModelRegistration, SaysWhyItFails) {
  Rng rng(6);
  const std::vector<UncertainPoint> points = cloud(100, rng);
  PointModel model({});
  const ModelRegistration empty = register_to_model(points, model, {}, {});
  EXPECT_FALSE(empty.found);
  EXPECT_NE(empty.reason.find("0 of 100 features"), std::string::npos) << empty.reason;
  model.update(points);
  EXPECT_FALSE(register_to_model(std::span(points).first(14), model, {}, {}).found);
  EXPECT_TRUE(register_to_model(std::span(points).first(15), model, {}, {}).found);
  EXPECT_FALSE(register_to_model(points, model, SE3(Mat3::Identity(), Vec3(0, 0, 50)), {}).found);
  PointModel line({});
  std::vector<UncertainPoint> on_line;
  for (int i = 0; i < 30; ++i) on_line.push_back(round_point(Vec3(0, 0, 1 + 0.1 * i), 0.001));
  line.update(on_line);
  const ModelRegistration degenerate = register_to_model(on_line, line, {}, {});
  EXPECT_FALSE(degenerate.found);
  EXPECT_FALSE(degenerate.reason.empty());
}

}  // namespace
}  // namespace hm
