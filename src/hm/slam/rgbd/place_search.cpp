#include "hm/slam/rgbd/place_search.hpp"

#include <algorithm>

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

std::vector<int> PlaceSearch::votes(const Keyframe& keyframe, std::uint32_t self) const {
  HM_CHECK(self <= size(), "keyframe {} of {}", self, size());
  DescriptorIndex::Query query{params_.neighbours, params_.max_descriptor_bits, params_.max_checks};
  const auto apart = static_cast<std::uint32_t>(params_.min_keyframes_apart);
  query.exclude_from = self - std::min(self, apart - 1);
  while (query.exclude_from < self && submaps_[query.exclude_from] != keyframe.submap) ++query.exclude_from;
  query.exclude_to = self;
  while (query.exclude_to + 1 < size() && query.exclude_to + 1 < self + apart &&
         submaps_[query.exclude_to + 1] == keyframe.submap)
    ++query.exclude_to;
  std::vector<int> votes(size(), 0);
  for (const Feature& feature : keyframe.features) {
    if (!feature.has_depth) continue;
    const auto neighbours = index_.nearest(feature.descriptor, query);
    for (auto one = neighbours.begin(); one != neighbours.end(); ++one) {
      const auto same = [&](const DescriptorNeighbour& other) {
        return other.owner.keyframe == one->owner.keyframe;
      };
      if (std::none_of(neighbours.begin(), one, same)) ++votes[one->owner.keyframe];
    }
  }
  return votes;
}

std::vector<PlaceCandidate> PlaceSearch::candidates(const Keyframe& keyframe, std::uint32_t self) const {
  return top_candidates(votes(keyframe, self), params_.candidates, params_.min_votes);
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

}  // namespace hm
