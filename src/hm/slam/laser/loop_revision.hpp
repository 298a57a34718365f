#pragma once
#include <cstddef>
#include <functional>
#include <stop_token>
#include <vector>

#include "hm/slam/laser/scan_graph_2d.hpp"

namespace hm {

/// Agreement of the scans of different visits, at the poses of a graph.
struct GraphAgreement {
  /// Points that agree, less three times those that stand in the free space of another visit. Not their
  /// share: a torn map has no contradictions, but also little that agrees.
  double score = 0;
  double points_per_place = 0;  ///< compared at a keyframe, mean
  /// Keyframes around which more than a quarter of the points compared is contradicted, in order.
  std::vector<std::size_t> contradicted;
};
GraphAgreement graph_agreement(const ScanGraph2D& graph);

struct LoopRevision {
  std::size_t trials = 0;    ///< hypotheses that were left out on trial
  std::size_t changes = 0;   ///< kept, since the map agrees better with itself
  std::size_t searched = 0;  ///< keyframes that were searched again, in trials and before them
};

/// Most hypotheses that a revision leaves out on trial.
inline constexpr std::size_t kMostRevisionTrials = 16;

/// Bounds of a revision's work, which is nearly all in searching keyframes again (20 to 45 ms each).
struct RevisionLimits {
  std::size_t searched_at_once = 120;  ///< contradicted keyframes, evenly chosen where there are more
  std::size_t searched = 1500;  ///< keyframes, over all trials; one that was searched twice counts twice
};

/// Who waits for a revision: an end is requested by `stop`; `progress` is called before each keyframe that is
/// searched again, with what was done until then.
struct RevisionContext {
  std::stop_token stop = {};
  std::function<void(const LoopRevision&)> progress = {};
  RevisionLimits limits = {};
};

/// Revises the loops of an optimised graph where its map contradicts itself: at the end of a drive, what was
/// seen after a loop can contradict it, and drift is better known than when the loop was searched for.
/// Keyframes at such places are searched again; and each group of loops that leads there is a hypothesis that
/// is left out on trial, alone and with other loops found in its place. The change with the best score is
/// kept, and so on until none raises it by what one place shows, or its limits are reached. (Latif et al.,
/// "Robust loop closing over time for pose graph SLAM", IJRR 2013, judge such groups by their residuals;
/// between rooms that look alike those are small.) Without contradictions nothing is tried.
///
/// Cost: of a trial two optimisations, two comparisons of all visits, and a search for the keyframes at the
/// places in question: a second or two in a drive of two hours, five where all of a map is contradicted.
/// Deterministic until a stop is requested; then no more keyframes are searched, and no trial begins.
LoopRevision revise_loops(ScanGraph2D& graph, const RevisionContext& context = {});

}  // namespace hm
