#include "hm/odometry/tracker/local_map.hpp"

#include <gtest/gtest.h>

#include <set>

#include "hm/core/rng.hpp"

namespace hm {
namespace {

const PinholeCamera kMapCamera{640, 480, 525, 525, 319.5, 239.5, {}};

MapLandmark landmark_at(const Vec3& p, std::size_t anchor) {
  MapLandmark landmark;
  landmark.p_odom = p;
  landmark.anchor = anchor;
  landmark.sightings = 1;
  return landmark;
}

/// Checks that every sighting refers to an existing landmark with an existing anchor and the correct count.
void expect_consistent(const LocalMap& map, std::size_t slots) {
  std::vector<int> counts(slots, 0);
  for (const MapKeyframe& keyframe : map.keyframes())
    for (const Sighting& sighting : keyframe.sightings) {
      EXPECT_TRUE(map.landmark(sighting.landmark).alive);
      counts[sighting.landmark] += 1;
    }
  std::size_t alive = 0;
  for (std::size_t i = 0; i < slots; ++i) {
    if (!map.landmark(i).alive) continue;
    ++alive;
    EXPECT_NE(map.find(map.landmark(i).anchor), nullptr);
    EXPECT_EQ(map.landmark(i).sightings, counts[i]);
  }
  EXPECT_EQ(alive, map.landmark_count());
}

TEST(LocalMap, StaysBoundedAndConsistentOverALongWalk) {
  Rng rng(1);
  LocalMap map(200, 6);
  std::size_t slots = 0, most_bytes = 0;
  std::vector<std::size_t> recent;
  for (int k = 0; k < 300; ++k) {
    MapKeyframe keyframe;
    keyframe.T_odom_camera = SE3(Mat3::Identity(), Vec3(0.1 * k, 0, 0));
    for (const std::size_t index : recent)
      if (map.landmark(index).alive && rng.uniform() < 0.7) keyframe.sightings.push_back({index});
    MapKeyframe& added = map.add_keyframe(std::move(keyframe));
    recent.clear();
    for (const Sighting& sighting : added.sightings) recent.push_back(sighting.landmark);
    for (int i = 0; i < 25; ++i) {
      const auto index = map.add_landmark(landmark_at(Vec3(0.1 * k, 0, 2), added.identity));
      if (!index) continue;
      MapKeyframe& newest = map.keyframes().back();
      newest.sightings.push_back({*index});
      recent.push_back(*index);
      slots = std::max(slots, *index + 1);
    }
    map.forget_unproven();
    std::erase_if(recent, [&](std::size_t index) { return !map.landmark(index).alive; });
    EXPECT_LE(map.landmark_count(), 200u);
    EXPECT_LE(map.keyframes().size(), 6u);
    if (k % 20 == 0) expect_consistent(map, slots);
    if (k < 50) most_bytes = std::max(most_bytes, map.memory_bytes());
  }
  EXPECT_LE(slots, 225u);
  EXPECT_LE(map.memory_bytes(), 2 * most_bytes);
}

TEST(LocalMap, CandidatesAreInViewAndSpread) {
  LocalMap map(10000, 10);
  MapKeyframe keyframe;
  const std::size_t identity = map.add_keyframe(std::move(keyframe)).identity;
  Rng rng(2);
  for (int i = 0; i < 1000; ++i) {  // most in a corner of the image
    const double x = rng.uniform(i < 900 ? 200.0 : 20.0, i < 900 ? 250.0 : 620.0);
    const double y = rng.uniform(i < 900 ? 200.0 : 20.0, i < 900 ? 250.0 : 460.0);
    map.add_landmark(landmark_at(kMapCamera.unproject(Vec2(x, y), 2), identity));
  }
  map.add_landmark(landmark_at(Vec3(0, 0, -2), identity));
  map.add_landmark(landmark_at(Vec3(50, 0, 2), identity));
  const auto chosen = map.candidates({}, kMapCamera, 100);
  EXPECT_EQ(chosen.size(), 100u);
  int crowded = 0;
  std::set<std::size_t> different;
  for (const Candidate& candidate : chosen) {
    EXPECT_LT((kMapCamera.project(map.landmark(candidate.landmark).p_odom) - candidate.pixel).norm(), 1e-9);
    crowded += candidate.pixel.x() > 200 && candidate.pixel.x() < 250 && candidate.pixel.y() > 200 &&
               candidate.pixel.y() < 250;
    different.insert(candidate.landmark);
  }
  EXPECT_EQ(different.size(), 100u);
  EXPECT_LT(crowded, 60);  // of 900 of the 1000
  // Seen from behind or from far away they look different: none is searched for.
  const SE3 behind(so3_exp(Vec3(0, 3.14159, 0)), Vec3(0, 0, 4));
  EXPECT_TRUE(map.candidates(behind, kMapCamera, 100).empty());
  EXPECT_TRUE(map.candidates(SE3(Mat3::Identity(), Vec3(0, 0, -4)), kMapCamera, 100).empty());
}

TEST(LocalMap, ForgetsWhatIsLookedForInVain) {
  LocalMap map(100, 10);
  const std::size_t identity = map.add_keyframe({}).identity;
  const std::size_t good = *map.add_landmark(landmark_at(Vec3(0, 0, 2), identity));
  const std::size_t bad = *map.add_landmark(landmark_at(Vec3(0, 0.1, 2), identity));
  map.keyframes().back().sightings = {{good}, {bad}};
  map.landmark(good).looked_for = map.landmark(bad).looked_for = 40;
  map.landmark(good).found = 30;
  map.forget_unproven();
  EXPECT_TRUE(map.landmark(good).alive);
  EXPECT_FALSE(map.landmark(bad).alive);
  EXPECT_EQ(map.keyframes().back().sightings.size(), 1u);
}

}  // namespace
}  // namespace hm
