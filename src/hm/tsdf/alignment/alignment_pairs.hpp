#pragma once
#include <cstddef>

#include "hm/tsdf/alignment/alignment_terms.hpp"

namespace hm {

/// Information estimated from pairs of neighbouring readings. Noise in the map's normals biases E[J J^T] of
/// single readings, so that a plane seems to constrain all directions. The noise of readings a few voxels
/// apart is independent, so that J_i J_k^T is unbiased (instrumental variables).
struct PairTerms {
  Mat6 H = Mat6::Zero();  ///< symmetric; weak directions may come out slightly negative
  double weight = 0;      ///< sum of the pairs' weights
};

/// Sums over pairs of neighbours among the first `count` readings. sum_alignment_terms() must have been
/// called for the same view before.
PairTerms sum_pair_terms(const AlignmentView& view, std::size_t count, const AlignmentPoints& points);

}  // namespace hm
