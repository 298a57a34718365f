#include "hm/slam/place_recognition/place_search.hpp"

#include <algorithm>
#include <tuple>

#include "hm/core/check.hpp"

namespace hm {

PlaceSearch::PlaceSearch(const PlaceSearchParams& params) : params_(params) {}

std::uint32_t PlaceSearch::add(const Keyframe& keyframe) {
  const std::uint32_t number = size();
  submaps_.push_back(keyframe.submap);
  for (std::size_t f = 0; f < keyframe.features.size(); ++f)
    if (keyframe.features[f].has_depth)
      index_.add(keyframe.features[f].descriptor, {number, static_cast<std::uint32_t>(f)});
  return number;
}

/// Excludes the keyframe itself and its neighbours in time of the same submap.
DescriptorIndex::Query PlaceSearch::query_without(const Keyframe& keyframe, std::uint32_t self) const {
  DescriptorIndex::Query query{params_.neighbours, params_.kMaxDescriptorBits, params_.max_checks};
  const auto apart = static_cast<std::uint32_t>(params_.min_keyframes_apart);
  query.exclude_from = self - std::min(self, apart - 1);
  while (query.exclude_from < self && submaps_[query.exclude_from] != keyframe.submap) ++query.exclude_from;
  query.exclude_to = self;
  while (query.exclude_to + 1 < size() && query.exclude_to + 1 < self + apart &&
         submaps_[query.exclude_to + 1] == keyframe.submap)
    ++query.exclude_to;
  return query;
}

std::vector<PlaceSearch::Vote> PlaceSearch::all_votes(const Keyframe& keyframe, std::uint32_t self) const {
  HM_CHECK(self <= size(), "keyframe {} of {}", self, size());
  const DescriptorIndex::Query query = query_without(keyframe, self);
  std::vector<Vote> votes;
  for (std::uint32_t f = 0; f < keyframe.features.size(); ++f) {
    if (!keyframe.features[f].has_depth) continue;
    const auto neighbours = index_.nearest(keyframe.features[f].descriptor, query);
    for (auto one = neighbours.begin(); one != neighbours.end(); ++one) {
      const auto same = [&](const DescriptorNeighbour& other) {
        return other.owner.keyframe == one->owner.keyframe;
      };
      if (std::none_of(neighbours.begin(), one, same))
        votes.push_back({one->owner.keyframe, one->owner.feature, f, one->bits});
    }
  }
  return votes;
}

std::vector<int> PlaceSearch::votes(const Keyframe& keyframe, std::uint32_t self) const {
  std::vector<int> counts(size(), 0);
  for (const Vote& vote : all_votes(keyframe, self)) ++counts[vote.keyframe];
  return counts;
}

std::vector<PlaceCandidate> PlaceSearch::candidates(const Keyframe& keyframe, std::uint32_t self) const {
  std::vector<Vote> votes = all_votes(keyframe, self);
  std::sort(votes.begin(), votes.end(), [](const Vote& a, const Vote& b) {
    return std::tie(a.keyframe, a.feature_there, a.bits, a.feature_here) <
           std::tie(b.keyframe, b.feature_there, b.bits, b.feature_here);
  });
  std::vector<std::uint32_t> voted;  // keyframes with votes; below, the number of votes
  std::vector<int> counts;
  for (const Vote& vote : votes) {
    if (voted.empty() || voted.back() != vote.keyframe) {
      voted.push_back(vote.keyframe);
      counts.push_back(0);
    }
    ++counts.back();
  }
  std::vector<PlaceCandidate> candidates = top_candidates(counts, params_.candidates, params_.kMinVotes);
  for (PlaceCandidate& candidate : candidates) {
    candidate.keyframe = voted[candidate.keyframe];
    auto vote = std::lower_bound(votes.begin(), votes.end(), candidate.keyframe,
                                 [](const Vote& v, std::uint32_t k) { return v.keyframe < k; });
    for (; vote != votes.end() && vote->keyframe == candidate.keyframe; ++vote)
      if (candidate.pairs.empty() || candidate.pairs.back().first != vote->feature_there)
        candidate.pairs.emplace_back(vote->feature_there, vote->feature_here);
  }
  return candidates;
}

std::vector<PlaceCandidate> top_candidates(const std::vector<int>& votes, int n, int min_votes) {
  std::vector<PlaceCandidate> candidates;
  for (std::size_t i = 0; i < votes.size(); ++i)
    if (votes[i] >= std::max(1, min_votes)) candidates.push_back({static_cast<std::uint32_t>(i), votes[i]});
  const std::size_t kept = std::min(candidates.size(), static_cast<std::size_t>(std::max(0, n)));
  std::partial_sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(kept),
                    candidates.end(), [](const PlaceCandidate& a, const PlaceCandidate& b) {
                      return a.votes != b.votes ? a.votes > b.votes : a.keyframe < b.keyframe;
                    });
  candidates.resize(kept);
  return candidates;
}

PlaceMatch verify_candidate(const Keyframe& there, const Keyframe& here, const PlaceCandidate& candidate,
                            std::size_t rank, const PlaceVerifierParams& params) {
  PlaceMatch match = verify_matches(there, here, candidate.pairs, params);
  if (match.is_same_place() || (rank >= kThoroughCandidates && match.inliers < kPromisingInliers))
    return match;
  return verify_place(there, here, params);
}

}  // namespace hm
