#pragma once
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "hm/geometry/pose_graph_2d.hpp"
#include "hm/geometry/trajectory.hpp"
#include "hm/slam/laser/loop_finder.hpp"
#include "hm/slam/laser/search/correlative_search.hpp"
#include "hm/slam/pose_graph/graph_part.hpp"
#include "hm/slam/pose_graph/pose_uncertainty.hpp"

namespace hm {

/// Search for a keyframe in a submap.
struct LoopAttempt {
  std::size_t submap = 0;
  LoopOutcome outcome = LoopOutcome::kNoMatch;
  double score = 0;
  SearchWindow window;  ///< in the frame of the submap's anchor
};

struct ScanGraphStep {
  std::size_t node = 0;
  std::vector<LoopAttempt> attempts;
  int loops_accepted = 0;
  double largest_correction_m = 0;  ///< of the accepted loops, relative to the pose in the graph
  double largest_turn_rad = 0;      ///< the same of the heading
  bool holds_place = false;         ///< an accepted loop determines the place in all directions
  /// Whether the graph should be optimised before the next search: that is around the graph's estimate, in a
  /// window as narrow as these loops have made its uncertainty.
  [[nodiscard]] bool corrects_much() const;
  /// Whether loops found the keyframe where the graph has it: the next few need not be searched.
  [[nodiscard]] bool confirms_graph() const;
};

/// Numbers of loop searches by outcome; `candidates` is the sum of the six after it.
struct ScanGraphStatistics {
  std::size_t candidates = 0;
  std::size_t accepted = 0, no_match = 0, ambiguous = 0, limit_reached = 0, not_verified = 0, alone = 0;
  std::size_t removed = 0;  ///< accepted, but removed after optimisation or revision as inconsistent
  [[nodiscard]] std::size_t rejected() const { return candidates - accepted + removed; }
};

/// Corrects the drift of 2D odometry by loop closure (dissertation 2.4): a pose graph of keyframe scans, with
/// loops found by correlative search in submaps of a few keyframes, in a window given by the graph's
/// uncertainty, verified by PL-ICP, and optimised with a robust loss. Provides `map -> odom`; poses in `odom`
/// are never changed.
///
/// add_keyframe() costs at most three bounded searches in each of `kMaxSubmapsTried` submaps and a pass over
/// all keyframe positions; where loops confirm the graph, only every fourth keyframe is searched; optimise(),
/// a sparse optimisation, is called by the user: after a step that corrects much before the next keyframe,
/// whose search is around the graph's poses (LaserLoopCloser does so). Deterministic; not thread safe.
class ScanGraph2D {
 public:
  explicit ScanGraph2D(const ScanGraph2DParams& params = {});

  /// Adds a keyframe and searches for loops. Stamps must increase; poses and covariance must be finite.
  ScanGraphStep add_keyframe(GraphKeyframe2D keyframe);
  /// Optimises the graph, or its part from node `first` on (older nodes are fixed), and removes loops that
  /// are inconsistent with the rest. The first keyframe is fixed.
  PoseGraphSolution optimise(std::size_t first = 0);

  /// Poses, loops and statistics, without the keyframes.
  struct State {
    PoseGraph2D graph;
    PathUncertainty2D paths;
    ScanGraphStatistics statistics;
  };
  [[nodiscard]] State state() const { return {graph_, paths_, statistics_}; }
  /// Goes back to an earlier state with as many keyframes.
  void restore(const State& state);
  /// Takes out the loops between the nodes of these edges, and counts them as removed.
  void take_out(std::span<const PoseEdge2D> loops);
  /// Repeats the search for loops of keyframes (in increasing order) around their poses in the graph, in
  /// windows of at least 1.5 m to either side and in submaps to which no loop of the keyframe leads. Loops of
  /// the same hypothesis as an excluded one are not accepted. Optimises the whole graph after each keyframe
  /// whose loops correct much. `goes_on`, asked before each keyframe, ends it. Returns the number of loops
  /// accepted.
  int search_again(std::span<const std::size_t> nodes, std::span<const PoseEdge2D> excluded = {},
                   const std::function<bool()>& goes_on = {});

  /// The edge of a keyframe's match, with the covariance that edges have; not added to the graph.
  [[nodiscard]] PoseEdge2D loop_edge(std::size_t node, const LoopMatch& match) const;

  [[nodiscard]] const ScanGraph2DParams& params() const { return params_; }
  [[nodiscard]] std::size_t size() const { return keyframes_.size(); }
  [[nodiscard]] const GraphKeyframe2D& keyframe(std::size_t node) const { return keyframes_[node]; }
  [[nodiscard]] std::span<const GraphKeyframe2D> keyframes() const { return keyframes_; }
  [[nodiscard]] const PoseGraph2D& graph() const { return graph_; }
  /// Correction at the last keyframe; not changed by add_keyframe(). Identity without keyframes.
  [[nodiscard]] SE2 T_map_odom() const;
  /// Corrected pose of the base at a time when odometry gave T_odom_base, interpolated between the
  /// corrections of the keyframes before and after it. Nothing without keyframes.
  [[nodiscard]] std::optional<SE2> T_map_base(Time stamp, const SE2& T_odom_base) const;
  /// Transforms a trajectory from `odom` to `map`; heights and tilts are kept.
  [[nodiscard]] Trajectory corrected(const Trajectory& T_odom_base) const;
  [[nodiscard]] const ScanGraphStatistics& statistics() const { return statistics_; }

 private:
  enum class SearchKind { kFirst, kRepeated };
  struct Candidate {
    std::size_t submap;
    double distance_m;
    SearchWindow window;
  };
  void add_odometry_edge();
  [[nodiscard]] std::vector<Candidate> loop_candidates(std::size_t node, SearchKind kind) const;
  [[nodiscard]] bool has_loop_to(std::size_t node, const ScanSubmap& submap) const;
  [[nodiscard]] SearchWindow window_of(std::size_t node, const ScanSubmap& submap,
                                       const PathUncertainty2D::Seen& seen) const;
  [[nodiscard]] double apartness(std::size_t node, const ScanSubmap& submap) const;
  LoopAttempt try_loop(std::size_t node, const Candidate& candidate, ScanGraphStep& step,
                       std::span<const PoseEdge2D> excluded = {});
  void forget_waiting_before(std::size_t node);
  LoopOutcome accept(const PoseEdge2D& edge, ScanGraphStep& step);
  /// The path up to a node, as if it were the newest.
  [[nodiscard]] MappedKeyframes path_to(std::size_t node) const {
    return {std::span(keyframes_).first(node + 1), std::span(graph_.T_map_node).first(node + 1)};
  }
  void count(LoopOutcome outcome);
  bool take_out_contradictions(GraphPart<PoseGraph2D>& part);

  ScanGraph2DParams params_;
  std::vector<GraphKeyframe2D> keyframes_;
  std::vector<ScanSubmap> submaps_;
  PoseGraph2D graph_;
  PathUncertainty2D paths_;
  std::vector<PoseEdge2D> waiting_;  // loops of the newest keyframes with which no other agrees yet
  std::size_t search_from_ = 0;      // keyframes before this one are not searched for loops
  LoopFinder finder_;
  ScanGraphStatistics statistics_;
};

}  // namespace hm
