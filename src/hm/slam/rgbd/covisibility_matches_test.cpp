#include "hm/slam/rgbd/covisibility_matches.hpp"

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

/// Keyframes of several walks along a corridor.
struct Visits {
  Rng rng{7};
  test::LandmarkWorld world = test::corridor(30, 60, rng);
  std::vector<SE3> truth;
  std::vector<Keyframe> keyframes;
  std::vector<PlacedKeyframe> placed;

  /// `mirrored`: with the camera facing backwards.
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

TEST(CovisibilityMatches, PairsAreOfOtherVisitsAndSeeTheSame) {
  Visits visits;
  visits.walk(2, 14);
  visits.walk(2, 1);
  const auto pairs = pairs_of_visits(visits.placed, landmark_camera());
  ASSERT_FALSE(pairs.empty());
  EXPECT_TRUE(std::ranges::find(pairs, KeyframePair(0, 14)) != pairs.end());
  EXPECT_TRUE(std::ranges::find(pairs, KeyframePair(13, 14)) == pairs.end()) << "of the same visit";
  for (const auto& [a, b] : pairs) EXPECT_GE(b - a, kKeyframesApart);

  visits.walk(2, 1, true);
  for (const auto& [a, b] : pairs_of_visits(visits.placed, landmark_camera()))
    EXPECT_NE(b, 15U) << "looks the other way, as none before";
}

TEST(CovisibilityMatches, SubmapsAreOtherVisitsAndMapsAreApart) {
  Visits visits;
  visits.walk(2, 1);
  visits.walk(2, 1, false, 1, 0);
  visits.walk(2, 1, false, 2, 1);
  EXPECT_THAT(pairs_of_visits(visits.placed, landmark_camera()), ElementsAre(KeyframePair(0, 1)));
}

TEST(CovisibilityMatches, PartnersAreBoundedAndSpreadOverAllVisits) {
  Visits visits;
  for (int i = 0; i < 400; ++i) visits.walk(2, 1);
  std::vector<std::uint32_t> partners;
  for (const auto& [a, b] : pairs_of_visits(visits.placed, landmark_camera()))
    if (b == 399) partners.push_back(a);
  ASSERT_EQ(partners.size(), kMostVisits);
  EXPECT_LT(partners.front(), 5U);
  EXPECT_GT(partners.back(), 375U);
}

/// The landmark nearest to a feature's position.
std::size_t landmark_of(const Visits& visits, std::uint32_t keyframe, std::uint32_t feature) {
  const BinaryDescriptor& descriptor = visits.keyframes[keyframe].features[feature].descriptor;
  const auto& points = visits.world.points;
  const auto nearest = std::ranges::min_element(points, {}, [&](const test::LandmarkWorld::Point& point) {
    return hamming_distance(point.descriptor, descriptor);
  });
  return static_cast<std::size_t>(nearest - points.begin());
}

/// With poses wrong by a few centimetres, as after graph optimisation, the links are correct.
TEST(CovisibilityMatches, LinksAreOfOnePoint) {
  Visits visits;
  visits.walk(2, 13);
  visits.walk(2.3, 3);
  for (PlacedKeyframe& placed : visits.placed)
    placed.T_map_camera =
        placed.T_map_camera *
        SE3::exp(0.006 * Vec6::NullaryExpr([&](Eigen::Index) { return visits.rng.normal(0, 1); }));
  const auto links = match_covisible(visits.placed, landmark_camera(), {});
  ASSERT_GT(links.size(), 100U);
  const auto wrong = std::ranges::count_if(links, [&](const FeatureLink& link) {
    return landmark_of(visits, link.keyframe_a, link.feature_a) !=
           landmark_of(visits, link.keyframe_b, link.feature_b);
  });
  EXPECT_LT(static_cast<double>(wrong), 0.03 * static_cast<double>(links.size()));
}

/// Two keyframes that observe `count` points of a wall, 2 m ahead, from two positions.
struct Wall {
  Rng rng{11};
  Keyframe keyframes[2];
  std::vector<PlacedKeyframe> placed;

  /// The first `shared` points have the same descriptors in both keyframes. In the second keyframe, all
  /// points are displaced by `offset`.
  Wall(std::size_t count, std::size_t shared, const SE3& T_first_second, const Vec3& offset = Vec3::Zero()) {
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 p(rng.uniform(-1.0, 1.0), rng.uniform(-0.8, 0.8), 2.0);
      const BinaryDescriptor look = test::random_descriptor(rng);
      add(keyframes[0], p, look);
      const bool is_shared = i < shared;
      add(keyframes[1], T_first_second.inverse() * p + offset,
          is_shared ? test::noisy(look, 0.08, rng) : test::random_descriptor(rng));
    }
    keyframes[1].submap = 1;
    placed = {{&keyframes[0], {}, 0}, {&keyframes[1], T_first_second, 0}};
  }

