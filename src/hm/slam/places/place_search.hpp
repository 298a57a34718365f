#pragma once
#include <cstdint>
#include <vector>

#include "hm/odometry/feature/keyframe.hpp"
#include "hm/slam/places/descriptor_index.hpp"
#include "hm/slam/places/place_params.hpp"
#include "hm/slam/places/place_verifier.hpp"

namespace hm {

/// A keyframe that may show the same place.
struct PlaceCandidate {
  std::uint32_t keyframe = 0;  ///< number of add()
  int votes = 0;
  /// The features that voted: of the candidate, of the keyframe that asks; each at most once. Sorted.
  std::vector<FeaturePair> pairs = {};
};

/// The heuristic of dissertation 3.3.2: every feature of a keyframe votes for the keyframes of its k nearest
/// descriptors; the n keyframes with most votes are candidates. Cost of a query: features * log(keyframes).
class PlaceSearch {
 public:
  explicit PlaceSearch(const PlaceSearchParams& params = {});

  /// Makes a keyframe's features known; returns its number, from 0 on.
  std::uint32_t add(const Keyframe& keyframe);
  [[nodiscard]] std::uint32_t size() const { return static_cast<std::uint32_t>(submaps_.size()); }

  /// Votes for every keyframe: a row of the match matrix. `self` is the number of this keyframe if it is
  /// known (then neither it nor its neighbours get votes), or size(). A feature votes at most once for a
  /// keyframe.
  [[nodiscard]] std::vector<int> votes(const Keyframe& keyframe, std::uint32_t self) const;
  /// The params.candidates keyframes with most votes, at least params.kMinVotes; most votes first, equals by
  /// number. Any params.candidates will do.
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

/// The n largest counts of a row as candidates.
std::vector<PlaceCandidate> top_candidates(const std::vector<int>& votes, int n, int min_votes);

/// Verifies a candidate for a keyframe by the features that voted. When that fails, by all features, if it is
/// among the first kThoroughCandidates or kPromisingInliers of the votes agree on a motion. `rank` is the
/// place in the list of candidates.
inline constexpr std::size_t kThoroughCandidates = 3;
inline constexpr int kPromisingInliers = 5;
PlaceMatch verify_candidate(const Keyframe& there, const Keyframe& here, const PlaceCandidate& candidate,
                            std::size_t rank, const PlaceVerifierParams& params);

}  // namespace hm
