#pragma once
#include <cstddef>

#include "hm/tsdf/alignment/alignment_terms.hpp"

namespace hm {

/// What neighbouring readings agree on about the geometry. The normals of a map hold noise, which makes a
/// plane look as if it were seen from all sides: E[J J^T] of one reading has a floor. Between readings a few
/// voxels apart the noise is independent, so that J_i J_k^T has none (instrumental variables).
struct PairTerms {
  Mat6 H = Mat6::Zero();  ///< symmetric; weak directions may come out slightly negative
  double weight = 0;      ///< sum of the pairs' weights
};

/// Over pairs of neighbours among the first `count` readings, whose corners sum_alignment_terms() looked up
/// for this very view.
PairTerms sum_pair_terms(const AlignmentView& view, std::size_t count, const AlignmentPoints& points);

}  // namespace hm