  static void add(Keyframe& keyframe, const Vec3& p_camera, const BinaryDescriptor& look) {
    Feature feature;
    feature.p_camera = p_camera;
    feature.pixel = landmark_camera().project(p_camera);
    feature.covariance = Vec3(16e-6, 16e-6, 36e-6).asDiagonal();
    feature.has_depth = true;
    feature.descriptor = look;
    keyframe.features.push_back(feature);
  }
  [[nodiscard]] std::size_t pairs() const { return pairs_of_visits(placed, landmark_camera()).size(); }
  [[nodiscard]] std::size_t links() const { return match_covisible(placed, landmark_camera(), {}).size(); }
};

/// Camera beside the wall that looks at its middle at an angle.
SE3 from_the_side(double angle_rad) {
  return SE3(Mat3::Identity(), Vec3(0, 0, 2)) * SE3(so3_exp(Vec3(0, angle_rad, 0)), Vec3::Zero()) *
         SE3(Mat3::Identity(), Vec3(0, 0, -2));
}

TEST(CovisibilityMatches, FromTheSideNothingLooksTheSame) {
  EXPECT_EQ(Wall(60, 60, from_the_side(0.5)).pairs(), 1U);
  EXPECT_GT(Wall(60, 60, from_the_side(0.5)).links(), 50U);
  EXPECT_EQ(Wall(60, 60, from_the_side(1.5)).pairs(), 0U);
}

TEST(CovisibilityMatches, ALittleOfThePictureIsNotEnough) {
  EXPECT_EQ(Wall(200, 200, SE3(Mat3::Identity(), Vec3(1.0, 0, 0))).pairs(), 1U);
  // The second keyframe's points are all in front of both cameras, but few in the image of the first.
  Wall aside(200, 200, {});
  for (std::size_t i = 0; i < 170; ++i) aside.keyframes[1].features[i].p_camera.x() += 4;
  std::ranges::sort(aside.keyframes[1].features, {}, [](const Feature& f) { return f.p_camera.y(); });
  EXPECT_EQ(aside.pairs(), 0U);
}

TEST(CovisibilityMatches, AFewMatchesMayBeChance) {
  EXPECT_EQ(Wall(60, 10, {}).links(), 0U);
  EXPECT_GE(Wall(60, 25, {}).links(), 12U);
}

/// Features away from the predicted position are not linked, however similar.
TEST(CovisibilityMatches, LooksAloneAreNotEnough) {
  EXPECT_EQ(Wall(60, 60, {}).links(), 60U);
  EXPECT_GT(Wall(60, 60, {}, Vec3(0.01, 0, 0)).links(), 55U);
  EXPECT_EQ(Wall(60, 60, {}, Vec3(0.04, 0, 0)).links(), 0U);
}

TEST(CovisibilityMatches, PairsThatLoopsHaveComparedAreLeftOut) {
  const Wall wall(60, 60, {});
  const KeyframePair compared[] = {{0, 1}};
  EXPECT_THAT(match_covisible(wall.placed, landmark_camera(), {}, compared), IsEmpty());
}

/// A path walked several times: links between all visits reduce the error of the keyframes.
TEST(CovisibilityMatches, MakeTheMapBetter) {
  double error_m[2] = {0, 0};
  for (const std::uint64_t seed : {1U, 2U}) {
    Rng rng(seed);
    const test::LandmarkWorld world = test::ring(8, 60, rng);
    const test::KeyframesOfWay way = test::walk(world, test::way_around(8, 0.5, 2.4), 0.003, rng);
    for (const bool match_covisible : {false, true}) {
      RgbdLoopParams params;
      params.match_covisible = match_covisible;
      RgbdLoopCloser closer(landmark_camera(), params);
      for (const auto& keyframe : way.keyframes) closer.add(keyframe);
      const RgbdAlignmentReport report = closer.finish();
      EXPECT_GT(report.loop_links, 1000U);
      EXPECT_EQ(report.visit_links > 1000, match_covisible);
      const auto corrected = closer.corrected();
      for (std::size_t i = 0; i < way.truth.size(); ++i)
        error_m[match_covisible ? 1 : 0] +=
            (corrected.keyframes()[i].T_map_camera.translation() - way.truth[i].translation()).norm();
    }
  }
  RecordProperty("ratio", std::to_string(error_m[1] / error_m[0]));
  EXPECT_LT(error_m[1], 0.95 * error_m[0]);
}

}  // namespace
}  // namespace hm
