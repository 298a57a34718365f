#include "hm/slam/rgbd/reference_keyframes.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <memory>
#include <numbers>
#include <set>

#include "hm/core/rng.hpp"
#include "hm/slam/rgbd/covisibility_matches.hpp"
#include "hm/slam/rgbd/testing/landmark_world.hpp"

namespace hm {
namespace {

/// Cameras anywhere in a room of 4 m x 4 m, looking anywhere on the level.
std::vector<SE3> stay_in_a_room(std::size_t keyframes) {
  Rng rng(1);
  std::vector<SE3> poses;
  for (std::size_t k = 0; k < keyframes; ++k)
    poses.push_back(test::level_camera(rng.uniform(0.1, 3.9), rng.uniform(0.1, 3.9),
                                       rng.uniform(-std::numbers::pi, std::numbers::pi)));
  return poses;
}

TEST(ReferenceKeyframes, AreBoundedByThePlaceHoweverLongTheStay) {
  const auto count = [](std::size_t keyframes) {
    return std::ranges::count(reference_keyframes(stay_in_a_room(keyframes)), true);
  };
  const auto all = static_cast<std::ptrdiff_t>(4 * 4 * 4 * kReferencesOfPlace);  // cubes, directions
  EXPECT_EQ(count(5000), all);
  EXPECT_EQ(count(10000), all);
}

TEST(ReferenceKeyframes, AreAllWhereEveryPlaceIsSeenAFewTimes) {
  std::vector<SE3> way = test::way_around(20, 0.3, 3);
  EXPECT_EQ(std::ranges::count(reference_keyframes(way), false), 0);
}

BundleObservation seen_by(std::uint32_t keyframe) {
  BundleObservation seen;
  seen.keyframe = keyframe;
  return seen;
}

std::vector<std::uint32_t> bounded(const std::vector<std::uint32_t>& keyframes,
                                   const std::vector<bool>& stands) {
  std::vector<BundleObservation> observations;
  for (const std::uint32_t keyframe : keyframes) observations.push_back(seen_by(keyframe));
  bound_covisibility(observations, stands);
  std::vector<std::uint32_t> left;
  for (const BundleObservation& seen : observations) left.push_back(seen.keyframe);
  return left;
}

TEST(BoundCovisibility, LeavesOneVisitAndTheReferences) {
  std::vector<bool> stands(200, false);
  EXPECT_THAT(bounded({}, stands), testing::IsEmpty());
  EXPECT_THAT(bounded({3, 50, 51, 79, 80, 150}, stands), testing::ElementsAre(50, 51, 79));
  stands[3] = stands[150] = true;
  EXPECT_THAT(bounded({3, 50, 51, 79, 80, 150}, stands), testing::ElementsAre(3, 50, 51, 79, 150));
  stands.assign(200, true);
  EXPECT_THAT(bounded({3, 50, 80, 150}, stands), testing::ElementsAre(3, 50, 80, 150));
}

/// A wall 2 m ahead that is visited again and again from one spot, each visit with its own landmarks.
struct Visits {
  static constexpr std::size_t kVisits = 100, kPoints = 40;
  std::vector<Keyframe> keyframes{kVisits};
  std::vector<const Keyframe*> pointers;
  Bundle bundle{test::landmark_camera(), {}, {}, {0}, {}};
  std::vector<PlacedKeyframe> placed;

  Visits() {
    Rng rng(2);
    std::vector<std::pair<Vec3, BinaryDescriptor>> wall;
    for (std::size_t i = 0; i < kPoints; ++i)
      wall.emplace_back(Vec3(rng.uniform(-1.0, 1.0), rng.uniform(-0.8, 0.8), 2.0),
                        test::random_descriptor(rng));
    for (std::size_t k = 0; k < kVisits; ++k) {
      keyframes[k].submap = static_cast<int>(k);
      for (std::size_t i = 0; i < kPoints; ++i) {
        Feature feature;
        feature.p_camera = wall[i].first;
        feature.pixel = test::landmark_camera().project(feature.p_camera);
        feature.covariance = Vec3(16e-6, 16e-6, 36e-6).asDiagonal();
        feature.has_depth = true;
        feature.descriptor = wall[i].second;
        keyframes[k].features.push_back(feature);
        keyframes[k].observations.push_back({1 + k * kPoints + i, feature.pixel,
                                             0.01 * Eigen::Matrix2d::Identity(), feature.p_camera.z(), 1e-4});
      }
      pointers.push_back(&keyframes[k]);
      bundle.T_map_camera.push_back(test::level_camera(0.5, 0.5, 0));
      placed.push_back({&keyframes[k], bundle.T_map_camera.back(), 0});
    }
  }
};

/// Each visit is compared with those that stand for the place, and with no others.
TEST(ReferenceKeyframes, AreWhatVisitsAreComparedWith) {
  const Visits visits;
  const std::vector<KeyframePair> pairs = pairs_of_visits(visits.placed, test::landmark_camera());
  EXPECT_LE(pairs.size(), Visits::kVisits * kReferencesOfPlace);
  for (const auto& [a, b] : pairs) EXPECT_LT(a, kReferencesOfPlace);
}

/// Every late visit shares landmarks with those that stand for the place, and with no other late one.
TEST(ReferenceKeyframes, HoldTheLandmarksOfAllVisits) {
  Visits visits;
  const std::vector<FeatureLink> links = match_covisible(visits.placed, test::landmark_camera(), {});
  make_landmarks(visits.bundle, visits.pointers, links);
  std::set<std::uint32_t> held;
  for (const BundleLandmark& landmark : visits.bundle.landmarks) {
    std::vector<std::uint32_t> late;
    bool has_reference = false;
    for (const BundleObservation& seen : landmark.observations) {
      has_reference |= seen.keyframe < kReferencesOfPlace;
      if (seen.keyframe >= kReferencesOfPlace) late.push_back(seen.keyframe);
    }
    if (late.empty()) continue;
    EXPECT_LT(late.back() - late.front(), kVisitKeyframes);
    if (has_reference) held.insert(late.begin(), late.end());
  }
  EXPECT_EQ(held.size(), Visits::kVisits - kReferencesOfPlace);
}

}  // namespace
}  // namespace hm
