#pragma once
#include <cstddef>
#include <vector>

#include "hm/slam/laser/scan_graph_2d.hpp"

namespace hm {

/// How well the scans of different visits agree as a graph places them.
struct GraphAgreement {
  /// Points that agree, less three times those that stand in the free space of another visit: a map that is
  /// torn has no contradictions left, but little that agrees.
  double score = 0;
  /// Keyframes around which more than a quarter of what both visits show is contradicted, in order.
  std::vector<std::size_t> contradicted;
};
GraphAgreement graph_agreement(const ScanGraph2D& graph);

struct LoopRevision {
  std::size_t trials = 0;   ///< groups of loops that were left out to see
  std::size_t changes = 0;  ///< kept, since the map agrees better with itself
};

/// Revises the loops of an optimised graph where its map contradicts itself: when a drive has ended, what
/// came after a loop speaks for or against it, too, and drift is known better than it was. Keyframes at such
/// places are searched again; and each group of loops that leads there is one hypothesis, which is left out
/// for a while, searching for other loops instead (compare Latif et al., "Robust loop closing over time for
/// pose graph SLAM", IJRR 2013, which judges groups by their residuals: between rooms that look alike those
/// are small). Of all hypotheses the one with the best score is kept, and so on until none raises it. Without
/// contradictions nothing is tried. Cost: at most 16 trials, each of one or two optimisations and a search at
/// the places in question.
LoopRevision revise_loops(ScanGraph2D& graph);

}  // namespace hm
