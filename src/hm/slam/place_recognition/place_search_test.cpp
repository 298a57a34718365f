#include "hm/slam/place_recognition/place_search.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "hm/slam/place_recognition/place_experiment.hpp"
#include "hm/slam/rgbd/testing/landmark_world.hpp"

namespace hm {
namespace {

/// One and a half rounds around a ring: the second half observes the first half again.
std::vector<std::shared_ptr<const Keyframe>> ring_keyframes(double step_m = 0.8) {
  Rng rng(7);
  const test::LandmarkWorld world = test::ring(8, 80, rng);
  return test::walk(world, test::way_around(8, step_m, 1.5), 0, rng).keyframes;
}

/// Regression: with a wrong clamp of the number of candidates, all keyframes became candidates, and memory
/// beyond the end was read.
TEST(PlaceSearch, AnyNumberOfCandidatesWillDo) {
  const auto keyframes = ring_keyframes();
  for (const int n : {1, 2, 5, static_cast<int>(keyframes.size()), 1000, 1 << 30}) {
    PlaceSearchParams params;
    params.candidates = n;
    params.min_keyframes_apart = 2;
    PlaceSearch search(params);
    for (std::uint32_t i = 0; i < keyframes.size(); ++i) {
      const auto candidates = search.candidates(*keyframes[i], i);
      EXPECT_LE(candidates.size(), static_cast<std::size_t>(n));
      EXPECT_LE(candidates.size(), i);
      for (std::size_t c = 0; c < candidates.size(); ++c) {
        EXPECT_LT(candidates[c].keyframe + 1, i);
        EXPECT_GE(candidates[c].votes, params.kMinVotes);
        if (c > 0) {
          EXPECT_GE(candidates[c - 1].votes, candidates[c].votes);
        }
      }
      EXPECT_EQ(search.add(*keyframes[i]), i);
    }
  }
  EXPECT_TRUE(top_candidates({3, 2, 1}, -5, 1).empty());
  EXPECT_TRUE(top_candidates({}, 3, 1).empty());
  EXPECT_EQ(top_candidates({0, 0, 7}, 3, 0).size(), 1U);  // no votes, no candidate
}

TEST(PlaceSearch, VotesAreThoseOfAnExhaustiveCount) {
  const auto keyframes = ring_keyframes();
  PlaceSearchParams params;
  params.min_keyframes_apart = 3;
  params.max_checks = 1000000;
  PlaceSearch search(params);
  for (const auto& keyframe : keyframes) search.add(*keyframe);
  const std::uint32_t self = 10;
  std::vector<int> expected(keyframes.size(), 0);
  for (const Feature& feature : keyframes[self]->features) {
    std::vector<std::pair<int, std::pair<std::uint32_t, std::uint32_t>>> all;
    for (std::uint32_t k = 0; k < keyframes.size(); ++k) {
      if (k + 3 > self && k < self + 3) continue;
      for (std::uint32_t f = 0; f < keyframes[k]->features.size(); ++f)
        if (const int bits = hamming_distance(feature.descriptor, keyframes[k]->features[f].descriptor);
            bits <= params.kMaxDescriptorBits)
          all.push_back({bits, {k, f}});
    }
    std::sort(all.begin(), all.end());
    std::vector<bool> voted(keyframes.size(), false);
    for (std::size_t i = 0; i < std::min<std::size_t>(all.size(), 4); ++i) voted[all[i].second.first] = true;
    for (std::size_t k = 0; k < voted.size(); ++k) expected[k] += voted[k] ? 1 : 0;
  }
  EXPECT_EQ(search.votes(*keyframes[self], self), expected);
  EXPECT_GT(std::accumulate(expected.begin(), expected.end(), 0), 50);
}

TEST(PlaceSearch, OtherSubmapsAreNeverTooNear) {
  Rng rng(8);
  const test::LandmarkWorld world = test::corridor(6, 80, rng);
  Keyframe before, after;
  before.features = test::see(world, test::level_camera(0, 0, 0), rng);
  after.features = test::see(world, test::level_camera(0.1, 0, 0), rng);
  PlaceSearch search;
  search.add(before);
  EXPECT_TRUE(search.candidates(after, 1).empty());
  after.submap = 1;
  EXPECT_EQ(search.candidates(after, 1).size(), 1U);
}

/// Candidate pairs are features with similar descriptors, each used once.
TEST(PlaceSearch, PairsAreOneToOne) {
  const auto keyframes = ring_keyframes();
  PlaceSearch search;
  for (const auto& keyframe : keyframes) search.add(*keyframe);
  for (std::uint32_t i = 0; i < keyframes.size(); i += 5)
    for (const PlaceCandidate& candidate : search.candidates(*keyframes[i], i)) {
      std::vector<bool> used_here(keyframes[i]->features.size(), false);
      std::uint32_t last = 0;
      for (std::size_t p = 0; p < candidate.pairs.size(); ++p) {
        const auto [there, here] = candidate.pairs[p];
        if (p > 0) {
          EXPECT_GT(there, last);
        }
        last = there;
        EXPECT_FALSE(used_here[here]);
        used_here[here] = true;
        EXPECT_LE(hamming_distance(keyframes[candidate.keyframe]->features[there].descriptor,
                                   keyframes[i]->features[here].descriptor),
                  64);
      }
    }
}

TEST(PlaceExperiment, HeuristicFindsWhatBruteForceFinds) {
  const auto keyframes = ring_keyframes();
  PlaceSearchParams search;
  search.min_keyframes_apart = 2;
  const PlaceMatrices all = brute_force_places(keyframes, search, {});
  const PlaceMatrices found = heuristic_places(keyframes, search, {});
  const PlaceSweepRow row = compare_places(all, found, search);
  EXPECT_GT(row.total, 40U);
  EXPECT_GE(row.candidate_recall(), 0.95);
  EXPECT_GE(row.association_recall(), 0.9);
  EXPECT_LT(found.comparisons, all.comparisons / 2);
  for (const PlaceAssociation& one : found.associations) {
    const SE3 truth = keyframes[one.a]->T_odom_camera.inverse() * keyframes[one.b]->T_odom_camera;
    EXPECT_LT((one.T_a_b.inverse() * truth).log().norm(), 0.08);
    EXPECT_GE(one.b, one.a + 2);
  }
  const PlacePictures pictures = draw_places(found, 3);
  EXPECT_EQ(pictures.association.width(), 3 * static_cast<int>(keyframes.size()));
  const PlaceAssociation& one = found.associations.front();
  EXPECT_EQ(pictures.association(3 * static_cast<int>(one.a) + 1, 3 * static_cast<int>(one.b) + 2).r, 255);
  EXPECT_EQ(pictures.association(0, 0).r, 0);
}

TEST(PlaceExperiment, NothingToCompare) {
  EXPECT_EQ(brute_force_places({}, {}, {}).comparisons, 0U);
  const auto nothing = heuristic_places({}, {}, {});
  EXPECT_EQ(compare_places(nothing, nothing, {}).candidate_recall(), 1);
  EXPECT_TRUE(draw_places(nothing).match.empty());
}

}  // namespace
}  // namespace hm
