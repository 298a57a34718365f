#include "hm/slam/rgbd/revisit_links.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "hm/core/rng.hpp"
#include "hm/slam/rgbd/rgbd_loop_closer.hpp"
#include "hm/slam/rgbd/testing/landmark_world.hpp"

namespace hm {
namespace {

using test::landmark_camera;
using testing::ElementsAre;
using testing::IsEmpty;

/// Keyframes along a corridor, as often as it was walked.
struct Visits {
  Rng rng{7};
  test::LandmarkWorld world = test::corridor(30, 60, rng);
  std::vector<SE3> truth;
  std::vector<Keyframe> keyframes;
  std::vector<PlacedKeyframe> placed;

  /// `mirrored`: looking back the way it came.
  void walk(double begin_m, std::size_t count, bool mirrored = false, int submap = 0, int map = 0) {
    for (std::size_t i = 0; i < count; ++i) {
      truth.push_back(
          test::level_camera(begin_m + 0.4 * static_cast<double>(i), 0, mirrored ? 3.14159 : 0.0));
      Keyframe keyframe;
      keyframe.submap = submap;
      keyframe.features = test::see(world, truth.back(), rng);
      keyframes.push_back(std::move(keyframe));
      placed.push_back({nullptr, truth.back(), map});
    }
    for (std::size_t i = 0; i < placed.size(); ++i) placed[i].keyframe = &keyframes[i];
  }
};

TEST(RevisitLinks, PairsAreOfOtherVisitsAndSeeTheSame) {
  Visits visits;
  visits.walk(2, 14);
  visits.walk(2, 1);
  const auto pairs = pairs_of_visits(visits.placed, landmark_camera());
  ASSERT_FALSE(pairs.empty());
  EXPECT_TRUE(std::ranges::find(pairs, KeyframePair(0, 14)) != pairs.end());
  EXPECT_TRUE(std::ranges::find(pairs, KeyframePair(13, 14)) == pairs.end()) << "of the same visit";
  for (const auto& [a, b] : pairs) EXPECT_GE(b - a, kKeyframesOfVisit);

  visits.walk(2, 1, true);
  for (const auto& [a, b] : pairs_of_visits(visits.placed, landmark_camera()))
    EXPECT_NE(b, 15U) << "looks the other way, as none before";
}

TEST(RevisitLinks, SubmapsAreOtherVisitsAndMapsAreApart) {
  Visits visits;
  visits.walk(2, 1);
  visits.walk(2, 1, false, 1, 0);
  visits.walk(2, 1, false, 2, 1);
  EXPECT_THAT(pairs_of_visits(visits.placed, landmark_camera()), ElementsAre(KeyframePair(0, 1)));
}

TEST(RevisitLinks, PartnersAreBoundedAndSpreadOverAllVisits) {
  Visits visits;
  for (int i = 0; i < 400; ++i) visits.walk(2, 1);
  std::vector<std::uint32_t> partners;
  for (const auto& [a, b] : pairs_of_visits(visits.placed, landmark_camera()))
    if (b == 399) partners.push_back(a);
  ASSERT_EQ(partners.size(), kMostVisits);
  EXPECT_LT(partners.front(), 5U);
  EXPECT_GT(partners.back(), 375U);
}

/// The landmark nearest to what a feature saw.
std::size_t landmark_of(const Visits& visits, std::uint32_t keyframe, std::uint32_t feature) {
  const BinaryDescriptor& descriptor = visits.keyframes[keyframe].features[feature].descriptor;
  const auto& points = visits.world.points;
  const auto nearest = std::ranges::min_element(points, {}, [&](const test::LandmarkWorld::Point& point) {
    return hamming_distance(point.descriptor, descriptor);
  });
  return static_cast<std::size_t>(nearest - points.begin());
}

/// With poses that are wrong by a few centimetres, as a solved graph leaves them, links are right.
TEST(RevisitLinks, LinksAreOfOnePoint) {
  Visits visits;
  visits.walk(2, 13);
  visits.walk(2.3, 3);
  for (PlacedKeyframe& placed : visits.placed)
    placed.T_map_camera = placed.T_map_camera * SE3::exp(0.006 * Vec6::NullaryExpr([&](Eigen::Index) {
                            return visits.rng.normal(0, 1);
                          }));
  const auto links = link_visits(visits.placed, landmark_camera(), {});
  ASSERT_GT(links.size(), 100U);
  const auto wrong = std::ranges::count_if(links, [&](const FeatureLink& link) {
    return landmark_of(visits, link.keyframe_a, link.feature_a) !=
           landmark_of(visits, link.keyframe_b, link.feature_b);
  });
  EXPECT_LT(static_cast<double>(wrong), 0.03 * static_cast<double>(links.size()));
}

/// What is nowhere near where it must be is no link, however alike; nor are a few that are alike by chance.
TEST(RevisitLinks, LooksAloneAreNotEnough) {
  Visits visits;
  visits.walk(2, 1);
  visits.walk(2, 1, false, 1);
  EXPECT_GT(link_visits(visits.placed, landmark_camera(), {}).size(), 50U);
  visits.placed[1].T_map_camera = visits.placed[1].T_map_camera * SE3(Mat3::Identity(), Vec3(0.4, 0.3, 0));
  EXPECT_THAT(link_visits(visits.placed, landmark_camera(), {}), IsEmpty());
}

/// A way that is walked three times: with the links between all visits the keyframes are nearer to the truth.
TEST(RevisitLinks, MakeTheMapBetter) {
  double error_m[2] = {0, 0};
  for (const std::uint64_t seed : {1U, 2U}) {
    Rng rng(seed);
    const test::LandmarkWorld world = test::ring(8, 60, rng);
    const test::KeyframesOfWay way = test::walk(world, test::way_around(8, 0.5, 2.4), 0.003, rng);
    for (const bool link_visits : {false, true}) {
      RgbdLoopParams params;
      params.link_visits = link_visits;
      RgbdLoopCloser closer(landmark_camera(), params);
      for (const auto& keyframe : way.keyframes) closer.add(keyframe);
      const RgbdAlignmentReport report = closer.finish();
      EXPECT_GT(report.loop_links, 1000U);
      EXPECT_EQ(report.visit_links > 1000, link_visits);
      const auto corrected = closer.corrected();
      for (std::size_t i = 0; i < way.truth.size(); ++i)
        error_m[link_visits ? 1 : 0] +=
            (corrected.keyframes()[i].T_map_camera.translation() - way.truth[i].translation()).norm();
    }
  }
  RecordProperty("ratio", std::to_string(error_m[1] / error_m[0]));
  EXPECT_LT(error_m[1], 0.95 * error_m[0]);
}

}  // namespace
}  // namespace hm
