#pragma once
#include <cstdint>
#include <vector>

#include "hm/odometry/feature/keyframe.hpp"
#include "hm/slam/place_recognition/descriptor_index.hpp"
#include "hm/slam/place_recognition/place_params.hpp"
#include "hm/slam/place_recognition/place_verifier.hpp"

namespace hm {

/// Keyframe that may show the same place as the query.
struct PlaceCandidate {
  std::uint32_t keyframe = 0;  ///< as returned by add()
  int votes = 0;
  /// Voting feature pairs (of the candidate, of the query keyframe), each feature at most once. Sorted.
  std::vector<FeaturePair> pairs = {};
};

/// Candidate search of dissertation 3.3.2: every feature of a keyframe votes for the keyframes of its k
/// nearest descriptors; the n keyframes with most votes are candidates. Cost of a query: features *
/// log(keyframes).
class PlaceSearch {
 public:
  explicit PlaceSearch(const PlaceSearchParams& params = {});

  /// Adds a keyframe's features with depth to the index; returns its number, from 0 on.
  std::uint32_t add(const Keyframe& keyframe);
  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(submaps_.size()); }

  /// Number of votes for every added keyframe (a row of the match matrix); at most one per feature and
  /// keyframe. `self`: number of this keyframe if it was added, to exclude it and its neighbours in time;
  /// else size().
  [[nodiscard]] std::vector<int> votes(const Keyframe& keyframe, std::uint32_t self) const;
  /// The params.candidates keyframes with most votes and at least params.kMinVotes, sorted by votes, then by
  /// number.
  [[nodiscard]] std::vector<PlaceCandidate> candidates(const Keyframe& keyframe, std::uint32_t self) const;

  [[nodiscard]] const DescriptorIndex& index() const { return index_; }

 private:
  struct Vote {
    std::uint32_t keyframe, feature_there, feature_here;
    int bits;
  };
  [[nodiscard]] std::vector<Vote> all_votes(const Keyframe& keyframe, std::uint32_t self) const;
  [[nodiscard]] DescriptorIndex::Query query_without(const Keyframe& keyframe, std::uint32_t self) const;

  PlaceSearchParams params_;
  DescriptorIndex index_;
  std::vector<int> submaps_;
};

/// Candidates with the n largest counts of a row.
std::vector<PlaceCandidate> top_candidates(const std::vector<int>& votes, int n, int min_votes);

/// Verifies a candidate with the feature pairs that voted; if that fails, with all features, provided that it
/// is among the first kThoroughCandidates or that kPromisingInliers of the votes agree on a transform.
/// `rank`: index in the list of candidates.
inline constexpr std::size_t kThoroughCandidates = 3;
inline constexpr int kPromisingInliers = 5;
PlaceMatch verify_candidate(const Keyframe& there, const Keyframe& here, const PlaceCandidate& candidate,
                            std::size_t rank, const PlaceVerifierParams& params);

}  // namespace hm
