#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "hm/geometry/image.hpp"
#include "hm/odometry/feature/keyframe.hpp"
#include "hm/slam/place_recognition/place_params.hpp"
#include "hm/slam/place_recognition/place_verifier.hpp"

namespace hm {

using KeyframeList = std::span<const std::shared_ptr<const Keyframe>>;

/// A verified pair of keyframes, a < b.
struct PlaceAssociation {
  std::uint32_t a = 0, b = 0;
  SE3 T_a_b;
  int inliers = 0;
};

/// The four matrices of dissertation 3.3 (Fig. 3.11), indexed by keyframe pairs (column x, row y).
struct PlaceMatrices {
  Image<std::int32_t> match;      ///< votes of the row's features for its candidates (empty for brute force)
  Image<std::uint8_t> candidate;  ///< 1 if the pair was compared
  Image<std::int32_t> correspondence;  ///< inliers of the compared pairs
  Image<std::uint8_t> association;     ///< 1 if both show the same place
  std::vector<PlaceAssociation> associations;
  std::size_t comparisons = 0;  ///< calls of verify_place
  double seconds = 0;           ///< processor time of the whole process, for profiling only
};

/// Compares every keyframe with every other in both directions (dissertation 3.3.1). Pairs closer than
/// search.min_keyframes_apart are skipped, here and below.
PlaceMatrices brute_force_places(KeyframeList keyframes, const PlaceSearchParams& search,
                                 const PlaceVerifierParams& verifier);

/// The heuristic of 3.3.2: candidates by voting, then geometric verification. A pair is entered
/// symmetrically, whichever of its keyframes proposes it, and is not compared again once associated.
PlaceMatrices heuristic_places(KeyframeList keyframes, const PlaceSearchParams& search,
                               const PlaceVerifierParams& verifier);

/// Row of Table 3.1: associations of the brute force missed with given n and k.
struct PlaceSweepRow {
  int candidates = 0, neighbours = 0;  ///< n, k
  std::size_t total = 0, missed_candidates = 0, missed_associations = 0;
  double seconds = 0;
  [[nodiscard]] double candidate_recall() const { return recall(missed_candidates); }
  [[nodiscard]] double association_recall() const { return recall(missed_associations); }

 private:
  [[nodiscard]] double recall(std::size_t missed) const {
    return total == 0 ? 1 : 1 - static_cast<double>(missed) / static_cast<double>(total);
  }
};

/// Compares two results over the same keyframes.
PlaceSweepRow compare_places(const PlaceMatrices& brute_force, const PlaceMatrices& heuristic,
                             const PlaceSearchParams& search);

/// The matrices as figures, white on black, with square roots of counts and `pixels` pixels per keyframe.
struct PlacePictures {
  Image<Rgb8> match, candidate, correspondence, association;
};
PlacePictures draw_places(const PlaceMatrices& matrices, int pixels = 2);

}  // namespace hm
